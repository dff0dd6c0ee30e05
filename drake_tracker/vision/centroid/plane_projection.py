"""From one centroid to a point: the ray through a pixel meets the plane in which the ball's centre rolls.

Source: Nashman and Chaconas 1990, section 5. The printed equation (2) repeats the line (1) and does not describe a
plane. This module solves the plane of the sentence before: z is half the diameter of the ball.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.core.constants import GRAVITY
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.frozen_state import FrozenState
from drake_tracker.vision.region_of_interest import RegionOfInterest, region_around

LOWEST_SIGHT = 2.3
"""Cotangent of the lowest elevation from which the camera looks at the board."""
ROLL = 0.01
"""How far a ball has on average rolled beyond its measured point [m] when the second of the two images is captured."""


def camera_on_board(
    K: ArrayLike, X_CB: ArrayLike, width: int, height: int, distortion: ArrayLike | None = None
) -> CameraModel:
    """Returns a `CameraModel` whose world is the board's frame B.

    Args:
        K: (3, 3) intrinsic matrix [px].
        X_CB: (4, 4), takes p_BQ to p_CQ [m].
        width: of the image [px].
        height: of the image [px].
        distortion: (5,) coefficients in OpenCV's order; None is a lens without distortion.
    """
    lens = np.zeros(5) if distortion is None else np.asarray(distortion)
    return CameraModel(np.asarray(K), lens, np.asarray(X_CB), width, height)


def project_to_plane(camera: CameraModel, uv: Sequence[float] | np.ndarray, z: float) -> np.ndarray | None:
    """Returns where the ray through a pixel meets the plane at height z above the board, p_BQ (3,) [m].

    Equation (1) is the line through the camera's centre and the ball's position in the image plane; its parameter t
    follows from the known z. Returns None when the line does not meet the plane in front of the camera.

    Args:
        camera: in the board's frame.
        uv: pixel, shape (2,) [px].
        z: height above the board [m].
    """
    p_BC, directions = camera.rays(np.array([uv], dtype=float))
    direction = directions[0]
    if direction[2] == 0.0:
        return None
    t = (z - p_BC[2]) / direction[2]
    return p_BC + t * direction if t > 0.0 else None


def board_window(
    camera: CameraModel, width: float, length: float, ball_diameter: float, bottom: float = 0.0
) -> RegionOfInterest:
    """Returns the `RegionOfInterest` in which a ball on the board can be seen, but nothing beyond the bottom edge.

    Args:
        camera: in the board's frame.
        width: of the board's face [m].
        length: of the board's face [m].
        ball_diameter: [m].
        bottom: width of a strip along the bottom edge that is left out [m]: the hand moves beyond that edge.

    Raises DrakeTrackerError when nothing is left, or the camera does not see the board.
    """
    if not bottom + LOWEST_SIGHT * ball_diameter < length:
        raise DrakeTrackerError(f"a strip of {bottom:g} m along the bottom edge leaves nothing of {length:g} m")
    half = width / 2
    # The top of a ball hides what lies behind it; for a camera on the upper side that is farther down the board.
    lowest_top = bottom + LOWEST_SIGHT * ball_diameter
    rims = ((bottom, 0.0), (lowest_top, ball_diameter), (length, 0.0), (length, ball_diameter))
    return region_around(camera, np.array([(x, y, z) for x in (-half, half) for y, z in rims]))


def seen_whole_from(camera: CameraModel, bottom: float, ball_radius: float) -> float:
    """Returns the lowest y_B [m] at which the camera sees all of a rolling ball, above a strip that is left out.

    Below that, the window's rim cuts the ball and shifts its centroid up the slope, in the end by more than its radius.
    A camera at elevation e over the slope sees a ball hide the board down to r cot(e / 2) below its contact point.

    Args:
        camera: in the board's frame.
        bottom: width of the strip left out [m].
        ball_radius: r [m].
    """
    _, y, z = camera.X_WC[:3, 3]
    return bottom + ball_radius / np.tan(0.5 * np.arctan2(z, y - bottom)) + ROLL


@dataclass(frozen=True)
class LastPoint(FrozenState):
    """The last accepted point.

    Attributes:
        stamp: of that point [s].
        place: its (x, y)_B [m]; empty before the first one.
        rejected: number of points rejected since.
    """

    stamp: float = 0.0
    place: tuple[float, ...] = ()
    rejected: int = 0


class PointFilter(Protocol):
    """Decides which measured points `PlaneProjectorSystem` accepts; it has no state of its own."""

    def judge(self, last: LastPoint, stamp: float, p_BQ: np.ndarray) -> tuple[bool, LastPoint]:
        """Returns (whether the point is accepted, the `LastPoint` to pass next time).

        Args:
            last: what the call before returned, at first ``LastPoint()``.
            stamp: of the point [s].
            p_BQ: the point in the plane's frame, shape (3,) [m].
        """
        ...


@dataclass(frozen=True)
class EveryPoint:
    """The `PointFilter` that accepts every point: for objects whose motion is not known beforehand."""

    def judge(self, last: LastPoint, stamp: float, p_BQ: np.ndarray) -> tuple[bool, LastPoint]:
        """Returns (True, `LastPoint` of this point), as `PointFilter.judge` does."""
        return True, LastPoint(stamp, (float(p_BQ[0]), float(p_BQ[1])))


@dataclass(frozen=True)
class PlausiblePoints:
    """The `PointFilter` of a ball that rolls down a board: rejects outliers (section 5, last paragraph).

    A point beyond the board's boundaries is rejected, and so is a point farther from the last point than a ball can
    roll in the time between. The limit is the speed of a ball that slides from the upper edge without friction. When
    ``restart_after`` points in a row are out of reach, the last accepted point may have been wrong, and the next one is
    accepted as a new start.

    Attributes:
        width: of the board's face [m].
        length: of the board's face [m].
        incline: of the board [rad].
        bottom: lowest y [m] at which a ball is seen whole.
        tolerance: measurement error [m] allowed in addition.
        restart_after: number of rejected points in a row.

    Raises DrakeTrackerError on a value outside its range.
    """

    width: float
    length: float
    incline: float
    bottom: float = 0.0
    tolerance: float = 0.02
    restart_after: int = 3

    def __post_init__(self) -> None:
        for name, least in (("width", 1e-3), ("length", 1e-3), ("incline", 0.0), ("tolerance", 0.0)):
            if not getattr(self, name) >= least:
                raise DrakeTrackerError(f"plane projection: {name} is {getattr(self, name)}; it must be >= {least:g}")
        if self.restart_after < 1:
            raise DrakeTrackerError(f"plane projection: restart_after is {self.restart_after}; it must be 1 or more")

    def limit(self, y: float, duration: float) -> float:
        """Returns the largest displacement [m] of a ball within a time.

        Args:
            y: place of the ball on the board, before or after [m].
            duration: the time [s].
        """
        speed = np.sqrt(2.0 * GRAVITY * np.sin(self.incline) * max(self.length - y, 0.0))
        return speed * duration + self.tolerance

    def judge(self, last: LastPoint, stamp: float, p_BQ: np.ndarray) -> tuple[bool, LastPoint]:
        """Returns (whether the point is accepted, the `LastPoint` to pass next time), as `PointFilter.judge` does."""
        x, y = float(p_BQ[0]), float(p_BQ[1])
        if not (abs(x) <= self.width / 2 and self.bottom <= y <= self.length):
            return False, last
        if last.place and last.rejected < self.restart_after:
            moved = np.hypot(x - last.place[0], y - last.place[1])
            if moved > self.limit(min(y, last.place[1]), abs(stamp - last.stamp)):
                return False, LastPoint(last.stamp, last.place, last.rejected + 1)
        return True, LastPoint(stamp, (x, y))
