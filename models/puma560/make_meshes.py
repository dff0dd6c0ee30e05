"""Writes the visual meshes of the PUMA 560, one OBJ per link.

Run ``python -m models.puma560.make_meshes`` at the project's root.

Modelled by eye from photographs of the arm; nothing here affects the physics. Each part is in the frame of its link.
"""

from pathlib import Path

from models.mesh_builder import (
    ALONG_Y,
    Solid,
    box,
    box_ring,
    cylinder,
    disc_ring,
    loft,
    part,
    rounded_slab,
    write_model,
)

PALETTE = {
    "cream": (0.93, 0.91, 0.85),
    "ivory": (0.86, 0.83, 0.75),
    "charcoal": (0.16, 0.17, 0.19),
    "graphite": (0.20, 0.21, 0.23),
    "steel": (0.62, 0.63, 0.65),
    "blue": (0.09, 0.23, 0.45),
}


def base_flare() -> Solid:
    """Returns the cast foot, concave between the bolted plate and the column."""
    heights = [i / 9.0 for i in range(10)]
    return loft([disc_ring(0.150 - 0.062 * h**0.5, 0.022 + 0.105 * h**1.6, 48) for h in heights])


def upper_arm() -> Solid:
    """Returns the slab from behind the shoulder, at x = -.4318, to the elbow, at x = 0."""
    return rounded_slab(
        [(-0.565, 0.012, 0.088), (-0.565, -0.012, 0.088), (-0.4318, 0.0, 0.108), (0.0, 0.0, 0.070)], 0.198, 0.305, 0.022
    )


def forearm() -> Solid:
    """Returns the tapered casting about z, the elbow at x = -.0203, z = 0."""
    stations = [  # x centre, half width in x, half width in y, corner radius, z
        (-0.014, 0.028, 0.022, 0.020, -0.145),
        (-0.015, 0.042, 0.033, 0.028, -0.139),
        (-0.016, 0.050, 0.040, 0.032, -0.125),
        (-0.018, 0.060, 0.045, 0.036, -0.080),
        (-0.0203, 0.069, 0.047, 0.038, -0.030),
        (-0.0203, 0.071, 0.047, 0.038, 0.010),
        (-0.016, 0.065, 0.046, 0.038, 0.070),
        (-0.008, 0.054, 0.043, 0.037, 0.180),
        (-0.001, 0.044, 0.040, 0.036, 0.290),
        (0.000, 0.041, 0.038, 0.036, 0.318),
        (0.000, 0.037, 0.035, 0.033, 0.326),
    ]
    return loft([box_ring(*station) for station in stations])


PARTS = {
    "base": [
        part(cylinder(0.175, 0.022), "charcoal", (0, 0, 0.011)),  # plate
        part(cylinder(0.01, 0.01), "steel", (0.115, 0.115, 0.025)),  # bolt 1
        part(cylinder(0.01, 0.01), "steel", (-0.115, 0.115, 0.025)),  # bolt 2
        part(cylinder(0.01, 0.01), "steel", (-0.115, -0.115, 0.025)),  # bolt 3
        part(cylinder(0.01, 0.01), "steel", (0.115, -0.115, 0.025)),  # bolt 4
        part(base_flare(), "charcoal"),  # flare
        part(cylinder(0.088, 0.37), "ivory", (0, 0, 0.305)),  # column
        part(cylinder(0.093, 0.02), "charcoal", (0, 0, 0.497)),  # collar
    ],
    "link1": [
        part(cylinder(0.088, 0.105), "ivory", (0, -0.1125, 0), ALONG_Y),  # neck
        part(cylinder(0.1, 0.275), "ivory", (0, 0, 0.0375)),  # drum
        part(cylinder(0.1015, 0.014), "blue", (0, 0, 0.155)),  # drum band
        part(cylinder(0.09, 0.018), "charcoal", (0, 0, -0.108)),  # drum step
        part(cylinder(0.062, 0.026), "charcoal", (0, 0, -0.129)),  # motor cap
        part(cylinder(0.086, 0.026), "charcoal", (0, 0, 0.187)),  # joint2 ring
    ],
    "link2": [
        part(upper_arm(), "cream"),  # casting
        part(cylinder(0.064, 0.011), "charcoal", (-0.4318, 0, 0.3055)),  # shoulder cover
        part(cylinder(0.022, 0.01), "steel", (-0.4318, 0, 0.312)),  # shoulder hub
        part(cylinder(0.036, 0.07), "charcoal", (-0.585, 0.04, 0.17)),  # motor 2
        part(cylinder(0.036, 0.07), "charcoal", (-0.585, -0.04, 0.17)),  # motor 3
        part(box((0.18, 0.026, 0.003)), "blue", (-0.2, 0, 0.3045)),  # nameplate
        part(cylinder(0.04, 0.009), "charcoal", (0, 0, 0.3045)),  # elbow cover
        part(cylinder(0.014, 0.008), "steel", (0, 0, 0.31)),  # elbow hub
    ],
    "link3": [
        part(forearm(), "cream"),  # casting
        part(cylinder(0.058, 0.016), "charcoal", (-0.0203, -0.0455, 0), ALONG_Y),  # elbow ring
        part(cylinder(0.044, 0.008), "charcoal", (-0.0203, 0.0475, 0), ALONG_Y),  # elbow cover
        part(box((0.018, 0.003, 0.13)), "blue", (-0.0075, 0.0426, 0.19), (0.03, 0, 0)),  # stripe
        part(cylinder(0.034, 0.014), "steel", (0, 0, 0.331)),  # wrist ring
    ],
    "link4": [
        part(cylinder(0.032, 0.056), "graphite", (0, -0.067, 0), ALONG_Y),  # barrel
        part(box((0.04, 0.018, 0.092)), "graphite", (0, -0.045, 0)),  # yoke
        part(box((0.04, 0.042, 0.012)), "graphite", (0, -0.021, 0.04)),  # fork left
        part(box((0.04, 0.042, 0.012)), "graphite", (0, -0.021, -0.04)),  # fork right
        part(cylinder(0.02, 0.012), "graphite", (0, 0, 0.04)),  # fork end left
        part(cylinder(0.02, 0.012), "graphite", (0, 0, -0.04)),  # fork end right
        part(cylinder(0.01, 0.098), "steel"),  # pin
    ],
    "link5": [
        part(cylinder(0.028, 0.066), "cream", (0, 0, 0), ALONG_Y),  # barrel
        part(cylinder(0.024, 0.032), "graphite", (0, 0, 0.03)),  # snout
    ],
    "link6": [
        part(cylinder(0.0315, 0.0105), "steel", (0, 0, 0.051)),  # disc
    ],
}


if __name__ == "__main__":
    write_model(Path(__file__).resolve().parent, PARTS, PALETTE)
