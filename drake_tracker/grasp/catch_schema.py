"""The motor schema of catching as a table (Nashman and Chaconas 1990, sections 2 and 5), in the manner of `schema.py`.

The hand waits with its cup beyond the middle of the board's bottom edge, follows the place where the ball will come
out, stands still when it comes, and raises the cup. The operator may stop it, or take it over, in every phase
(section 3: the operator interface is there to "observe, supervise, and directly control the system").
"""

from enum import IntEnum

from drake_tracker.arm.tool_motion import MotionFrame
from drake_tracker.grasp.motor_schema import Program


class CatchPhase(IntEnum):
    """Numbers of the phases, as logged."""

    WAIT = 0
    FOLLOW = 1
    SETTLE = 2
    CUP = 3
    RAISE = 4
    HOLD = 5
    STOPPED = 6
    MANUAL = 7


class OperatorMode(IntEnum):
    """First element of what the operator says."""

    SUPERVISE = 0
    STOP = 1
    TAKE_OVER = 2


def _program(frame, height, duration, frozen):
    return Program(frame, height, duration, jaws_closed=False, frozen=frozen)


CATCH_PROGRAMS = {
    CatchPhase.WAIT: _program(MotionFrame.HOME, "rim_height", "home_duration", frozen=False),
    CatchPhase.FOLLOW: _program(MotionFrame.OBJECT, "rim_height", "", frozen=False),
    CatchPhase.SETTLE: _program(MotionFrame.OBJECT, "rim_height", "", frozen=False),
    CatchPhase.CUP: _program(MotionFrame.OBJECT, "rim_height", "", frozen=False),
    CatchPhase.RAISE: _program(MotionFrame.HELD, "raised_height", "raise_duration", frozen=True),
    CatchPhase.HOLD: _program(MotionFrame.HELD, "raised_height", "raise_duration", frozen=True),
    CatchPhase.STOPPED: _program(MotionFrame.OBJECT, "", "stop_duration", frozen=True),
    CatchPhase.MANUAL: _program(MotionFrame.OBJECT, "", "", frozen=True),
}
"""An empty duration is that which the way to the goal takes; an empty height is none: the goal is the tool's own."""

CATCH_SAME_MOTION = {
    (CatchPhase.FOLLOW, CatchPhase.SETTLE),
    (CatchPhase.SETTLE, CatchPhase.FOLLOW),
    (CatchPhase.SETTLE, CatchPhase.CUP),
    (CatchPhase.CUP, CatchPhase.FOLLOW),
    (CatchPhase.RAISE, CatchPhase.HOLD),
}
"""Changes of phase that leave the motion under way as it is."""

_BY_THE_OPERATOR = (("operator_stops", CatchPhase.STOPPED), ("operator_takes_over", CatchPhase.MANUAL))

CATCH_TRANSITIONS = {
    CatchPhase.WAIT: (*_BY_THE_OPERATOR, ("ball_comes", CatchPhase.FOLLOW)),
    CatchPhase.FOLLOW: (
        *_BY_THE_OPERATOR,
        ("ball_lost", CatchPhase.WAIT),
        ("about_to_arrive", CatchPhase.SETTLE),
    ),
    CatchPhase.SETTLE: (
        *_BY_THE_OPERATOR,
        ("arrives_elsewhere", CatchPhase.FOLLOW),
        ("arrives_later", CatchPhase.FOLLOW),
        ("arrived", CatchPhase.CUP),
    ),
    CatchPhase.CUP: (*_BY_THE_OPERATOR, ("arrives_later", CatchPhase.FOLLOW), ("at_rest", CatchPhase.RAISE)),
    CatchPhase.RAISE: (*_BY_THE_OPERATOR, ("raised", CatchPhase.HOLD)),
    CatchPhase.HOLD: _BY_THE_OPERATOR,
    CatchPhase.STOPPED: (("operator_takes_over", CatchPhase.MANUAL), ("operator_lets_go", CatchPhase.WAIT)),
    CatchPhase.MANUAL: (("operator_stops", CatchPhase.STOPPED), ("operator_lets_go", CatchPhase.WAIT)),
}
"""From each phase, the conditions that are asked in this order and the phase that each leads to."""
