"""A calibrated camera: from points in the world to pixels, and from pixels to rays."""

import dataclasses
import math
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike
from pydrake.math import RigidTransform

from drake_tracker.cameras.lens_models import COEFFICIENTS, PINHOLE, Coordinate, LensModel, make_lens


@dataclasses.dataclass(frozen=True, eq=False)
class CameraModel:
    """A calibrated camera at a known pose.

    Pixel coordinates follow OpenCV: the centre of the top left pixel is (0, 0), u runs to the right, v down. The camera
    frame C has x to the right, y down and z along the optical axis.

    Attributes:
        K: (3, 3) intrinsic matrix [px].
        distortion: coefficients in OpenCV's order: k1, k2, p1, p2, k3 or k1, k2, p1, p2, k3, ..., k6 of a pinhole;
            k1, ..., k4 of a fisheye.
        X_CW: (4, 4) homogeneous matrix that takes p_WQ to p_CQ [m].
        width: of the full image [px].
        height: of the full image [px].
        lens: "pinhole" or "fisheye", see `lens_models`.

    The arrays are copied and made read-only. Raises ValueError on an array of another shape, or another lens.
    """

    K: np.ndarray
    distortion: np.ndarray
    X_CW: np.ndarray
    width: int
    height: int
    lens: str = PINHOLE

    def __post_init__(self) -> None:
        if self.lens not in COEFFICIENTS:
            raise ValueError(f"CameraModel.lens is {self.lens!r}; it must be one of {', '.join(COEFFICIENTS)}")
        shapes = [(count,) for count in COEFFICIENTS[self.lens]]
        for name, allowed in (("K", [(3, 3)]), ("distortion", shapes), ("X_CW", [(4, 4)])):
            array = np.array(getattr(self, name), dtype=float)
            if array.shape not in allowed:
                wanted = " or ".join(map(str, allowed))
                raise ValueError(f"CameraModel.{name} has shape {array.shape}; it must be {wanted}")
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
        uv = np.asarray(uv, dtype=float).reshape(-1, 2)
        X_WC = self.X_WC
        if len(uv) == 0:
            return X_WC[:3, 3], np.empty((0, 3))
        directions_C = np.column_stack([self._model.normalised(uv), np.ones(len(uv))])
        directions_C /= np.linalg.norm(directions_C, axis=1, keepdims=True)
        return X_WC[:3, 3], directions_C @ X_WC[:3, :3].T

    def ray(self, u: float, v: float) -> tuple[np.ndarray, np.ndarray]:
        """Returns the ray of a single pixel, faster than `rays`: (origin (3,) [m], direction (3,))."""
        x, y = self._model.normalised_one(u, v)
        length = math.sqrt(x * x + y * y + 1.0)
        return self.X_WC[:3, 3], (np.array([[x / length, y / length, 1.0 / length]]) @ self.X_WC[:3, :3].T)[0]

    def pixels(self, x: Coordinate, y: Coordinate) -> tuple[Coordinate, Coordinate]:
        """Returns the pixels (u, v) of normalised image coordinates, which are x / z and y / z in the camera frame."""
        return self._model.pixels(x, y)

    def in_frame(self, X_WF: ArrayLike) -> Self:
        """Returns the same camera with another frame F as its world.

        Args:
            X_WF: pose of F, shape (4, 4) [m].
        """
        return dataclasses.replace(self, X_CW=self.X_CW @ np.asarray(X_WF))

    @property
    def focal_lengths(self) -> tuple[float, float]:
        """Focal lengths along u and v [px]."""
        return float(self.K[0, 0]), float(self.K[1, 1])

    @property
    def is_wide(self) -> bool:
        """Whether the lens is a fisheye or has rational distortion."""
        return len(self.distortion) != 5

    @cached_property
    def _model(self) -> LensModel:
        """The lens."""
        return make_lens(self.lens, self.K, self.distortion)

    def _distort(self, p_CQ: np.ndarray) -> np.ndarray:
        """Returns the pixels (n, 2) of the points ``p_CQ`` (n, 3) [m] in front of the camera."""
        if len(p_CQ) == 1:
            x, y, z = p_CQ[0].tolist()
            inverse = 1.0 / z
            return np.array([self.pixels(x * inverse, y * inverse)])
        return np.column_stack(self.pixels(*(p_CQ[:, :2] * (1.0 / p_CQ[:, 2:])).T))


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
