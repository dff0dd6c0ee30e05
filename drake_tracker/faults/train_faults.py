"""Faults of the train: it stops, turns back, is pushed, thrown off its track, or carried away."""

import math
from dataclasses import dataclass

import numpy as np

from drake_tracker.core.constants import GRAVITY
from drake_tracker.faults.fault import SpeedFault, TrainFault

MASS = 0.25
"""Mass of the train [kg]."""
HAND_GAIN = 25.0
"""Force of an invisible hand per error of the speed [N s/m]; above .25 kg / (1/300 s) = 75 the motion is jerky."""
HAND_FORCE = 8.0
"""Largest force of the hand that carries the train, apart from the weight of the train [N]."""
HAND_SPEED = 1.0
"""Largest speed of the invisible hand [m/s]."""
CARRY_HEIGHT = 0.06
"""Height to which it lifts the train [m], below the hand of the arm while that waits."""
REACTION_TIME = 0.1
"""Time constant with which it approaches a place [s]."""
SETTING_DOWN_SPEED = 0.08
"""Speed at which it sets the train down [m/s]."""
UPRIGHT_STIFFNESS, UPRIGHT_DAMPING = 0.1, 0.004
"""With which it keeps the train upright [N m/rad, N m s/rad]: stable at a step of 1/300 s for 8.5e-5 kg m^2."""


@dataclass(frozen=True)
class TrainStoppedFault(SpeedFault):
    """`TrainStopped`: the drive holds the train."""

    def target_speed(self, speed: float) -> float:
        return 0.0


@dataclass(frozen=True)
class TrainReversedFault(SpeedFault):
    """`TrainReversed`: the drive runs backwards at the same speed."""

    def target_speed(self, speed: float) -> float:
        return -speed


@dataclass(frozen=True)
class TrainPushedFault(TrainFault):
    """`TrainPushed`: a constant force along or across the train."""

    def wrench(self, time: float, state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        along, left = axes(state)
        return np.zeros(3), self.settings.force * (along if self.settings.direction == "along" else left)


@dataclass(frozen=True)
class TrainDerailedFault(TrainFault):
    """`TrainDerailed`: a bounded force moves the train to one side in the first half of the time, and stops it then."""

    def wrench(self, time: float, state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        _, left = axes(state)
        side = left if self.settings.side == "left" else -left
        limit = self.settings.force
        if time < 0.5 * (self.begin + self.end):
            # Where the rail holds, it takes the whole force to move the train at all; where it does not, little.
            missing = self.settings.speed - float(state[10:13] @ side)
            return np.zeros(3), np.clip(limit * missing / self.settings.speed, 0.0, limit) * side
        force = -HAND_GAIN * np.array([*state[10:12], 0.0])
        return np.zeros(3), force * min(1.0, limit / max(float(np.linalg.norm(force)), 1e-9))


@dataclass(frozen=True)
class TrainCarriedFault(TrainFault):
    """`TrainMoved` and `TrainRemoved`: an invisible hand lifts the train, carries it to a place and sets it down.

    The hand applies a bounded force that brings the train to a speed. The first fifth of the time is for lifting, the
    last third for setting down; then the hand lets go. The rail lets go when the train is lifted. The jaws of the arm
    are stronger than this hand.

    Attributes:
        table_height: height of the table's top [m].
    """

    table_height: float = 0.45

    def velocity(self, time: float, position: np.ndarray) -> np.ndarray:
        """Returns the velocity (3,) [m/s] that the hand wants.

        Args:
            time: [s].
            position: of the train's reference point (3,) [m].
        """
        share = (time - self.begin) / (self.end - self.begin)
        height = position[2] - self.table_height - 0.035
        across = np.zeros(2)
        if share > 0.2:
            across = (np.asarray(self.settings.to) - position[:2]) / REACTION_TIME
            across *= min(1.0, HAND_SPEED / max(float(np.hypot(*across)), 1e-9))
        if share < 2 / 3:
            vertical = np.clip((CARRY_HEIGHT - height) / REACTION_TIME, -HAND_SPEED, HAND_SPEED)
        else:
            vertical = -SETTING_DOWN_SPEED
        return np.array([*across, vertical])

    def wrench(self, time: float, state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        force = HAND_GAIN * (self.velocity(time, state[4:7]) - state[10:13])
        force *= min(1.0, HAND_FORCE / max(float(np.linalg.norm(force)), 1e-9))
        up = vertical_axis(state)
        torque = UPRIGHT_STIFFNESS * np.cross(up, [0.0, 0.0, 1.0]) - UPRIGHT_DAMPING * state[7:10]
        return torque, force + [0.0, 0.0, MASS * GRAVITY]


def axes(state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns the horizontal unit vectors along the train, and to its left, each (3,).

    Args:
        state: the 13 numbers of the free body.
    """
    qw, qx, qy, qz = state[:4]
    heading = math.atan2(2.0 * (qx * qy + qw * qz), qw**2 + qx**2 - qy**2 - qz**2)
    cos, sin = math.cos(heading), math.sin(heading)
    return np.array([cos, sin, 0.0]), np.array([-sin, cos, 0.0])


def vertical_axis(state: np.ndarray) -> np.ndarray:
    """Returns the train's own vertical axis in W, (3,), a unit vector.

    Args:
        state: the 13 numbers of the free body.
    """
    qw, qx, qy, qz = state[:4] / np.linalg.norm(state[:4])
    return np.array([2.0 * (qx * qz + qw * qy), 2.0 * (qy * qz - qw * qx), 1.0 - 2.0 * (qx**2 + qy**2)])
