"""Tests of the complete diagram, on rendered images for a few cycles."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from wires import arrows

from drake_tracker import load_scenario, make_diagram
from drake_tracker.core.messages import ArmCommand, JawState, ToolStatus
from drake_tracker.diagrams.hand_eye import HandEyeDiagram
from drake_tracker.network.channels import FROM_TRACKER
from drake_tracker.tasks.train.task import TASK

ARROWS = {
    ("world", "camera_left", "vision", "camera_left"),
    ("world", "camera_right", "vision", "camera_right"),
    ("vision", "point", "host", "point"),
    ("host", "prediction", "link", "packet"),
    ("link", "delivered", "arm", "packet"),
    ("world", "arm_state", "arm", "arm_state"),
    ("world", "arm_effort", "arm", "arm_effort"),
    ("world", "jaws", "arm", "jaws"),
    ("arm", "arm_desired_state", "world", "arm_desired_state"),
    ("arm", "arm_feedforward", "world", "arm_feedforward"),
    ("arm", "gripper_desired_state", "world", "gripper_desired_state"),
}


@pytest.fixture(scope="module")
def hand_eye():
    return make_diagram(load_scenario("train:learned", seed=4))


def test_subsystems_and_connections_are_those_of_the_architecture(hand_eye):
    assert arrows(hand_eye) == ARROWS
    assert [hand_eye.get_input_port(k).get_name() for k in range(hand_eye.num_input_ports())] == ["operator"]


def test_its_documented_ports_are_its_ports(hand_eye):
    listed = HandEyeDiagram.__doc__.split("output_ports:")[1].split("``operator``")[0]
    documented = {line.strip(" -") for line in listed.splitlines() if line.strip().startswith("-")}
    assert documented == {hand_eye.get_output_port(k).get_name() for k in range(hand_eye.num_output_ports())}


def test_every_signal_of_the_log_is_a_port_with_as_many_fields(hand_eye):
    of_other_vision = {*FROM_TRACKER, "truth_judged", "hand_point", "hand_correction", "wrist"}
    for name, (_, fields) in TASK.signals().items():
        if name in of_other_vision:
            continue
        assert hand_eye.GetOutputPort(name).size() == len(fields), name


def test_the_picture_of_the_diagram_shows_the_subsystems(hand_eye):
    picture = hand_eye.GetGraphvizString(max_depth=1)
    assert all(name in picture for name in ("world", "vision", "host", "link", "arm", "truth_train_state"))


@pytest.fixture(scope="module")
def after(hand_eye):
    """The diagram's Context after 0.4 s, before anything could be predicted."""
    simulator = Simulator(hand_eye, hand_eye.CreateDefaultContext())
    simulator.AdvanceTo(0.4)
    return simulator.get_context()


def test_the_hand_waits_at_home_with_open_jaws_until_something_is_seen(hand_eye, after):
    def read(port):
        return hand_eye.GetOutputPort(port).Eval(after)

    start = hand_eye.CreateDefaultContext()
    at_rest = hand_eye.GetOutputPort("arm_state").Eval(start)
    assert at_rest[6:] == pytest.approx(np.zeros(6))
    assert read("arm_state")[:6] == pytest.approx(at_rest[:6], abs=1e-3)
    assert read("arm_state")[6:] == pytest.approx(np.zeros(6), abs=1e-2)
    assert ArmCommand(read("command")).phase == 0
    assert not ToolStatus(read("status")).flipping
    assert JawState(read("jaws")).width == pytest.approx(0.088, abs=1e-3)


def test_vision_measures_points(hand_eye, after):
    point = hand_eye.GetOutputPort("point").Eval(after)
    assert point[-1] == 1.0
    train = hand_eye.GetOutputPort("truth_train_state").Eval(after)
    assert np.hypot(*(point[1:3] - train[4:6])) < 0.06  # the point is a quarter of a second old


def test_a_second_context_starts_from_the_initial_state(hand_eye, after):
    fresh = hand_eye.CreateDefaultContext()
    assert fresh.get_time() == 0.0
    assert not np.any(hand_eye.GetOutputPort("point").Eval(fresh))
    assert not np.any(hand_eye.GetOutputPort("delivered").Eval(fresh))
