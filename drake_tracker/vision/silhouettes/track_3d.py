"""The track of one object: where it was seen, how it moves, and whether it can be seen now."""

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from drake_tracker.core.frozen_state import FrozenState, read_only
from drake_tracker.core.messages import TrackState
from drake_tracker.vision.silhouettes.object_shape import HEADING_SPEED, ObjectShape

ACCELERATION_NOISE = 0.6
"""Process noise of the velocity [m/s/sqrt(s)]: a train on the tightest bend changes it by .2 m/s^2."""
TURN_TIME, FASTEST_TURN = 0.5, 3.0
"""Time over which the turn rate is averaged [s], and its largest value [rad/s]: .15 m/s on a radius of .05 m."""
CORRELATED = 10.0
"""How many times as uncertain a measurement counts whose silhouette is merged: its error stays for many images."""
TRUE_STD, TRUE_SHARED_STD = 0.65, 0.5
"""Standard deviation of the measured error, as a share of the standard deviation in the tracker, for separate and
merged objects. The tracker uses larger standard deviations, so as not to lose an object whose error is unusually
large."""
HEIGHT_BIAS = 0.045
"""Systematic error of the height as a share of the object's height: cameras above it see more of its top."""
START_SPEED = 0.3
"""Standard deviation of the velocity of a new track [m/s], per axis."""
STANDING_SPEED = 0.012
"""Speed below which an object without moving edges stands [m/s]."""
HEIGHT_KNOWN = 5
"""Measurements with both images from which the height of an object is known."""
GUESS_TIME = 2.0
"""Time [s] after which even an object whose size or height is a guess gives points: the background is known then."""
CLIMBS = 0.015
"""Range of heights from which on an object is on a hill, beyond what the error of vision varies on a level path [m];
chosen."""
HEIGHT_STD = 0.004
"""Standard deviation of the height of an object that moves on a level surface [m]."""
CLIMB_NOISE, GUESS_NOISE = 0.1, 0.01
"""Process noise of the vertical velocity on a hill, and while the height is only guessed [m/s/sqrt(s)]; chosen."""
GUESSED = (-np.inf, np.inf)
"""Range of the heights of an object that was merged with another one, until both images have shown it alone [m]."""
COLOUR_WEIGHT = 0.1
"""Weight of the newest region in the remembered colour of an object."""


class Measurement(NamedTuple):
    """A triangulated point.

    Attributes:
        p_WQ: its position, shape (3,) [m].
        covariance: of the position, its systematic part included, shape (3, 3) [m^2].
        gap: distance between the two rays [m].
        share: visible share of the object, of the image in which it is smaller.
        assumed: information in the covariance about the height that is only the track's own prediction [1/m^2].
    """

    p_WQ: np.ndarray
    covariance: np.ndarray
    gap: float
    share: float
    assumed: float = 0.0

    def reported(self, shared: bool, height: float) -> "Measurement":
        """Returns the measurement with the covariance of its total error, as it is reported.

        Args:
            shared: whether a silhouette it comes from is merged with that of another object.
            height: of the object [m].
        """
        covariance = (TRUE_SHARED_STD if shared else TRUE_STD) ** 2 * self.covariance
        covariance[2, 2] += (HEIGHT_BIAS * height) ** 2
        return self._replace(covariance=covariance)

    def independent_covariance(self) -> np.ndarray:
        """Returns the covariance of the position without the information of the track itself, shape (3, 3) [m^2]."""
        if self.assumed == 0.0:
            return self.covariance
        information = np.linalg.inv(self.covariance)
        information[2, 2] -= 0.99 * self.assumed  # the rest keeps the covariance of a single ray finite
        return np.linalg.inv(information)


