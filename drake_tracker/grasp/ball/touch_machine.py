"""Touching three marks on the board with a guarded move (Nashman and Chaconas 1990, section 3): phases, state, machine.

The paper places "the manipulator's end effector at three locations on the board". An operator has jogged the probe over
each mark beforehand. Here the arm moves above the mark, moves down slowly until its drives measure contact, records the
position of the probe by its encoders at the onset of the force, and moves up again.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Any

import numpy as np

from drake_tracker.arm.arm_model import ArmModel
from drake_tracker.arm.motion.tool_motion import MotionFrame
from drake_tracker.arm.motion.transform_equation import PEAK_OVER_MEAN
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.frozen_state import FrozenState, read_only
from drake_tracker.core.messages import TouchReport
from drake_tracker.grasp.config import TouchConfig


class TouchPhase(IntEnum):
    """Phases of the arm: values of `TouchReport`'s ``phase`` field."""

    TRAVEL = 0
    ABOVE = 1
    DOWN = 2
    UP = 3
    DONE = 4
    MISSED = 5


@dataclass(frozen=True)
class TouchState(FrozenState):
    """Everything the touching remembers.

    Attributes:
        phase: what the arm is doing.
        mark: number of the current mark.
        motion: number of straight-line motions begun.
        duration: duration of the motion under way [s].
        since: time at which the phase began [s].
        force: filtered force against the approach [N].
        rest_force: the same in free air, before the descent [N].
        felt: consecutive samples above the threshold.
        last_free: position of the probe when it last felt nothing, p_WP in W, shape (3,) [m].
        points: positions touched so far, p_WP in W, shape (k, 3) [m].
    """

    phase: TouchPhase
    mark: int
    motion: int
    duration: float
    since: float
    force: float
    rest_force: float
    felt: int
    last_free: np.ndarray
    points: np.ndarray


_SHORTEST = 0.3
"""Shortest motion [s]."""
_FREE_SHARE = 0.2
"""Fraction of the threshold up to which the probe is in free air: a soft board is not yet pressed in."""
_FIRST_POINT = TouchReport.get_fields().index("x0")


