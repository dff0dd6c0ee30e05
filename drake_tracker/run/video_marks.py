"""The marks in the camera video, and their colours."""

import cv2
import numpy as np
from numpy.typing import ArrayLike

from drake_tracker.tasks.style import bgr, draw_text

GROUND, VOID = "#15181c", "#0c0e10"
"""Colours of the background and of empty panels."""
BRIGHT, MEDIUM, DIM = "#f2f4f6", "#a3abb5", "#565e68"
"""Colours of text."""
ENERGY, PATH, OUTLINE, GOAL = "#ffb000", "#4cc2ff", "#77808a", "#ff8a3d"
"""Colours of moving pixels, the predicted path, the window of interest and the predicted arrival."""
_SHIFT = 4
"""Number of fractional bits in the coordinates that OpenCV's drawing functions receive."""


def fixed(point: ArrayLike) -> tuple[int, ...]:
    """Returns coordinates [px] as OpenCV's drawing functions receive them, with `_SHIFT` fractional bits."""
    return tuple(round(float(c) * (1 << _SHIFT)) for c in np.asarray(point))


def polyline(image: np.ndarray, points: ArrayLike, colour: str, thickness: int, closed: bool = False) -> None:
    """Draws a line through points.

    Args:
        image: BGR image, changed in place.
        points: points [px], shape (n, 2).
        colour: colour, "#rrggbb".
        thickness: thickness of the line [px].
        closed: whether to connect the last point with the first.
    """
    corners = np.rint(np.asarray(points) * (1 << _SHIFT)).astype(np.int32)
    cv2.polylines(image, [corners], closed, bgr(colour), thickness, cv2.LINE_AA, _SHIFT)


def dot(image: np.ndarray, point: ArrayLike, radius: float, colour: str) -> None:
    """Draws a filled circle.

    Args:
        image: BGR image, changed in place.
        point: its centre [px]; nothing is drawn if it is not finite.
        radius: radius [px].
        colour: colour, "#rrggbb".
    """
    if np.isfinite(point).all():
        cv2.circle(image, fixed(point), int(radius * (1 << _SHIFT)), bgr(colour), -1, cv2.LINE_AA, _SHIFT)


def ring(image: np.ndarray, point: ArrayLike, radius: float, colour: str) -> None:
    """Draws a circle with a dark edge; arguments as for `dot`."""
    if np.isfinite(point).all():
        for width, shade in ((4, VOID), (2, colour)):
            cv2.circle(image, fixed(point), int(radius * (1 << _SHIFT)), bgr(shade), width, cv2.LINE_AA, _SHIFT)


def cross(image: np.ndarray, point: ArrayLike, arm: float = 13.0, gap: float = 0.0) -> None:
    """Draws a cross.

    Args:
        image: image, changed in place.
        point: its centre [px].
        arm: length of its arms [px].
        gap: half the width of the gap in its middle, which leaves a small object visible [px].
    """
    for width, shade in ((4, VOID), (2, BRIGHT)):
        for step in ((1.0, 0.0), (0.0, 1.0)):
            along = [np.asarray(point) + reach * np.array(step) for reach in (-arm - gap, -gap, gap, arm + gap)]
            for ends in ((along[0], along[3]),) if not gap else (along[:2], along[2:]):
                cv2.line(image, fixed(ends[0]), fixed(ends[1]), bgr(shade), width, cv2.LINE_AA, _SHIFT)


def diamond(image: np.ndarray, point: ArrayLike, radius: float, colour: str) -> None:
    """Draws a filled square that stands on a corner; arguments as for `dot`."""
    if np.isfinite(point).all():
        corners = np.asarray(point) + np.array([(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)]) * radius
        cv2.fillPoly(image, [np.rint(corners * (1 << _SHIFT)).astype(np.int32)], bgr(colour), cv2.LINE_AA, _SHIFT)
        polyline(image, corners, VOID, 1, closed=True)


def right_text(image: np.ndarray, text: str, right: int, y: int, size: int, colour: str) -> None:
    """Writes a line of text that ends at a given column.

    Args:
        image: BGR image, changed in place.
        text: one line of text.
        right: column at which the text ends [px].
        y: row of the baseline [px].
        size: font size [px].
        colour: colour, "#rrggbb".
    """
    # Drawn once outside the image to measure its width.
    width = draw_text(image, text, 0, -100, size, colour)
    draw_text(image, text, right - width, y, size, colour)


def legend_path(page: np.ndarray, x: int, y: int) -> None:
    """Draws the mark of the predicted path.

    Args:
        page: BGR image, changed in place.
        x: column of its centre [px].
        y: row of its centre [px].
    """
    ring(page, (x - 5, y), 5.0, PATH)
    for step in (5, 11):
        dot(page, (x + step - 1, y), 2.0, PATH)


def legend_goal(page: np.ndarray, x: int, y: int) -> None:
    """Draws the mark of the predicted arrival; arguments as for `legend_path`."""
    polyline(page, [(x - 10, y), (x + 10, y)], GOAL, 2)
    diamond(page, (x, y), 6.0, GOAL)


def legend_energy(page: np.ndarray, x: int, y: int) -> None:
    """Draws the mark of moving pixels; arguments as for `legend_path`."""
    cv2.rectangle(page, (x - 6, y - 5), (x + 5, y + 5), bgr(ENERGY), -1)


def legend_centroid(page: np.ndarray, x: int, y: int) -> None:
    """Draws the mark of a centroid; arguments as for `legend_path`."""
    cross(page, (x, y), 7.0)


def legend_outline(page: np.ndarray, x: int, y: int) -> None:
    """Draws the mark of a window of interest; arguments as for `legend_path`."""
    polyline(page, [(x - 8, y + 2), (x - 2, y - 6), (x + 8, y - 1), (x + 2, y + 6)], OUTLINE, 1, closed=True)
