"""Locates an object in the images of a camera on the hand: an appearance learned in hover is found again until contact.

The image is rectified on the horizontal plane of the object's top, in a frame that moves and turns with the predicted
object. There the object keeps its size and its direction, whatever the height of the hand. What it looks like there is
learned while the fixed cameras see it, and found again by masked normalised correlation.
"""

import math
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import NamedTuple

import cv2
import numpy as np

from drake_tracker.core.frozen_state import FrozenState, read_only
from drake_tracker.vision.camera_model import CameraModel

CELL = 0.002
"""Side of a cell of a rectified patch [m]: a little less than a pixel on the table in hover."""
HALF_LENGTH, HALF_WIDTH = 0.09, 0.036
"""Half the extent of the template along and across the direction of travel [m]."""
MARGIN = 0.012
"""Width of the rim around the object that belongs to its template [m]: the contrast with the table is there."""
REACH_ALONG, REACH_ACROSS = 0.024, 0.016
"""Largest distance of the object from its predicted place at which it is searched for [m]."""
TURN = math.radians(4.0)
"""Step of the search for the object's direction relative to the predicted one [rad]."""
LARGEST_TURN = math.radians(16.0)
"""Largest angle between the object's direction and the predicted one that is searched [rad]."""
LEARNED = 8
"""Images from which a template is known."""
MEMORY = 20
"""Images over which template and place are averaged, once there are as many."""
FORGOTTEN = 15
"""Images in a row in which the fixed cameras see the object but the template is not found, after which it is learned
anew."""
LEAST_CORRELATION = 0.6
"""Correlation of an image with the template below which the object does not count as found."""
LEAST_SHARE = 0.3
"""Least share of the template that an image must show."""
DARKEST = 10.0
"""Mean grey level of an image below which it is dark."""
ALONG_STD, ACROSS_STD, HEIGHT_STD = 0.0025, 0.0015, 0.003
"""Standard deviations of the measured place relative to the learned one [m]."""
DRIFT = 3.5
"""Standard deviations by which the fixed cameras may disagree, beside `DRIFT_FLOOR`."""
DRIFT_FLOOR = 0.008
"""Disagreement with the fixed cameras that is always tolerated [m]."""


class WristReason(IntEnum):
    """Why there is no measurement of the camera on the hand."""

    VALID = 0
    NO_IMAGE = 1
    NO_PREDICTION = 2
    DARK = 3
    OUT_OF_VIEW = 4
    NOT_LEARNED = 5
    POOR_MATCH = 6
    AT_THE_EDGE = 7
    DISAGREES = 8
    JAWS_CLOSED = 9


class Expectation(NamedTuple):
    """Where the host predicts the object at the capture of an image.

    Attributes:
        p_WQ: its reference point, shape (3,) [m].
        yaw: its direction of travel [rad].
    """

    p_WQ: np.ndarray
    yaw: float


class FixedPoint(NamedTuple):
    """What the fixed cameras measured at the same stamp.

    Attributes:
        p_WQ: shape (3,) [m].
        covariance: shape (3, 3) [m^2].
        length: largest dimension of the object [m].
    """

    p_WQ: np.ndarray
    covariance: np.ndarray
    length: float


@dataclass(frozen=True, eq=False)
class Appearance(FrozenState):
    """What is known of the object, in its own frame: x along its direction of travel, y to its left.

    Attributes:
        grey: template, float32 (h, w) [grey levels]; a cell is `CELL` wide, rows run along y, columns along x.
        weight: float32 (h, w), 1 where the template is known and shows the object or its rim, else 0.
        count: number of images that were learned.
        anchor: place of the reference point relative to the template's middle, shape (2,) [m].
        anchor_variance: of it, shape (2,) [m^2].
        z: height of the reference point in W [m].
        turn: direction of the object relative to the predicted one, as found in the newest image [rad].
        length: of the object [m].
        missed: number of images since it was last found, of those in which the fixed cameras saw it.
    """

    grey: np.ndarray
    weight: np.ndarray
    count: int
    anchor: np.ndarray
    anchor_variance: np.ndarray
    z: float
    turn: float
    length: float
    missed: int = 0


class WristMeasurement(NamedTuple):
    """What one image of the camera on the hand says.

    Attributes:
        reason: `WristReason.VALID`, or why there is no measurement.
        p_WQ: the object's reference point, shape (3,) [m].
        covariance: of it, shape (3, 3) [m^2].
        correlation: of the image with the template, -1 to 1.
    """

    reason: WristReason
    p_WQ: np.ndarray
    covariance: np.ndarray
    correlation: float = 0.0


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


