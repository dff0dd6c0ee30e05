"""A calibrated camera: from points in the world to pixels, and from pixels to rays."""

import dataclasses
import math
from functools import cached_property
from typing import Any, Self, TypeVar

import cv2
import numpy as np
from numpy.typing import ArrayLike
from pydrake.math import RigidTransform

Coordinate = TypeVar("Coordinate", float, np.ndarray)
_UNDISTORT_ROUNDS = 30
_UNDISTORT_TOLERANCE_PX = 1e-6


@dataclasses.dataclass(frozen=True, eq=False)
class CameraModel:
    """A pinhole camera with lens distortion, at a known pose.

    Pixel coordinates follow OpenCV: the centre of the top left pixel is (0, 0), u runs to the right, v down. The camera
    frame C has x to the right, y down and z along the optical axis.

    Attributes:
        K: (3, 3) intrinsic matrix [px].
        distortion: (5,) coefficients k1, k2, p1, p2, k3 in OpenCV's order.
        X_CW: (4, 4) homogeneous matrix that takes p_WQ to p_CQ [m].
        width: of the full image [px].
        height: of the full image [px].

    The arrays are copied and made read-only. Raises ValueError on an array of another shape.
    """

    K: np.ndarray
    distortion: np.ndarray
    X_CW: np.ndarray
    width: int
    height: int

    def __post_init__(self) -> None:
        for name, shape in (("K", (3, 3)), ("distortion", (5,)), ("X_CW", (4, 4))):
            array = np.array(getattr(self, name), dtype=float)
            if array.shape != shape:
                raise ValueError(f"CameraModel.{name} has shape {array.shape}; it must be {shape}")
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    @classmethod
    def from_camera_info(cls, info: Any, X_WC: RigidTransform) -> Self:
        """Returns the model of the camera that a Drake `RgbdSensor` renders with.

        Args:
            info: the sensor's `CameraInfo`, of the camera that renders the colour image.
            X_WC: pose of the camera frame: the ``X_PB`` of a sensor that is fixed to the world.
        """
        return cls(opencv_intrinsics(info), np.zeros(5), X_WC.inverse().GetAsMatrix4(), info.width(), info.height())

    @cached_property
    def X_WC(self) -> np.ndarray:
        """(4, 4) homogeneous matrix that takes p_CQ to p_WQ [m], read-only."""
        R_WC = self.X_CW[:3, :3].T
        X_WC = np.eye(4)
        X_WC[:3, :3] = R_WC
        X_WC[:3, 3] = -R_WC @ self.X_CW[:3, 3]
        X_WC.setflags(write=False)
        return X_WC

    def project(self, p_WQ: ArrayLike) -> np.ndarray:
        """Returns the pixels (n, 2) at which the points ``p_WQ`` (n, 3) [m] appear.

        A point that is not in front of the camera has no image: its row is NaN.
        """
        p_WQ = np.asarray(p_WQ, dtype=float).reshape(-1, 3)
        p_CQ = p_WQ @ self.X_CW[:3, :3].T + self.X_CW[:3, 3]
        seen = p_CQ[:, 2] > 0.0
        if seen.all():
            return self._distort(p_CQ)
        uv = np.full((len(p_CQ), 2), np.nan)
        if seen.any():
            uv[seen] = self._distort(p_CQ[seen])
        return uv

    def sees(self, p_WQ: ArrayLike) -> np.ndarray:
        """Returns which of the points ``p_WQ`` (n, 3) [m] appear within the image, as booleans (n,)."""
        u, v = self.project(p_WQ).T
        return (u >= -0.5) & (u < self.width - 0.5) & (v >= -0.5) & (v < self.height - 0.5)

    def rays(self, uv: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """Returns the rays through the pixels ``uv`` (n, 2), in W.

        Returns (origin, directions): p_WC (3,) [m], the camera's centre, and unit vectors (n, 3) towards the scene.
        """
        uv = np.asarray(uv, dtype=float).reshape(-1, 1, 2)
        X_WC = self.X_WC
        if len(uv) == 0:
            return X_WC[:3, 3], np.empty((0, 3))
        directions_C = np.column_stack([self._undistort(uv), np.ones(len(uv))])
        directions_C /= np.linalg.norm(directions_C, axis=1, keepdims=True)
        return X_WC[:3, 3], directions_C @ X_WC[:3, :3].T

    def ray(self, u: float, v: float) -> tuple[np.ndarray, np.ndarray]:
        """Returns the same as `rays` of a single pixel, in less time: (origin (3,) [m], direction (3,))."""
        if self._is_pinhole:
            fx, fy, cx, cy = self._lens[:4]
            x, y = (u - cx) * (1.0 / fx), (v - cy) * (1.0 / fy)
        else:
            x, y = self._undistort_one(u, v)
        length = math.sqrt(x * x + y * y + 1.0)
        return self.X_WC[:3, 3], (np.array([[x / length, y / length, 1.0 / length]]) @ self.X_WC[:3, :3].T)[0]

    def pixels(self, x: Coordinate, y: Coordinate) -> tuple[Coordinate, Coordinate]:
        """Returns the pixels (u, v) of normalised image coordinates, which are x / z and y / z in the camera frame.

        The arithmetic is that of ``cv2.projectPoints``, to the last bit, which also computes derivatives.
        """
        fx, fy, cx, cy, k1, k2, p1, p2, k3 = self._lens
        if not self._is_pinhole:
            r2 = x * x + y * y
            radial = 1.0 + k1 * r2
            if k2 or k3:
                r4 = r2 * r2
                radial = radial + k2 * r4 + k3 * (r4 * r2)
            if p1 or p2:
                cross = 2.0 * x * y
                x, y = (
                    x * radial + p1 * cross + p2 * (r2 + 2.0 * x * x),
                    y * radial + p1 * (r2 + 2.0 * y * y) + p2 * cross,
                )
            else:
                x, y = x * radial, y * radial
        return x * fx + cx, y * fy + cy

    @property
    def focal_lengths(self) -> tuple[float, float]:
        """Focal lengths along u and v [px]."""
        return self._lens[0], self._lens[1]

    @cached_property
    def _lens(self) -> tuple[float, ...]:
        """Focal lengths and principal point [px], and coefficients of the distortion: fx, fy, cx, cy, k1, ..., k3."""
        K = self.K
        return (*(float(value) for value in (K[0, 0], K[1, 1], K[0, 2], K[1, 2])), *self.distortion.tolist())

    @cached_property
    def _is_pinhole(self) -> bool:
        """Whether the lens has no distortion."""
        return not self.distortion.any()

    def _distort(self, p_CQ: np.ndarray) -> np.ndarray:
        """Returns the pixels (n, 2) of the points ``p_CQ`` (n, 3) [m] in front of the camera."""
        if len(p_CQ) == 1:
            x, y, z = p_CQ[0].tolist()
            inverse = 1.0 / z
            return np.array([self.pixels(x * inverse, y * inverse)])
        return np.column_stack(self.pixels(*(p_CQ[:, :2] * (1.0 / p_CQ[:, 2:])).T))

    def _undistort(self, uv: np.ndarray) -> np.ndarray:
        """Returns the normalised image coordinates (n, 2) of the pixels ``uv`` (n, 1, 2), without distortion."""
        if self._is_pinhole:
            return (uv[:, 0] - self.K[:2, 2]) * (1.0 / self.K.diagonal()[:2])
        xy = cv2.undistortPoints(uv, self.K, self.distortion)[:, 0]
        # OpenCV stops after five iterations, which leaves up to .02 px with a strong lens: iterate until it is exact.
        for _ in range(_UNDISTORT_ROUNDS):
            miss = self._distort(np.column_stack([xy, np.ones(len(xy))])) - uv[:, 0]
            if np.abs(miss).max() < _UNDISTORT_TOLERANCE_PX:
                break
            xy = xy - miss / (self.K[0, 0], self.K[1, 1])
        return xy

    def _undistort_one(self, u: float, v: float) -> tuple[float, float]:
        """Returns the same as `_undistort` of a single pixel."""
        x, y = cv2.undistortPoints(np.array([[[u, v]]]), self.K, self.distortion)[0, 0].tolist()
        fx, fy = self._lens[:2]
        for _ in range(_UNDISTORT_ROUNDS):
            found_u, found_v = self.pixels(x, y)
            miss_u, miss_v = found_u - u, found_v - v
            if abs(miss_u) < _UNDISTORT_TOLERANCE_PX and abs(miss_v) < _UNDISTORT_TOLERANCE_PX:
                break
            x, y = x - miss_u / fx, y - miss_v / fy
        return x, y


def opencv_intrinsics(info: Any) -> np.ndarray:
    """Returns the intrinsic matrix (3, 3) [px] in OpenCV's pixel coordinates of a Drake `CameraInfo`.

    The two conventions are half a pixel apart. To Drake's renderer pixel (0, 0) spans 0 to 1, so that the centre of an
    image is (w/2, h/2); in OpenCV a pixel's centre has whole numbers, and the same point is ((w-1)/2, (h-1)/2).

    Args:
        info: a `CameraInfo`, with its principal point as the renderer uses it.
    """
    K = np.array(info.intrinsic_matrix())
    K[:2, 2] -= 0.5
    return K
