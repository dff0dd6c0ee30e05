"""Writes the visual mesh of the table below its textured face.

Run ``python -m models.table.make_meshes`` at the project's root.
"""

from pathlib import Path

from models.mesh_builder import box, part, write_model

PALETTE = {"edge": (0.13, 0.09, 0.065), "graphite": (0.20, 0.21, 0.23), "foot": (0.08, 0.08, 0.09)}

PARTS = {
    "frame": [
        part(box((0.7, 1, 0.0295)), "edge", (0.56, 0, 0.43475)),  # slab
        part(box((0.05, 0.05, 0.42)), "graphite", (0.245, 0.465, 0.21)),  # leg near left
        part(box((0.06, 0.06, 0.012)), "foot", (0.245, 0.465, 0.006)),  # foot near left
        part(box((0.05, 0.05, 0.42)), "graphite", (0.245, -0.465, 0.21)),  # leg near right
        part(box((0.06, 0.06, 0.012)), "foot", (0.245, -0.465, 0.006)),  # foot near right
        part(box((0.03, 0.88, 0.05)), "graphite", (0.245, 0, 0.395)),  # apron near
        part(box((0.05, 0.05, 0.42)), "graphite", (0.875, 0.465, 0.21)),  # leg far left
        part(box((0.06, 0.06, 0.012)), "foot", (0.875, 0.465, 0.006)),  # foot far left
        part(box((0.05, 0.05, 0.42)), "graphite", (0.875, -0.465, 0.21)),  # leg far right
        part(box((0.06, 0.06, 0.012)), "foot", (0.875, -0.465, 0.006)),  # foot far right
        part(box((0.03, 0.88, 0.05)), "graphite", (0.875, 0, 0.395)),  # apron far
        part(box((0.58, 0.03, 0.05)), "graphite", (0.56, 0.465, 0.395)),  # apron left
        part(box((0.58, 0.03, 0.03)), "graphite", (0.56, 0.465, 0.12)),  # stretcher left
        part(box((0.58, 0.03, 0.05)), "graphite", (0.56, -0.465, 0.395)),  # apron right
        part(box((0.58, 0.03, 0.03)), "graphite", (0.56, -0.465, 0.12)),  # stretcher right
        part(box((0.03, 0.9, 0.03)), "graphite", (0.56, 0, 0.12)),  # stretcher middle
    ],
}


if __name__ == "__main__":
    write_model(Path(__file__).resolve().parent, PARTS, PALETTE)
