"""The grasp machine: runs the motor schema of `schema.py` on the inputs of the arm's computer."""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from drake_tracker.arm.arm_model import ArmModel
from drake_tracker.arm.motion.differential_ik import make_parameters
from drake_tracker.core.messages import Frozen, packet_target
from drake_tracker.core.timing import PATH_DURATION
from drake_tracker.grasp.config import GraspConfig, touch_delay
from drake_tracker.grasp.descent import Likelihood, behind, calibrated, horizon, likelihood, time_to_touch
from drake_tracker.grasp.gate import SLOWER, Gate, can_follow, judge_prediction, judge_probability, stands
from drake_tracker.grasp.jaws import (
    GRIP_CONFIRMED,
    OBLIQUE_CONFIRMED,
    STILL,
    WIDTH_TOLERANCE,
    closed_on_nothing,
    feels_grip,
    feels_oblique_grip,
    next_opening,
)
from drake_tracker.grasp.motor_schema import since
from drake_tracker.grasp.operator_override import STOPPING_SHARE, OperatedMachine, OperatedState, Pace, resting_target
from drake_tracker.grasp.prediction_memory import PredictionMemory, remember
from drake_tracker.grasp.train.schema import BY_HAND, PROGRAMS, SAME_MOTION, TRANSITIONS, Phase

SEEN_FOR = 0.2
"""The object counts as seen once its target has been valid and fresh for this long [s]."""
CAUGHT_UP = 0.008
"""Distance along the path [m] up to which a guided hand is above the object, so that the jaws may close."""
LONGEST_WAIT = 0.3
"""Longest time for which the jaws wait for the hand to catch up [s]."""
PATIENCE = 2.0
"""A guided grasp has missed after this many times `GraspConfig.close_timeout` at the latest, even if the jaws still
move."""
MANUAL_ACCELERATION = 2.0
"""Largest acceleration of the hand under the operator's control [m/s^2]."""
SHORTEST_STOP = 0.06
"""Shortest time in which the operator's stop brings a hand to rest that is about to arrive at the table [s]."""
GUIDED_RETREAT = 0.4
"""Duration [s] in which a guided hand leaves an object that it has missed. With 1 s, 18 of 35 missed attempts threw the
object off its track, with 0.4 s 13 of 41, with 0.3 s 16 of 43 (random walks, seeds 74100 to 74111, which no result
uses)."""
SHORTEST_MOTION = 0.15
"""Shortest duration of a motion under the operator's control [s]."""
FADING = 3.0
"""Time constant [s] with which the best probability lately fades; chosen."""
FOLLOW_TOLERANCE = 0.0005
"""Distance [m] that the operator's pose must move before the hand follows."""


@dataclass(frozen=True, kw_only=True)
class GraspState(OperatedState):
    """All that the machine remembers.

    Attributes:
        phase: the phase.
        seen_since: time since when the target has been valid and fresh [s], infinity while it is not.
        newest: stamp of the newest packet on which a target rested [s].
        heard: time at which it was first seen [s].
        object: number of the track of the newest packet, 0 with a host that tracks only one object.
        followed: the same when the phase began.
        gripped_since: time since when the jaws have measured a grip [s], infinity while they do not.
        jaws_moved: last time at which the opening of the jaws changed [s].
        attempts: number of grasps begun.
        gate: why the machine waits.
        remembered_error: largest lateral error [m] of the predictions on which the gate's verdict rests.
        memory: predictions made so far, and what became of them.
        p_success: probability that a grasp would succeed.
        likely: the same before it is calibrated, also with the surprises of the path.
        best: highest cautious probability lately, which fades with `FADING`.
        descent_duration: duration of the descent [s] that the gate has rehearsed.
        branch: half turns of the jaws when the operator stopped the hand or took control of it.
    """

    phase: Phase = Phase.ACQUIRE
    seen_since: float = np.inf
    newest: float = -np.inf
    heard: float = -np.inf
    object: int = 0
    followed: int = 0
    gripped_since: float = np.inf
    jaws_moved: float = -np.inf
    attempts: int = 0
    gate: Gate = Gate.NOT_TRACKING
    remembered_error: float = 0.0
    memory: PredictionMemory = PredictionMemory()
    p_success: float = 0.0
    likely: Likelihood = Likelihood()
    best: float = 0.0
    descent_duration: float = 0.0
    branch: float = 0.0


