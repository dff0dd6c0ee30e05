"""Writes the visual meshes of the seven-joint arm, one OBJ per link.

Run ``python -m models.seven_joint.make_meshes`` at the project's root.

A design of this project around the axes of the K-1607: a chain of modules, each with a fork that carries a pitch joint
and a drum that carries a roll joint. Each part is in the frame of its link.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from models.mesh_builder import ALONG_Y, Part, Solid, box, cylinder, disc_ring, loft, part, rounded_slab, write_model

PALETTE = {
    "pearl": (0.90, 0.90, 0.88),
    "silver": (0.74, 0.75, 0.76),
    "slate": (0.23, 0.26, 0.30),
    "charcoal": (0.14, 0.15, 0.17),
    "steel": (0.60, 0.62, 0.64),
    "teal": (0.05, 0.40, 0.44),
}
UP_Y = (-0.5 * np.pi, 0.0, 0.0)
"""Turns z to y."""
COLUMN_X, SHOULDER_Z = -0.35, 0.60
SHOULDER, ELBOW, WRIST = 0.142875, 0.10795, 0.079375
"""Offsets of the pitch joints from the centre line of the arm [m]: 5.625, 4.25 and 3.125 in."""
LENGTH = 0.6858
"""Length of upper arm and forearm [m]: 27 in."""


def turned(profile: Sequence[tuple[float, float]]) -> Solid:
    """Returns a solid of revolution about z through (radius, height) pairs, from lower to upper."""
    return loft([disc_ring(radius, height, 64) for radius, height in profile])


def drum(radius: float, low: float, high: float, bevel: float = 0.008) -> Solid:
    """Returns a cylinder about z with chamfered edges."""
    return turned([(radius - bevel, low), (radius, low + bevel), (radius, high - bevel), (radius - bevel, high)])


def fork(
    pivot_x: float, pivot_radius: float, root_low: float, root_radius: float, inner: float, outer: float
) -> list[Part]:
    """Returns the two cheeks of a fork about y through (pivot_x, 0), rooted on a tube about z that ends below."""
    outline = [(pivot_x, 0.0, pivot_radius), (0.0, root_low, root_radius)]
    bevel = 0.35 * (outer - inner)
    sides = ((inner, outer), (-outer, -inner))
    cheeks = [part(rounded_slab(outline, low, high, bevel), "pearl", (0, 0, 0), ALONG_Y) for low, high in sides]
    caps = [
        part(drum(0.72 * pivot_radius, -0.008, 0.008, 0.004), "slate", (pivot_x, side * (outer + 0.004), 0), ALONG_Y)
        for side in (-1.0, 1.0)
    ]
    hubs = [
        part(cylinder(0.26 * pivot_radius, 0.008), "steel", (pivot_x, side * (outer + 0.014), 0), ALONG_Y)
        for side in (-1.0, 1.0)
    ]
    return cheeks + caps + hubs


def knuckle(axis_x: float, pivot_radius: float, body_radius: float, half: float, height: float) -> list[Part]:
    """Returns what turns in a fork about z: its barrel, and the body up to the next roll axis at x = axis_x."""
    outline = [(0.0, 0.0, 0.92 * pivot_radius), (axis_x, 0.35 * height, body_radius), (axis_x, height, body_radius)]
    return [
        part(drum(pivot_radius, -half, half, 0.006), "slate"),
        part(rounded_slab(outline, -0.88 * half, 0.88 * half, 0.22 * half), "silver"),
    ]


def tube(low: float, high: float, radius: float, waist: float) -> Solid:
    """Returns a tube about z that is a little slimmer in the middle, with a flange at each end."""
    share = np.linspace(0.0, 1.0, 13)
    waisted = [(waist + (radius - waist) * (2.0 * s - 1.0) ** 4, low + s * (high - low)) for s in share]
    return turned(waisted)


def ring(radius: float, middle: float, width: float, colour: str) -> Part:
    """Returns a band about z."""
    return part(drum(radius, middle - 0.5 * width, middle + 0.5 * width, 0.003), colour)


def bolts(radius: float, height: float) -> list[Part]:
    """Returns four bolts on a circle about the column."""
    angle = np.pi / 4.0 + 0.5 * np.pi * np.arange(4)
    return [
        part(cylinder(0.014, 0.014), "steel", (COLUMN_X + radius * np.cos(a), radius * np.sin(a), height))
        for a in angle
    ]


COLUMN = [(0.245, 0.0), (0.245, 0.020), (0.238, 0.027), (0.185, 0.032), (0.158, 0.055), (0.144, 0.100), (0.138, 0.335)]

PARTS = {
    "base": [
        part(turned(COLUMN), "charcoal", (COLUMN_X, 0, 0)),  # pedestal
        *bolts(0.215, 0.034),
        part(drum(0.142, 0.325, 0.355), "steel", (COLUMN_X, 0, 0)),  # bearing
        part(box((0.004, 0.10, 0.05)), "steel", (COLUMN_X + 0.1415, 0, 0.20)),  # plate
    ],
    "link1": [
        part(drum(0.134, -0.243, -0.125, 0.012), "pearl"),  # drum
        ring(0.1355, -0.230, 0.010, "teal"),
        *fork(0.0, 0.100, -0.122, 0.098, 0.092, 0.138),
    ],
    "link2": [
        *knuckle(-SHOULDER, 0.088, 0.090, 0.088, 0.150),
        part(drum(0.098, 0.190, 0.262, 0.008), "pearl", (-SHOULDER, 0, 0), UP_Y),  # roll drum
        part(drum(0.0995, 0.220, 0.232, 0.003), "teal", (-SHOULDER, 0, 0), UP_Y),  # band
    ],
    "link3": [
        ring(0.088, 0.272 - LENGTH, 0.022, "charcoal"),
        part(tube(0.280 - LENGTH, -0.165, 0.082, 0.070), "pearl"),
        part(drum(0.092, -0.185, -0.090, 0.010), "pearl"),  # root of the fork
        part(box((0.003, 0.052, 0.150)), "slate", (0.0700, 0, -0.29)),  # nameplate
        *fork(-ELBOW, 0.076, -0.115, 0.080, 0.070, 0.098),
    ],
    "link4": [
        *knuckle(ELBOW, 0.066, 0.064, 0.066, 0.120),
        part(drum(0.074, 0.150, 0.206, 0.007), "pearl", (ELBOW, 0, 0), UP_Y),  # roll drum
        part(drum(0.0755, 0.172, 0.182, 0.003), "teal", (ELBOW, 0, 0), UP_Y),  # band
    ],
    "link5": [
        ring(0.065, 0.215 - LENGTH, 0.020, "charcoal"),
        part(tube(0.222 - LENGTH, -0.125, 0.060, 0.050), "pearl"),
        part(drum(0.066, -0.140, -0.068, 0.008), "pearl"),  # root of the fork
        part(box((0.003, 0.036, 0.110)), "slate", (0.0505, 0, -0.29)),  # nameplate
        *fork(-WRIST, 0.054, -0.088, 0.056, 0.048, 0.070),
    ],
    "link6": [
        *knuckle(WRIST, 0.046, 0.042, 0.045, 0.060),
        part(drum(0.048, 0.068, 0.092, 0.005), "slate", (WRIST, 0, 0), UP_Y),  # roll bearing
    ],
    "link7": [
        part(drum(0.052, 0.094, 0.142, 0.006), "pearl"),  # tool roll drum
        ring(0.0532, 0.118, 0.008, "teal"),
        part(drum(0.040, 0.142, 0.160, 0.003), "charcoal"),  # neck
        part(cylinder(0.046, 0.00764), "steel", (0, 0, 0.16382)),  # tool plate
    ],
}


if __name__ == "__main__":
    write_model(Path(__file__).resolve().parent, PARTS, PALETTE)
