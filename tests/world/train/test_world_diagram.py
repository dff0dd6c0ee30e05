import numpy as np
import pytest
from pydrake.geometry import Role
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator

from drake_tracker.arm.arm_model import make_arm_model, tool_down
from drake_tracker.arm.description import PUMA560
from drake_tracker.arm.motion.differential_ik import joints_for
from drake_tracker.core.messages import JawState, Verdict
from drake_tracker.vision.region_of_interest import project_region
from drake_tracker.world.base_world_diagram import WorldConfig
from drake_tracker.world.config import CamerasConfig, TrackConfig, TrainConfig
from drake_tracker.world.imaging.cameras import CAMERA_NAMES, true_camera_models
from drake_tracker.world.train import world_diagram
from drake_tracker.world.train.plant import TABLE_FRAME, TRAIN_HEIGHT
from drake_tracker.world.train.tracks import make_track
from drake_tracker.world.train.world_diagram import WorldDiagram

START = 0.2
"""Arc length at which the train starts [m]."""
SPEED, JAW_OPENING = 0.15, 0.088
WINDOWS = {"camera_left": (40, 70, 170, 100), "camera_right": (46, 74, 170, 100)}


@pytest.fixture(scope="module")
def q_initial():
    return joints_for(make_arm_model(PUMA560), PUMA560.q_start, tool_down([0.56, 0.0, 0.70], np.pi))


@pytest.fixture(scope="module")
def track():
    return make_track("oval")


@pytest.fixture(scope="module")
def world(q_initial, track):
    config = WorldConfig(arm=PUMA560, q_initial=q_initial, jaw_opening=JAW_OPENING, windows=WINDOWS)
    return WorldDiagram(
        config, track=track, start=START, motion=TrackConfig(speed=SPEED), cameras=CamerasConfig(noise=0.0)
    )


def held(world, q_initial, opening=0.044):
    """A Simulator of the world in which the arm is to stand still."""
    simulator = Simulator(world)
    context = simulator.get_mutable_context()
    world.GetInputPort("arm_desired_state").FixValue(context, np.concatenate([q_initial, np.zeros(6)]))
    world.GetInputPort("arm_feedforward").FixValue(context, np.zeros(6))
    world.GetInputPort("gripper_desired_state").FixValue(context, [opening, 0.0])
    return simulator, context


def test_ports(world):
    inputs = [world.get_input_port(k).get_name() for k in range(world.num_input_ports())]
    outputs = [world.get_output_port(k).get_name() for k in range(world.num_output_ports())]
    assert inputs == ["arm_desired_state", "arm_feedforward", "gripper_desired_state"]
    assert outputs == [
        *("camera_left", "camera_right", "arm_state", "arm_effort", "jaws"),
        *("truth_train_state", "truth_verdict", "truth_query"),
    ]
    assert world.get_name() == "world"


def test_it_starts_at_rest_where_it_is_told(world, q_initial, track):
    _, context = held(world, q_initial)
    state = world.GetOutputPort("arm_state").Eval(context)
    assert state == pytest.approx(np.concatenate([q_initial, np.zeros(6)]))
    assert JawState(world.GetOutputPort("jaws").Eval(context)).width == pytest.approx(JAW_OPENING)
    train = world.GetOutputPort("truth_train_state").Eval(context)
    x, y, heading = track.pose(START)
    assert train[4:7] == pytest.approx([x, y, 0.45 + TRAIN_HEIGHT])
    assert train[[0, 3]] == pytest.approx([np.cos(heading / 2), np.sin(heading / 2)])
    assert np.all(train[7:] == 0.0)


def test_the_train_sets_off_along_its_track(world, q_initial, track):
    simulator, context = held(world, q_initial)
    simulator.AdvanceTo(1.0)
    train = world.GetOutputPort("truth_train_state").Eval(context)
    s, lateral = track.nearest(train[4], train[5], track.pose(START + 0.12)[2])
    assert abs(lateral) < 1e-3
    assert START + 0.10 < s < START + 0.15
    assert np.hypot(train[10], train[11]) == pytest.approx(SPEED, rel=0.02)
    verdict = Verdict(world.GetOutputPort("truth_verdict").Eval(context))
    assert verdict.lift == pytest.approx(0.0, abs=1e-3)
    assert not (verdict.taken or verdict.derailed or verdict.table_touched)


