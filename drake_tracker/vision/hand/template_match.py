"""Masked normalised correlation of a template with the places in a patch, and the place where it is largest."""

import cv2
import numpy as np

LEAST_SHARE = 0.3
"""Least share of the template that an image must show."""


def correlate(patch: np.ndarray, seen: np.ndarray, template: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Returns the normalised correlation of a template at each place in a patch; -1 where too little of it is seen.

    Cells count only where the template is known and the patch is seen (Padfield 2012, for weights of 0 and 1).

    Args:
        patch: float32 (H, W).
        seen: float32 (H, W), 0 or 1.
        template: float32 (h, w).
        weight: float32 (h, w), 0 or 1.

    Returns an array (H - h + 1, W - w + 1).
    """
    level = float(template[weight > 0.0].mean())  # near-zero means keep the differences of sums exact
    P, T = (patch - level) * seen, (template - level) * weight

    def total(image: np.ndarray, kernel: np.ndarray) -> np.ndarray:
        return cv2.matchTemplate(image, kernel, cv2.TM_CCORR).astype(float)

    count = total(seen, weight)
    enough = count >= LEAST_SHARE * weight.sum()
    count = np.maximum(count, 1.0)
    sum_P, sum_T = total(P, weight), total(seen, T)
    covariance = total(P, T) - sum_P * sum_T / count
    spread_P = np.maximum(total(P * P, weight) - sum_P**2 / count, 1.0)
    spread_T = np.maximum(total(seen, T * T) - sum_T**2 / count, 1.0)
    return np.where(enough, covariance / np.sqrt(spread_P * spread_T), -1.0)


def peak(scores: np.ndarray) -> tuple[float, float, bool]:
    """Returns (row, column, at edge) of the largest score, between the cells by a parabola through its neighbours."""
    row, column = np.unravel_index(int(scores.argmax()), scores.shape)
    height, width = scores.shape
    if not (0 < row < height - 1 and 0 < column < width - 1):
        return float(row), float(column), True
    return (
        row + _vertex(*scores[row - 1 : row + 2, column]),
        column + _vertex(*scores[row, column - 1 : column + 2]),
        False,
    )


def _vertex(before: float, at: float, after: float) -> float:
    """Returns where a parabola through three values, 1 apart, is largest, relative to the middle one."""
    bend = before - 2.0 * at + after
    return 0.0 if bend >= 0.0 else float(np.clip(0.5 * (before - after) / bend, -0.5, 0.5))
