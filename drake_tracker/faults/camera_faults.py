"""Faults of the pose of a camera: it was knocked, or its calibration is wrong."""

from dataclasses import dataclass, replace

import cv2
import numpy as np

from drake_tracker.faults.fault import CalibrationFault, ImageFault, PointFault, Sight, View
from drake_tracker.vision.camera_model import CameraModel


@dataclass(frozen=True)
class CameraKnockedFault(ImageFault, PointFault):
    """`CameraKnocked`: the camera turns about its centre.

    A rotation about the centre of a pinhole camera moves its pixels by a homography, exactly. What it would see beyond
    the edge of the rendered window is not rendered; the pixels of the edge are repeated there.
    """

    def homography(self, K: np.ndarray) -> np.ndarray:
        """Returns the matrix (3, 3) that takes the pixels before the knock to those after it.

        Args:
            K: (3, 3) intrinsic matrix [px].
        """
        angle, direction = np.deg2rad([self.settings.angle_deg, self.settings.direction_deg])
        axis = np.array([-np.sin(direction), np.cos(direction), 0.0])  # z_C x (the direction in which it turns)
        R, _ = cv2.Rodrigues(angle * axis)
        return K @ R.T @ np.linalg.inv(K)

    def image(self, image: np.ndarray, view: View, time: float, held: np.ndarray | None) -> np.ndarray:
        K = view.model.K.copy()
        K[:2, 2] -= view.window[:2]
        size = image.shape[1::-1]
        return cv2.warpPerspective(image, self.homography(K), size, borderMode=cv2.BORDER_REPLICATE)

    def centroid(self, sight: Sight) -> np.ndarray | None:
        if sight.uv is None:
            return None
        u, v, w = self.homography(sight.model.K) @ [*sight.uv, 1.0]
        return np.array([u / w, v / w])


@dataclass(frozen=True)
class CalibrationWrongFault(CalibrationFault):
    """`CalibrationWrong`: the model is rotated about the vertical axis through the camera, and moved along its x_C."""

    def calibrated(self, camera: str, model: CameraModel) -> CameraModel:
        if not self.hits(camera):
            return model
        angle = np.deg2rad(self.settings.angle_deg)
        R, _ = cv2.Rodrigues(np.array([0.0, 0.0, angle]))
        X_WC = np.array(model.X_WC)
        X_WC[:3, :3] = R @ X_WC[:3, :3]
        X_WC[:3, 3] += self.settings.distance * X_WC[:3, 0]
        return replace(model, X_CW=np.linalg.inv(X_WC))
