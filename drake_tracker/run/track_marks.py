"""The marks of regions and tracks in the camera video, for a vision that tracks several objects."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import ArrayLike

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.core.messages import REGION_FIELDS, TrackPoints, TrackState, message_rows
from drake_tracker.run.video_marks import BRIGHT, MEDIUM, VOID, dot, fixed, polyline
from drake_tracker.tasks.style import bgr, draw_text, track_light
from drake_tracker.tasks.tracks import TrackRow, track_rows

RING, DOT = 10.0, 3.0
"""Radii of the marks of an unseen object and of a seen object [px]."""
_TAG, _TAG_WIDTH, _TAG_HEIGHT = (9, -8), 10, 17
"""Offset of a number from its object, width of a digit and height of the tag [px]."""
_DASHES = 8


@dataclass(frozen=True)
class RegionMark:
    """One object in an image.

    Attributes:
        u: column of the centroid [px], full image.
        v: row [px].
        width: extent along u [px].
        height: extent along v [px].
        number: number of its track; 0 or less: none.
    """

    u: float
    v: float
    width: float
    height: float
    number: int


@dataclass(frozen=True, eq=False)
class TrackMark:
    """One track in one image.

    Attributes:
        row: the track.
        then: (u, v) of its position at the stamp [px], full image; NaN behind the camera.
        now: (u, v) of where it is when the present image is captured, if it keeps its velocity [px].
    """

    row: TrackRow
    then: tuple[float, float]
    now: tuple[float, float]


def region_marks(message: np.ndarray) -> tuple[RegionMark, ...]:
    """Returns the marks of a `Regions` vector."""
    u, v, width, height, track = (
        message_rows(np.asarray(message), REGION_FIELDS)[:, REGION_FIELDS.index(name)]
        for name in ("u", "v", "width", "height", "track")
    )
    return tuple(
        RegionMark(float(u[k]), float(v[k]), float(width[k]), float(height[k]), int(track[k]))
        for k in np.nonzero(width > 0.0)[0]
    )


def track_marks(message: np.ndarray, camera: CameraModel, now: float) -> tuple[TrackMark, ...]:
    """Returns the marks of a `TrackPoints` vector in the image of a camera.

    Args:
        message: the vector.
        camera: the calibrated camera.
        now: time of the present image [s].
    """
    rows = track_rows(message)
    if not rows:
        return ()
    ahead = max(now - TrackPoints(message).stamp, 0.0)
    then = camera.project([row.p_WQ for row in rows])
    later = camera.project([row.p_WQ + (row.state != TrackState.STANDING) * ahead * row.v_WQ for row in rows])
    return tuple(
        TrackMark(row, (float(a[0]), float(a[1])), (float(b[0]), float(b[1]))) for row, a, b in zip(rows, then, later)
    )


def draw_region(image: np.ndarray, corners: ArrayLike, mark: RegionMark, target: bool) -> None:
    """Draws the rectangle of a region, thick for the target.

    Args:
        image: BGR image, changed in place.
        corners: two opposite corners [px], shape (2, 2).
        mark: the region.
        target: whether its track is the target.
    """
    (left, top), (right, bottom) = np.asarray(corners)
    outline = [(left, top), (right, top), (right, bottom), (left, bottom)]
    colour = track_light(mark.number) if mark.number > 0 else MEDIUM
    polyline(image, outline, VOID, 4 if target else 3, closed=True)
    polyline(image, outline, colour, 2 if target else 1, closed=True)


def draw_track(image: np.ndarray, point: ArrayLike, row: TrackRow) -> None:
    """Draws the mark of a track and its number: a dot where its object is seen, a dashed ring where it is not.

    Args:
        image: BGR image, changed in place.
        point: position [px]; nothing is drawn if it is not finite, or far outside the image.
        row: the track.
    """
    point = np.asarray(point, float)
    height, width = image.shape[:2]
    if not (np.isfinite(point).all() and -width <= point[0] <= 2 * width and -height <= point[1] <= 2 * height):
        return
    colour = track_light(row.number)
    if row.seen:
        dot(image, point, DOT + 1.0, VOID)
        dot(image, point, DOT, colour)
    else:
        dashed_ring(image, point, RING, colour)
    x, y = np.rint(point + _TAG).astype(int)
    tag(image, int(x), int(y), str(row.number), colour, row.target)


def dashed_ring(image: np.ndarray, point: ArrayLike, radius: float, colour: str) -> None:
    """Draws a dashed circle with a dark edge.

    Args:
        image: BGR image, changed in place.
        point: its centre [px].
        radius: radius [px].
        colour: colour, "#rrggbb".
    """
    centre, axes = fixed(point), fixed((radius, radius))
    for width, shade in ((4, VOID), (2, colour)):
        for start in np.arange(_DASHES) * 360.0 / _DASHES:
            cv2.ellipse(image, centre, axes, 0.0, start, start + 150.0 / _DASHES, bgr(shade), width, cv2.LINE_AA, 4)


def tag(image: np.ndarray, x: int, y: int, words: str, colour: str, filled: bool) -> None:
    """Writes the number of a track: dark on its colour for the target, in its colour on dark otherwise.

    Args:
        image: BGR image, changed in place.
        x: column of the left edge [px].
        y: row of the baseline [px].
        words: the number.
        colour: colour of the track, "#rrggbb".
        filled: whether it is the target.
    """
    right = x + _TAG_WIDTH * len(words) + 8
    cv2.rectangle(image, (x, y - _TAG_HEIGHT + 1), (right, y + 2), bgr(colour if filled else VOID), -1)
    cv2.rectangle(image, (x, y - _TAG_HEIGHT + 1), (right, y + 2), bgr(colour), 1)
    draw_text(image, words, x + 4, y - 1, 15, VOID if filled else colour, bold=True)


def legend_seen(page: np.ndarray, x: int, y: int) -> None:
    """Draws the mark of an object that is seen; arguments as for `video_marks.legend_path`."""
    tag(page, x - 9, y + 6, "n", BRIGHT, False)


def legend_lost(page: np.ndarray, x: int, y: int) -> None:
    """Draws the mark of an object that is not seen; arguments as for `video_marks.legend_path`."""
    dashed_ring(page, (x, y), 6.0, BRIGHT)


def legend_target(page: np.ndarray, x: int, y: int) -> None:
    """Draws the mark of the target; arguments as for `video_marks.legend_path`."""
    tag(page, x - 9, y + 6, "n", BRIGHT, True)
