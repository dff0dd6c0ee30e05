"""Writes the visual mesh of the cup: one OBJ for the hand.

Run ``python -m models.cup.make_meshes`` at the project's root.
"""

from pathlib import Path

import numpy as np

from models.mesh_builder import Part, Solid, box, box_ring, cylinder, ellipsoid, loft, part, write_model

PALETTE = {
    "anodised": (0.19, 0.20, 0.23),
    "steel": (0.62, 0.63, 0.65),
    "shell": (0.09, 0.23, 0.45),
    "lining": (0.16, 0.16, 0.17),
    "brass": (0.70, 0.55, 0.25),
}
TOOL = np.array([-0.062, 0.0, 0.160])
"""Origin of the frame `tool` in the frame of the hand [m]."""
HALF_DEPTH, HALF_WIDTH, WALL, DEPTH, BACK = 0.040, 0.050, 0.005, 0.070, 0.030
"""The bowl [m]: half the inside along x and y, thickness, depth below the rim, height of the back wall above it."""


def at(x: float, y: float, z: float) -> tuple[float, ...]:
    """Returns a position in the frame of the hand, given in the frame of the tool."""
    return tuple(TOOL + (x, y, z))


def bowl() -> list[Part]:
    """Returns the bowl: a rounded shell around a lining, open at the top (towards -z)."""
    outer = [
        box_ring(0.0, HALF_DEPTH + WALL - inset, HALF_WIDTH + WALL - inset, 0.012, height)
        for height, inset in ((0.0, 0.0), (DEPTH - 0.006, 0.0), (DEPTH, 0.0015), (DEPTH + WALL, 0.006))
    ]
    inner = [
        box_ring(0.0, HALF_DEPTH - inset, HALF_WIDTH - inset, 0.008, height)
        for height, inset in ((DEPTH, 0.005), (DEPTH - 0.005, 0.0), (0.0, 0.0))
    ]
    shell = open_loft(outer)
    rim = open_loft([inner[-1], outer[0]])
    lining = open_loft(inner)
    bottom = box((2.0 * HALF_DEPTH - 0.01, 2.0 * HALF_WIDTH - 0.01, 0.001))
    underside = box((2.0 * HALF_DEPTH - 0.002, 2.0 * HALF_WIDTH - 0.002, 0.001))
    return [
        part(shell, "shell", at(0, 0, 0)),
        part(rim, "brass", at(0, 0, 0)),
        part(lining, "lining", at(0, 0, 0)),
        part(bottom, "lining", at(0, 0, DEPTH - 0.0005)),
        part(underside, "shell", at(0, 0, DEPTH + WALL - 0.0005)),
    ]


def open_loft(rings: list[np.ndarray]) -> Solid:
    """As `loft`, without the caps."""
    vertices, normals, triangles = loft(rings)
    count = len(rings) * len(rings[0])
    return vertices[:count], normals[:count], triangles[np.all(triangles < count, axis=1)]


PARTS = {
    "hand": [
        part(cylinder(0.034, 0.012), "steel", (0, 0, 0.006)),  # adapter
        part(cylinder(0.026, 0.014), "anodised", (0, 0, 0.019)),  # neck
        *[
            part(cylinder(0.0035, 0.004), "anodised", (0.027 * np.cos(a), 0.027 * np.sin(a), 0.013))  # screws
            for a in np.deg2rad([45, 135, 225, 315])
        ],
        part(box((0.020, 0.020, 0.175)), "anodised", at(0.056, 0, -0.0475)),  # stem
        part(box((0.006, 0.050, 0.060)), "steel", at(0.047, 0, 0.020)),  # plate on the stem
        part(box((WALL, 2.0 * (HALF_WIDTH + WALL) - 0.02, BACK + 0.02)), "shell", at(0.0425, 0, 0.01 - 0.5 * BACK)),
        part(box((0.001, 2.0 * HALF_WIDTH - 0.012, BACK + 0.005)), "lining", at(0.0398, 0, -0.5 * BACK)),
        part(box((WALL + 0.0012, 2.0 * (HALF_WIDTH + WALL) - 0.02, 0.002)), "brass", at(0.0425, 0, -BACK - 0.001)),
        *bowl(),
        part(cylinder(0.0028, 0.016), "steel", at(0, 0, DEPTH + WALL + 0.007)),  # shaft of the tip
        part(cylinder(0.007, 0.004), "steel", at(0, 0, DEPTH + WALL + 0.002)),  # its nut
        part(ellipsoid((0.004, 0.004, 0.004)), "brass", at(0, 0, DEPTH + WALL + 0.015)),  # tip
    ],
}


if __name__ == "__main__":
    write_model(Path(__file__).resolve().parent, PARTS, PALETTE)
