"""Where a camera on the hand sees the hand itself, and where it looks: both from the joints and the jaws."""

import numpy as np

from drake_tracker.arm.arm_model import ArmModel
from drake_tracker.arm.arm_shape import ArmShape
from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.vision.hand.arm_silhouette import ArmSilhouette

_WIDTH_STEP = 0.001
"""Step of the jaws' opening in which silhouettes are drawn [m]: less than a pixel."""
_MARGIN = 2
"""Growth of the silhouette to every side [px]."""


class HandView:
    """A camera that is fixed to the hand: its pose at given joints, and the part of its image that the hand covers.

    Silhouettes are kept once they are drawn. They depend on the opening of the jaws alone.

    Args:
        camera: calibrated camera whose world frame is that of the tool: its ``X_CW`` is X_CT.
        model: kinematics of the arm.
        shape: of the arm and its hand.
    """

    def __init__(self, camera: CameraModel, model: ArmModel, shape: ArmShape) -> None:
        self.camera = camera
        self._model, self._shape = model, shape
        self._silhouette = ArmSilhouette(camera, (0, 0, camera.width, camera.height), margin=_MARGIN)
        self._drawn: dict[int, np.ndarray] = {}

    @property
    def num_joints(self) -> int:
        """Number of the arm's joints."""
        return self._model.num_joints

    def at(self, q: np.ndarray) -> CameraModel:
        """Returns the camera in the world at joint positions q, shape (n,) [rad]."""
        X_TW = self._model.tool_pose(q).inverse().GetAsMatrix4()
        camera = self.camera
        return camera.in_frame(X_TW)

    def scene(self, jaw_width: float) -> np.ndarray:
        """Returns float32 (h, w), 1 where the image shows the scene and 0 where it shows the hand.

        Args:
            jaw_width: opening of the jaws [m].
        """
        step = round(jaw_width / _WIDTH_STEP)
        if step not in self._drawn:
            q = self._model.q_nominal
            X_TW = self._model.tool_pose(q).inverse().GetAsMatrix4()
            pieces = [p_WQ @ X_TW[:3, :3].T + X_TW[:3, 3] for p_WQ in self._shape.pieces(q, step * _WIDTH_STEP)]
            self._drawn[step] = (self._silhouette.mask(pieces) == 0).astype(np.float32)
        return self._drawn[step]
