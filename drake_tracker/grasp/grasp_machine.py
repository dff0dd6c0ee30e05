"""The grasp machine: runs the motor schema of `schema.py` on what the arm's computer knows."""

from dataclasses import dataclass, replace

import numpy as np

from drake_tracker.arm.differential_ik import make_parameters
from drake_tracker.core.messages import KNOT_COUNT, KNOT_SPACING
from drake_tracker.grasp.gate import Gate, can_follow, horizon, judge_prediction
from drake_tracker.grasp.motor_schema import SchemaMachine, since
from drake_tracker.grasp.prediction_memory import PredictionMemory, remember
from drake_tracker.grasp.schema import PROGRAMS, SAME_MOTION, TRANSITIONS, Phase

SEEN_FOR = 0.2
"""The object counts as seen once its target has been valid and fresh for this long [s]."""
GRIP_CONFIRMED = 0.06
"""The jaws hold something once they have stood still under force for this long [s]."""
WIDTH_TOLERANCE = 0.010
"""A stop of the jaws this near [m] to the object's width is the object."""
PATH_DURATION = (KNOT_COUNT - 1) * KNOT_SPACING
"""A predicted path ends so long [s] after its stamp."""
FORCE_SHARE = 0.6
"""Share of the grip force that must be felt to believe in a grip."""


@dataclass(frozen=True)
class GraspState:
    """All that the machine remembers. Times in s, widths in m."""

    phase: Phase = Phase.ACQUIRE
    entered: float = 0.0
    motion: int = 0
    jaw_width: float = 0.0
    seen_since: float = np.inf
    gripped_since: float = np.inf
    attempts: int = 0
    gate: Gate = Gate.NOT_TRACKING
    remembered_error: float = 0.0
    memory: PredictionMemory = PredictionMemory()

    def __deepcopy__(self, memo):
        return self


@dataclass(frozen=True)
class Observation:
    """What the arm's computer knows at a tick: messages as named views, q_commanded [rad], time [s]."""

    time: float
    target: object
    packet: np.ndarray
    jaws: object
    status: object
    q_commanded: np.ndarray


class GraspMachine(SchemaMachine):
    """Arithmetic of the grasp machine.

    Args:
      parameters: a scenario's `Grasp`. model: the arm's `ArmModel`. period: time between ticks [s].
    """

    def __init__(self, parameters, model, period):
        super().__init__(parameters, PROGRAMS, TRANSITIONS, SAME_MOTION)
        self.model = model
        self.period = period
        self._ik_parameters = make_parameters(model, period)

    def initial_state(self):
        return GraspState(jaw_width=self.parameters.jaw_opening)

    def update(self, state, seen):
        """Returns the state after a tick with the given `Observation`."""
        # While it is blind nothing is seen: what was seen before the descent does not count after it.
        fresh = bool(seen.target.valid) and not seen.target.stale and not PROGRAMS[state.phase].frozen
        state = replace(
            state,
            seen_since=min(state.seen_since, seen.time) if fresh else np.inf,
            gripped_since=min(state.gripped_since, seen.time) if self._feels_grip(seen) else np.inf,
        )
        if not PROGRAMS[state.phase].frozen and seen.target.valid:
            memory = remember(state.memory, seen.packet, horizon(self.parameters, seen.target))
            state = replace(state, memory=memory)
        state = self._judge(state, seen)
        state = self.advance(state, seen)
        return replace(state, jaw_width=self._slew_jaws(state))

    # Conditions of TRANSITIONS, each a question about (state, seen).

    def object_seen(self, state, seen):
        return since(state.seen_since, seen.time) >= SEEN_FOR

    def object_lost(self, state, seen):
        return not seen.target.valid

    def told_to_hold(self, state, seen):
        return self.parameters.when_stale == "hold" and bool(seen.target.stale)

    def may_intercept(self, state, seen):
        return state.gate == Gate.OPEN

    def time_to_close(self, state, seen):
        return self._elapsed(state, seen) >= self.parameters.descent_duration - self.parameters.closing_lead

    def jaws_hold(self, state, seen):
        return since(state.gripped_since, seen.time) >= GRIP_CONFIRMED

    def jaws_empty(self, state, seen):
        if seen.jaws.width < self.parameters.object_width - WIDTH_TOLERANCE:
            return True
        return state.phase == Phase.CLOSE and self._elapsed(state, seen) > self.parameters.close_timeout

    def lift_done(self, state, seen):
        return self._elapsed(state, seen) >= self.parameters.lift_duration

    def retreat_done(self, state, seen):
        return self._elapsed(state, seen) >= self.parameters.retreat_duration

    # Parts of a tick.

    def _judge(self, state, seen):
        gate, error = self._gate(state, seen)
        return replace(state, gate=gate, remembered_error=error)

    def _gate(self, state, seen):
        parameters = self.parameters
        if state.phase != Phase.TRACK:
            return Gate.NOT_TRACKING, 0.0
        settling = self._elapsed(state, seen) < parameters.approach_duration + parameters.settle_time
        if settling or seen.status.fraction < 1.0:  # a target that jumped is approached anew within the phase
            return Gate.SETTLING, 0.0
        if seen.status.flipping:
            return Gate.FLIPPING, 0.0
        if seen.target.stale:
            return Gate.STALE, 0.0
        if horizon(parameters, seen.target) > PATH_DURATION:
            return Gate.OUT_OF_REACH, 0.0
        verdict, error = judge_prediction(parameters, state.memory, seen.packet, seen.target)
        if verdict == Gate.OPEN and not can_follow(
            parameters,
            self.model,
            self._ik_parameters,
            seen.q_commanded,
            seen.packet,
            seen.target.time - self.period,
            parameters.hover_height,
            seen.status.branch,
        ):
            verdict = Gate.OUT_OF_REACH
        return verdict, error

    def enter(self, state, phase, seen):
        state = super().enter(state, phase, seen)
        return replace(state, attempts=state.attempts + (phase == Phase.INTERCEPT))

    def _feels_grip(self, seen):
        return (
            abs(seen.jaws.width - self.parameters.object_width) <= WIDTH_TOLERANCE
            and seen.jaws.force >= FORCE_SHARE * self.parameters.grip_force
        )

    def _slew_jaws(self, state):
        goal = 0.0 if PROGRAMS[state.phase].jaws_closed else self.parameters.jaw_opening
        step = self.parameters.jaw_speed * self.period
        return state.jaw_width + min(max(goal - state.jaw_width, -step), step)
