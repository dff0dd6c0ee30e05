"""The common part of all motor schemas: phases in a table, and the machine that goes from one phase to the next.

A skilled action is "an ordered set of parametrized motor control programs of short duration" (Allen et al. 1991,
section 5).
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Any, Generic, Protocol, TypeVar

import numpy as np

from drake_tracker.arm.motion.tool_motion import MotionFrame
from drake_tracker.core.frozen_state import FrozenState
from drake_tracker.core.messages import Frozen

ROUNDING = 1e-9
"""Bound on the rounding error of sums of periods [s]."""

Transitions = Mapping[Any, Sequence[tuple[str, Any]]]
"""From each phase, the conditions in the order in which they are asked, and the phase that each leads to."""


@dataclass(frozen=True)
class Program:
    """The program of the arm in a phase.

    Attributes:
        frame: frame of the motion.
        height: name of the setting with the height of the tool above the object's reference point.
        duration: name of the setting with the duration of the motion.
        jaws_closed: whether the jaws close or stay closed.
        blind: whether the arm works without vision: it follows the packet that it holds, and uses no newer one.
    """

    frame: MotionFrame
    height: str
    duration: str
    jaws_closed: bool
    blind: bool


@dataclass(frozen=True)
class SchemaState(FrozenState):
    """The state of the machine of every motor schema.

    Attributes:
        phase: the phase, an IntEnum of the task.
        entered: time at which the phase began [s].
        motion: number of straight-line motions begun.
        jaw_width: opening of the jaws that is asked for [m].
    """

    phase: IntEnum
    entered: float = 0.0
    motion: int = 0
    jaw_width: float = 0.0


class Observed(Protocol):
    """The inputs of the arm's computer at a tick."""

    @property
    def time(self) -> float:
        """Time of the tick [s]."""
        ...


State = TypeVar("State", bound=SchemaState)
Seen = TypeVar("Seen", bound=Observed)


class SchemaMachine(Generic[State, Seen]):
    """Arithmetic of a machine that runs a motor schema.

    Args:
        config: settings of the task; the programs name fields of it.
        programs: {phase: `Program`}.
        transitions: {phase: ((condition, next phase), ...)}. The conditions are names of methods of the machine, which
            take the state and the inputs, and are evaluated in this order.
        same_motion: pairs (phase, next phase) between which the motion under way goes on.
    """

    def __init__(
        self,
        config: Any,
        programs: Mapping[Any, Program],
        transitions: Transitions,
        same_motion: Collection[tuple[Any, Any]],
    ) -> None:
        self.config = config
        self._programs, self._transitions, self._same_motion = programs, transitions, same_motion

    def command(self, state: State) -> np.ndarray:
        """Returns the `ArmCommand` vector of a state."""
        program = self._programs[state.phase]
        height, duration = self.height(state), self.duration(state)
        return np.array(
            [state.phase, state.motion, duration, program.frame, height, float(self.frozen(state)), state.jaw_width]
        )

    def frozen(self, state: State) -> Frozen:
        """Returns the reference frame of the motion."""
        return Frozen.BLIND if self._programs[state.phase].blind else Frozen.FREE

    def height(self, state: State) -> float:
        """Returns the height of the tool above the object's reference point [m]."""
        return getattr(self.config, self._programs[state.phase].height)

    def duration(self, state: State) -> float:
        """Returns the duration of the motion [s]."""
        return getattr(self.config, self._programs[state.phase].duration)

    def advance(self, state: State, seen: Seen) -> State:
        """Returns the state after the first transition whose condition holds, or the state as it was."""
        for condition, phase in self._transitions[state.phase]:
            if getattr(self, condition)(state, seen):
                return self.enter(state, phase, seen)
        return state

    def enter(self, state: State, phase: Any, seen: Seen) -> State:
        """Returns the state at the beginning of a phase."""
        same = (state.phase, phase) in self._same_motion
        return replace(state, phase=phase, entered=seen.time, motion=state.motion if same else state.motion + 1)

    @staticmethod
    def _elapsed(state: State, seen: Seen) -> float:
        """Returns the time [s] since the phase began; see `since`."""
        return since(state.entered, seen.time)


def since(start: float, now: float) -> float:
    """Returns how long ago ``start`` was [s], plus `ROUNDING`.

    Both are times of ticks, sums of periods with rounding errors. The addition makes sure that a number of periods that
    has just passed is not missed.
    """
    return now - start + ROUNDING
