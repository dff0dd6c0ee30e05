"""The motor schema of picking and placing as a table, with the state and the inputs of the pick machine.

Each order names a part on the belt and the cell that it belongs in. The hand goes above the part, descends and closes
while both move, lifts the part, carries it to its cell, puts it down there and comes back.
"""

import math
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any

import numpy as np

from drake_tracker.arm.motion.tool_motion import MotionFrame
from drake_tracker.core.frozen_state import read_only
from drake_tracker.core.messages import PickOrder, message_size
from drake_tracker.grasp.gate import Gate
from drake_tracker.grasp.motor_schema import Program
from drake_tracker.grasp.operator_override import OperatedState, operated


class PickPhase(IntEnum):
    """Numbers of the phases, as logged."""

    WAIT = 0
    TRACK = 1
    INTERCEPT = 2
    CLOSE = 3
    LIFT = 4
    CARRY = 5
    LOWER = 6
    RELEASE = 7
    RAISE = 8
    RETREAT = 9
    STOPPED = 10
    MANUAL = 11


_GOAL = MotionFrame.GOAL
PICK_PROGRAMS = {
    PickPhase.WAIT: Program(MotionFrame.HOME, "hover_height", "", jaws_closed=False, blind=False),
    PickPhase.TRACK: Program(MotionFrame.OBJECT, "hover_height", "", jaws_closed=False, blind=False),
    PickPhase.INTERCEPT: Program(
        MotionFrame.OBJECT, "grasp_height", "descent_duration", jaws_closed=False, blind=False
    ),
    PickPhase.CLOSE: Program(MotionFrame.OBJECT, "grasp_height", "descent_duration", jaws_closed=True, blind=False),
    PickPhase.LIFT: Program(MotionFrame.HELD, "lift_height", "lift_duration", jaws_closed=True, blind=True),
    PickPhase.CARRY: Program(_GOAL, "carry_height", "", jaws_closed=True, blind=True),
    PickPhase.LOWER: Program(_GOAL, "place_height", "lower_duration", jaws_closed=True, blind=True),
    PickPhase.RELEASE: Program(_GOAL, "place_height", "release_duration", jaws_closed=False, blind=True),
    PickPhase.RAISE: Program(_GOAL, "carry_height", "raise_duration", jaws_closed=False, blind=True),
    PickPhase.RETREAT: Program(MotionFrame.HELD, "hover_height", "retreat_duration", jaws_closed=False, blind=True),
    PickPhase.STOPPED: Program(_GOAL, "", "stop_duration", jaws_closed=False, blind=True),
    PickPhase.MANUAL: Program(_GOAL, "", "", jaws_closed=False, blind=True),
}
"""The program of the arm in each phase; heights and durations are fields of `PickConfig`. An empty height is the height
of the goal, an empty duration the time for the distance. In `BY_HAND` the jaws stay as they are."""

BY_HAND = (PickPhase.STOPPED, PickPhase.MANUAL)
"""Phases in which the operator decides."""
SAME_MOTION = {(PickPhase.INTERCEPT, PickPhase.CLOSE), (PickPhase.LOWER, PickPhase.RELEASE)}
"""Changes of phase during which the motion under way goes on."""
LEAVING = (PickPhase.RELEASE, PickPhase.RAISE)
"""Phases in which the fingers are among the parts of the neighbouring cells: the jaws do not open fully."""
ABOVE_CELL = (PickPhase.CARRY, PickPhase.RAISE)
"""Phases in which the hand is higher than a belt that rises beside the cell."""
FOLLOWING = (PickPhase.INTERCEPT, PickPhase.CLOSE)
"""Phases in which the hand follows vision without leaving the part."""

PICK_TRANSITIONS = operated(
    {
        PickPhase.WAIT: (("order_waits", PickPhase.TRACK),),
        PickPhase.TRACK: (
            ("order_withdrawn", PickPhase.WAIT),
            ("part_lost", PickPhase.WAIT),
            ("may_descend", PickPhase.INTERCEPT),
        ),
        PickPhase.INTERCEPT: (("success_unlikely", PickPhase.RETREAT), ("time_to_close", PickPhase.CLOSE)),
        PickPhase.CLOSE: (("jaws_empty", PickPhase.RETREAT), ("jaws_hold", PickPhase.LIFT)),
        PickPhase.LIFT: (("jaws_empty", PickPhase.RETREAT), ("motion_done", PickPhase.CARRY)),
        PickPhase.CARRY: (
            ("jaws_empty", PickPhase.RETREAT),
            ("arrived", PickPhase.LOWER),
            ("kept_away", PickPhase.CARRY),
        ),
        PickPhase.LOWER: (("arrived", PickPhase.RELEASE), ("kept_away", PickPhase.CARRY)),
        PickPhase.RELEASE: (("released", PickPhase.RAISE),),
        PickPhase.RAISE: (("motion_done", PickPhase.WAIT),),
        PickPhase.RETREAT: (("motion_done", PickPhase.WAIT),),
    },
    stopped=PickPhase.STOPPED,
    manual=PickPhase.MANUAL,
    after=(("lets_go_of_full_jaws", PickPhase.CARRY), ("operator_lets_go", PickPhase.RETREAT)),
)
"""From each phase, the conditions in the order in which they are asked, and the phase that each leads to."""


_NO_ORDER = read_only(np.zeros(message_size(PickOrder)))


@dataclass(frozen=True, kw_only=True)
class PickState(OperatedState):
    """All that the machine remembers.

    Attributes:
        phase: the phase.
        order: the `PickOrder` vector in work, read-only; all zeros without one.
        done: number of the last job that was done or failed.
        gripped_since: time since when the jaws have measured a grip [s], infinity while they do not.
        attempts: number of picks begun.
        picked: number of parts that the jaws held after the lift.
        placed: number of parts put down.
        failed: number of orders that failed.
        carried: number of the last job whose part the hand began to carry.
        put_down: number of the last job whose part the jaws let go in its cell.
        gate: why the hand waits above a part.
        p_success: probability that a pick would succeed.
        branch: half turns of the jaws when they took the part, or when the operator took control.
    """

    phase: PickPhase = PickPhase.WAIT
    order: np.ndarray = field(default_factory=lambda: _NO_ORDER)
    done: int = 0
    gripped_since: float = math.inf
    attempts: int = 0
    picked: int = 0
    placed: int = 0
    failed: int = 0
    carried: int = 0
    put_down: int = 0
    gate: Gate = Gate.NOT_TRACKING
    p_success: float = 0.0
    branch: float = 0.0


@dataclass(frozen=True)
class PickObservation:
    """The inputs of the arm's computer at a tick.

    Attributes:
        time: time of the tick [s].
        target: a `ServoTarget`.
        packet: the `Prediction` vector on which the target rests.
        order: the newest `PickOrder`.
        jaws: a `JawState`.
        status: a `ToolStatus`.
        arm_state: measured joint positions and velocities, shape (2 n,) [rad, rad/s].
        operator: an `OperatorCommand`.
    """

    time: float
    target: Any
    packet: np.ndarray
    order: Any
    jaws: Any
    status: Any
    arm_state: np.ndarray
    operator: Any
