"""The motor schema of catching as a table (Nashman and Chaconas 1990, sections 2 and 5), like `schema.py`.

The hand waits with its cup beyond the middle of the board's bottom edge, follows the place where the ball will leave
the board, stands still when it arrives, and raises the cup. The operator can stop the hand, or take control of it, in
every phase (section 3: the operator interface is there to "observe, supervise, and directly control the system").
"""

from enum import IntEnum

from drake_tracker.arm.motion.tool_motion import MotionFrame
from drake_tracker.grasp.motor_schema import Program
from drake_tracker.grasp.operator_override import operated


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


def _program(frame: MotionFrame, height: str, duration: str, blind: bool) -> Program:
    """Returns a program of a hand without jaws."""
    return Program(frame, height, duration, jaws_closed=False, blind=blind)


CATCH_PROGRAMS = {
    CatchPhase.WAIT: _program(MotionFrame.HOME, "rim_height", "home_duration", blind=False),
    CatchPhase.FOLLOW: _program(MotionFrame.OBJECT, "rim_height", "", blind=False),
    CatchPhase.SETTLE: _program(MotionFrame.OBJECT, "rim_height", "", blind=False),
    CatchPhase.CUP: _program(MotionFrame.OBJECT, "rim_height", "", blind=False),
    CatchPhase.RAISE: _program(MotionFrame.HELD, "raised_height", "raise_duration", blind=True),
    CatchPhase.HOLD: _program(MotionFrame.HELD, "raised_height", "raise_duration", blind=True),
    CatchPhase.STOPPED: _program(MotionFrame.OBJECT, "", "stop_duration", blind=True),
    CatchPhase.MANUAL: _program(MotionFrame.OBJECT, "", "", blind=True),
}
"""The program of the arm in each phase; heights and durations are fields of `CatchConfig`. An empty duration is the
time for the distance to the goal. An empty height is zero, because the goal is a pose of the tool itself."""

CATCH_SAME_MOTION = {
    (CatchPhase.FOLLOW, CatchPhase.SETTLE),
    (CatchPhase.SETTLE, CatchPhase.FOLLOW),
    (CatchPhase.SETTLE, CatchPhase.CUP),
    (CatchPhase.CUP, CatchPhase.FOLLOW),
    (CatchPhase.RAISE, CatchPhase.HOLD),
}
"""Changes of phase during which the motion under way goes on."""

CATCH_TRANSITIONS = operated(
    {
        CatchPhase.WAIT: (("ball_comes", CatchPhase.FOLLOW),),
        CatchPhase.FOLLOW: (("ball_lost", CatchPhase.WAIT), ("about_to_arrive", CatchPhase.SETTLE)),
        CatchPhase.SETTLE: (
            ("arrives_elsewhere", CatchPhase.FOLLOW),
            ("arrives_later", CatchPhase.FOLLOW),
            ("arrived", CatchPhase.CUP),
        ),
        CatchPhase.CUP: (("arrives_later", CatchPhase.FOLLOW), ("at_rest", CatchPhase.RAISE)),
        CatchPhase.RAISE: (("raised", CatchPhase.HOLD),),
        CatchPhase.HOLD: (),
    },
    stopped=CatchPhase.STOPPED,
    manual=CatchPhase.MANUAL,
    after=(("operator_lets_go", CatchPhase.WAIT),),
)
"""From each phase, the conditions in the order in which they are asked, and the phase that each leads to."""