@dataclass(frozen=True, eq=False)
class Track3D(FrozenState):
    """A track: a Kalman filter of constant speed and turn rate, and the appearance of its object.

    The filter serves to find the object in the next image. Paths are predicted by the estimators.

    Attributes:
        number: identity, from 1 on; never used twice. 0 while the track is not yet confirmed.
        stamp: of the state [s].
        mean: position and velocity in W, shape (6,) [m, m/s].
        covariance: shape (6, 6).
        state: a `TrackState`.
        seen: stamp of the newest measurement [s].
        hits: number of measurements.
        misses: images without a measurement since the newest.
        shape: its size.
        height: z_W of its centroid as seen by both cameras, without other objects in the way [m].
        heights: lowest and highest value of ``height`` since it is known, or `GUESSED` [m].
        colour: red, green, blue [grey levels].
        stereo: number of measurements in which both images showed it alone; they determine its height and colour.
        merged: newest stamp at which another object shared its silhouette, or it was seen in one image only [s].
        alone: newest stamp at which an image showed it without another object in its silhouette [s].
        guessed_until: stamp until which it gives no points, because its size or height is only guessed, unless it is
            seen alone before [s].
        turn_rate: of the velocity about W's z axis [rad/s].
        measurement: the measurement of this stamp, or None.
        places: number of its region in the left and in the right image of this stamp, -1 without one.
    """

    number: int
    stamp: float
    mean: np.ndarray
    covariance: np.ndarray
    state: TrackState
    seen: float
    hits: int
    misses: int
    shape: ObjectShape
    height: float
    colour: tuple[float, float, float]
    heights: tuple[float, float] = (np.inf, -np.inf)
    stereo: int = 0
    merged: float = -np.inf
    alone: float = np.inf
    guessed_until: float = -np.inf
    turn_rate: float = 0.0
    measurement: Measurement | None = None
    places: tuple[int, int] = (-1, -1)

    @property
    def position(self) -> np.ndarray:
        """Estimated position p_WQ, shape (3,) [m]."""
        return self.mean[:3]

    @property
    def height_known(self) -> bool:
        """Whether it has a height, measured or guessed, so that one image or divided silhouettes can locate it."""
        return self.stereo >= HEIGHT_KNOWN or self.heights == GUESSED

    @property
    def expected_height(self) -> float:
        """Height that locates it where images do not suffice: the predicted one if it is free [m]."""
        return float(self.mean[2]) if self.height_free else self.height

    @property
    def height_free(self) -> bool:
        """Whether the filter estimates its height, which varies by more than the error of vision, or is a guess."""
        return self.heights[1] - self.heights[0] > CLIMBS

    @property
    def expected_height_std(self) -> float:
        """Standard deviation of `expected_height` [m]."""
        return max(HEIGHT_STD, math.sqrt(float(self.covariance[2, 2]))) if self.height_free else HEIGHT_STD

    @property
    def speed(self) -> float:
        """Estimated speed [m/s]."""
        return float(np.linalg.norm(self.mean[3:]))

    def predicted(self, stamp: float) -> "Track3D":
        """Returns the track at a later stamp [s], without a measurement.

        An object that stands is expected where it stands.
        """
        step = stamp - self.stamp
        F = np.eye(6)
        if self.state != TrackState.STANDING:
            F[[0, 1, 2], [3, 4, 5]] = step
        noise = ACCELERATION_NOISE**2 * step
        mean = F @ self.mean
        c, s = math.cos(self.turn_rate * step), math.sin(self.turn_rate * step)
        mean[3:5] = c * mean[3] - s * mean[4], s * mean[3] + c * mean[4]
        covariance = F @ self.covariance @ F.T
        flat = covariance.reshape(-1)
        growths = noise * step**2 / 3.0, noise * step / 2.0, noise * step / 2.0, noise
        for first, growth in zip((0, 3, 18, 21), growths):  # the diagonals of the four blocks
            block = flat[first : first + 15 : 7]
            block += growth
            if self.height_free:
                climb_noise = GUESS_NOISE if self.heights == GUESSED else CLIMB_NOISE
                block[2] += ((climb_noise / ACCELERATION_NOISE) ** 2 - 1.0) * growth
        return replace(
            self,
            stamp=stamp,
            mean=read_only(mean),
            covariance=read_only(covariance),
            measurement=None,
            places=(-1, -1),
        )

    def placed(self, p_WQ: np.ndarray, std: float) -> "Track3D":
        """Returns the track with the position that its estimator predicts.

        Args:
            p_WQ: position, shape (3,) [m].
            std: its standard deviation [m].
        """
        mean, covariance = self.mean.copy(), self.covariance.copy()
        mean[:3] = p_WQ
        covariance[:3] = covariance[:, :3] = 0.0
        covariance[[0, 1, 2], [0, 1, 2]] = std**2
        return replace(self, mean=read_only(mean), covariance=read_only(covariance))

    def with_velocity(self, v_WQ: np.ndarray, std: float | np.ndarray) -> "Track3D":
        """Returns the track with a velocity, shape (3,), and its standard deviation per axis [m/s]."""
        mean, covariance = self.mean.copy(), self.covariance.copy()
        mean[3:] = v_WQ
        covariance[3:] = covariance[:, 3:] = 0.0
        covariance[[3, 4, 5], [3, 4, 5]] = std**2
        return replace(self, mean=read_only(mean), covariance=read_only(covariance))

    def without_point(self) -> "Track3D":
        """Returns the track of an object that was found, but cannot yet be told apart from another one.

        It was last seen just before its stamp, so that nobody takes its position for a measurement.
        """
        return replace(self, state=TrackState.MERGED, measurement=None, seen=math.nextafter(self.stamp, -math.inf))

    def as_object_of(self, other: "Track3D") -> "Track3D":
        """Returns the track with its place and motion, and with the identity and the look of another one's object."""
        return replace(
            self,
            number=other.number,
            shape=other.shape,
            height=other.height,
            heights=other.heights,
            colour=other.colour,
            hits=other.hits,
            stereo=other.stereo,
        )

    def distance_squared(self, measurement: Measurement) -> float:
        """Returns the squared Mahalanobis distance of a measurement from the prediction."""
        innovation = measurement.p_WQ - self.mean[:3]
        S = self.covariance[:3, :3] + measurement.covariance
        return float(innovation @ np.linalg.solve(S, innovation))

    def updated(self, measurement: Measurement, shared: bool = False, places: tuple[int, int] = (-1, -1)) -> "Track3D":
        """Returns the track after a measurement of its stamp.

        The turn rate is not learned from merged silhouettes: it carries the track through the time in which they are.

        Args:
            measurement: the measurement.
            shared: whether a silhouette it comes from is merged with that of another object.
            places: as in `Track3D`.
        """
        P, R = self.covariance, measurement.independent_covariance() * (CORRELATED if shared else 1.0)
        gain = np.linalg.solve(P[:3, :3] + R, P[:3]).T
        mean = self.mean + gain @ (measurement.p_WQ - self.mean[:3])
        covariance = P - gain @ P[:3]
        return replace(
            self,
            mean=read_only(mean),
            covariance=read_only(0.5 * (covariance + covariance.T)),
            turn_rate=self.turn_rate if shared else self._turn_rate_to(mean[3:]),
            seen=self.stamp,
            hits=self.hits + 1,
            misses=0,
            measurement=measurement.reported(shared, float(self.shape.dimensions[2])),
            places=places,
        )

    def _turn_rate_to(self, velocity: np.ndarray) -> float:
        """Returns the turn rate [rad/s] after the velocity was corrected, shape (3,) [m/s]."""
        (x, y), (new_x, new_y) = self.mean[3:5].tolist(), velocity[:2].tolist()
        square = x * x + y * y
        if square < HEADING_SPEED**2:
            return 0.0
        rate = self.turn_rate + (x * new_y - y * new_x) / square / TURN_TIME
        return min(max(rate, -FASTEST_TURN), FASTEST_TURN)


def new_track(
    stamp: float, measurement: Measurement, shape: ObjectShape, colour: tuple[float, float, float]
) -> Track3D:
    """Returns the unconfirmed track that begins with a measurement of a moving object. It gives no points at first.

    Args:
        stamp: of the measurement [s].
        measurement: the measurement.
        shape: as in `Track3D`.
        colour: as in `Track3D`.
    """
    covariance = np.zeros((6, 6))
    covariance[:3, :3] = measurement.covariance
    covariance[3:, 3:] = START_SPEED**2 * np.eye(3)
    mean = np.concatenate([measurement.p_WQ, np.zeros(3)])
    return Track3D(
        number=0,
        stamp=stamp,
        mean=read_only(mean),
        covariance=read_only(covariance),
        state=TrackState.MOVING,
        seen=stamp,
        hits=1,
        misses=0,
        shape=shape,
        height=float(measurement.p_WQ[2]),
        colour=colour,
        alone=stamp,
        guessed_until=stamp + GUESS_TIME,
        measurement=measurement,
    )