@dataclass(frozen=True)
class GraspObservation:
    """The inputs of the arm's computer at a tick.

    Attributes:
        time: time of the tick [s].
        target: a `ServoTarget`.
        packet: the `Prediction` vector on which the target rests.
        jaws: a `JawState`.
        status: a `ToolStatus`.
        q_commanded: the last joint set-points, shape (n,) [rad].
        operator: an `OperatorCommand`.
    """

    time: float
    target: Any
    packet: np.ndarray
    jaws: Any
    status: Any
    q_commanded: np.ndarray
    operator: Any


class GraspMachine(OperatedMachine[GraspState, GraspObservation]):
    """Arithmetic of the grasp machine.

    Args:
        config: heights, durations, and conditions of the gate.
        model: the controller's model of the arm.
        period: time between ticks [s].
        rest_height: z_W of the object's reference point while the object stands on its track [m].
    """

    config: GraspConfig

    def __init__(self, config: GraspConfig, model: ArmModel, period: float, rest_height: float) -> None:
        super().__init__(config, PROGRAMS, TRANSITIONS, SAME_MOTION)
        self.model = model
        self.period = period
        self.rest_height = rest_height
        self._ik_parameters = make_parameters(model, period)

    def initial_state(self) -> GraspState:
        """Returns the state of a hand that waits at home with open jaws."""
        return GraspState(jaw_width=self.config.jaw_opening, descent_duration=self.config.descent_duration)

    def update(self, state: GraspState, seen: GraspObservation) -> GraspState:
        """Returns the state after a tick."""
        # While the arm is blind nothing is seen: what was seen before the descent does not count after it.
        blind = PROGRAMS[state.phase].blind
        fresh = bool(seen.target.valid) and not seen.target.stale and not blind
        gripping = feels_grip(seen.jaws, self.config.object_width, self.config.grip_force)
        state = replace(
            state,
            seen_since=min(state.seen_since, seen.time) if fresh else np.inf,
            gripped_since=min(state.gripped_since, seen.time) if gripping else np.inf,
            jaws_moved=seen.time if abs(seen.jaws.speed) > STILL else state.jaws_moved,
        )
        if seen.target.valid and seen.target.stamp > state.newest:
            number = packet_target(seen.target.seq)
            state = replace(state, newest=float(seen.target.stamp), heard=seen.time, object=number)
        memory_closed = blind or not seen.target.valid
        if not memory_closed:
            memory = remember(state.memory, seen.packet, horizon(self.config, seen.target))
            state = replace(state, memory=memory)
        likely = self._likelihood(state, seen)
        best = max(likely.cautious, state.best * math.exp(-self.period / FADING))
        p_success = calibrated(likely.now, self.config.descent)
        state = self._judge(replace(state, p_success=p_success, likely=likely, best=best), seen)
        state = self.advance(state, seen)
        if state.phase == Phase.MANUAL:
            state = self.obey(state, seen)
        return self.with_tool(replace(state, jaw_width=self._slew_jaws(state, seen)), seen)

    def height(self, state: GraspState) -> float:
        """Returns the height of the tool above the object's reference point [m]; by hand, above its place at rest."""
        return state.goal[2] - self.rest_height if state.phase in BY_HAND else super().height(state)

    def frozen(self, state: GraspState) -> Frozen:
        """Returns the reference frame of the motion. A guided descent follows vision until the jaws hold."""
        guided = self.config.descent == "guided" and state.phase in (Phase.INTERCEPT, Phase.CLOSE)
        return Frozen.GUIDED if guided else super().frozen(state)

    def duration(self, state: GraspState) -> float:
        """Returns the duration of the motion [s]."""
        if state.phase in (Phase.INTERCEPT, Phase.CLOSE):
            return state.descent_duration
        return state.duration if state.phase in (*BY_HAND, Phase.RETREAT) else super().duration(state)

    def goal_target(self, state: GraspState) -> np.ndarray:
        """Returns the `ServoTarget` vector of an object at rest under the goal, with the jaws as they are along it."""
        x, y, _, yaw = state.goal
        return resting_target(state.entered, np.array([x, y, self.rest_height, yaw - np.pi * state.branch]))

    def pace(self, state: GraspState) -> Pace:
        """Returns how the hand moves under the operator's control."""
        return Pace(self.config.manual_speed, MANUAL_ACCELERATION, SHORTEST_MOTION, FOLLOW_TOLERANCE)

    def approach(self, state: GraspState, pose: np.ndarray, height: float, seen: GraspObservation) -> GraspState:
        """Returns the state with a new goal, not below the height at which the jaws grasp."""
        return super().approach(state, np.array([*pose[:2], max(pose[2], self.lowest), pose[3]]), height, seen)

    @property
    def lowest(self) -> float:
        """z_W of the tool [m] at which the jaws grasp: below it the fingers come close to the table."""
        return self.rest_height + self.config.grasp_height

    def stopping_time(self, tool: np.ndarray, rate: np.ndarray) -> float:
        """Returns the time in which the operator's stop brings the hand to rest [s], shorter near the table."""
        room, normal = max(tool[2] - self.lowest, 0.0), self.config.stop_duration
        falls = STOPPING_SHARE * normal * max(-rate[2], 0.0)
        return normal if falls <= room else max(normal * room / falls, SHORTEST_STOP)

    # Conditions of TRANSITIONS: questions about the state and what is seen.

    def object_seen(self, state: GraspState, seen: GraspObservation) -> bool:
        """Returns whether the object has been seen for long enough."""
        return since(state.seen_since, seen.time) >= SEEN_FOR

    def object_lost(self, state: GraspState, seen: GraspObservation) -> bool:
        """Returns whether the target cannot be followed."""
        return not seen.target.valid

    def object_changed(self, state: GraspState, seen: GraspObservation) -> bool:
        """Returns whether the packets are about another object, which must be approached as the first one was."""
        return state.object != state.followed

    def must_hold(self, state: GraspState, seen: GraspObservation) -> bool:
        """Returns whether no packets arrive and the hand should then stand still."""
        return self.config.when_stale == "hold" and bool(seen.target.stale)

    def link_silent(self, state: GraspState, seen: GraspObservation) -> bool:
        """Returns whether no new packet that the arm may follow has arrived for a while."""
        return since(state.heard, seen.time) >= self.config.silence

    def may_intercept(self, state: GraspState, seen: GraspObservation) -> bool:
        """Returns whether the gate is open."""
        return state.gate == Gate.OPEN

    def success_unlikely(self, state: GraspState, seen: GraspObservation) -> bool:
        """Returns whether a guided descent is no longer worth while."""
        cautious = calibrated(state.likely.cautious, self.config.descent)
        return self.config.descent == "guided" and cautious < self.config.abort_probability

    def time_to_close(self, state: GraspState, seen: GraspObservation) -> bool:
        """Returns whether the jaws should begin to close. In a guided descent they wait for a hand that catches up."""
        late = self._elapsed(state, seen) - (state.descent_duration - self.config.closing_lead)
        if self.config.descent == "guided" and 0.0 <= late < LONGEST_WAIT:
            return abs(behind(seen.packet, seen.target).along) <= CAUGHT_UP
        return late >= 0.0

    def misses_before_touch(self, state: GraspState, seen: GraspObservation) -> bool:
        """Returns whether success has become unlikely while closing jaws are still wide open."""
        return self.success_unlikely(state, seen) and self._wide_open(state, seen)

    def jaws_hold(self, state: GraspState, seen: GraspObservation) -> bool:
        """Returns whether the grip is confirmed.

        Oblique jaws stop at the corners of the object. A guided hand lifts it as it lies between them if it does not
        turn straight.
        """
        if since(state.gripped_since, seen.time) >= GRIP_CONFIRMED:
            return True
        config = self.config
        if config.descent != "guided" or since(state.jaws_moved, seen.time) < OBLIQUE_CONFIRMED:
            return False
        return feels_oblique_grip(seen.jaws, config.object_width, config.jaw_opening, config.grip_force)

    def jaws_empty(self, state: GraspState, seen: GraspObservation) -> bool:
        """Returns whether the jaws have closed on nothing, or have found no grip in time.

        In a guided grasp the time counts from when the jaws stopped.
        """
        if closed_on_nothing(seen.jaws, self.config.object_width):
            return True
        if state.phase != Phase.CLOSE:
            return False
        elapsed, timeout = self._elapsed(state, seen), self.config.close_timeout
        if self.config.descent == "guided" and elapsed <= PATIENCE * timeout:
            return min(elapsed, since(state.jaws_moved, seen.time)) > timeout
        return elapsed > timeout

    def lets_go_of_full_jaws(self, state: GraspState, seen: GraspObservation) -> bool:
        """Returns whether the operator only supervises, and the jaws hold something."""
        return self.operator_lets_go(state, seen) and self.jaws_hold(state, seen)

    def lift_done(self, state: GraspState, seen: GraspObservation) -> bool:
        """Returns whether the lift is over."""
        return self._elapsed(state, seen) >= self.config.lift_duration

    def retreat_done(self, state: GraspState, seen: GraspObservation) -> bool:
        """Returns whether the retreat is over."""
        return self._elapsed(state, seen) >= state.duration

    # Parts of a tick.

    def _likelihood(self, state: GraspState, seen: GraspObservation) -> Likelihood:
        """Returns how likely a grasp is to succeed: the present one, or one that would begin now."""
        remaining = time_to_touch(self.config)
        if state.phase == Phase.INTERCEPT:
            remaining = max(remaining - self._elapsed(state, seen), touch_delay(self.config))
        elif state.phase == Phase.CLOSE and self.config.descent == "guided":  # the jaws may have waited
            remaining = (state.jaw_width - self.config.object_width) / self.config.jaw_speed
        elif state.phase == Phase.CLOSE:
            remaining = touch_delay(self.config) - self._elapsed(state, seen)
        height = seen.status.z - seen.target.z
        return likelihood(self.config, state.memory, seen.packet, seen.target, remaining, height)

    def _judge(self, state: GraspState, seen: GraspObservation) -> GraspState:
        gate, error = self._gate(state, seen)
        if gate != Gate.OPEN:
            return replace(state, gate=gate, remembered_error=error)
        duration = self._descent_duration(seen)
        if duration is None:
            return replace(state, gate=Gate.OUT_OF_REACH, remembered_error=error)
        return replace(state, gate=gate, remembered_error=error, descent_duration=duration)

    def _descent_duration(self, seen: GraspObservation) -> float | None:
        """Returns the duration of a descent that the arm can follow [s], None when there is none.

        An object that stands still can wait: where a joint is too slow for the normal descent, a slower one will do.
        """
        config = self.config
        durations = [config.descent_duration]
        if stands(seen.packet):
            durations.append(SLOWER * config.descent_duration)
        for duration in durations:
            if can_follow(
                config,
                self.model,
                self._ik_parameters,
                seen.q_commanded,
                seen.packet,
                seen.target.time - self.period,
                config.hover_height,
                seen.status.branch,
                duration,
            ):
                return duration
        return None

    def _gate(self, state: GraspState, seen: GraspObservation) -> tuple[Gate, float]:
        """Returns why the machine waits, and the largest lateral error [m] of the predictions that were judged."""
        config = self.config
        if state.phase != Phase.TRACK:
            return Gate.NOT_TRACKING, 0.0
        if seen.target.stale:
            return Gate.STALE, 0.0
        settling = self._elapsed(state, seen) < config.approach_duration + config.settle_time
        if settling or seen.status.fraction < 1.0:  # a target that jumped is approached anew within the phase
            return Gate.SETTLING, 0.0
        if seen.status.flipping:
            return Gate.FLIPPING, 0.0
        if horizon(config, seen.target) > PATH_DURATION:
            return Gate.OUT_OF_REACH, 0.0
        if config.gate == "probability":
            return judge_probability(config, state.memory, seen.target, state.likely, state.best), 0.0
        return judge_prediction(config, state.memory, seen.packet, seen.target)

    def enter(self, state: GraspState, phase: Phase, seen: GraspObservation) -> GraspState:
        """Returns the state at the beginning of a phase."""
        if phase == Phase.RETREAT:
            quick = self.config.descent == "guided" and state.phase not in BY_HAND
            state = replace(state, duration=GUIDED_RETREAT if quick else self.config.retreat_duration)
        state = replace(super().enter(state, phase, seen), followed=state.object)
        if phase in BY_HAND:
            return replace(self.stop(state, seen), branch=seen.status.branch)
        return replace(state, attempts=state.attempts + (phase == Phase.INTERCEPT))

    def _wide_open(self, state: GraspState, seen: GraspObservation) -> bool:
        """Returns whether the object still has room between the jaws, which have not touched it."""
        return min(state.jaw_width, seen.jaws.width) > self.config.object_width + WIDTH_TOLERANCE

    def _jaws_wait(self, state: GraspState, seen: GraspObservation) -> bool:
        """Returns whether closing jaws wait for a guided hand that catches up."""
        if self.config.descent != "guided" or state.phase != Phase.CLOSE or not self._wide_open(state, seen):
            return False
        late = abs(behind(seen.packet, seen.target).along) > CAUGHT_UP
        return late and self._elapsed(state, seen) < LONGEST_WAIT

    def _slew_jaws(self, state: GraspState, seen: GraspObservation) -> float:
        """Returns the opening of the jaws that is asked for next [m]."""
        if state.phase in BY_HAND:
            return state.jaw_width
        if self._jaws_wait(state, seen):
            return state.jaw_width
        goal = 0.0 if PROGRAMS[state.phase].jaws_closed else self.config.jaw_opening
        return next_opening(state.jaw_width, goal, self.config.jaw_speed, self.period)
