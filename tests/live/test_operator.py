"""The operator at the page: panel, System, and a run of the train in which a person stops and jogs the arm."""

import numpy as np
import pytest
from ball_scenario import make_scenario, true_poses
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from drake_tracker import load_scenario
from drake_tracker.core.log import load_log
from drake_tracker.core.messages import ArmCommand, OperatorCommand
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.grasp.ball.catch_schema import CatchPhase
from drake_tracker.grasp.operator_override import OperatorMode
from drake_tracker.grasp.train.schema import Phase
from drake_tracker.live.operator import JOG_STEP, JOG_TURN, MOST_STEPS, OperatorPanel
from drake_tracker.live.operator_system import LEAD, OperatorSystem, add_operator, moved
from drake_tracker.live.view import LiveView
from drake_tracker.run.options import RunOptions
from drake_tracker.run.simulation import simulate
from drake_tracker.tasks.registry import make_diagram


def test_the_panel_keeps_mode_and_steps_until_they_are_read():
    panel = OperatorPanel()
    assert panel.read() == (OperatorMode.SUPERVISE, (0, 0, 0, 0), 0)
    panel.jog("x", 1)  # nobody has taken over
    panel.set_mode("take_over")
    panel.jog("x", 1)
    panel.jog("x", 1)
    panel.jog("yaw", -1)
    assert panel.mode == OperatorMode.TAKE_OVER
    assert panel.read() == (OperatorMode.TAKE_OVER, (2, 0, 0, -1), 0)
    assert panel.read() == (OperatorMode.TAKE_OVER, (0, 0, 0, 0), 0)
    panel.jog("z", 1)
    panel.set_mode("stop")
    assert panel.read() == (OperatorMode.STOP, (0, 0, 0, 0), 0), "a stop drops steps"


def test_a_key_that_is_held_down_does_not_pile_up_steps():
    panel = OperatorPanel()
    panel.set_mode("take_over")
    for _ in range(500):
        panel.jog("y", 1)
    assert panel.read().steps == (0, MOST_STEPS, 0, 0)


@pytest.mark.parametrize("mode", ["", "STOP", "hold", None, 1, ["stop"], True])
def test_an_unknown_mode_is_refused(mode):
    panel = OperatorPanel()
    with pytest.raises(ValueError, match="supervise, stop, take_over"):
        panel.set_mode(mode)
    assert panel.mode == OperatorMode.SUPERVISE


@pytest.mark.parametrize("axis, sign", [("w", 1), (None, 1), ("x", 0), ("x", 2), ("x", "1"), ("x", True), (["x"], 1)])
def test_an_unknown_step_is_refused(axis, sign):
    with pytest.raises(ValueError, match="axis must be one of"):
        OperatorPanel().jog(axis, sign)


def test_a_step_moves_the_goal_but_never_far_from_the_tool():
    tool = np.array([0.5, 0.1, 0.7, 3.0])
    goal = moved(tool, np.array([1, 0, -1, 2]), tool)
    assert goal == pytest.approx([0.5 + JOG_STEP, 0.1, 0.7 - JOG_STEP, 3.0 + 2 * JOG_TURN])
    for _ in range(50):
        goal = moved(goal, np.array([1, 0, 0, 0]), tool)
    assert goal[0] == pytest.approx(0.5 + LEAD) and goal[1:] == pytest.approx([0.1, 0.7 - JOG_STEP, 3.0 + 2 * JOG_TURN])
    behind = moved(goal, np.zeros(4, int), tool - [0.2, 0.0, 0.0, 0.0])
    assert np.array_equal(behind, goal), "only a step moves it"


def test_the_system_says_what_the_panel_said_and_begins_where_the_tool_is():
    panel = OperatorPanel()
    system = OperatorSystem(panel)
    simulator = Simulator(system)
    context = simulator.get_mutable_context()
    system.GetInputPort("status").FixValue(context, [4, 1.0, 0, 0.5, 0.1, 0.7, 3.0, 1])

    def after(cycle):
        simulator.AdvanceTo((cycle + 0.5) * VISION_PERIOD)
        return system.GetOutputPort("operator").Eval(context).tolist()

    assert after(0) == [0, 0, 0, 0, 0, 0]
    panel.set_mode("take_over")
    assert after(1) == [2, 0.5, 0.1, 0.7, 3.0, 0]
    panel.jog("y", -1)
    system.GetInputPort("status").FixValue(context, [4, 1.0, 0, 0.48, 0.1, 0.7, 3.0, 1])
    assert after(2) == pytest.approx([2, 0.5, 0.1 - JOG_STEP, 0.7, 3.0, 0]), "the goal does not follow the tool"
    panel.set_mode("stop")
    assert after(3) == [1, 0, 0, 0, 0, 0]
    panel.set_mode("take_over")
    assert after(4) == [2, 0.48, 0.1, 0.7, 3.0, 0]


@pytest.mark.parametrize("number", [0, 3, -1, 1.0, True, "1", None, [1]])
def test_only_a_track_that_there_is_can_be_selected(number):
    panel = OperatorPanel()
    panel.select(2, [1, 2])
    with pytest.raises(ValueError, match="no such track"):
        panel.select(number, [1, 2])
    panel.set_mode("stop")
    assert panel.read() == (OperatorMode.STOP, (0, 0, 0, 0), 2), "a selection stays"


def test_the_system_passes_the_selection_on_and_logs_it():
    panel = OperatorPanel()
    system = OperatorSystem(panel)
    simulator = Simulator(system)
    system.GetInputPort("status").FixValue(simulator.get_mutable_context(), np.zeros(8))
    for number in (0, 4):
        if number:
            panel.select(number, [number])
        simulator.AdvanceTo(simulator.get_context().get_time() + 1.5 * VISION_PERIOD)
        operator, selected = (system.GetOutputPort(n).Eval(simulator.get_context()) for n in ("operator", "selected"))
        assert operator.tolist() == [0, 0, 0, 0, 0, number] and selected.tolist() == [number]


