"""The motor schema of grasping as a table (Allen et al. 1991, section 5).

A skilled action is "an ordered set of parametrized motor control programs of short duration". Each phase is one such
program: where the hand moves and for how long, what the jaws do, whether vision is used. `TRANSITIONS` has the
conditions for the change of phase; these conditions are methods of `GraspMachine`. The operator can stop the hand, or
take control of it, in every phase.
"""

from enum import IntEnum

from drake_tracker.arm.motion.tool_motion import MotionFrame
from drake_tracker.grasp.motor_schema import Program
from drake_tracker.grasp.operator_override import operated


class Phase(IntEnum):
    """Numbers of the phases, as logged."""

    ACQUIRE = 0
    TRACK = 1
    INTERCEPT = 2
    CLOSE = 3
    LIFT = 4
    HOLD = 5
    RETREAT = 6
    HOVER = 7
    STOPPED = 8
    MANUAL = 9


PROGRAMS = {
    Phase.ACQUIRE: Program(MotionFrame.HOME, "hover_height", "retreat_duration", jaws_closed=False, blind=False),
    Phase.TRACK: Program(MotionFrame.OBJECT, "hover_height", "approach_duration", jaws_closed=False, blind=False),
    Phase.INTERCEPT: Program(MotionFrame.OBJECT, "grasp_height", "descent_duration", jaws_closed=False, blind=True),
    Phase.CLOSE: Program(MotionFrame.OBJECT, "grasp_height", "descent_duration", jaws_closed=True, blind=True),
    Phase.LIFT: Program(MotionFrame.HELD, "lift_height", "lift_duration", jaws_closed=True, blind=True),
    Phase.HOLD: Program(MotionFrame.HELD, "lift_height", "lift_duration", jaws_closed=True, blind=True),
    Phase.RETREAT: Program(MotionFrame.HELD, "hover_height", "retreat_duration", jaws_closed=False, blind=True),
    Phase.HOVER: Program(MotionFrame.HELD, "hover_height", "approach_duration", jaws_closed=False, blind=False),
    Phase.STOPPED: Program(MotionFrame.GOAL, "", "stop_duration", jaws_closed=False, blind=True),
    Phase.MANUAL: Program(MotionFrame.GOAL, "", "", jaws_closed=False, blind=True),
}
"""The program of the arm in each phase; heights and durations are fields of `GraspConfig`. An empty height is the
height of the goal, an empty duration the time for the distance to the goal. In `BY_HAND` the jaws stay as they are."""

BY_HAND = (Phase.STOPPED, Phase.MANUAL)
"""Phases in which the operator decides."""

SAME_MOTION = {(Phase.INTERCEPT, Phase.CLOSE), (Phase.LIFT, Phase.HOLD)}
"""Changes of phase during which the motion under way goes on."""

TRANSITIONS = operated(
    {
        Phase.ACQUIRE: (("object_seen", Phase.TRACK),),
        Phase.TRACK: (
            ("object_lost", Phase.ACQUIRE),
            ("object_changed", Phase.TRACK),
            ("must_hold", Phase.HOVER),
            ("link_silent", Phase.HOVER),
            ("may_intercept", Phase.INTERCEPT),
        ),
        Phase.INTERCEPT: (("success_unlikely", Phase.RETREAT), ("time_to_close", Phase.CLOSE)),
        Phase.CLOSE: (
            ("jaws_empty", Phase.RETREAT),
            ("jaws_hold", Phase.LIFT),
            ("misses_before_touch", Phase.RETREAT),
        ),
        Phase.LIFT: (("jaws_empty", Phase.RETREAT), ("lift_done", Phase.HOLD)),
        Phase.HOLD: (("jaws_empty", Phase.RETREAT),),
        Phase.RETREAT: (("retreat_done", Phase.ACQUIRE),),
        Phase.HOVER: (("object_seen", Phase.TRACK),),
    },
    stopped=Phase.STOPPED,
    manual=Phase.MANUAL,
    after=(("lets_go_of_full_jaws", Phase.HOLD), ("operator_lets_go", Phase.RETREAT)),
)
"""From each phase, the conditions in the order in which they are asked, and the phase that each leads to."""
