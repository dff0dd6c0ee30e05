"""The board's pose in the world from three touched points (Nashman and Chaconas 1990, section 3).

"The position and orientation of the board is identified in world coordinates by placing the manipulator's end effector
at three locations on the board and calculating the plane which contains all three points."

The plane gives the normal z_B and the board's height. The positions of the touched marks give the board's position and
rotation in the plane. The standard deviations of the result follow from two standard deviations: s, of a touch across
the plane, and p, of the operator's placement of the probe over a mark. The marks lie r_i = 0.21, 0.21 and 0.12 m from
their centre:

- Across the plane: s/sqrt(3) at the centre; tilt about x_B s sqrt(3/2)/0.18 m, about y_B s/(sqrt(2) 0.20 m). An s of
  0.1 mm gives 0.04 deg and 0.02 deg. The simulated arm notes a touch less than 0.1 mm too deep, far less than p.
- In the plane: p/sqrt(3) in x and in y at the centre, and p/sqrt(sum r_i^2) = p/0.32 m in rotation. A p of 0.5 mm gives
  0.3 mm and 0.09 deg: 1 mm across the path of a ball at the board's far end, but 0.4 mm at the bottom edge.
"""

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from drake_tracker.core.errors import DrakeTrackerError

MAX_MISFIT = 0.010
"""Largest difference [m] between the distance of two touched points and the distance of their marks."""
MIN_AREA = 0.002
"""Smallest area [m^2] of the triangle of touched points that determines the plane."""


def board_pose_from_touches(points: np.ndarray, marks_B: np.ndarray, probe_radius: float) -> RigidTransform:
    """Returns X_WB of the board.

    Args:
        points: touched positions of the probe's centre in W, shape (3, 3) [m].
        marks_B: the marks (x, y) on the board's face, in the same order, shape (3, 2) [m].
        probe_radius: radius of the probe's spherical tip [m], the height of its centre above the face.

    Raises DrakeTrackerError when the points are (nearly) collinear, or their distances differ from the distances of the
    marks.
    """
    points, marks_B = np.asarray(points, dtype=float), np.asarray(marks_B, dtype=float)
    cross = np.cross(points[1] - points[0], points[2] - points[0])
    area = 0.5 * np.linalg.norm(cross)
    if not area > MIN_AREA:
        raise DrakeTrackerError(
            f"the three points touched on the board are nearly collinear (a triangle of {1e4 * area:.1f} cm^2): "
            "they do not determine a plane"
        )
    misfit = np.max(np.abs(_sides(points) - _sides(marks_B)))
    if misfit > MAX_MISFIT:
        raise DrakeTrackerError(
            f"the distances between the points touched on the board differ by up to {1e3 * misfit:.0f} mm from those "
            f"of the marks ({1e3 * MAX_MISFIT:.0f} mm are allowed): was each mark touched, and in the right order?"
        )
    normal = cross / np.linalg.norm(cross)
    if normal[2] < 0.0:  # the face points up
        normal = -normal
    on_face = points - probe_radius * normal
    x_B, y_B = _in_plane_axes(on_face, marks_B, normal)
    R_WB = np.column_stack([x_B, y_B, normal])
    p_WB = on_face.mean(axis=0) - R_WB[:, :2] @ marks_B.mean(axis=0)
    return RigidTransform(RotationMatrix(R_WB), p_WB)


def _in_plane_axes(on_face: np.ndarray, marks_B: np.ndarray, normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns x_B and y_B in W: the rotation about the normal that fits the marks best (Kabsch in the plane)."""
    u = on_face[1] - on_face[0]
    u = u / np.linalg.norm(u)
    v = np.cross(normal, u)
    seen = (on_face - on_face.mean(axis=0)) @ np.column_stack([u, v])
    known = marks_B - marks_B.mean(axis=0)
    sine = np.sum(known[:, 0] * seen[:, 1] - known[:, 1] * seen[:, 0])
    cosine = np.sum(known * seen)
    angle = np.arctan2(sine, cosine)
    x_B = np.cos(angle) * u + np.sin(angle) * v
    return x_B, np.cross(normal, x_B)


def _sides(points: np.ndarray) -> np.ndarray:
    """Returns the lengths of a triangle's sides, shape (3,)."""
    return np.linalg.norm(points - np.roll(points, -1, axis=0), axis=1)
