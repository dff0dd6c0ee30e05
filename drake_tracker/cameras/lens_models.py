"""Models of a lens: from normalised image coordinates to pixels, and back.

Normalised image coordinates are x / z and y / z in the camera frame. All three models are OpenCV's, and have other
names elsewhere: `BrownLens` is ROS's ``plumb_bob`` and, without k3, Kalibr's ``radtan``; `RationalLens` is ROS's
``rational_polynomial``; `FisheyeLens` is ROS's and Kalibr's ``equidistant``. Sources: OpenCV, "Camera Calibration and
3D Reconstruction" and "Fisheye camera model"; Kannala and Brandt 2006, equation (6).
"""

import math
from typing import Protocol, TypeVar

import cv2
import numpy as np

Coordinate = TypeVar("Coordinate", float, np.ndarray)
PINHOLE, FISHEYE = "pinhole", "fisheye"
COEFFICIENTS = {PINHOLE: (5, 8), FISHEYE: (4,)}
"""Numbers of coefficients of distortion that each kind of lens may have."""
_ROUNDS = 30
_TOLERANCE_PX = 1e-6
_NEWTON_ROUNDS = 12
_WIDEST = math.radians(89.5)
"""Largest angle between a ray and the optical axis [rad]; beyond it x / z and y / z do not describe a ray."""
_TABLE = np.linspace(0.0, _WIDEST, 2000)
"""Angles at which the radial distortion is tabulated, to start its inversion [rad]."""


class LensModel(Protocol):
    """The role of a lens in a `CameraModel`."""

    def pixels(self, x: Coordinate, y: Coordinate) -> tuple[Coordinate, Coordinate]:
        """Returns the pixels (u, v) of normalised image coordinates."""
        ...

    def normalised(self, uv: np.ndarray) -> np.ndarray:
        """Returns the normalised image coordinates (n, 2) of the pixels ``uv`` (n, 2)."""
        ...

    def normalised_one(self, u: float, v: float) -> tuple[float, float]:
        """Returns the same as `normalised` of a single pixel."""
        ...


def make_lens(kind: str, K: np.ndarray, distortion: np.ndarray) -> LensModel:
    """Returns the `LensModel` of a camera.

    Args:
        kind: PINHOLE or FISHEYE.
        K: (3, 3) intrinsic matrix [px], without skew.
        distortion: as many coefficients as `COEFFICIENTS` allows, in OpenCV's order.
    """
    if kind == FISHEYE:
        return FisheyeLens(K, distortion)
    return BrownLens(K, distortion) if len(distortion) == 5 else RationalLens(K, distortion)


class BrownLens:
    """A pinhole with polynomial distortion: k1, k2, p1, p2, k3.

    Args:
        K: (3, 3) intrinsic matrix [px], without skew.
        distortion: (5,) coefficients.
    """

    def __init__(self, K: np.ndarray, distortion: np.ndarray) -> None:
        self._K, self._distortion = K, distortion
        self._focal = _focal(K)
        self._coefficients = distortion.tolist()
        self._is_ideal = not distortion.any()

    def pixels(self, x: Coordinate, y: Coordinate) -> tuple[Coordinate, Coordinate]:
        """Returns the pixels (u, v) of normalised image coordinates.

        The arithmetic is that of ``cv2.projectPoints``, to the last bit, which also computes derivatives.
        """
        (fx, fy, cx, cy), (k1, k2, p1, p2, k3) = self._focal, self._coefficients
        if not self._is_ideal:
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

    def normalised(self, uv: np.ndarray) -> np.ndarray:
        """Returns the normalised image coordinates (n, 2) of the pixels ``uv`` (n, 2)."""
        if self._is_ideal:
            return (uv - self._K[:2, 2]) * (1.0 / self._K.diagonal()[:2])
        xy = cv2.undistortPoints(uv[:, np.newaxis], self._K, self._distortion)[:, 0]
        # OpenCV stops after five iterations, which leaves up to .02 px with a strong lens: iterate until it is exact.
        for _ in range(_ROUNDS):
            miss = np.column_stack(self.pixels(*xy.T)) - uv
            if np.abs(miss).max() < _TOLERANCE_PX:
                break
            xy = xy - miss / (self._K[0, 0], self._K[1, 1])
        return xy

    def normalised_one(self, u: float, v: float) -> tuple[float, float]:
        """Returns the same as `normalised` of a single pixel, in less time."""
        fx, fy, cx, cy = self._focal
        if self._is_ideal:
            return (u - cx) * (1.0 / fx), (v - cy) * (1.0 / fy)
        x, y = cv2.undistortPoints(np.array([[[u, v]]]), self._K, self._distortion)[0, 0].tolist()
        for _ in range(_ROUNDS):
            found_u, found_v = self.pixels(x, y)
            miss_u, miss_v = found_u - u, found_v - v
            if abs(miss_u) < _TOLERANCE_PX and abs(miss_v) < _TOLERANCE_PX:
                break
            x, y = x - miss_u / fx, y - miss_v / fy
        return x, y