def test_the_hand_with_the_cup_listens_to_the_operator_too():
    scenario = make_scenario(seed=4)
    hand_eye = make_diagram(scenario, true_poses(scenario))
    builder = DiagramBuilder()
    builder.AddSystem(hand_eye)
    panel = OperatorPanel()
    port = add_operator(builder, hand_eye=hand_eye, panel=panel)
    assert port.get_name() == "operator"
    root = builder.Build()
    simulator = Simulator(root)
    context = hand_eye.GetMyContextFromRoot(simulator.get_context())
    for mode, phase in (("stop", CatchPhase.STOPPED), ("take_over", CatchPhase.MANUAL), ("supervise", CatchPhase.WAIT)):
        panel.set_mode(mode)
        simulator.AdvanceTo(simulator.get_context().get_time() + 0.03)
        assert ArmCommand(hand_eye.GetOutputPort("command").Eval(context)).phase == phase


def test_an_arm_without_an_operators_input_is_left_alone():
    builder = DiagramBuilder()
    assert add_operator(builder, hand_eye=builder.AddSystem(ConstantVectorSource([0.0])), panel=OperatorPanel()) is None


class Person:
    """Does things at the page at given times [s] of the run, and never holds it."""

    def __init__(self, live, deeds):
        self._live, self._deeds, self._look = live, sorted(deeds), live.look

    def look(self, now, phase, p_success, interrupted):
        while self._deeds and now >= self._deeds[0][0]:
            _, action, values = self._deeds.pop(0)
            self._live._act(action, values)
        self._look(now, phase, p_success, interrupted)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A run in which a person stops the hand while it follows the train, takes over, jogs it, and releases it."""
    out = tmp_path_factory.mktemp("operator") / "run"
    jogs = [(3.2 + 0.1 * k, "jog", {"axis": "x", "sign": -1}) for k in range(8)]
    jogs += [(4.2 + 0.06 * k, "jog", {"axis": "z", "sign": -1}) for k in range(28)]
    deeds = [
        (2.0, "operator", {"mode": "stop"}),
        (3.0, "operator", {"mode": "take_over"}),
        *jogs,
        (6.8, "operator", {"mode": "supervise"}),
    ]
    scenario = load_scenario("train:learned", seed=3, duration=9.5, overrides=["vision=!Measured {}"])
    with LiveView(say=lambda line: None) as live:
        live.look = Person(live, deeds).look
        simulate(scenario, out, RunOptions(record=False), live=live)
        live.finish({"success": False})
    return load_log(out / "log.npz")


def speed(log):
    tool = log["tool"]
    return tool.times, np.linalg.norm(np.gradient(tool.view("x", "y", "z"), VISION_PERIOD, axis=0), axis=1)


def during(log, start, end):
    return (log["tool"].times > start) & (log["tool"].times < end)


def test_the_log_says_what_the_operator_did(run):
    operator = run["operator"]
    assert operator.names == OperatorCommand.get_fields()
    assert np.diff(operator.times) == pytest.approx(VISION_PERIOD)
    changes = operator.times[np.nonzero(np.diff(operator["mode"]))[0] + 1]
    assert changes == pytest.approx([2.0, 3.0, 6.8], abs=0.06)
    phases = [Phase(int(phase)) for phase in run["command"]["phase"]]
    order = [phases[0]] + [b for a, b in zip(phases, phases[1:]) if a != b]
    assert order[:6] == [Phase.ACQUIRE, Phase.TRACK, Phase.STOPPED, Phase.MANUAL, Phase.RETREAT, Phase.ACQUIRE]
    assert order[6] == Phase.TRACK, "it follows the train again"


def test_the_hand_comes_to_rest_at_once_and_stays(run):
    _, moving = speed(run)
    assert moving[during(run, 1.7, 1.95)].min() > 0.1, "it was moving"
    assert moving[during(run, 2.4, 3.0)].max() < 0.005
    place = run["tool"].view("x", "y", "z")
    stopped = place[during(run, 1.98, 3.0)]
    assert np.linalg.norm(stopped[-1] - stopped[0]) < 0.08


def test_the_operator_jogs_the_tool_but_not_into_the_table(run):
    _, moving = speed(run)
    place = run["tool"].view("x", "y", "z")
    before, after = place[during(run, 2.9, 3.0)][-1], place[during(run, 4.1, 4.2)][-1]
    assert after - before == pytest.approx([-8 * JOG_STEP, 0.0, 0.0], abs=0.004)
    assert moving[during(run, 3.0, 6.8)].max() < 0.2
    low = place[during(run, 6.5, 6.8)][-1]
    assert low[2] == pytest.approx(0.485 + 0.004, abs=0.003)
    assert not run["truth_verdict"]["table_touched"].any()
    width = run["command"]["jaw_width"]
    assert np.ptp(width) == 0.0, "the jaws stay as they are"


def test_the_page_refuses_what_is_no_wish():
    with LiveView(say=lambda line: None) as live:
        for action, values in (
            ("operator", {}),
            ("operator", {"mode": "go"}),
            ("operator", {"mode": "stop", "more": 1}),
            ("jog", {"axis": "x"}),
            ("jog", {"axis": "x", "sign": 3}),
        ):
            with pytest.raises(ValueError):
                live._act(action, values)
        assert live._act("operator", {"mode": "stop"})["operator"] == "stop"
