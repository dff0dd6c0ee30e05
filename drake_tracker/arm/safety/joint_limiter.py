"""The last check before the joints: set-points that break no limit of the arm and from which the arm can still stop.

The inverse kinematics plans within the limits, so that a run in which nothing goes wrong never feels this layer: a
set-point that breaks no rule passes unchanged, bit for bit.
"""

import math
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from drake_tracker.arm.arm_clearance import ArmClearance, Nearness
from drake_tracker.arm.arm_model import ArmModel
from drake_tracker.arm.motion.differential_ik import LIMIT_MARGIN
from drake_tracker.core.timing import SERVO_PERIOD

BRAKING_SHARE = 0.6
"""Fraction of each drive's torque with which a stop is planned. Gravity, the other joints and the corrections of the
joint servos need the rest."""

TORQUE_SHARE = 0.95
"""Fraction of each drive's largest torque that a set-point may need. The joint servo corrects with the rest: with 1.0,
the drives saturated for 40 ms behind a target that jumped. Grasps of the ball need up to 0.946."""


class Limit(IntEnum):
    """Reasons for a changed set-point: the index of the count in a `LimiterReport`, after the number of changed
    set-points."""

    INVALID = 0
    POSITION = 1
    SPEED = 2
    ACCELERATION = 3
    TORQUE = 4
    OBSTACLE = 5
    LINK = 6
    CONTACT = 7


LIMITS = {
    Limit.INVALID: "the set-point was not finite",
    Limit.POSITION: "a joint could not have stopped before the end of its range",
    Limit.SPEED: "a joint would have exceeded its rated speed",
    Limit.ACCELERATION: "a joint would have changed its speed faster than its drive allows",
    Limit.TORQUE: "a drive would have needed almost all its torque",
    Limit.OBSTACLE: "the arm could not have stopped before the table",
    Limit.LINK: "the arm could not have stopped before touching itself",
    Limit.CONTACT: "a drive had pushed against something with all its torque (`collision_reflex`)",
}
"""The meaning of each limit, in words."""

_NEAR = {Nearness.OBSTACLE: Limit.OBSTACLE, Nearness.LINK: Limit.LINK}


@dataclass(frozen=True, eq=False)
class LimitedStep:
    """A step of the set-points.

    Attributes:
        q: the next set-point, shape (n,) [rad].
        v: velocity of the step, shape (n,) [rad/s].
        limits: the limits for which the step was changed.
    """

    q: np.ndarray
    v: np.ndarray
    limits: frozenset[Limit] = frozenset()


