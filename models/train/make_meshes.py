"""Writes the visual meshes of the trains, one OBJ each.

Run ``python -m models.train.make_meshes`` at the project's root.

All parts are in the frame of the train: the centre of its body, x forward, z up, the table at z = -.035.
"""

from collections.abc import Sequence
from pathlib import Path

from models.mesh_builder import ALONG_X, ALONG_Y, Part, box, cylinder, ellipsoid, part, write_model

PALETTE = {
    "yellow": (0.98, 0.83, 0.30),
    "cream": (0.97, 0.94, 0.85),
    "white": (0.96, 0.96, 0.95),
    "red": (0.80, 0.13, 0.10),
    "navy": (0.07, 0.10, 0.22),
    "brass": (0.88, 0.70, 0.28),
    "steel": (0.72, 0.73, 0.75),
    "iron": (0.30, 0.30, 0.32),
    "tyre": (0.20, 0.20, 0.22),
    "glass": (0.16, 0.22, 0.28),
    "coal": (0.10, 0.11, 0.12),
}
SIDES = (1.0, -1.0)


def running_gear(wheel_x: Sequence[float], hub: str, beam: str, rods: bool) -> list[Part]:
    """Returns wheels at ``wheel_x`` [m], buffer beams with buffers, and coupling rods if ``rods``.

    The arguments hub and beam are colours.
    """
    parts = []
    for side in SIDES:
        for x in wheel_x:
            parts.append(part(cylinder(0.010, 0.005), "tyre", (x, side * 0.0145, -0.025), ALONG_Y))
            parts.append(part(cylinder(0.0055, 0.001), hub, (x, side * 0.0173, -0.025), ALONG_Y))
        if rods:
            parts.append(part(box((0.078, 0.0012, 0.0026)), "steel", (0.0, side * 0.0183, -0.0262)))
        for end in SIDES:
            parts.append(part(cylinder(0.0042, 0.006), "steel", (end * 0.063, side * 0.012, -0.0185), ALONG_X))
    parts += [part(box((0.004, 0.038, 0.011)), beam, (end * 0.058, 0.0, -0.0185)) for end in SIDES]
    return parts


def locomotive(
    body: str,
    cab: str,
    beam: str,
    hub: str,
    smokebox: str = "iron",
    fittings: str = "brass",
    bright: str = "steel",
    glass: str = "glass",
    lamp: str = "white",
) -> list[Part]:
    """Returns a side-tank locomotive, its tanks and cab flat at y = +-.020 where the pads grip.

    The arguments are colours.
    """
    parts = [
        part(box((0.114, 0.038, 0.005)), beam, (0.0, 0.0, -0.0185)),  # footplate
        part(box((0.062, 0.040, 0.022)), body, (0.009, 0.0, -0.005)),  # side tanks
        part(cylinder(0.0165, 0.068), body, (0.014, 0.0, 0.004), ALONG_X),  # boiler
        part(box((0.014, 0.028, 0.018)), body, (0.047, 0.0, -0.008)),  # saddle
        part(cylinder(0.0168, 0.012), smokebox, (0.048, 0.0, 0.004), ALONG_X),
        part(cylinder(0.0125, 0.003), bright, (0.0553, 0.0, 0.004), ALONG_X),  # smokebox door
        part(cylinder(0.0050, 0.012), smokebox, (0.048, 0.0, 0.024)),  # chimney
        part(cylinder(0.0064, 0.003), bright, (0.048, 0.0, 0.030)),
        part(ellipsoid((0.0075, 0.0075, 0.0080)), fittings, (0.014, 0.0, 0.020)),  # steam dome
        part(cylinder(0.0030, 0.010), fittings, (-0.008, 0.0, 0.0225)),  # safety valve
        part(box((0.036, 0.040, 0.036)), cab, (-0.040, 0.0, 0.002)),
        part(box((0.042, 0.040, 0.004)), cab, (-0.039, 0.0, 0.022)),  # roof
        part(box((0.0008, 0.024, 0.010)), glass, (-0.058, 0.0, 0.0115)),
        part(ellipsoid((0.0032, 0.0032, 0.0032)), lamp, (0.0575, 0.0, -0.0105)),
    ]
    for side in SIDES:
        parts += [
            part(box((0.017, 0.0008, 0.012)), glass, (-0.041, side * 0.020, 0.0105)),
            part(box((0.054, 0.0006, 0.002)), beam, (0.009, side * 0.020, 0.002)),  # lining
            part(box((0.0008, 0.007, 0.007)), glass, (-0.022, side * 0.0145, 0.0145)),
        ]
    return parts + running_gear((-0.036, 0.0, 0.036), hub, beam, rods=True)


def stripes() -> list[Part]:
    """Returns navy bands 10 mm wide across the locomotive, 10 to 15 mm apart."""
    parts = [part(box((0.010, 0.0404, 0.0404)), "navy", (x, 0.0, 0.004)) for x in (-0.052, -0.028)]
    for x in (-0.010, 0.010, 0.030):
        parts.append(part(box((0.010, 0.0404, 0.0224)), "navy", (x, 0.0, -0.005)))
        parts.append(part(cylinder(0.0168, 0.010), "navy", (x, 0.0, 0.004), ALONG_X))
    return parts


def mark() -> list[Part]:
    """Returns a white band round the cab, 16 mm wide."""
    return [
        part(box((0.016, 0.0406, 0.034)), "white", (-0.040, 0.0, 0.002)),
        part(box((0.016, 0.0406, 0.0046)), "white", (-0.040, 0.0, 0.0221)),
    ]


def railcar() -> list[Part]:
    """Returns a streamlined railcar: a half-cylinder roof and round ends over a flat-sided skirt."""
    parts = [
        part(box((0.114, 0.026, 0.005)), "iron", (0.0, 0.0, -0.0185)),
        part(box((0.090, 0.040, 0.026)), "red", (0.0, 0.0, -0.008)),
        part(box((0.0902, 0.0402, 0.010)), "cream", (0.0, 0.0, 0.0)),
        part(cylinder(0.020, 0.090), "cream", (0.0, 0.0, 0.005), ALONG_X),
    ]
    for end in SIDES:
        parts += [
            part(ellipsoid((0.0150, 0.0200, 0.0200)), "cream", (end * 0.045, 0.0, 0.005)),
            part(ellipsoid((0.0148, 0.0198, 0.0220)), "red", (end * 0.045, 0.0, 0.0)),
            part(ellipsoid((0.003, 0.003, 0.003)), "white", (end * 0.059, 0.0, 0.003)),
        ]
    for side in SIDES:
        for x in (-0.034, -0.017, 0.0, 0.017, 0.034):
            parts.append(part(box((0.012, 0.0012, 0.008)), "glass", (x, side * 0.0198, 0.0062)))
    return parts + running_gear((-0.030, 0.030), "red", "red", rods=False)


PARTS = {
    "plain": locomotive(body="yellow", cab="cream", beam="red", hub="red"),
    "striped": locomotive(body="white", cab="white", beam="navy", hub="white", fittings="white") + stripes(),
    "round": railcar(),
    "dark": locomotive(*["coal"] * 4, *["coal"] * 5) + mark(),
    "cube": [part(box((0.030, 0.030, 0.030)), "red", (0.0, 0.0, 0.0))],
}


if __name__ == "__main__":
    write_model(Path(__file__).resolve().parent, PARTS, PALETTE)