def test_the_servos_hold_the_arm_and_report_their_torque(world, q_initial):
    simulator, context = held(world, q_initial)
    simulator.AdvanceTo(0.3)
    q = world.GetOutputPort("arm_state").Eval(context)[:6]
    assert q == pytest.approx(q_initial, abs=0.02)  # it sags a little: nothing here counters gravity
    effort = world.GetOutputPort("arm_effort").Eval(context)
    assert effort.shape == (6,) and 5.0 < abs(effort[1]) < 186.4


def test_the_cameras_show_the_windows_asked_for_and_the_train_in_them(world, q_initial, track):
    _, context = held(world, q_initial)
    plant, train = world.laboratory.plant, world.laboratory.train_body
    plant_context = plant.GetMyMutableContextFromRoot(context)
    here = [*track.pose(START)[:2], 0.45 + TRAIN_HEIGHT]

    def images():
        return [world.GetOutputPort(name).Eval(context).data[..., :3].astype(int).copy() for name in CAMERA_NAMES]

    with_train = images()
    plant.SetFreeBodyPose(plant_context, train, RigidTransform([3.0, 0.0, 1.0]))
    without = images()
    models = true_camera_models(CamerasConfig())
    for name, a, b in zip(CAMERA_NAMES, with_train, without):
        u0, v0, width, height = WINDOWS[name]
        assert a.shape == (height, width, 3)
        rows, columns = np.nonzero(np.abs(a - b).max(axis=2) > 20)
        assert 300 < len(rows) < 1500
        seen = np.array([columns.mean() + u0, rows.mean() + v0])
        # Not exactly: chimney and cab are no box, and the wheels are dark.
        assert seen == pytest.approx(models[name].project(here)[0], abs=3.0)


def test_what_is_not_rendered_through_a_window_is_not_in_the_work_volume(world, q_initial, track, monkeypatch):
    """The frame under the table is left out; some pixels outside of the polygon in which the vision looks show that."""
    monkeypatch.setattr(world_diagram, "hide_table_frame", lambda laboratory: None)
    config = WorldConfig(arm=PUMA560, q_initial=q_initial, windows=WINDOWS)
    complete = WorldDiagram(config, track=track, start=START, cameras=CamerasConfig(noise=0.0))
    perceived = []
    for each in (world, complete):
        inspector = each.laboratory.scene_graph.model_inspector()
        perceived.append({inspector.GetName(geometry) for geometry in inspector.GetAllGeometryIds(Role.kPerception)})
    assert perceived[1] - perceived[0] == {TABLE_FRAME}
    contexts = [held(each, q_initial)[1] for each in (world, complete)]
    for name, model in true_camera_models(CamerasConfig()).items():
        few, all_ = (each.GetOutputPort(name).Eval(context).data for each, context in zip((world, complete), contexts))
        seen = project_region(model, [[0.33, -0.30, 0.45], [0.79, 0.30, 0.505]]).mask(WINDOWS[name]) > 0
        assert seen.sum() > 3000
        difference = np.abs(few.astype(int) - all_)[seen].max(axis=1)
        # Where rails and sleepers coincide, the order in which they are drawn depends on what else is drawn.
        assert (difference > 0).mean() < 1e-3 and difference.max() <= 16


def test_the_settings_reach_the_parts(q_initial, track):
    world = WorldDiagram(
        WorldConfig(arm=PUMA560, q_initial=q_initial, time_step=1.0 / 600.0),
        track=track,
        start=START,
        motion=TrackConfig(speed=0.0),
        train=TrainConfig(body="dark"),
        table_height=0.44,
        cameras=CamerasConfig(width=64, height=48),
    )
    simulator, context = held(world, q_initial)
    assert world.GetOutputPort("camera_left").Eval(context).data.shape == (48, 64, 4)
    simulator.AdvanceTo(0.2)
    train = world.GetOutputPort("truth_train_state").Eval(context)
    assert train[6] == pytest.approx(0.44 + TRAIN_HEIGHT, abs=1e-3)
    assert np.hypot(train[10], train[11]) < 1e-3
    assert world.laboratory.plant.time_step() == 1.0 / 600.0
    assert {"camera_left_noise", "camera_right_noise"} <= {part.get_name() for part in world.GetSystems()}
