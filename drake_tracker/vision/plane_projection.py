"""From one centroid to a point: the ray through a pixel meets the plane in which the ball's centre rolls.

Source: Nashman and Chaconas 1990, section 5. The equation (2) printed there repeats the line (1) and is no plane; what
is solved here is its sentence: z is half the diameter of the ball.
"""

from dataclasses import dataclass

import numpy as np

from drake_tracker.core.constants import GRAVITY
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.vision.camera_model import CameraModel
from drake_tracker.vision.window import window_around

LOWEST_SIGHT = 2.3
"""Cotangent of the lowest elevation from which the camera looks at the board."""
ROLL = 0.01
"""How far a ball is on average ahead of its reading [m] when the second of the two images is taken."""


def camera_on_board(K, X_CB, width, height, distortion=None):
    """Returns a `CameraModel` whose world is the board's frame B.

    Args:
        K: (3, 3) intrinsic matrix [px]. X_CB: (4, 4), takes p_BQ to p_CQ [m]. width, height: of the image [px].
        distortion: (5,) coefficients in OpenCV's order, none by default.
    """
    return CameraModel(K, np.zeros(5) if distortion is None else distortion, X_CB, width, height)


def project_to_plane(camera, uv, z):
    """Returns where the ray through a pixel meets the plane at height z above the board, p_BQ (3,) [m], or None.

    Equation (1) is the line through the camera's centre and the ball's place on the image plane; its parameter t
    follows from the known z. None when the line does not meet the plane in front of the camera.

    Args:
        camera: a `CameraModel` in the board's frame. uv: (2,) [px]. z: [m].
    """
    p_BC, directions = camera.rays([uv])
    direction = directions[0]
    if direction[2] == 0.0:
        return None
    t = (z - p_BC[2]) / direction[2]
    return p_BC + t * direction if t > 0.0 else None


def board_window(camera, width, length, ball_diameter, bottom=0.0):
    """Returns the `Window` in which a ball on the board can be seen, but nothing beyond the bottom edge.

    Args:
        camera: a `CameraModel` in the board's frame. width, length: of the board's face [m]. ball_diameter: [m].
        bottom: width of a strip along the bottom edge that is left out [m]: beyond that edge the hand moves.

    Raises DrakeTrackerError when nothing is left, or the camera does not see the board.
    """
    if not bottom + LOWEST_SIGHT * ball_diameter < length:
        raise DrakeTrackerError(f"a strip of {bottom:g} m along the bottom edge leaves nothing of {length:g} m")
    half = width / 2
    # The top of a ball hides what lies behind it, for a camera on the upper side what lies farther down.
    lowest_top = bottom + LOWEST_SIGHT * ball_diameter
    rims = ((bottom, 0.0), (lowest_top, ball_diameter), (length, 0.0), (length, ball_diameter))
    return window_around(camera, np.array([(x, y, z) for x in (-half, half) for y, z in rims]))


def seen_whole_from(camera, bottom, ball_radius):
    """Returns the lowest y_B [m] at which a rolling ball is in sight as a whole, above a strip that is left out.

    Below it the window's rim cuts the ball and shifts its centroid up the slope, by more than its radius in the end. A
    camera at the elevation e over the slope sees a ball hide the board down to r cot(e / 2) below where it touches it.

    Args:
        camera: a `CameraModel` in the board's frame. bottom: width of the strip left out [m]. ball_radius: r [m].
    """
    _, y, z = camera.X_WC[:3, 3]
    return bottom + ball_radius / np.tan(0.5 * np.arctan2(z, y - bottom)) + ROLL


@dataclass(frozen=True)
class LastReading:
    """Stamp [s] and place (x, y) [m] of the last reading that was believed, and how many were not since."""

    stamp: float = 0.0
    place: tuple = ()
    rejected: int = 0

    def __deepcopy__(self, memo):
        return self


@dataclass(frozen=True)
class EveryReading:
    """Believes every reading: in place of `PlausibleReadings` where nothing is known of what moves, or how."""

    def judge(self, last, stamp, p_BQ):
        """Returns (True, `LastReading`), as `PlausibleReadings.judge` does."""
        return True, LastReading(stamp, (float(p_BQ[0]), float(p_BQ[1])))


@dataclass(frozen=True)
class PlausibleReadings:
    """Tells readings of a ball that rolls down a board from spurious ones (section 5, last paragraph).

    A reading beyond the board's boundaries is not believed, nor one displaced from the last by more than a ball can
    roll in the time between: no ball that was at rest somewhere on the board is faster than one that slides down from
    its upper edge without friction. When ``restart_after`` readings in a row are out of reach, the last one that was
    believed may have been wrong, and the next is taken as a new start.

    Attributes:
        width, length: of the board's face [m].
        incline: of the board [rad].
        bottom: lowest y [m] at which a ball is seen whole.
        tolerance: error of a reading [m], allowed in addition.
        restart_after: readings.

    Raises DrakeTrackerError on a value outside its range.
    """

    width: float
    length: float
    incline: float
    bottom: float = 0.0
    tolerance: float = 0.02
    restart_after: int = 3

    def __post_init__(self):
        for name, least in (("width", 1e-3), ("length", 1e-3), ("incline", 0.0), ("tolerance", 0.0)):
            if not getattr(self, name) >= least:
                raise DrakeTrackerError(f"plane projection: {name} is {getattr(self, name)}; it must be >= {least:g}")
        if self.restart_after < 1:
            raise DrakeTrackerError(f"plane projection: restart_after is {self.restart_after}; it must be 1 or more")

    def limit(self, y, duration):
        """Returns the greatest displacement [m] within a time [s] of a ball that was or is at y [m] on the board."""
        speed = np.sqrt(2.0 * GRAVITY * np.sin(self.incline) * max(self.length - y, 0.0))
        return speed * duration + self.tolerance

    def judge(self, last, stamp, p_BQ):
        """Returns (believed, `LastReading` to pass next time) for a reading p_BQ (3,) [m] at a stamp [s]."""
        x, y = float(p_BQ[0]), float(p_BQ[1])
        if not (abs(x) <= self.width / 2 and self.bottom <= y <= self.length):
            return False, last
        if last.place and last.rejected < self.restart_after:
            moved = np.hypot(x - last.place[0], y - last.place[1])
            if moved > self.limit(min(y, last.place[1]), abs(stamp - last.stamp)):
                return False, LastReading(last.stamp, last.place, last.rejected + 1)
        return True, LastReading(stamp, (x, y))
