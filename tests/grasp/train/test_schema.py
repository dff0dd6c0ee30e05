import re
from pathlib import Path

import pytest

from drake_tracker.arm.motion.tool_motion import MotionFrame
from drake_tracker.grasp.config import GraspConfig
from drake_tracker.grasp.train.grasp_machine import GraspMachine
from drake_tracker.grasp.train.schema import BY_HAND, PROGRAMS, SAME_MOTION, TRANSITIONS, Phase


def successors(phase):
    return [after for _, after in TRANSITIONS[phase]]


def test_every_phase_has_a_program_and_transitions():
    assert set(PROGRAMS) == set(TRANSITIONS) == set(Phase)


@pytest.mark.parametrize("phase", Phase)
def test_every_name_in_the_tables_exists(phase):
    program = PROGRAMS[phase]
    for name in filter(None, (program.height, program.duration)):
        assert isinstance(getattr(GraspConfig(), name), float)
    for condition, _ in TRANSITIONS[phase]:
        assert callable(getattr(GraspMachine, condition))


def test_every_phase_can_be_reached_and_left():
    reached, queue = set(), [Phase.ACQUIRE]
    while queue:
        phase = queue.pop()
        if phase not in reached:
            reached.add(phase)
            queue += successors(phase)
    assert reached == set(Phase)
    assert all(successors(phase) for phase in Phase)


def test_a_miss_is_checked_before_success():
    for phase in (Phase.CLOSE, Phase.LIFT, Phase.HOLD):
        assert TRANSITIONS[phase][2] == ("jaws_empty", Phase.RETREAT)


@pytest.mark.parametrize("phase", Phase)
def test_the_operator_is_asked_first_in_every_phase(phase):
    wanted = {"operator_stops": Phase.STOPPED, "operator_takes_over": Phase.MANUAL}
    asked = {condition: after for condition, after in wanted.items() if after != phase}
    assert TRANSITIONS[phase][: len(asked)] == tuple(asked.items())


def test_vision_is_not_used_from_the_descent_until_the_hand_is_out_of_the_way():
    blind = {phase for phase in Phase if PROGRAMS[phase].blind}
    assert blind == {Phase.INTERCEPT, Phase.CLOSE, Phase.LIFT, Phase.HOLD, Phase.RETREAT, *BY_HAND}


def test_the_jaws_are_closed_from_closing_to_holding_and_open_otherwise():
    closed = {phase for phase in Phase if PROGRAMS[phase].jaws_closed}
    assert closed == {Phase.CLOSE, Phase.LIFT, Phase.HOLD}


def test_the_hand_moves_with_the_object_until_it_holds_it_and_then_straight_up():
    for phase in (Phase.TRACK, Phase.INTERCEPT, Phase.CLOSE):
        assert PROGRAMS[phase].frame == MotionFrame.OBJECT
    for phase in (Phase.LIFT, Phase.HOLD, Phase.RETREAT, Phase.HOVER):
        assert PROGRAMS[phase].frame == MotionFrame.HELD


def test_phases_that_share_a_motion_agree_on_it():
    for before, after in SAME_MOTION:
        assert after in successors(before)
        one, other = PROGRAMS[before], PROGRAMS[after]
        assert (one.frame, one.height, one.duration) == (other.frame, other.height, other.duration)


def test_the_state_diagram_shows_every_phase_and_transition():
    text = (Path(__file__).parents[3] / "docs" / "diagrams" / "arm_phases.dot").read_text(encoding="utf-8")
    drawn = re.findall(r'(\w+) -> (\w+) \[tooltip="(\w+)"', text)
    table = [
        (phase.name, after.name, name)
        for phase, ways in TRANSITIONS.items()
        for name, after in ways
        if not {phase, after} & set(BY_HAND)
    ]
    assert sorted(drawn) == sorted(table)
    for phase in Phase:
        (blind,) = re.findall(rf"{phase.name} \[label=<<B>{phase.value} {phase.name.lower()}</B>.*>(.*)\]", text)
        assert ("fillcolor" in blind) == PROGRAMS[phase].blind
