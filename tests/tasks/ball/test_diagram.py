"""Tests of the ball's diagram: connections, signals, timing, and that no ground truth reaches the controller."""

import pytest
from ball_scenario import make_scenario, true_poses
from faulty_runs import all_at_once
from pydrake.geometry import SceneGraph
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import Simulator
from wires import Wires, arrows, controller_subsystems, truths

from drake_tracker import DrakeTrackerError, load_scenario, make_diagram
from drake_tracker.core.timing import BALL_SERVO_PERIOD
from drake_tracker.grasp.ball.catch_schema import CatchPhase
from drake_tracker.tasks.ball.scenario import BallScenario
from drake_tracker.tasks.ball.task import TASK
from drake_tracker.world.config import BoardConfig

ARROWS = {
    ("world", "camera", "vision", "camera"),
    ("vision", "point", "host", "point"),
    ("host", "prediction", "link", "packet"),
    ("link", "delivered", "arm", "packet"),
    ("world", "arm_state", "arm", "arm_state"),
    ("world", "arm_effort", "arm", "arm_effort"),
    ("arm", "arm_desired_state", "world", "arm_desired_state"),
    ("arm", "arm_feedforward", "world", "arm_feedforward"),
    ("arm", "ready", "world", "ready"),
}
BEHIND_THE_SENSORS = {"camera_pixels", "camera_noise", "camera_faults"}
"""Systems of the world between the rendered image and the port that the controller reads."""


@pytest.fixture(scope="module")
def hand_eye():
    scenario = make_scenario(seed=3, noise=2.0)
    return make_diagram(scenario, true_poses(scenario))


@pytest.fixture(scope="module")
def faulty():
    """A diagram with every fault that the ball has."""
    faults = load_scenario("ball", overrides=[all_at_once("ball")]).faults
    scenario = make_scenario(seed=3, noise=2.0).with_settings({"faults": faults})
    return make_diagram(scenario, true_poses(scenario))


def test_subsystems_and_connections_are_those_of_the_architecture(hand_eye):
    assert arrows(hand_eye) == ARROWS


def test_the_only_input_is_the_operator(hand_eye):
    assert [hand_eye.get_input_port(k).get_name() for k in range(hand_eye.num_input_ports())] == ["operator"]


def test_every_signal_of_the_log_is_a_port_with_as_many_fields(hand_eye):
    for name, (_, fields) in TASK.signals().items():
        assert hand_eye.GetOutputPort(name).size() == len(fields), name


@pytest.mark.parametrize("diagram", ["hand_eye", "faulty"])
def test_the_controller_reads_camera_and_joints_but_no_ground_truth(diagram, request):
    hand_eye = request.getfixturevalue(diagram)
    world = hand_eye.world
    plant = world.laboratory.plant
    arm = world.laboratory.arm
    joints = plant.get_state_output_port(arm), plant.get_net_actuation_output_port(arm)
    sensors = (world.cameras["camera"].sensor_port, *joints)
    allowed = {(port.get_system(), int(port.get_index())) for port in sensors}
    wires = Wires(hand_eye)
    wires.leave_open(hand_eye.arm, "operator")
    upstream = wires.upstream(controller_subsystems(hand_eye).values(), allowed)
    leaking = [
        path
        for (leaf, port), path in upstream.items()
        if (leaf, port) not in allowed and wires.inside(leaf, world) and leaf.get_name() not in BEHIND_THE_SENSORS
    ]
    assert leaking == []
    assert {found for found in upstream if found in allowed} == allowed


def is_truth(thing):
    if isinstance(thing, (SceneGraph, BallScenario, BoardConfig)):
        return True
    if isinstance(thing, MultibodyPlant):
        return thing.HasModelInstanceNamed("ball") or thing.HasModelInstanceNamed("board")
    return type(thing).__module__.startswith("drake_tracker.world")


@pytest.mark.parametrize("diagram", ["hand_eye", "faulty"])
@pytest.mark.parametrize("subsystem", ["vision", "host", "link", "arm"])
def test_no_object_of_the_controller_refers_to_the_world(diagram, subsystem, request):
    assert truths(controller_subsystems(request.getfixturevalue(diagram))[subsystem], is_truth) == {}


def test_the_hand_waits_beyond_the_edge_and_then_reports_ready(hand_eye):
    simulator = Simulator(hand_eye)
    context = simulator.get_context()
    simulator.AdvanceTo(0.1)
    assert hand_eye.GetOutputPort("command").Eval(context)[0] == CatchPhase.WAIT
    while not hand_eye.arm.GetOutputPort("ready").Eval(hand_eye.arm.GetMyContextFromRoot(context))[0]:
        assert context.get_time() < 2.5
        simulator.AdvanceTo(context.get_time() + BALL_SERVO_PERIOD)
    q = hand_eye.GetOutputPort("arm_state").Eval(context)[: hand_eye.arm.model.num_joints]
    p_BT = hand_eye.poses.X_WB.inverse() @ hand_eye.arm.model.tool_pose(q).translation()
    assert p_BT[0] == pytest.approx(0.0, abs=0.002)
    assert -0.07 < p_BT[1] < -0.03 and -0.04 < p_BT[2] < 0.0


@pytest.mark.parametrize("kind", ["BackgroundDifference", "StaticThreshold", "NormalFlow"])
def test_each_detector_can_be_chosen(kind):
    scenario = load_scenario("ball", overrides=[f"vision.detector=!{kind} {{}}"])
    diagram = make_diagram(scenario, true_poses(scenario))
    assert type(diagram.vision.GetSubsystemByName("motion")._detector).__name__ == f"{kind}Detector"


def test_the_seven_joint_arm_replaces_the_puma():
    scenario = load_scenario("ball:seven_joint")
    diagram = make_diagram(scenario, true_poses(scenario))
    assert diagram.arm.model.num_joints == 7
    fields = TASK.signals(7)
    assert diagram.GetOutputPort("q_commanded").size() == len(fields["q_commanded"][1])


@pytest.mark.parametrize("name", ["ball", "ball:seven_joint", "ball:every_image"])
def test_every_scenario_of_the_ball_builds(name):
    scenario = load_scenario(name)
    hand_eye = make_diagram(scenario, true_poses(scenario))
    assert [part.get_name() for part in hand_eye.GetSystems()] == ["world", "vision", "host", "link", "arm"]


def test_building_without_initialisation_is_rejected():
    with pytest.raises(DrakeTrackerError, match=r"make_diagram\(scenario, initialise\(scenario\)\)"):
        make_diagram(load_scenario("ball"))
