"""The operator's override of every hand: stop the hand, or take control of it.

In both papers a person watches: the operator interface serves to "observe, supervise, and directly control the system"
(Nashman and Chaconas 1990, section 3).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import IntEnum
from typing import Any, NamedTuple, Protocol, TypeVar

import numpy as np

from drake_tracker.arm.motion.transform_equation import straight_motion_time
from drake_tracker.core.frozen_state import read_only
from drake_tracker.core.messages import ServoTarget, message_size
from drake_tracker.grasp.motor_schema import SchemaMachine, SchemaState, Transitions

STOPPING_SHARE = 0.3
"""A motion that stops continues by this fraction of speed times duration; with a smaller one it would move back."""
SAME_YAW = 0.01
"""Directions that differ by at most this [rad] belong to the same goal."""


def operated(
    transitions: Transitions, *, stopped: IntEnum, manual: IntEnum, after: Sequence[tuple[str, Any]]
) -> Transitions:
    """Returns transitions in which the operator is asked first in every phase.

    Args:
        transitions: those of the automatic phases.
        stopped: phase in which the operator has stopped the hand.
        manual: phase in which the operator controls the hand.
        after: transitions from these two phases once the operator only supervises.
    """
    stops, takes_over = ("operator_stops", stopped), ("operator_takes_over", manual)
    asked = {phase: (stops, takes_over, *others) for phase, others in transitions.items()}
    return {**asked, stopped: (takes_over, *after), manual: (stops, *after)}


class Pace(NamedTuple):
    """How the hand moves to a goal.

    Attributes:
        speed: largest speed [m/s].
        acceleration: largest acceleration [m/s^2].
        shortest: shortest duration of a motion [s].
        tolerance: distance that the goal must move before the hand follows [m].
    """

    speed: float
    acceleration: float
    shortest: float
    tolerance: float


@dataclass(frozen=True, kw_only=True)
class OperatedState(SchemaState):
    """The state of the machine of an operated hand.

    Attributes:
        goal: pose (x, y, z, yaw) in W of the goal, read-only, shape (4,) [m, rad].
        duration: duration of the motion to the goal [s].
        tool: commanded pose of the tool at the last tick, shape (4,) [m, rad], None before the first.
    """

    goal: np.ndarray = field(default_factory=lambda: read_only(np.zeros(4)))
    duration: float = 0.0
    tool: np.ndarray | None = None


class OperatorSeen(Protocol):
    """The inputs of the arm's computer at a tick."""

    @property
    def time(self) -> float:
        """Time of the tick [s]."""
        ...

    @property
    def status(self) -> Any:
        """A `ToolStatus`."""
        ...

    @property
    def operator(self) -> Any:
        """An `OperatorCommand`."""
        ...


State = TypeVar("State", bound=OperatedState)
Seen = TypeVar("Seen", bound=OperatorSeen)


class OperatedMachine(SchemaMachine[State, Seen]):
    """Arithmetic of a motor schema whose hand the operator can stop, or take control of.

    Attributes:
        period: time between ticks [s].
    """

    period: float

    def pace(self, state: State) -> Pace:
        """Returns how the hand moves to its goal."""
        raise NotImplementedError

    def operator_takes_over(self, state: State, seen: Seen) -> bool:
        """Returns whether the operator takes control of the hand."""
        return seen.operator.mode == OperatorMode.TAKE_OVER

    def operator_lets_go(self, state: State, seen: Seen) -> bool:
        """Returns whether the operator only supervises."""
        return seen.operator.mode == OperatorMode.SUPERVISE

    def operator_stops(self, state: State, seen: Seen) -> bool:
        """Returns whether the operator stops the hand; any unknown mode means a stop."""
        return not (self.operator_takes_over(state, seen) or self.operator_lets_go(state, seen))

    def stop(self, state: State, seen: Seen) -> State:
        """Returns the state of a hand that comes to rest where it is."""
        tool, rate = self._tool(state, seen)
        duration = self.stopping_time(tool, rate)
        return replace(state, goal=read_only(tool + STOPPING_SHARE * duration * rate), duration=duration)

    def stopping_time(self, tool: np.ndarray, rate: np.ndarray) -> float:
        """Returns the time in which the operator's stop brings the hand to rest [s].

        Args:
            tool: commanded pose of the tool (x, y, z, yaw), shape (4,) [m, rad].
            rate: its rate per second, shape (4,).
        """
        return self.config.stop_duration

    def approach(self, state: State, pose: np.ndarray, height: float, seen: Seen) -> State:
        """Returns the state with a new goal if it differs, and with a motion long enough for the hand's pace.

        Args:
            state: the state before.
            pose: pose (x, y, z, yaw) in W of the new goal, shape (4,) [m, rad].
            height: height of the tool above the goal [m].
            seen: the inputs of the arm's computer.
        """
        pace = self.pace(state)
        step = pose - state.goal
        same = np.linalg.norm(step[:3]) <= pace.tolerance and abs(step[3]) <= SAME_YAW
        if same and state.entered != seen.time:
            return state
        tool, v_WT = self._tool(state, seen)
        displacement = pose[:3] + [0.0, 0.0, height] - tool[:3]
        needed = straight_motion_time(displacement, v_WT[:3], pace.speed, pace.acceleration)
        duration = max(needed, pace.shortest)
        return replace(state, goal=read_only(np.array(pose, dtype=float)), motion=state.motion + 1, duration=duration)

    def obey(self, state: State, seen: Seen) -> State:
        """Returns the state of a hand that goes to the pose of the operator in control; a pose that is not finite is
        ignored."""
        operator = seen.operator
        pose = np.array([operator.x, operator.y, operator.z, operator.yaw])
        return self.approach(state, pose, 0.0, seen) if np.all(np.isfinite(pose)) else state

    def with_tool(self, state: State, seen: Seen) -> State:
        """Returns the state that remembers where the tool is now; to be called at the end of a tick."""
        return replace(state, tool=read_only(_tool_pose(seen.status)))

    def _tool(self, state: State, seen: Seen) -> tuple[np.ndarray, np.ndarray]:
        """Returns the commanded tool (x, y, z, yaw) [m, rad] and its rate per second, each of shape (4,)."""
        tool = _tool_pose(seen.status)
        return tool, (tool - state.tool) / self.period if state.tool is not None else np.zeros(4)


def resting_target(time: float, pose: np.ndarray) -> np.ndarray:
    """Returns the `ServoTarget` vector of a valid object that stands still.

    Args:
        time: of the target [s].
        pose: (x, y, z, yaw) in W, shape (4,) [m, rad].
    """
    vector = np.zeros(message_size(ServoTarget))
    target = ServoTarget(vector)
    target.time = time
    target.x, target.y, target.z, target.yaw = pose
    target.valid = 1.0
    return vector


def _tool_pose(status: Any) -> np.ndarray:
    return np.array([status.x, status.y, status.z, status.yaw])


class OperatorMode(IntEnum):
    """Modes of the operator: values of `OperatorCommand`'s ``mode`` field."""

    SUPERVISE = 0
    STOP = 1
    TAKE_OVER = 2
