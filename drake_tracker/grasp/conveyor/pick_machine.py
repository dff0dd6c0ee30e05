"""The pick machine: runs the motor schema of `pick_schema.py` on the orders of the host."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.special import ndtr

from drake_tracker.arm.arm_model import ArmModel
from drake_tracker.arm.motion.transform_equation import LEVEL, Slope
from drake_tracker.core.frozen_state import read_only
from drake_tracker.core.messages import Frozen, PickOrder, evaluate_prediction, packet_target
from drake_tracker.core.part_kinds import PART_SHAPES
from drake_tracker.grasp.config import PickConfig, closing_time
from drake_tracker.grasp.conveyor.pick_motions import PickMotions
from drake_tracker.grasp.conveyor.pick_schema import (
    ABOVE_CELL,
    BY_HAND,
    FOLLOWING,
    LEAVING,
    PICK_PROGRAMS,
    PICK_TRANSITIONS,
    SAME_MOTION,
    PickObservation,
    PickPhase,
    PickState,
)
from drake_tracker.grasp.descent import BESIDE, RESPONSE, behind, calibrated, miss
from drake_tracker.grasp.gate import Gate
from drake_tracker.grasp.jaws import GRIP_CONFIRMED, closed_on_nothing, feels_grip, next_opening
from drake_tracker.grasp.motor_schema import since
from drake_tracker.grasp.operator_override import OperatedMachine, Pace, resting_target

ALONG_JAWS = 0.014
"""Largest error along the jaws at which two pairs of pads still hold a part [m]."""
ROUNDED = 0.004
"""Error beyond the room between part and jaws up to which the pads, whose radius is 6 mm, still push a part on a belt
between them [m]; chosen on 570 descents to boxes and discs, `benchmarks/launches.py` with seeds 82100 to 82169."""
SUREST = 0.9999
"""Largest probability that a normal error may give; misses that are rarer come from the belt's changes of speed."""
TOGETHER = 0.006
"""Distance [m] from the part up to which the jaws may close."""
LONGEST_WAIT = 0.2
"""Longest time for which the jaws wait for the hand to catch up [s]."""
LARGEST_YAW = 1e3
"""Largest direction of a place [rad]."""


