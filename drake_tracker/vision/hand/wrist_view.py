"""Locates an object in the images of a camera on the hand: an appearance learned in hover is found again until contact.

The image is rectified on the horizontal plane of the object's top, in a frame that moves and turns with the predicted
object. There the object keeps its size and its direction, whatever the height of the hand. Its appearance is learned
while the fixed cameras see it, and found again by masked normalised correlation.
"""

import math
from dataclasses import replace
from typing import NamedTuple

import cv2
import numpy as np

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.vision.hand.wrist_measurement import (
    Expectation,
    FixedPoint,
    WristMeasurement,
    WristReason,
    disagree,
    nothing,
)
from drake_tracker.vision.hand.wrist_template import (
    HALF_LENGTH,
    HALF_WIDTH,
    LEARNED,
    WristTemplate,
    WristTemplateLearner,
    missed,
)
from drake_tracker.vision.rectified_patch import CELL, rectified, rotation
from drake_tracker.vision.subpixel_peak import peak_offset

REACH_ALONG, REACH_ACROSS = 0.024, 0.016
"""Largest distance of the object from its predicted place at which it is searched for [m]."""
TURN = math.radians(4.0)
"""Step of the search for the object's direction relative to the predicted one [rad]."""
LARGEST_TURN = math.radians(16.0)
"""Largest searched angle between the object's direction and the predicted direction [rad]."""
LEAST_CORRELATION = 0.6
"""Correlation of an image with the template below which the object does not count as found."""
DARKEST = 10.0
"""Mean grey level of an image below which it is dark."""
ALONG_STD, ACROSS_STD, HEIGHT_STD = 0.0025, 0.0015, 0.003
"""Standard deviations of the measured place relative to the learned one [m]."""
LEAST_SHARE = 0.3
"""Least share of the template that an image must show."""


class Match(NamedTuple):
    """Where a template was found.

    Attributes:
        along: distance from the middle of the patch, along the patch [m].
        across: the same across it [m].
        turn: angle of the patch that fits best [rad].
        correlation: normalised, -1 to 1.
        at_edge: whether the best place is at the edge of the search.
    """

    along: float
    across: float
    turn: float
    correlation: float
    at_edge: bool


class WristView:
    """Learns the appearance of an object from the hand, and finds the object again. All memory is with the caller.

    Args:
        table_height: height of the table's top in W [m].
        object_width: width of the object between the jaws [m].
    """

    def __init__(self, table_height: float, object_width: float) -> None:
        self._learner = WristTemplateLearner(table_height, object_width)

    def measure(
        self,
        appearance: WristTemplate | None,
        image: np.ndarray,
        seen: np.ndarray,
        camera: CameraModel,
        expected: Expectation,
        fixed: FixedPoint | None,
    ) -> tuple[WristTemplate | None, WristMeasurement]:
        """Returns the learned object after an image, and the place of the object.

        Args:
            appearance: what was known before, None for nothing.
            image: grey, float32 (h, w), without distortion.
            seen: float32 (h, w), 1 where the image shows the scene and 0 where it shows the hand.
            camera: the camera at the capture of the image.
            expected: where the object is predicted.
            fixed: what the fixed cameras measured at the same stamp, None for nothing.
        """
        if float(image.mean()) < DARKEST:
            return appearance, nothing(WristReason.DARK)
        if appearance is None:
            if fixed is None:
                return None, nothing(WristReason.NOT_LEARNED)
            begun = self._learner.begin(image, seen, camera, expected.yaw, fixed)
            return begun, nothing(WristReason.OUT_OF_VIEW if begun is None else WristReason.NOT_LEARNED)
        origin = self._learner.middle(expected.p_WQ, appearance.z)
        match = self._found(appearance, image, seen, camera, origin, expected.yaw)
        if match.correlation <= -1.0:
            return appearance, nothing(WristReason.OUT_OF_VIEW)
        if match.correlation < LEAST_CORRELATION:
            return missed(appearance, fixed), nothing(WristReason.POOR_MATCH, match.correlation)
        if match.at_edge:
            return missed(appearance, fixed), nothing(WristReason.AT_THE_EDGE, match.correlation)
        yaw = expected.yaw + match.turn
        R = rotation(yaw)
        middle = origin[:2] + rotation(expected.yaw) @ (match.along, match.across)
        learned = replace(appearance, turn=match.turn, missed=0)
        if fixed is not None:
            learned = self._learner.refine(learned, image, seen, camera, middle, yaw, fixed)
        p_WQ = np.array([*(middle + R @ learned.anchor), learned.z])
        variance = learned.anchor_variance + (ALONG_STD**2, ACROSS_STD**2)
        covariance = np.zeros((3, 3))
        covariance[:2, :2] = R @ np.diag(variance) @ R.T
        covariance[2, 2] = HEIGHT_STD**2
        if learned.count < LEARNED:
            return learned, nothing(WristReason.NOT_LEARNED, match.correlation)
        if fixed is not None and disagree(p_WQ, covariance, fixed):
            return learned, nothing(WristReason.DISAGREES, match.correlation)
        return learned, WristMeasurement(WristReason.VALID, p_WQ, covariance, match.correlation)

    def _found(
        self,
        appearance: WristTemplate,
        image: np.ndarray,
        seen: np.ndarray,
        camera: CameraModel,
        origin: np.ndarray,
        yaw: float,
    ) -> Match:
        """Returns where the template fits best, in coordinates of the predicted direction."""
        half = (HALF_LENGTH + REACH_ALONG, HALF_WIDTH + REACH_ACROSS)
        best: Match | None = None
        for step in (0.0, -TURN, TURN):
            turn = float(np.clip(appearance.turn + step, -LARGEST_TURN, LARGEST_TURN))
            patch, visible = rectified(image, seen, camera, origin, yaw + turn, half)
            scores = correlate(patch, visible, appearance.grey, appearance.weight)
            if best is None or scores.max() > best.correlation:
                row, column, at_edge = peak(scores)
                place = np.array([column * CELL - REACH_ALONG, row * CELL - REACH_ACROSS])
                along, across = rotation(turn) @ place
                best = Match(along, across, turn, float(scores.max()), at_edge)
        assert best is not None
        return best


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
        row + peak_offset(scores[:, column], int(row), 0.5),
        column + peak_offset(scores[row], int(column), 0.5),
        False,
    )