class TouchMachine:
    """Arithmetic of the touching.

    Args:
        model: the controller's model of the arm, with the probe as its tool frame.
        jogs: where the operator left the probe over each mark, (x, y, z, yaw) in W, shape (3, 4) [m, rad].
        p_start: position of the probe at the start in W, shape (3,) [m].
        period: time between ticks [s].
        config: speeds, distances and the threshold of the force.
    """

    def __init__(
        self,
        model: ArmModel,
        jogs: np.ndarray,
        p_start: Sequence[float] | np.ndarray,
        period: float,
        config: TouchConfig = TouchConfig(),
    ) -> None:
        self.model = model
        self.jogs = np.array(jogs, dtype=float)
        self.period = period
        self.config = config
        self._stops = np.vstack([p_start, self.jogs[:, :3]])

    def initial_state(self) -> TouchState:
        """Returns the state of a probe that sets out for the first mark."""
        nowhere = read_only(np.zeros(3))
        no_points = read_only(np.zeros((0, 3)))
        return TouchState(TouchPhase.TRAVEL, 0, 1, self._travel_time(0), 0.0, 0.0, 0.0, 0, nowhere, no_points)

    def update(
        self,
        state: TouchState,
        time: float,
        status: Any,
        q: np.ndarray,
        v: np.ndarray,
        acceleration: np.ndarray,
        effort: np.ndarray,
    ) -> TouchState:
        """Returns the state after a tick.

        Args:
            state: the state before.
            time: time of the tick [s].
            status: a `ToolStatus`.
            q: measured joint positions, shape (n,) [rad].
            v: measured joint velocities, shape (n,) [rad/s].
            acceleration: commanded joint accelerations, shape (n,) [rad/s^2].
            effort: torques that the joint servos apply, shape (n,) [N m].
        """
        felt = contact_force(self.model, q, v, acceleration, effort)[2]
        force = low_pass(state.force, felt, self.period, self.config.force_time_constant)
        state = replace(state, force=force)
        arrived = status.motion == state.motion and status.fraction >= 1.0
        if state.phase == TouchPhase.DOWN:
            return self._descend(state, time, arrived, q)
        if state.phase == TouchPhase.TRAVEL and arrived:
            lower = PEAK_OVER_MEAN * self.config.clearance / self.config.travel_speed
            return self._enter(state, TouchPhase.ABOVE, time, max(lower, _SHORTEST))
        if state.phase == TouchPhase.ABOVE and arrived:
            if time - state.since >= state.duration + self.config.settle:
                down = PEAK_OVER_MEAN * self.config.reach_below / self.config.descent_speed
                here = read_only(self.model.tool_pose(q).translation())
                state = replace(state, rest_force=force, felt=0, last_free=here)
                return self._enter(state, TouchPhase.DOWN, time, down)
        elif state.phase == TouchPhase.UP and arrived:
            if len(state.points) == len(self.jogs):
                return self._enter(state, TouchPhase.DONE, time, _SHORTEST)
            state = replace(state, mark=state.mark + 1)
            return self._enter(state, TouchPhase.TRAVEL, time, self._travel_time(state.mark))
        return state

    def command(self, state: TouchState) -> np.ndarray:
        """Returns the `ArmCommand` vector of a state: straight motions relative to the jogged pose as the object."""
        height = self.config.clearance
        if state.phase == TouchPhase.ABOVE:
            height = 0.0
        elif state.phase in (TouchPhase.DOWN, TouchPhase.MISSED):
            height = -self.config.reach_below
        return np.array([state.phase, state.motion, state.duration, MotionFrame.OBJECT, height, 0.0, 0.0])

    def target(self, state: TouchState, time: float) -> np.ndarray:
        """Returns the `ServoTarget` vector of a state at a time [s]: the pose over its mark, standing still."""
        return np.concatenate([[time], self.jogs[state.mark], np.zeros(4), [time, 0.0, 0.0, 0.0, 1.0]])

    def report(self, state: TouchState) -> np.ndarray:
        """Returns the `TouchReport` vector of a state."""
        points = np.zeros((3, 3))
        points[: len(state.points)] = state.points
        return np.concatenate([[state.phase, state.mark, state.force - state.rest_force], points.ravel()])

    def _descend(self, state: TouchState, time: float, arrived: bool, q: np.ndarray) -> TouchState:
        push, threshold = state.force - state.rest_force, self.config.threshold
        if push <= _FREE_SHARE * threshold:
            state = replace(state, last_free=read_only(self.model.tool_pose(q).translation()))
        state = replace(state, felt=state.felt + 1 if push > threshold else 0)
        if state.felt >= self.config.samples:
            state = replace(state, points=read_only(np.vstack([state.points, state.last_free])))
            return self._enter(state, TouchPhase.UP, time, _SHORTEST)
        if arrived:
            return replace(state, phase=TouchPhase.MISSED)
        return state

    def _enter(self, state: TouchState, phase: TouchPhase, time: float, duration: float) -> TouchState:
        return replace(state, phase=phase, motion=state.motion + 1, duration=duration, since=time)

    def _travel_time(self, mark: int) -> float:
        """Returns the duration of the motion to a mark [s]."""
        distance = np.linalg.norm(self._stops[mark + 1] - self._stops[mark])
        return max(PEAK_OVER_MEAN * float(distance) / self.config.travel_speed, _SHORTEST)


def touched_points(report: np.ndarray) -> np.ndarray:
    """Returns the touched positions of the probe's centre, p_WP in W, shape (3, 3) [m].

    Args:
        report: a `TouchReport` vector.

    Raises DrakeTrackerError when a descent found nothing, or when the touching is not finished.
    """
    fields = TouchReport(np.asarray(report))
    if fields.phase == TouchPhase.MISSED:
        raise DrakeTrackerError(
            f"the arm felt nothing below mark {int(fields.mark) + 1} of the board: is the board where the scenario "
            "(board.edge_position) says it is?"
        )
    if fields.phase != TouchPhase.DONE:
        raise DrakeTrackerError(f"the arm has not finished touching the board: {TouchPhase(int(fields.phase)).name}")
    return np.asarray(report)[_FIRST_POINT:].reshape(3, 3)


def contact_force(
    model: ArmModel, q: np.ndarray, v: np.ndarray, acceleration: np.ndarray, effort: np.ndarray
) -> np.ndarray:
    """Returns the force F on the tool's origin, expressed in W, shape (3,) [N].

    Args:
        model: the arm with its tool.
        q: measured joint positions, shape (n,) [rad].
        v: measured joint velocities, shape (n,) [rad/s].
        acceleration: commanded joint accelerations, shape (n,) [rad/s^2].
        effort: torques that the joint servos apply, shape (n,) [N m].
    """
    unexplained = model.drive_torques(q, v, acceleration) - np.asarray(effort)
    _, J_WT = model.tool_pose_and_jacobian(q)
    return np.linalg.lstsq(J_WT[3:].T, unexplained, rcond=None)[0]


def low_pass(filtered: float, value: float, period: float, time_constant: float) -> float:
    """Returns the output of a first-order low-pass filter after one more period.

    Args:
        filtered: the output before.
        value: the input.
        period: time since the last input [s].
        time_constant: time constant of the filter [s].
    """
    return filtered + (1.0 - math.exp(-period / time_constant)) * (value - filtered)