class JointLimiter:
    """Arithmetic of the limiter.

    The rules, in this order:

    1. A set-point that is not finite is replaced by a stop.
    2. No joint moves faster than its rated speed. All joints are slowed down alike, so that the path is kept.
    3. A joint moves towards the end of its range no faster than it can stop before it, `LIMIT_MARGIN` from the end.
    4. No joint changes its speed faster than its drive can, with the inertia that it has in this pose.
    5. No drive needs more than `TORQUE_SHARE` of its largest torque for gravity, friction and the acceleration of all
       joints. The change of speed of all joints is reduced alike.
    6. If the arm could not stop before it is too near to itself or to an obstacle, it stops now, along its path.

    A stop is planned with `BRAKING_SHARE` of the torques. The stop ends in a pose that was checked when the arm last
    moved. The poses before, a tenth of a second, are not checked. An arm that is already too near to an obstacle may
    move away from the obstacle.

    Args:
        model: the arm.
        period: period of the set-points [s].
        clearance: distances between the arm's links and to obstacles; None: they are not checked.
    """

    def __init__(self, model: ArmModel, period: float = SERVO_PERIOD, clearance: ArmClearance | None = None) -> None:
        self._model, self._period, self._clearance = model, period, clearance
        self._lower, self._upper = model.position_lower + LIMIT_MARGIN, model.position_upper - LIMIT_MARGIN

    def step(self, q: np.ndarray, v_last: np.ndarray, q_wanted: np.ndarray) -> LimitedStep:
        """Returns the step that comes nearest to a wanted one within the limits.

        Args:
            q: the last set-point, shape (n,) [rad].
            v_last: velocity of the last step, shape (n,) [rad/s].
            q_wanted: the next set-point that is wanted, shape (n,) [rad].
        """
        acceleration = self._model.effort_limit / self._model.inertia(q)
        braking = BRAKING_SHARE * acceleration
        with np.errstate(over="ignore"):  # set-points of 1e308
            wanted = v = (q_wanted - q) / self._period
        if not np.isfinite(v).all():
            return self._stop(q, v_last, braking, frozenset({Limit.INVALID}))
        limits = set()
        for limit, rule in (
            (Limit.SPEED, self._within_speed),
            (Limit.POSITION, lambda v: self._within_range(q, v, braking)),
            (Limit.ACCELERATION, lambda v: self._within_acceleration(v_last, v, acceleration)),
            (Limit.TORQUE, lambda v: self._within_torque(q, v_last, v)),
        ):
            limited = rule(v)
            if limited is not v:
                limits.add(limit)
            v = limited
        q_next = q_wanted
        if v is not wanted:
            q_next = np.clip(q + self._period * v, self._lower, self._upper)
            v = (q_next - q) / self._period
        near = self._near(q, q_next, v, braking)
        if near is not None:
            return self._stop(q, v_last, braking, frozenset(limits | {_NEAR[near]}))
        return LimitedStep(q_next, v, frozenset(limits))

    def _within_speed(self, v: np.ndarray) -> np.ndarray:
        share = float(np.max(np.abs(v) / self._model.velocity_limit))
        return v if share <= 1.0 else v / share

    def _within_range(self, q: np.ndarray, v: np.ndarray, braking: np.ndarray) -> np.ndarray:
        """Returns the velocity at which each joint can still stop within its range after the step."""

        def fastest(room: np.ndarray) -> np.ndarray:
            T, room = self._period, np.maximum(room, 0.0)
            # The root of T v + v^2 / (2 braking) = room, without the difference of two nearly equal numbers.
            return 2.0 * room / (T + np.sqrt(T * T + 2.0 * room / braking))

        limited = np.clip(v, -fastest(q - self._lower), fastest(self._upper - q))
        # The rounding of one part in 10^9 is not worth a change.
        return v if (np.abs(limited - v) <= 1e-9 + 1e-9 * np.abs(v)).all() else limited

    def _within_acceleration(self, v_last: np.ndarray, v: np.ndarray, acceleration: np.ndarray) -> np.ndarray:
        change = acceleration * self._period
        limited = np.clip(v, v_last - change, v_last + change)
        return v if np.array_equal(limited, v) else limited

    def _within_torque(self, q: np.ndarray, v_last: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Returns the velocity with the largest part of the wanted change that the drives' torques allow."""
        largest = TORQUE_SHARE * self._model.effort_limit
        steady = self._model.drive_torques(q, v_last, np.zeros_like(v))
        added = self._model.drive_torques(q, v_last, (v - v_last) / self._period) - steady
        excess = (np.abs(steady + added) > largest) & (np.abs(steady) < largest)
        if not excess.any():
            return v
        share = np.min((largest - np.sign(added) * steady)[excess] / np.abs(added)[excess])
        return v_last + min(share, 1.0) * (v - v_last)

    def _near(self, q: np.ndarray, q_next: np.ndarray, v: np.ndarray, braking: np.ndarray) -> Nearness | None:
        """Returns the body that the arm would come too near to in a step, or in a stop after the step; None:
        nothing."""
        if self._clearance is None:
            return None
        rest = 0.5 * self._period * (self._steps_to_stop(v, braking) - 1) * v
        near = self._clearance.nearness(q_next) or (self._clearance.nearness(q_next + rest) if rest.any() else None)
        if near is None or self._clearance.nearness(q) is None:
            return near
        before, after = (self._clearance.distance(joints, 1.0) for joints in (q, q_next))
        return near if after <= before else None

    def _steps_to_stop(self, v: np.ndarray, braking: np.ndarray) -> int:
        """Returns in how many steps all joints together come to rest."""
        return max(1, math.ceil(float(np.max(np.abs(v) / braking)) / self._period - 1e-9))

    def _stop(self, q: np.ndarray, v_last: np.ndarray, braking: np.ndarray, limits: frozenset[Limit]) -> LimitedStep:
        """Returns the next step of a stop, in which the joints slow down alike."""
        v = v_last * (1.0 - 1.0 / self._steps_to_stop(v_last, braking))
        return LimitedStep(np.clip(q + self._period * v, self._lower, self._upper), v, limits)
