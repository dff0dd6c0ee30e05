"""Faults of the pose of a camera: it was knocked, shakes or pans, or its calibration is wrong."""

import math
from dataclasses import dataclass, replace

import cv2
import numpy as np

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.faults.fault import TIME_TOLERANCE, CalibrationFault, FaultyView, ImageFault, PointFault, Sight


def turned(K: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """Returns the homography (3, 3) that takes the pixels before a turn of a camera about its centre to those after it.

    Args:
        K: (3, 3) intrinsic matrix [px].
        turn: (2,) angle by which the camera turns to the right and downwards [rad].
    """
    R, _ = cv2.Rodrigues(np.array([-turn[1], turn[0], 0.0]))  # about z_C x (the direction in which it turns)
    return K @ R.T @ np.linalg.inv(K)


class TurnedCameraFault(ImageFault, PointFault):
    """A camera that turns about its centre.

    A rotation about the centre of a pinhole camera moves its pixels by a homography, exactly. The scene beyond the edge
    of the rendered window is not rendered; the pixels of the edge are repeated instead.
    """

    interpolation = cv2.INTER_CUBIC

    def turn(self, camera: str, K: np.ndarray, time: float) -> np.ndarray:
        """Returns the angles (2,) by which a camera is turned to the right and downwards at a time [rad].

        Args:
            camera: "left", "right", or "both" for the only one.
            K: (3, 3) its intrinsic matrix [px].
            time: of the image [s].
        """
        raise NotImplementedError

    def image(self, image: np.ndarray, view: FaultyView, time: float, held: np.ndarray | None) -> np.ndarray:
        K = view.model.K.copy()
        K[:2, 2] -= view.window[:2]
        H = turned(K, self.turn(view.camera, K, time))
        return cv2.warpPerspective(
            image, H, image.shape[1::-1], flags=self.interpolation, borderMode=cv2.BORDER_REPLICATE
        )

    def centroid(self, sight: Sight) -> np.ndarray | None:
        if sight.uv is None:
            return None
        K = sight.model.K
        u, v, w = turned(K, self.turn(sight.camera, K, sight.time)) @ [*sight.uv, 1.0]
        return np.array([u / w, v / w])


@dataclass(frozen=True)
class CameraKnockedFault(TurnedCameraFault):
    """`CameraKnocked`: the camera is turned by a constant angle."""

    interpolation = cv2.INTER_LINEAR

    def turn(self, camera: str, K: np.ndarray, time: float) -> np.ndarray:
        angle, direction = np.deg2rad([self.settings.angle_deg, self.settings.direction_deg])
        return angle * np.array([np.cos(direction), np.sin(direction)])


@dataclass(frozen=True)
class CameraShakeFault(TurnedCameraFault):
    """`CameraShake`: the camera is turned by random angles, different for each camera.

    Random angles belong to instants that are one correlation time apart. Between two of them, the angle is their mean
    with the weights cos and sin of an angle that grows from 0 to 90 degrees, which keeps the standard deviation
    constant.
    """

    def turn(self, camera: str, K: np.ndarray, time: float) -> np.ndarray:
        span = max(VISION_PERIOD, self.settings.correlation_time)
        place = max(0.0, (time - self.begin + TIME_TOLERANCE) / span)
        number = math.floor(place)
        before, after = (self.random(len(camera), number + k).standard_normal(2) for k in (0, 1))
        blend = 0.5 * math.pi * (place - number)
        return self.settings.std * (math.cos(blend) * before + math.sin(blend) * after) / K[[0, 1], [0, 1]]


@dataclass(frozen=True)
class CameraPanFault(TurnedCameraFault):
    """`CameraPan`: the camera turns at a constant rate, and stays where it looks when the fault ends."""

    def active(self, time: float) -> bool:
        return self.begin - TIME_TOLERANCE <= time

    def turn(self, camera: str, K: np.ndarray, time: float) -> np.ndarray:
        distance = self.settings.rate * (min(time, self.end) - self.begin) / VISION_PERIOD
        direction = np.deg2rad(self.settings.direction_deg)
        return distance * np.array([np.cos(direction), np.sin(direction)]) / K[[0, 1], [0, 1]]


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
