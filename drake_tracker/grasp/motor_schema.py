"""What every motor schema shares: phases in a table, and the machine that goes from one to the next.

A skilled action is "an ordered set of parametrized motor control programs of short duration" (Allen et al. 1991,
section 5).
"""

from dataclasses import dataclass, replace

import numpy as np

from drake_tracker.arm.tool_motion import MotionFrame

ROUNDING = 1e-9
"""Of sums of periods [s]."""


@dataclass(frozen=True)
class Program:
    """What the arm does in a phase. ``height`` and ``duration`` name fields of the task's parameters."""

    frame: MotionFrame
    height: str
    duration: str
    jaws_closed: bool
    frozen: bool


class SchemaMachine:
    """Arithmetic of a machine that runs a motor schema. Its state has phase, entered [s], motion and jaw_width [m].

    Args:
      parameters: of the task; the programs name fields of it.
      programs: {phase: `Program`}. transitions: {phase: ((condition, next phase), ...)}, the conditions being methods
        of the machine, questions about (state, seen), asked in this order; ``seen`` has the ``time`` [s].
      same_motion: changes of phase that leave the motion under way as it is.
    """

    def __init__(self, parameters, programs, transitions, same_motion):
        self.parameters = parameters
        self._programs, self._transitions, self._same_motion = programs, transitions, same_motion

    def command(self, state):
        """Returns the `ArmCommand` vector of a state."""
        program = self._programs[state.phase]
        height, duration = self.height(state), self.duration(state)
        return np.array(
            [state.phase, state.motion, duration, program.frame, height, float(program.frozen), state.jaw_width]
        )

    def height(self, state):
        """Returns the height of the tool above the object's reference point [m]."""
        return getattr(self.parameters, self._programs[state.phase].height)

    def duration(self, state):
        """Returns the duration of the motion [s]."""
        return getattr(self.parameters, self._programs[state.phase].duration)

    def advance(self, state, seen):
        """Returns the state after the first transition whose condition holds, or as it was."""
        for condition, phase in self._transitions[state.phase]:
            if getattr(self, condition)(state, seen):
                return self.enter(state, phase, seen)
        return state

    def enter(self, state, phase, seen):
        """Returns the state at the beginning of a phase."""
        same = (state.phase, phase) in self._same_motion
        return replace(state, phase=phase, entered=seen.time, motion=state.motion if same else state.motion + 1)

    @staticmethod
    def _elapsed(state, seen):
        """Returns the time [s] since the phase began; see `since`."""
        return since(state.entered, seen.time)


def since(start, now):
    """Returns how long [s] ago ``start`` was. Both are times of ticks, whose sums are rounded: of a number of periods
    that is just reached nothing must be missing.
    """
    return now - start + ROUNDING
