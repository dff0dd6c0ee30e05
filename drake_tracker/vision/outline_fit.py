"""Where objects of known size stand in a silhouette that shows all of them.

Each object appears as the outline of its box. The outlines are placed so that they cover the silhouette and little
else: one after the other is moved to the place where it explains most pixels, given the others, until none moves.
"""

import math
from collections.abc import Sequence

import cv2
import numpy as np

ROUNDS = 6
"""How often every outline is moved at most."""
FIRST_REACH, REACH = 8, 3
"""How far an outline is moved at a time in either direction, in the first round and later [px]."""
PULL = 0.2
"""Loss of pixels, as a share of the outline's, that an outline accepts to be a standard deviation nearer to where it is
expected."""
STEADY = 0.05
"""Outlines that move less than this [px] have found their places."""


def box_outline(edges: np.ndarray) -> np.ndarray:
    """Returns the corners of the outline of a box about its centre, shape (n, 2) [px].

    Args:
        edges: the three edges of the box as they appear in the image, as columns, shape (2, 3) [px].
    """
    signs = np.array([[a, b, c] for a in (-0.5, 0.5) for b in (-0.5, 0.5) for c in (-0.5, 0.5)])
    return cv2.convexHull((signs @ edges.T).astype(np.float32))[:, 0]


def fit_outlines(
    silhouette: np.ndarray, outlines: Sequence[np.ndarray], centres: Sequence[np.ndarray], stds: Sequence[float]
) -> list[np.ndarray]:
    """Returns the centres (u, v) [px] at which outlines cover a silhouette best.

    Args:
        silhouette: uint8 (h, w), 1 where it is.
        outlines: of each object, as from `box_outline`.
        centres: where each object is expected, shape (2,) [px].
        stds: standard deviation of each expectation [px].
    """
    templates = [_template(outline) for outline in outlines]
    border = max(max(template.shape) for template in templates) + FIRST_REACH
    padded = cv2.copyMakeBorder(silhouette, border, border, border, border, cv2.BORDER_CONSTANT)
    height, width = silhouette.shape
    limits = np.array([width, height], float) - 1.0
    expected = [np.clip(centre, 0.0, limits) + border for centre in centres]
    found = list(expected)
    for turn in range(ROUNDS):
        moved = 0.0
        for k, template in enumerate(templates):
            alone = padded.copy()
            for other, place in enumerate(found):
                if other != k:
                    _erase(alone, templates[other], place)
            reach = FIRST_REACH if turn == 0 else REACH
            place = _best_place(cv2.add(alone, padded), template, found[k], reach, expected[k], stds[k])
            place = np.clip(place, border, limits + border)
            moved = max(moved, float(np.abs(place - found[k]).max()))
            found[k] = place
        if moved < STEADY:
            break
    return [place - border for place in found]


def own_shares(silhouette: np.ndarray, outlines: Sequence[np.ndarray], centres: Sequence[np.ndarray]) -> list[float]:
    """Returns which share of each outline covers pixels of the silhouette that no larger outline covers.

    Args:
        silhouette: uint8 (h, w), 1 where it is.
        outlines: of each object, as from `box_outline`.
        centres: of each object, shape (2,) [px].
    """
    areas = [cv2.contourArea(outline) for outline in outlines]
    rest, shares = silhouette.copy(), [0.0] * len(outlines)
    for k in sorted(range(len(outlines)), key=lambda k: -areas[k]):
        mask = np.zeros_like(silhouette)
        corners = np.rint((outlines[k] + centres[k]) * 16.0).astype(np.int32)
        cv2.fillConvexPoly(mask, corners, 1, lineType=cv2.LINE_8, shift=4)
        shares[k] = cv2.countNonZero(cv2.bitwise_and(mask, rest)) / max(areas[k], 1.0)
        rest = cv2.subtract(rest, mask)
    return shares


def _template(outline: np.ndarray) -> np.ndarray:
    """Returns an outline filled with 1, uint8, of odd width and height, with its centre in the middle."""
    half_width, half_height = (math.ceil(float(np.abs(outline[:, axis]).max())) for axis in (0, 1))
    template = np.zeros((2 * half_height + 1, 2 * half_width + 1), np.uint8)
    corners = np.rint((outline + (half_width, half_height)) * 16.0).astype(np.int32)
    cv2.fillConvexPoly(template, corners, 1, lineType=cv2.LINE_8, shift=4)
    return template


def _erase(image: np.ndarray, template: np.ndarray, place: np.ndarray) -> None:
    """Sets the pixels under a template to 0."""
    height, width = template.shape
    u, v = np.rint(place).astype(int) - (width // 2, height // 2)
    view = image[v : v + height, u : u + width]
    np.multiply(view, 1 - template, out=view)


def _best_place(
    scores: np.ndarray, template: np.ndarray, start: np.ndarray, reach: int, expected: np.ndarray, std: float
) -> np.ndarray:
    """Returns the centre near ``start`` at which a template covers the highest scores, shape (2,) [px]."""
    height, width = template.shape
    u, v = np.rint(start).astype(int)
    top, left = v - reach - height // 2, u - reach - width // 2
    view = scores[top : top + height + 2 * reach, left : left + width + 2 * reach]
    covered = cv2.matchTemplate(view, template, cv2.TM_CCORR)
    du, dv = (np.arange(-reach, reach + 1) + (centre - goal) for centre, goal in zip((u, v), expected))
    pull = PULL * float(template.sum()) / max(std, 1.0) ** 2
    total = covered - pull * (du[None, :] ** 2 + dv[:, None] ** 2)
    row, column = np.unravel_index(int(total.argmax()), total.shape)
    return np.array([u - reach + _peak(total[row], int(column)), v - reach + _peak(total[:, column], int(row))], float)


def _peak(values: np.ndarray, index: int) -> float:
    """Returns where the parabola through the largest value and its neighbours has its maximum."""
    if not 0 < index < len(values) - 1:
        return float(index)
    before, at, after = values[index - 1 : index + 2]
    bend = before - 2.0 * at + after
    return float(index + (0.5 * (before - after) / bend if bend < 0.0 else 0.0))