def plane_homography(camera: CameraModel, origin: np.ndarray, yaw: float) -> np.ndarray:
    """Returns the matrix (3, 3) that takes points (x, y, 1) [m] of a horizontal plane to pixels, without distortion.

    Args:
        camera: the camera at the capture of the image.
        origin: of the plane's coordinates, shape (3,) [m, W].
        yaw: angle of their x axis about z_W [rad].
    """
    c, s = math.cos(yaw), math.sin(yaw)
    X_WP = np.array([[c, -s, origin[0]], [s, c, origin[1]], [0.0, 0.0, origin[2]], [0.0, 0.0, 1.0]])
    return camera.K @ camera.X_CW[:3] @ X_WP


def rectified(
    image: np.ndarray, seen: np.ndarray, camera: CameraModel, origin: np.ndarray, yaw: float, half: tuple[float, float]
) -> tuple[np.ndarray, np.ndarray]:
    """Returns a patch of a horizontal plane and which of its cells are seen, both float32 of one shape.

    Args:
        image: grey, float32, without distortion.
        seen: float32, 1 where the image shows the scene and 0 where it shows the hand.
        camera: the camera at the capture.
        origin: middle of the patch, shape (3,) [m, W].
        yaw: angle of the patch's columns about z_W [rad].
        half: half the extent of the patch along and across [m].
    """
    columns, rows = (2 * round(extent / CELL) + 1 for extent in half)
    cells = np.array([[CELL, 0.0, -half[0]], [0.0, CELL, -half[1]], [0.0, 0.0, 1.0]])
    H = plane_homography(camera, origin, yaw) @ cells
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    patch = cv2.warpPerspective(_softened(image, camera, origin), H, (columns, rows), flags=flags)
    mask = cv2.warpPerspective(seen, H, (columns, rows), flags=flags)
    ends = np.array([[0.0, 0.0, 1.0], [columns, 0.0, 1.0], [0.0, rows, 1.0], [columns, rows, 1.0]]) @ H[2]
    if ends.min() <= 0.0:  # part of the patch is behind the camera
        mask = np.zeros_like(mask)
    return patch, (mask > 0.99).astype(np.float32)


def _softened(image: np.ndarray, camera: CameraModel, origin: np.ndarray) -> np.ndarray:
    """Returns an image that is smoothed so that a cell averages the pixels in it."""
    depth = float(camera.X_CW[2, :3] @ origin + camera.X_CW[2, 3])
    pixels = CELL * camera.K[0, 0] / max(depth, CELL)
    return cv2.GaussianBlur(image, (0, 0), 0.5 * pixels) if pixels > 1.0 else image


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


