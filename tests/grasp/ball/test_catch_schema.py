import pytest

from drake_tracker.arm.motion.tool_motion import MotionFrame
from drake_tracker.grasp.ball.catch_machine import CatchMachine
from drake_tracker.grasp.ball.catch_schema import CATCH_PROGRAMS, CATCH_SAME_MOTION, CATCH_TRANSITIONS, CatchPhase
from drake_tracker.grasp.config import CatchConfig


def successors(phase):
    return [after for _, after in CATCH_TRANSITIONS[phase]]


def test_every_phase_has_a_program_and_transitions():
    assert set(CATCH_PROGRAMS) == set(CATCH_TRANSITIONS) == set(CatchPhase)


@pytest.mark.parametrize("phase", CatchPhase)
def test_every_name_in_the_tables_exists(phase):
    program = CATCH_PROGRAMS[phase]
    for name in filter(None, (program.height, program.duration)):
        assert isinstance(getattr(CatchConfig(), name), float)
    for condition, _ in CATCH_TRANSITIONS[phase]:
        assert callable(getattr(CatchMachine, condition))


def test_every_phase_can_be_reached_from_waiting():
    reached, queue = set(), [CatchPhase.WAIT]
    while queue:
        phase = queue.pop()
        if phase not in reached:
            reached.add(phase)
            queue += successors(phase)
    assert reached == set(CatchPhase)


@pytest.mark.parametrize("phase", CatchPhase)
def test_the_operator_is_asked_first_in_every_phase(phase):
    asked = [condition for condition, _ in CATCH_TRANSITIONS[phase]]
    assert all(condition.startswith("operator_") for condition in asked[:2])
    wanted = {CatchPhase.STOPPED, CatchPhase.MANUAL} - {phase}
    assert wanted <= set(successors(phase)[:2])


def test_a_raised_cup_stays_up_unless_the_operator_intervenes():
    assert set(successors(CatchPhase.HOLD)) == {CatchPhase.STOPPED, CatchPhase.MANUAL}
    for phase in (CatchPhase.RAISE, CatchPhase.HOLD):
        assert CATCH_PROGRAMS[phase].frame == MotionFrame.HELD


def test_phases_that_share_a_motion_agree_on_it():
    for before, after in CATCH_SAME_MOTION:
        assert after in successors(before)
        one, other = CATCH_PROGRAMS[before], CATCH_PROGRAMS[after]
        assert (one.frame, one.height, one.duration) == (other.frame, other.height, other.duration)
