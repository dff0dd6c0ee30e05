"""The appearance of an object from above, learned from the images of a camera on the hand.

The appearance belongs to the object's own frame, in which it does not depend on the height of the hand.
"""

from dataclasses import dataclass, replace

import numpy as np

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.core.frozen_state import FrozenState, read_only
from drake_tracker.vision.hand.wrist_measurement import FixedPoint
from drake_tracker.vision.rectified_patch import CELL, rectified, rotation

HALF_LENGTH, HALF_WIDTH = 0.09, 0.036
"""Half the extent of the template along and across the direction of travel [m]."""
MARGIN = 0.012
"""Width of the rim around the object that belongs to its template [m]: the contrast with the table is there."""
LEARNED = 8
"""Images from which a template is known."""
MEMORY = 20
"""Images over which template and place are averaged, once there are as many."""
FORGOTTEN = 15
"""Images in a row in which the fixed cameras see the object but the template is not found, after which it is learned
anew."""


@dataclass(frozen=True, eq=False)
class WristTemplate(FrozenState):
    """The learned object, in its own frame: x along its direction of travel, y to its left.

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


class WristTemplateLearner:
    """Learns an `WristTemplate`. All memory is with the caller.

    Args:
        table_height: height of the table's top in W [m].
        object_width: width of the object between the jaws [m].
    """

    def __init__(self, table_height: float, object_width: float) -> None:
        self._table, self._width = table_height, object_width

    def middle(self, p_WQ: np.ndarray, z: float) -> np.ndarray:
        """Returns the middle of the object's top, shape (3,) [m].

        Args:
            p_WQ: its reference point, half as high, of which x and y are used, shape (2,) or (3,) [m].
            z: height of the reference point in W [m].
        """
        return np.array([p_WQ[0], p_WQ[1], 2.0 * z - self._table])

    def begin(
        self, image: np.ndarray, seen: np.ndarray, camera: CameraModel, yaw: float, fixed: FixedPoint
    ) -> WristTemplate | None:
        """Returns the appearance after the first image, None if it does not show the whole object.

        Args:
            image: grey, float32 (h, w), without distortion.
            seen: float32 (h, w), 1 where the image shows the scene and 0 where it shows the hand.
            camera: the camera at the capture of the image.
            yaw: predicted direction of the object [rad].
            fixed: what the fixed cameras measured at the same stamp.
        """
        z = float(fixed.p_WQ[2])
        origin = self.middle(fixed.p_WQ, z)
        grey, visible = rectified(image, seen, camera, origin, yaw, (HALF_LENGTH, HALF_WIDTH))
        box = self._box(fixed.length, grey.shape)
        if (visible * box).sum() < box.sum():
            return None
        return WristTemplate(
            grey=read_only(grey),
            weight=read_only(visible * box),
            count=1,
            anchor=read_only(np.zeros(2)),
            anchor_variance=read_only(_in_frame(fixed.covariance, yaw)),
            z=z,
            turn=0.0,
            length=fixed.length,
        )

    def refine(
        self,
        appearance: WristTemplate,
        image: np.ndarray,
        seen: np.ndarray,
        camera: CameraModel,
        middle: np.ndarray,
        yaw: float,
        fixed: FixedPoint,
    ) -> WristTemplate:
        """Returns the appearance after another image in which the fixed cameras see the object, too.

        Args:
            appearance: what was known before.
            image: as for `begin`.
            seen: as for `begin`.
            camera: as for `begin`.
            middle: where the object was found in the image, (x, y) in W [m].
            yaw: its direction as found [rad].
            fixed: as for `begin`.
        """
        share = 1.0 / min(appearance.count + 1, MEMORY)
        z = appearance.z + share * (float(fixed.p_WQ[2]) - appearance.z)
        length = appearance.length + share * (fixed.length - appearance.length)
        origin = self.middle(middle, appearance.z)
        patch, visible = rectified(image, seen, camera, origin, yaw, (HALF_LENGTH, HALF_WIDTH))
        grey = appearance.grey + np.float32(share) * visible * (patch - appearance.grey)
        offset = rotation(yaw).T @ (fixed.p_WQ[:2] - middle)
        anchor = appearance.anchor + share * (offset - appearance.anchor)
        return replace(
            appearance,
            grey=read_only(grey),
            count=appearance.count + 1,
            anchor=read_only(anchor),
            z=z,
            length=length,
        )

    def _box(self, length: float, shape: tuple[int, ...]) -> np.ndarray:
        """Returns float32 of a patch's shape, 1 on an object in its middle and on the rim around it."""
        y, x = (CELL * np.abs(np.arange(n) - n // 2) for n in shape)
        inside = (x <= 0.5 * length + MARGIN)[None] & (y <= 0.5 * self._width + MARGIN)[:, None]
        return inside.astype(np.float32)


def missed(appearance: WristTemplate, fixed: FixedPoint | None) -> WristTemplate | None:
    """Returns the state after an image in which the template was not found, None if the template must be learned anew.

    Args:
        appearance: what was known before.
        fixed: what the fixed cameras measured at the same stamp, None for nothing.
    """
    if fixed is None:
        return appearance
    count = appearance.missed + 1
    return None if count >= FORGOTTEN or appearance.count < LEARNED else replace(appearance, missed=count)


def _in_frame(covariance: np.ndarray, yaw: float) -> np.ndarray:
    """Returns the variances (2,) along and across a direction of a covariance (3, 3) in W."""
    R = rotation(yaw)
    return np.diag(R.T @ covariance[:2, :2] @ R).copy()