class PickMachine(OperatedMachine[PickState, PickObservation]):
    """Arithmetic of the pick machine.

    Args:
        config: heights, durations, and conditions of the descent.
        model: the controller's model of the arm.
        period: time between ticks [s].
        home: reference (x, y, z, yaw) in W over which the hand waits, shape (4,) [m, rad].
        places: lowest and highest corner in W of the box in which parts may be put down, shape (2, 3) [m].
        slope: of the belt, which is as high as the floors of the cells at W's x axis.
    """

    config: PickConfig

    def __init__(
        self,
        config: PickConfig,
        model: ArmModel,
        period: float,
        home: np.ndarray,
        places: np.ndarray,
        slope: Slope = LEVEL,
    ) -> None:
        super().__init__(config, PICK_PROGRAMS, PICK_TRANSITIONS, SAME_MOTION)
        self.slope = slope
        self.motions = PickMotions(config, model)
        self.period, self.home, self.places = period, np.asarray(home, dtype=float), np.asarray(places, dtype=float)

    def initial_state(self) -> PickState:
        """Returns the state of a hand that waits with open jaws."""
        return PickState(jaw_width=self.config.jaw_opening, duration=self.config.shortest_motion)

    def update(self, state: PickState, seen: PickObservation) -> PickState:
        """Returns the state after a tick."""
        order = PickOrder(state.order)
        gripping = bool(order.valid) and feels_grip(seen.jaws, order.width, self.config.grip_force)
        state = replace(state, gripped_since=min(state.gripped_since, seen.time) if gripping else math.inf)
        if state.phase == PickPhase.WAIT and self._is_new(state, seen.order):
            state = replace(state, order=read_only(np.array(seen.order[:])))
        state = replace(state, p_success=self._probability(state, seen))
        state = replace(state, gate=self._gate(state, seen))
        state = self.advance(state, seen)
        if state.phase == PickPhase.MANUAL:
            state = self.obey(state, seen)
        return self.with_tool(replace(state, jaw_width=self._slew_jaws(state)), seen)

    def height(self, state: PickState) -> float:
        """Returns the height of the tool above the origin of the part or of its cell [m]."""
        if state.phase in BY_HAND:
            return 0.0
        return super().height(state) + (self._rise(state) if state.phase in ABOVE_CELL else 0.0)

    def frozen(self, state: PickState) -> Frozen:
        """Returns the reference frame of the motion. The hand follows vision until the jaws hold the part."""
        return Frozen.GUIDED if state.phase in FOLLOWING else super().frozen(state)

    def duration(self, state: PickState) -> float:
        """Returns the duration of the motion [s]."""
        if not PICK_PROGRAMS[state.phase].duration:
            return state.duration
        duration = super().duration(state)
        if state.phase in (PickPhase.LOWER, PickPhase.RAISE):  # with the same acceleration
            way = self.config.carry_height - self.config.place_height
            duration *= math.sqrt(1.0 + self._rise(state) / way)
        return duration

    def goal_target(self, state: PickState) -> np.ndarray:
        """Returns the `ServoTarget` vector of the goal: the place of the part, or where the operator wants the tool."""
        x, y, z, yaw = state.goal
        turn = math.pi * state.branch
        return resting_target(state.entered, np.array([x, y, z, yaw - turn]))

    def pace(self, state: PickState) -> Pace:
        """Returns how the hand moves under the operator's control."""
        return Pace(self.config.manual_speed, self.config.hand_acceleration, self.config.shortest_motion, 0.0005)

    def enter(self, state: PickState, phase: PickPhase, seen: PickObservation) -> PickState:
        """Returns the state at the beginning of a phase."""
        state = super().enter(state, phase, seen)
        if phase in BY_HAND:
            return replace(self.stop(state, seen), branch=seen.status.branch)
        order = PickOrder(state.order)
        if phase == PickPhase.INTERCEPT:
            state = replace(state, attempts=state.attempts + 1)
        elif phase == PickPhase.CARRY:
            picked = state.picked + (order.job != state.carried)  # once, even if the operator interrupts
            state = replace(state, picked=picked, carried=int(order.job), branch=seen.status.branch)
            state = self._towards_cell(state, seen)
        elif phase == PickPhase.RELEASE:
            placed = state.placed + (order.job != state.put_down)
            state = replace(state, placed=placed, put_down=int(order.job))
        elif phase == PickPhase.TRACK:
            target = seen.target
            p_WP = np.array([target.x, target.y, target.z])
            v_WP = np.array([target.vx, target.vy, target.vz])
            wrist = self.motions.unwound(p_WP, target.yaw, seen)
            state = replace(state, duration=self._duration(state, p_WP, wrist, v_WP, seen))
        elif phase == PickPhase.WAIT:
            failed = order.job > state.done and order.job != state.put_down
            wrist = self.motions.unwound(self.home[:3], self.home[3], seen)
            duration = self._duration(state, self.home[:3], wrist, np.zeros(3), seen)
            state = replace(state, failed=state.failed + failed, done=int(order.job), duration=duration)
        return state

    # Conditions of PICK_TRANSITIONS: questions about the state and what is seen.

    def order_waits(self, state: PickState, seen: PickObservation) -> bool:
        """Returns whether there is an order that was not yet carried out, and packets about its part."""
        return PickOrder(state.order).job > state.done and self._about_order(state, seen)

    def order_withdrawn(self, state: PickState, seen: PickObservation) -> bool:
        """Returns whether the host has replaced or cancelled the order."""
        return bool(seen.order.job != PickOrder(state.order).job) or not seen.order.number

    def part_lost(self, state: PickState, seen: PickObservation) -> bool:
        """Returns whether the part cannot be followed."""
        return not seen.target.valid

    def may_descend(self, state: PickState, seen: PickObservation) -> bool:
        """Returns whether nothing holds the hand back."""
        return state.gate == Gate.OPEN

    def success_unlikely(self, state: PickState, seen: PickObservation) -> bool:
        """Returns whether the descent is no longer worth while."""
        return state.p_success < self.config.abort_probability

    def time_to_close(self, state: PickState, seen: PickObservation) -> bool:
        """Returns whether the jaws should begin to close. They wait for a hand that catches up."""
        late = self._elapsed(state, seen) - (self.config.descent_duration - self.config.closing_lead)
        if 0.0 <= late < LONGEST_WAIT:
            offset = behind(seen.packet, seen.target)
            return math.hypot(offset.across, offset.along) <= TOGETHER
        return late >= 0.0

    def jaws_hold(self, state: PickState, seen: PickObservation) -> bool:
        """Returns whether the grip is confirmed."""
        return since(state.gripped_since, seen.time) >= GRIP_CONFIRMED

    def jaws_empty(self, state: PickState, seen: PickObservation) -> bool:
        """Returns whether the jaws have closed on nothing, or have found no grip in time."""
        if closed_on_nothing(seen.jaws, PickOrder(state.order).width):
            return True
        return state.phase == PickPhase.CLOSE and self._elapsed(state, seen) > self.config.close_timeout

    def lets_go_of_full_jaws(self, state: PickState, seen: PickObservation) -> bool:
        """Returns whether the operator only supervises, and the jaws hold a part."""
        return self.operator_lets_go(state, seen) and self.jaws_hold(state, seen)

    def motion_done(self, state: PickState, seen: PickObservation) -> bool:
        """Returns whether the motion of the phase is over."""
        return self._elapsed(state, seen) >= self.duration(state)

    def arrived(self, state: PickState, seen: PickObservation) -> bool:
        """Returns whether the motion of the phase is over, and the measured tool is where it was commanded to be.

        A limit of a joint, or something that the arm has run into, may keep it away.
        """
        if not self.motion_done(state, seen):
            return False
        place, yaw = self.motions.measured_tool(seen)
        commanded = np.array([seen.status.x, seen.status.y, seen.status.z])
        near = float(np.linalg.norm(place - commanded)) <= self.config.place_tolerance
        return near and abs(yaw - seen.status.yaw) <= math.radians(self.config.place_turn_tolerance_deg)

    def kept_away(self, state: PickState, seen: PickObservation) -> bool:
        """Returns whether the tool has not arrived in time."""
        return self._elapsed(state, seen) >= self.duration(state) + self.config.place_timeout

    def released(self, state: PickState, seen: PickObservation) -> bool:
        """Returns whether the jaws have had the time to open."""
        return self._elapsed(state, seen) >= self.config.release_duration

    # Parts of a tick.

    def _is_new(self, state: PickState, order: Any) -> bool:
        """Returns whether there is a new order that the hand may carry out."""
        newer = order.job > max(PickOrder(state.order).job, state.done)
        return newer and may_carry_out(order, self.places, self.config.jaw_opening)

    @staticmethod
    def _about_order(state: PickState, seen: PickObservation) -> bool:
        return bool(seen.target.valid) and packet_target(seen.target.seq) == int(PickOrder(state.order).number)

    def _remaining(self, state: PickState, seen: PickObservation) -> float:
        """Returns the time until the pads touch [s], if the descent began now or is under way."""
        closing = closing_time(self.config, PickOrder(state.order).width)
        if state.phase == PickPhase.CLOSE:
            return closing - self._elapsed(state, seen)
        whole = self.config.descent_duration - self.config.closing_lead + closing
        return max(whole - self._elapsed(state, seen), closing) if state.phase == PickPhase.INTERCEPT else whole

    def _probability(self, state: PickState, seen: PickObservation) -> float:
        """Returns the probability that the pads come down beside the part, or push it between them.

        The prediction has the same normal error across and along the jaws. Vision is followed until shortly before the
        touch. The error is therefore the error of a prediction over its age and `RESPONSE`. The result is `calibrated`.
        """
        order = PickOrder(state.order)
        if not (order.valid and self._about_order(state, seen)):
            return 0.0
        beside = seen.status.z - seen.target.z <= BESIDE
        offset = miss(seen.packet, seen.target, self._remaining(state, seen), beside)
        std = evaluate_prediction(seen.packet, seen.target.time + RESPONSE)[4]
        room = 0.5 * (self.config.jaw_opening - order.width) + ROUNDED
        computed = _within(room, offset.across, std) * _within(ALONG_JAWS, offset.along, std)
        return calibrated(min(computed, SUREST), "belt")

    def _gate(self, state: PickState, seen: PickObservation) -> Gate:
        if state.phase != PickPhase.TRACK:
            return Gate.NOT_TRACKING
        if seen.target.stale:
            return Gate.STALE
        if seen.status.fraction < 1.0 or self._elapsed(state, seen) < state.duration:
            return Gate.SETTLING
        if seen.status.flipping:
            return Gate.FLIPPING
        return Gate.OPEN if state.p_success >= self.config.launch_probability else Gate.SUCCESS_UNLIKELY

    def _towards_cell(self, state: PickState, seen: PickObservation) -> PickState:
        """Returns the state of a hand that carries its part to the cell of the order."""
        order = PickOrder(state.order)
        place = np.array([order.place_x, order.place_y, order.place_z])
        yaw = self.motions.place_yaw(order, place, seen)
        state = replace(state, goal=read_only(np.array([*place, yaw])))
        duration = self._duration(state, place, self.motions.wrist_at(place, yaw, seen), np.zeros(3), seen)
        return replace(state, duration=duration)

    def _rise(self, state: PickState) -> float:
        """Returns by how much a belt that rises is higher than the floor of the cell, beside it [m]."""
        return max(float(np.dot(self.slope, state.goal[:2])), 0.0)

    def _duration(
        self, state: PickState, p_WO: np.ndarray, wrist: float, v_WO: np.ndarray, seen: PickObservation
    ) -> float:
        """Returns the duration of a motion from here to the height of the phase above a place [s].

        Args:
            state: at the beginning of the phase.
            p_WO: the place now, shape (3,) [m].
            wrist: angle of the last joint there [rad].
            v_WO: velocity of the place, shape (3,) [m/s].
            seen: the inputs of the arm's computer.
        """
        tool, v_WT = self._tool(state, seen)
        displacement = p_WO + [0.0, 0.0, self.height(state)] - tool[:3]
        return self.motions.duration(displacement, wrist, v_WT[:3], v_WO, seen)

    def _slew_jaws(self, state: PickState) -> float:
        """Returns the opening of the jaws that is asked for next [m]."""
        if state.phase in BY_HAND:
            return state.jaw_width
        goal = 0.0 if PICK_PROGRAMS[state.phase].jaws_closed else self.config.jaw_opening
        if state.phase in LEAVING:
            goal = min(float(PickOrder(state.order).width) + self.config.release_gap, goal)
        return next_opening(state.jaw_width, goal, self.config.jaw_speed, self.period)


def _within(limit: float, centre: float, std: float) -> float:
    """Returns the probability that the magnitude of a normal error is below a limit."""
    if std <= 0.0:
        return float(abs(centre) <= limit)
    return float(ndtr((limit - centre) / std) - ndtr((-limit - centre) / std))


def may_carry_out(order: Any, places: np.ndarray, jaw_opening: float) -> bool:
    """Returns whether a hand may carry out an order. Any other order is ignored, as if it had not arrived.

    Every number is finite; there is a part of a known kind, which fits between the open jaws; and its place is where
    parts may be put down.

    Args:
        order: a `PickOrder`.
        places: lowest and highest corner in W of the box in which parts may be put down, shape (2, 3) [m].
        jaw_opening: opening of the jaws before the pick [m].
    """
    if not np.isfinite(order[:]).all() or order.valid != 1.0 or order.number <= 0.0:
        return False
    place = np.array([order.place_x, order.place_y, order.place_z])
    return bool(
        order.kind in PART_SHAPES
        and 0.0 < order.width < jaw_opening
        and abs(order.place_yaw) <= LARGEST_YAW
        and (place >= places[0]).all()
        and (place <= places[1]).all()
    )
