"""Writes the visual meshes of the gripper: one OBJ for the hand and one for both jaws.

Run ``python -m models.gripper.make_meshes`` at the project's root.
"""

from pathlib import Path

from models.mesh_builder import ALONG_X, ALONG_Y, box, cylinder, part, write_model

PALETTE = {
    "anodised": (0.19, 0.20, 0.23),
    "gunmetal": (0.33, 0.34, 0.37),
    "steel": (0.62, 0.63, 0.65),
    "rubber": (0.80, 0.36, 0.10),
    "blue": (0.09, 0.23, 0.45),
}

PARTS = {
    "hand": [
        part(cylinder(0.034, 0.016), "steel", (0, 0, 0.008)),  # adapter
        part(cylinder(0.028, 0.016), "anodised", (0, 0, 0.022)),  # neck
        part(box((0.062, 0.124, 0.042)), "anodised", (0, 0, 0.047)),  # body
        part(cylinder(0.021, 0.042), "anodised", (0, 0.062, 0.047)),  # end left
        part(cylinder(0.021, 0.042), "anodised", (0, -0.062, 0.047)),  # end right
        part(box((0.001, 0.084, 0.01)), "blue", (0.0312, 0, 0.047)),  # band front
        part(box((0.001, 0.084, 0.01)), "blue", (-0.0312, 0, 0.047)),  # band back
        part(box((0.026, 0.164, 0.007)), "steel", (0, 0, 0.0715)),  # rail
        part(cylinder(0.004, 0.006), "steel", (0.02, 0.04, 0.0255)),  # screw 1
        part(cylinder(0.004, 0.006), "steel", (-0.02, 0.04, 0.0255)),  # screw 2
        part(cylinder(0.004, 0.006), "steel", (0.02, -0.04, 0.0255)),  # screw 3
        part(cylinder(0.004, 0.006), "steel", (-0.02, -0.04, 0.0255)),  # screw 4
        part(cylinder(0.006, 0.068), "steel", (0, 0, 0.047), ALONG_X),  # cable gland
    ],
    "jaw": [
        part(box((0.04, 0.032, 0.016)), "gunmetal", (0, 0.02, -0.067)),  # carriage
        part(box((0.024, 0.012, 0.073)), "gunmetal", (0, 0.013, -0.0235)),  # blade
        part(box((0.008, 0.01, 0.024)), "gunmetal", (0, 0.022, -0.048)),  # rib
        part(box((0.042, 0.007, 0.025)), "gunmetal", (0, 0.0095, 0.0005)),  # backing
        part(box((0.04, 0.006, 0.022)), "rubber", (0, 0.003, 0)),  # pad
        part(cylinder(0.0035, 0.002), "steel", (0, 0.0195, -0.005), ALONG_Y),  # bolt upper
        part(cylinder(0.0035, 0.002), "steel", (0, 0.0195, 0.007), ALONG_Y),  # bolt lower
    ],
}


if __name__ == "__main__":
    write_model(Path(__file__).resolve().parent, PARTS, PALETTE)