class RationalLens:
    """A pinhole with rational distortion, for wide lenses: k1, k2, p1, p2, k3, k4, k5, k6.

    A pixel that no ray reaches has the ray of the widest one.

    Args:
        K: (3, 3) intrinsic matrix [px], without skew.
        distortion: (8,) coefficients.
    """

    def __init__(self, K: np.ndarray, distortion: np.ndarray) -> None:
        self._focal = _focal(K)
        k1, k2, self._p1, self._p2, k3, k4, k5, k6 = distortion.tolist()
        self._above, self._below = (k1, k2, k3), (k4, k5, k6)
        radius = np.tan(_TABLE)
        self._table = _rising(radius, radius * self._radial(radius**2)[0])

    def pixels(self, x: Coordinate, y: Coordinate) -> tuple[Coordinate, Coordinate]:
        """Returns the pixels (u, v) of normalised image coordinates."""
        fx, fy, cx, cy = self._focal
        x, y = self._distort(x, y, self._radial(x * x + y * y)[0])
        return x * fx + cx, y * fy + cy

    def normalised(self, uv: np.ndarray) -> np.ndarray:
        """Returns the normalised image coordinates (n, 2) of the pixels ``uv`` (n, 2), by Newton's method."""
        fx, fy, cx, cy = self._focal
        goal = (uv - (cx, cy)) / (fx, fy)
        reached = np.hypot(*goal.T)
        start = np.interp(reached, *self._table[::-1])
        x, y = (goal * (start / np.maximum(reached, 1e-12))[:, np.newaxis]).T
        p1, p2, widest = self._p1, self._p2, self._table[0][-1]
        for _ in range(_NEWTON_ROUNDS):
            radial, slope = self._radial(x * x + y * y)
            miss_x, miss_y = np.array(self._distort(x, y, radial)) - goal.T
            # The derivatives of the distorted coordinates by x and y.
            a = radial + 2.0 * x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x
            b = 2.0 * x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y
            d = radial + 2.0 * y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x
            determinant = a * d - b * b
            determinant = np.where(np.abs(determinant) < 1e-9, 1e-9, determinant)
            x, y = x - (d * miss_x - b * miss_y) / determinant, y - (a * miss_y - b * miss_x) / determinant
            shrink = np.minimum(1.0, widest / np.maximum(np.hypot(x, y), 1e-12))
            x, y = x * shrink, y * shrink
        return np.column_stack([x, y])

    def normalised_one(self, u: float, v: float) -> tuple[float, float]:
        """Returns the same as `normalised` of a single pixel."""
        x, y = self.normalised(np.array([[u, v]]))[0].tolist()
        return x, y

    def _radial(self, r2: Coordinate) -> tuple[Coordinate, Coordinate]:
        """Returns the factor of the radius and its derivative by the squared radius."""
        (k1, k2, k3), (k4, k5, k6) = self._above, self._below
        above = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
        below = 1.0 + r2 * (k4 + r2 * (k5 + r2 * k6))
        radial = above / below
        return radial, (k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3) - radial * (k4 + r2 * (2.0 * k5 + r2 * 3.0 * k6))) / below

    def _distort(self, x: Coordinate, y: Coordinate, radial: Coordinate) -> tuple[Coordinate, Coordinate]:
        r2, cross = x * x + y * y, 2.0 * x * y
        return (
            x * radial + self._p1 * cross + self._p2 * (r2 + 2.0 * x * x),
            y * radial + self._p1 * (r2 + 2.0 * y * y) + self._p2 * cross,
        )


class FisheyeLens:
    """A fisheye, in which the radius is a polynomial of the angle to the optical axis: k1, k2, k3, k4.

    As in OpenCV and Kalibr, only directions less than 90 deg from the axis have an image. A pixel that no ray reaches
    has the ray of the widest one.

    Args:
        K: (3, 3) intrinsic matrix [px], without skew.
        distortion: (4,) coefficients.
    """

    def __init__(self, K: np.ndarray, distortion: np.ndarray) -> None:
        self._focal = _focal(K)
        self._coefficients = distortion.tolist()
        self._table = _rising(_TABLE, self._radius(_TABLE))

    def pixels(self, x: Coordinate, y: Coordinate) -> tuple[Coordinate, Coordinate]:
        """Returns the pixels (u, v) of normalised image coordinates."""
        fx, fy, cx, cy = self._focal
        radius = np.maximum(np.hypot(x, y), 1e-12)
        scale = self._radius(np.arctan(radius)) / radius
        return x * scale * fx + cx, y * scale * fy + cy

    def normalised(self, uv: np.ndarray) -> np.ndarray:
        """Returns the normalised image coordinates (n, 2) of the pixels ``uv`` (n, 2), by Newton's method."""
        fx, fy, cx, cy = self._focal
        goal = (uv - (cx, cy)) / (fx, fy)
        reached = np.hypot(*goal.T)
        angle = np.interp(reached, *self._table[::-1])
        k1, k2, k3, k4 = self._coefficients
        for _ in range(_NEWTON_ROUNDS):
            a2 = angle * angle
            slope = 1.0 + a2 * (3.0 * k1 + a2 * (5.0 * k2 + a2 * (7.0 * k3 + a2 * 9.0 * k4)))
            angle = angle - (self._radius(angle) - reached) / np.maximum(slope, 1e-3)
            angle = np.clip(angle, 0.0, self._table[0][-1])
        return goal * (np.tan(angle) / np.maximum(reached, 1e-12))[:, np.newaxis]

    def normalised_one(self, u: float, v: float) -> tuple[float, float]:
        """Returns the same as `normalised` of a single pixel."""
        x, y = self.normalised(np.array([[u, v]]))[0].tolist()
        return x, y

    def _radius(self, angle: Coordinate) -> Coordinate:
        k1, k2, k3, k4 = self._coefficients
        a2 = angle * angle
        return angle * (1.0 + a2 * (k1 + a2 * (k2 + a2 * (k3 + a2 * k4))))


def _focal(K: np.ndarray) -> tuple[float, float, float, float]:
    """Returns focal lengths and principal point [px]: fx, fy, cx, cy."""
    return float(K[0, 0]), float(K[1, 1]), float(K[0, 2]), float(K[1, 2])


def _rising(arguments: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns the beginning of a table up to which its values rise; beyond it a polynomial does not describe a lens."""
    falls = np.flatnonzero(~(np.diff(values) > 0.0))
    end = falls[0] + 1 if len(falls) else len(values)
    return arguments[:end], values[:end]