class WristView:
    """Learns what an object looks like from the hand, and finds it again. All memory is with the caller.

    Args:
        table_height: height of the table's top in W [m].
        object_width: width of the object between the jaws [m].
    """

    def __init__(self, table_height: float, object_width: float) -> None:
        self._table, self._width = table_height, object_width

    def measure(
        self,
        appearance: Appearance | None,
        image: np.ndarray,
        seen: np.ndarray,
        camera: CameraModel,
        expected: Expectation,
        fixed: FixedPoint | None,
    ) -> tuple[Appearance | None, WristMeasurement]:
        """Returns what is known of the object after an image, and where the object is.

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
            return self._begun(image, seen, camera, expected, fixed)
        origin = self._middle(expected.p_WQ, appearance.z)
        match = self._found(appearance, image, seen, camera, origin, expected.yaw)
        if match.correlation <= -1.0:
            return appearance, nothing(WristReason.OUT_OF_VIEW)
        if match.correlation < LEAST_CORRELATION:
            return _missed(appearance, fixed), nothing(WristReason.POOR_MATCH, match.correlation)
        if match.at_edge:
            return _missed(appearance, fixed), nothing(WristReason.AT_THE_EDGE, match.correlation)
        yaw = expected.yaw + match.turn
        R = _rotation(yaw)
        middle = origin[:2] + _rotation(expected.yaw) @ (match.along, match.across)
        learned = replace(appearance, turn=match.turn, missed=0)
        if fixed is not None:
            learned = self._learned(learned, image, seen, camera, middle, yaw, fixed)
        p_WQ = np.array([*(middle + R @ learned.anchor), learned.z])
        variance = learned.anchor_variance + (ALONG_STD**2, ACROSS_STD**2)
        covariance = np.zeros((3, 3))
        covariance[:2, :2] = R @ np.diag(variance) @ R.T
        covariance[2, 2] = HEIGHT_STD**2
        if learned.count < LEARNED:
            return learned, nothing(WristReason.NOT_LEARNED, match.correlation)
        if fixed is not None and _disagree(p_WQ, covariance, fixed):
            return learned, nothing(WristReason.DISAGREES, match.correlation)
        return learned, WristMeasurement(WristReason.VALID, p_WQ, covariance, match.correlation)

    def _middle(self, p_WQ: np.ndarray, z: float) -> np.ndarray:
        """Returns the middle of the object's top, shape (3,) [m], from its reference point, half as high."""
        return np.array([p_WQ[0], p_WQ[1], 2.0 * z - self._table])

    def _found(
        self,
        appearance: Appearance,
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
                along, across = _rotation(turn) @ place
                best = Match(along, across, turn, float(scores.max()), at_edge)
        assert best is not None
        return best

    def _begun(
        self, image: np.ndarray, seen: np.ndarray, camera: CameraModel, expected: Expectation, fixed: FixedPoint
    ) -> tuple[Appearance | None, WristMeasurement]:
        """Returns the appearance after the first image."""
        z = float(fixed.p_WQ[2])
        origin = self._middle(fixed.p_WQ, z)
        grey, visible = rectified(image, seen, camera, origin, expected.yaw, (HALF_LENGTH, HALF_WIDTH))
        box = self._box(fixed.length, grey.shape)
        if (visible * box).sum() < box.sum():
            return None, nothing(WristReason.OUT_OF_VIEW)
        appearance = Appearance(
            grey=read_only(grey),
            weight=read_only(visible * box),
            count=1,
            anchor=read_only(np.zeros(2)),
            anchor_variance=read_only(_in_frame(fixed.covariance, expected.yaw)),
            z=z,
            turn=0.0,
            length=fixed.length,
        )
        return appearance, nothing(WristReason.NOT_LEARNED)

    def _box(self, length: float, shape: tuple[int, ...]) -> np.ndarray:
        """Returns float32 of a patch's shape, 1 on an object in its middle and on the rim around it."""
        y, x = (CELL * np.abs(np.arange(n) - n // 2) for n in shape)
        inside = (x <= 0.5 * length + MARGIN)[None] & (y <= 0.5 * self._width + MARGIN)[:, None]
        return inside.astype(np.float32)

    def _learned(
        self,
        appearance: Appearance,
        image: np.ndarray,
        seen: np.ndarray,
        camera: CameraModel,
        middle: np.ndarray,
        yaw: float,
        fixed: FixedPoint,
    ) -> Appearance:
        """Returns the appearance after another image in which the fixed cameras see the object, too."""
        share = 1.0 / min(appearance.count + 1, MEMORY)
        z = appearance.z + share * (float(fixed.p_WQ[2]) - appearance.z)
        length = appearance.length + share * (fixed.length - appearance.length)
        origin = np.array([*middle, 2.0 * appearance.z - self._table])
        patch, visible = rectified(image, seen, camera, origin, yaw, (HALF_LENGTH, HALF_WIDTH))
        grey = appearance.grey + np.float32(share) * visible * (patch - appearance.grey)
        offset = _rotation(yaw).T @ (fixed.p_WQ[:2] - middle)
        anchor = appearance.anchor + share * (offset - appearance.anchor)
        return replace(
            appearance,
            grey=read_only(grey),
            count=appearance.count + 1,
            anchor=read_only(anchor),
            z=z,
            length=length,
        )


def nothing(reason: WristReason, correlation: float = 0.0) -> WristMeasurement:
    """Returns a measurement without a place.

    Args:
        reason: why there is none.
        correlation: of the image with the template.
    """
    return WristMeasurement(reason, np.zeros(3), np.zeros((3, 3)), correlation)


def _missed(appearance: Appearance, fixed: FixedPoint | None) -> Appearance | None:
    """Returns what is known after an image in which the template was not found, None if it must be learned anew."""
    if fixed is None:
        return appearance
    missed = appearance.missed + 1
    return None if missed >= FORGOTTEN or appearance.count < LEARNED else replace(appearance, missed=missed)


def _rotation(angle: float) -> np.ndarray:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s], [s, c]])


def _in_frame(covariance: np.ndarray, yaw: float) -> np.ndarray:
    """Returns the variances (2,) along and across a direction of a covariance (3, 3) in W."""
    R = _rotation(yaw)
    return np.diag(R.T @ covariance[:2, :2] @ R).copy()


def _disagree(p_WQ: np.ndarray, covariance: np.ndarray, fixed: FixedPoint) -> bool:
    """Returns whether a measurement contradicts that of the fixed cameras, horizontally."""
    difference = p_WQ[:2] - fixed.p_WQ[:2]
    distance = float(np.hypot(*difference))
    if distance <= DRIFT_FLOOR:
        return False
    direction = difference / distance
    variance = direction @ (covariance + fixed.covariance)[:2, :2] @ direction
    return bool(distance > DRIFT_FLOOR + DRIFT * math.sqrt(variance))
