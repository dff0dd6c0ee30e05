"""Places a part of known shape so that its silhouettes fit the silhouettes in the images of all cameras.

This is the alignment of a template (Lucas and Kanade 1981) whose template is the drawn silhouette: the difference
between the observed and the drawn silhouette is a linear function of a small displacement (dx, dy, dyaw) of the part,
which the method of Gauss and Newton finds. Because the drawn silhouette contains the height of the part, both images
count together. Pixels that show something else count neither for nor against a place.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

from drake_tracker.core.part_kinds import PART_SHAPES
from drake_tracker.vision.parts.part_silhouette import PartPose, PartSilhouette, Patch

LARGEST_STEP = np.array([0.006, 0.006, 0.25])
"""Largest displacement in one step: x, y [m] and yaw [rad]."""
CORRELATED = 9.0
"""Number of neighbouring pixels whose errors are alike, by which the variances grow. Chosen on seeds 3 and 4, so that
the errors are as large as the variances say."""
LEAST_STD = np.array([3e-4, 3e-4, 0.006])
"""No place is better known than this: x, y [m] and yaw [rad]."""
UNKNOWN_YAW_STD = 1.0
"""Standard deviation of the direction of a part that has none [rad]."""
_TURN = np.array([[0.0, -1.0], [1.0, 0.0]])


class SeenWindow(NamedTuple):
    """Content of one camera's image.

    Attributes:
        silhouette: draws parts in it.
        seen: float32 (h, w), 1 on the foreground, smoothed with `soften`.
        weight: float32 (h, w), 1 where the image shows the belt or objects on the belt, 0 elsewhere.
    """

    silhouette: PartSilhouette
    seen: np.ndarray
    weight: np.ndarray


@dataclass(frozen=True, eq=False)
class PartFit:
    """Where a part is.

    Attributes:
        pose: of the part.
        covariance: of x, y [m] and yaw [rad], shape (3, 3).
        misfit: mean square of the difference between observed and drawn silhouette, as a share of the drawn one.
        share: of the drawn silhouettes in all images that is not hidden.
        filled: share of the visible part of the silhouettes that is foreground.
    """

    pose: PartPose
    covariance: np.ndarray
    misfit: float
    share: float
    filled: float


def soften(image: np.ndarray) -> np.ndarray:
    """Returns a smoothed image, so that a silhouette that is a little displaced still tells where to."""
    return cv2.GaussianBlur(image, (5, 5), 1.0)


def fit_part(
    windows: Sequence[SeenWindow], pose: PartPose, steps: int, drawn_there: Sequence[Patch | None] | None = None
) -> PartFit | None:
    """Returns where a part is, near a pose; None when no image shows anything of the place.

    Args:
        windows: of all cameras.
        pose: near which it is.
        steps: of the method of Gauss and Newton, 1 or more.
        drawn_there: its silhouettes at that pose in the windows, if they are drawn already.
    """
    free = 3 if PART_SHAPES[pose.kind].turns else 2
    patches = drawn_there
    for _ in range(steps):
        if patches is None:
            patches = [each.silhouette.patch(pose) for each in windows]
        normal, gradient, squares = np.zeros((3, 3)), np.zeros(3), 0.0
        drawn, visible, filled = 0.0, 0.0, 0.0
        for window, patch in zip(windows, patches):
            if patch is None:
                continue
            weight = window.weight[patch.rows, patch.columns]
            soft = soften(patch.share)
            residual = window.seen[patch.rows, patch.columns] - soft
            weighted = weight * residual
            slopes = _slopes(soft, patch).reshape(3, -1)
            normal += (slopes * weight.reshape(-1)) @ slopes.T
            gradient += slopes @ weighted.reshape(-1)
            squares += float(np.vdot(weighted, residual))
            drawn += float(patch.share.sum())
            shown = patch.share * weight
            visible += float(shown.sum())
            filled += float(np.vdot(shown, residual + soft))
        if visible < 1.0 or np.linalg.cond(normal[:free, :free]) > 1e12:
            return None
        step = np.zeros(3)
        step[:free] = np.linalg.solve(normal[:free, :free], gradient[:free])
        step = np.clip(step, -LARGEST_STEP, LARGEST_STEP)
        pose = PartPose(pose.kind, pose.x + float(step[0]), pose.y + float(step[1]), pose.yaw + float(step[2]))
        patches = None
    misfit = max(squares - float(gradient @ step), 0.0) / visible
    # A pixel's error is that of a silhouette with this misfit, at least that of the rounding of its outline.
    inverse = np.zeros((3, 3))
    inverse[:free, :free] = np.linalg.inv(normal[:free, :free])
    covariance = CORRELATED * max(misfit, 0.005) * inverse + np.diag(LEAST_STD**2)
    if free == 2:
        covariance[2, 2] = UNKNOWN_YAW_STD**2
    return PartFit(pose, covariance, misfit, visible / max(drawn, 1e-9), filled / visible)


def _slopes(soft: np.ndarray, patch: Patch) -> np.ndarray:
    """Returns the derivatives of a drawn silhouette by x, y and yaw of the part, shape (3, h, w).

    The whole silhouette is assumed to turn about the origin of P in the image, as the silhouette of a flat part would.
    """
    along_u = (0.5 * cv2.Sobel(soft, cv2.CV_32F, 1, 0, ksize=1)).astype(np.float64)
    along_v = (0.5 * cv2.Sobel(soft, cv2.CV_32F, 0, 1, ksize=1)).astype(np.float64)
    J = patch.jacobian
    (turn_uu, turn_uv), (turn_vu, turn_vv) = (J @ _TURN @ np.linalg.inv(J)).tolist()
    (ux, uy), (vx, vy) = J.tolist()
    height, width = soft.shape
    u = (np.arange(width, dtype=np.float32) - np.float32(patch.centre[0])).astype(np.float64)[None, :]
    v = (np.arange(height, dtype=np.float32) - np.float32(patch.centre[1])).astype(np.float64)[:, None]
    slopes = np.empty((3, height, width))
    np.add(along_u * ux, along_v * vx, out=slopes[0])
    np.add(along_u * uy, along_v * vy, out=slopes[1])
    np.add(along_u * (turn_uu * u + turn_uv * v), along_v * (turn_vu * u + turn_vv * v), out=slopes[2])
    return np.negative(slopes, out=slopes)
