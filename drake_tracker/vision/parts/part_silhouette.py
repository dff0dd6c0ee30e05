"""How a part that lies on the belt appears in the image of a calibrated camera: its silhouette, drawn between pixels.

A part is a prism, or several. Of each convex piece the camera sees the convex hull of its projected corners; the
silhouette is their union.
"""

import math
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import cv2
import numpy as np

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.core.frozen_state import read_only
from drake_tracker.core.part_kinds import PART_SHAPES, PartKind, part_outline, solids

FINE = 4
"""Subdivisions of a pixel along u and along v with which a silhouette is drawn."""
_SHIFT = 4
_ROUND = 5
"""One corner in this many of a disc's outline is enough, at less than a tenth of a pixel."""
_STEP = 0.001
"""Displacement from which derivatives are taken [m]."""
_ORIGIN = _STEP * np.eye(3, 3, k=-1)
"""The origin of P, and places beside it along x and y of W [m]."""


@dataclass(frozen=True)
class PartPose:
    """A part on the belt.

    Attributes:
        kind: of the part.
        x: of the origin of P in W [m].
        y: of the origin of P in W [m].
        yaw: direction of x_P in W [rad].
    """

    kind: PartKind
    x: float
    y: float
    yaw: float


class Patch(NamedTuple):
    """The silhouette of a part in a rectangle of a window.

    Attributes:
        rows: of the window.
        columns: of the window.
        share: of each pixel that the silhouette covers, float32 (h, w).
        centre: where the origin of P appears, (u, v) [px], from the first pixel of the rectangle.
        jacobian: derivative of that by x and y of the part, shape (2, 2) [px/m].
    """

    rows: slice
    columns: slice
    share: np.ndarray
    centre: np.ndarray
    jacobian: np.ndarray


class PartSilhouette:
    """Draws parts as a camera sees them through a window of its image.

    Args:
        camera: calibrated camera.
        window: (u0, v0, width, height) [px] of the full image.
        belt_height: z_W of the plane on which parts lie [m].
    """

    def __init__(self, camera: CameraModel, window: tuple[int, int, int, int], belt_height: float) -> None:
        self._camera, self._belt_height = camera, belt_height
        self._first = np.array(window[:2], dtype=float)
        self._width, self._height = window[2:]

    def outlines(self, pose: PartPose) -> list[np.ndarray]:
        """Returns the hull of each convex piece of a part, in pixels of the window, shape (n, 2) each, float32."""
        return self._hulls(pose.kind, self._project(pose))

    def patch(self, pose: PartPose, margin: int = 3) -> Patch | None:
        """Returns the silhouette of a part, None when it is outside of the window.

        Args:
            pose: of the part.
            margin: width of the border of the rectangle around the silhouette [px].
        """
        pixels = self._project(pose)
        outlines = self._hulls(pose.kind, pixels)
        every = outlines[0] if len(outlines) == 1 else np.concatenate(outlines)
        (low_u, low_v), (high_u, high_v) = every.min(axis=0).tolist(), every.max(axis=0).tolist()
        if not math.isfinite(low_u + low_v + high_u + high_v):
            return None
        u0, v0 = max(math.floor(low_u) - margin, 0), max(math.floor(low_v) - margin, 0)
        u1 = min(math.ceil(high_u) + margin + 1, self._width)
        v1 = min(math.ceil(high_v) + margin + 1, self._height)
        if u0 >= u1 or v0 >= v1:
            return None
        first = np.array([u0, v0], dtype=float)
        fine = np.zeros((FINE * (v1 - v0), FINE * (u1 - u0)), np.uint8)
        for outline in outlines:
            corners = FINE * (outline - first + 0.5) - 0.5
            cv2.fillConvexPoly(
                fine, np.rint(corners * (1 << _SHIFT)).astype(np.int32), 255, lineType=cv2.LINE_8, shift=_SHIFT
            )
        share = cv2.resize(fine, (u1 - u0, v1 - v0), interpolation=cv2.INTER_AREA).astype(np.float32) / 255.0
        origin, *beside = pixels[-len(_ORIGIN) :]
        jacobian = (np.array(beside) - origin).T / _STEP
        return Patch(slice(v0, v1), slice(u0, u1), share, origin - self._first - first, jacobian)

    def _project(self, pose: PartPose) -> np.ndarray:
        """Returns where the corners of a part appear, then the points of `_ORIGIN`, shape (n, 2) [px], full image."""
        c, s = math.cos(pose.yaw), math.sin(pose.yaw)
        corners = _corners(pose.kind)
        p_WQ = np.empty((len(corners) + len(_ORIGIN), 3))
        np.matmul(corners, [[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]], out=p_WQ[: len(corners)])
        p_WQ[: len(corners)] += (pose.x, pose.y, self._belt_height)
        p_WQ[len(corners) :] = _ORIGIN + (pose.x, pose.y, self._belt_height + 0.5 * PART_SHAPES[pose.kind].height)
        return self._camera.project(p_WQ)

    def _hulls(self, kind: PartKind, pixels: np.ndarray) -> list[np.ndarray]:
        """Returns the hull of each convex piece of a part whose corners appear at pixels of the full image."""
        inside = (pixels[: -len(_ORIGIN)] - self._first).astype(np.float32)
        return [cv2.convexHull(inside[piece])[:, 0] for piece in _pieces(kind)]


@cache
def _corners(kind: PartKind) -> np.ndarray:
    """Returns the corners of all pieces of `piece_corners`, shape (n, 3)."""
    return read_only(np.concatenate(piece_corners(kind)))


@cache
def _pieces(kind: PartKind) -> tuple[slice, ...]:
    """Returns the rows of `_corners` of each piece."""
    ends = np.cumsum([len(each) for each in piece_corners(kind)]).tolist()
    return tuple(slice(start, end) for start, end in zip([0, *ends], ends))


@cache
def piece_corners(kind: PartKind) -> tuple[np.ndarray, ...]:
    """Returns the corners of each convex piece of a part that stands on the plane z = 0, in P's x and y, (n, 3) [m]."""
    height = PART_SHAPES[kind].height
    bases = [part_outline(kind)]
    if kind is PartKind.DISC:
        bases = [bases[0][::_ROUND]]
    if kind is PartKind.ELL:
        signs = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
        bases = [np.array(centre) + signs * size for centre, size in solids(kind)]
    return tuple(
        read_only(np.vstack([np.column_stack([base, np.full(len(base), z)]) for z in (0.0, height)])) for base in bases
    )
