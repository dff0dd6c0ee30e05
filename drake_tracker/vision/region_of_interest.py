"""The polygonal window of interest: the part of an image in which the work volume can appear.

Motion outside it (a passer-by, the arm's own links) is ignored, and pixels outside it need not even be rendered.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import ArrayLike

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.core.errors import DrakeTrackerError

POLYGON_SHIFT = 4
"""Fractional bits of the polygon's corners when it is filled."""


@dataclass(frozen=True, eq=False)
class RegionOfInterest:
    """A convex polygon in an image and the upright rectangle that contains it.

    Attributes:
        polygon: shape (n, 2), read-only: corners (u, v) in full-frame pixel coordinates.
        bounds: the rectangle (u0, v0, width, height) [px]; (u0, v0) is its top left pixel in the full frame.
    """

    polygon: np.ndarray
    bounds: tuple[int, int, int, int]

    def mask(self, bounds: tuple[int, int, int, int] | None = None) -> np.ndarray:
        """Returns the polygon drawn into a rectangle (u0, v0, width, height), by default the window's own.

        The mask is uint8 of shape (height, width), 255 inside the polygon and 0 outside.
        """
        u0, v0, width, height = bounds or self.bounds
        mask = np.zeros((height, width), np.uint8)
        corners = np.rint((self.polygon - (u0, v0)) * (1 << POLYGON_SHIFT)).astype(np.int32)
        cv2.fillConvexPoly(mask, corners, 255, lineType=cv2.LINE_8, shift=POLYGON_SHIFT)
        return mask


def check_box(box: ArrayLike, name: str = "work volume") -> tuple[np.ndarray, np.ndarray]:
    """Returns (lower, upper) corners, each of shape (3,), of a box given as [[x, y, z], [x, y, z]] [m].

    Args:
        box: the two corners.
        name: of the box, for the message of an error.

    Raises DrakeTrackerError when it is not such a pair or the lower corner is not below the upper one.
    """
    box = np.asarray(box, dtype=float)
    if box.shape != (2, 3) or not np.isfinite(box).all() or not (box[0] < box[1]).all():
        raise DrakeTrackerError(
            f"{name} {box.tolist()} must be two corners [[xmin, ymin, zmin], [xmax, ymax, zmax]], "
            "each minimum below its maximum"
        )
    return box[0], box[1]


def footprint(work_volume: ArrayLike, outline: str) -> np.ndarray:
    """Returns the outline, shape (n, 2) [m], of a work volume seen from above.

    Args:
        work_volume: lower and upper corner in W, shape (2, 3) [m].
        outline: "box" for the box itself, "ellipse" for its inscribed ellipse: an oval track does not use the corners
            of a box, and in the image the arm's links move over the far corners.

    Raises DrakeTrackerError on another outline.
    """
    (x0, y0, _), (x1, y1, _) = check_box(work_volume)
    if outline == "box":
        return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])
    if outline == "ellipse":
        angle = np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False)
        centre, half = np.array([x0 + x1, y0 + y1]) / 2, np.array([x1 - x0, y1 - y0]) / 2
        return centre + half * np.column_stack([np.cos(angle), np.sin(angle)])
    raise DrakeTrackerError(f"work volume outline is {outline!r}; it must be box or ellipse")


def is_within(work_volume: ArrayLike, outline: str, points: ArrayLike) -> np.ndarray:
    """Returns which points are within the `footprint` of a work volume, its edge included, bool of shape (n,).

    Args:
        work_volume: lower and upper corner in W, shape (2, 3) [m].
        outline: "box" or "ellipse".
        points: (x, y) in W, shape (n, 2) [m].
    """
    edge = footprint(work_volume, outline).astype(np.float32)
    return np.array([cv2.pointPolygonTest(edge, (float(x), float(y)), False) >= 0 for x, y in np.asarray(points)])


def project_region(
    camera: CameraModel, work_volume: ArrayLike, outline: str = "box", *, padding: int = 4
) -> RegionOfInterest:
    """Returns the `RegionOfInterest` through which a camera sees a work volume.

    Args:
        camera: calibrated camera in W.
        work_volume: lower and upper corner of a box in W, shape (2, 3) [m].
        outline: of its `footprint`, "box" or "ellipse".
        padding: width of the border kept around the polygon [px], so that smoothing and gradients inside it are not
            affected by the edge of an image that is rendered through the window only.

    The rectangle lies within the full frame; its sides are even where the frame's are. Raises DrakeTrackerError when a
    corner of the volume is behind the camera or the camera does not see the volume.
    """
    ground = footprint(work_volume, outline)
    rims = [np.column_stack([ground, np.full(len(ground), corner[2])]) for corner in np.asarray(work_volume)]
    return region_around(camera, np.vstack(rims), padding)


def region_around(camera: CameraModel, points: ArrayLike, padding: int = 4) -> RegionOfInterest:
    """Returns the `RegionOfInterest` of a camera whose polygon is the convex hull of the images of points.

    Args:
        camera: calibrated camera.
        points: shape (n, 3) [m], in the camera's world frame.
        padding: width of the border kept around the polygon [px].

    Raises DrakeTrackerError as `project_region` does.
    """
    corners = camera.project(points)
    if np.isnan(corners).any():
        raise DrakeTrackerError("a corner of the work volume lies behind a camera; move the camera or the volume")
    polygon = cv2.convexHull(corners.astype(np.float32)).reshape(-1, 2).astype(float)
    polygon.setflags(write=False)
    u0, width = _even_span(polygon[:, 0], camera.width, padding)
    v0, height = _even_span(polygon[:, 1], camera.height, padding)
    if width <= 0 or height <= 0:
        raise DrakeTrackerError("a camera does not see the work volume; turn the camera or move the volume")
    return RegionOfInterest(polygon, (u0, v0, width, height))


def _even_span(coordinates: np.ndarray, size: int, padding: int) -> tuple[int, int]:
    """Returns (first pixel, number of pixels) that cover the coordinates within an image side of ``size`` pixels."""
    first = max(0, int(np.floor(coordinates.min())) - padding) // 2 * 2
    end = min(size, int(np.ceil(coordinates.max())) + padding + 1)
    return first, min(size, end + end % 2) - first
