"""Writes the visual meshes of the UR5e-like arm, one OBJ per link.

Run ``python -m models.ur5e.make_meshes`` at the project's root.

Plain cylinders about the axes of the arm, of about its thickness; no manufacturer's drawing or mesh was used, and
nothing here affects the physics. Each part is in the frame of its link.
"""

from pathlib import Path

from models.mesh_builder import ALONG_X, cylinder, part, write_model

PALETTE = {
    "silver": (0.78, 0.79, 0.80),
    "graphite": (0.22, 0.23, 0.25),
    "blue": (0.30, 0.52, 0.70),
    "charcoal": (0.15, 0.16, 0.17),
}
PEDESTAL = 0.45
"""Height of the arm's foot above the floor [m], as in ``ur5e.sdf``."""

PARTS = {
    "base": [
        part(cylinder(0.16, 0.02), "charcoal", (0, 0, 0.01)),  # plate
        part(cylinder(0.085, PEDESTAL - 0.02), "graphite", (0, 0, 0.5 * PEDESTAL)),  # pedestal
        part(cylinder(0.075, 0.09), "silver", (0, 0, PEDESTAL + 0.045)),  # foot
        part(cylinder(0.062, 0.012), "blue", (0, 0, PEDESTAL + 0.096)),  # ring
    ],
    "link1": [
        part(cylinder(0.060, 0.13), "silver", (0, -0.005, 0), (1.5707963267948966, 0.0, 0.0)),  # about joint 1
        part(cylinder(0.060, 0.06), "silver", (0, 0, 0.045)),  # about joint 2
        part(cylinder(0.058, 0.012), "blue", (0, 0, 0.079)),  # ring
    ],
    "link2": [
        part(cylinder(0.060, 0.10), "silver", (0.425, 0, 0.135)),  # shoulder
        part(cylinder(0.058, 0.012), "blue", (0.425, 0, 0.190)),  # shoulder cap
        part(cylinder(0.048, 0.425), "silver", (0.2125, 0, 0.138), ALONG_X),  # tube
        part(cylinder(0.056, 0.10), "silver", (0, 0, 0.115)),  # elbow
        part(cylinder(0.054, 0.012), "blue", (0, 0, 0.170)),  # elbow cap
    ],
    "link3": [
        part(cylinder(0.054, 0.10), "silver", (0.3922, 0, 0.015)),  # elbow
        part(cylinder(0.054, 0.012), "blue", (0.3922, 0, -0.040)),  # elbow cap
        part(cylinder(0.038, 0.3922), "silver", (0.1961, 0, 0.007), ALONG_X),  # tube
        part(cylinder(0.042, 0.08), "silver", (0, 0, 0.03)),  # wrist
    ],
    "link4": [
        part(cylinder(0.042, 0.09), "silver", (0, 0, 0)),  # about joint 5
        part(cylinder(0.041, 0.010), "blue", (0, 0, 0.050)),  # cap
        part(cylinder(0.040, 0.06), "silver", (0, -0.03, 0), (1.5707963267948966, 0.0, 0.0)),  # about joint 4
    ],
    "link5": [
        part(cylinder(0.042, 0.09), "silver", (0, 0, 0)),  # about joint 6
        part(cylinder(0.040, 0.06), "silver", (0, 0.03, 0), (1.5707963267948966, 0.0, 0.0)),  # about joint 5
        part(cylinder(0.041, 0.010), "blue", (0, 0, -0.050)),  # cap
    ],
    "link6": [
        part(cylinder(0.0375, 0.045), "graphite", (0, 0, -0.0225)),  # flange
    ],
}


if __name__ == "__main__":
    write_model(Path(__file__).resolve().parent, PARTS, PALETTE)
