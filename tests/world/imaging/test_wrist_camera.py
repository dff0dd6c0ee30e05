import numpy as np
import pytest
from pydrake.math import RigidTransform

from drake_tracker import load_scenario, make_diagram
from drake_tracker.cameras.boards.board_poses import pose_error
from drake_tracker.core.messages import JawState
from drake_tracker.tasks.train.setup import resolve
from drake_tracker.tasks.train.vision import wrist_parts
from drake_tracker.world.config import WristCamera
from drake_tracker.world.imaging.wrist_camera import true_wrist_model, wrist_camera_pose

CAMERAS = ["cameras.render_processes=0"]


@pytest.fixture(scope="module")
def at_start():
    """The diagram of `train:wrist`, and its Context at the start."""
    diagram = make_diagram(load_scenario("train:wrist", seed=700, overrides=CAMERAS))
    return diagram, diagram.CreateDefaultContext()


def test_the_camera_looks_towards_the_axis_of_the_tool():
    X_TC = wrist_camera_pose(WristCamera(offset=(0.06, 0.0, -0.1), tilt_deg=15.0))
    assert X_TC.translation() == pytest.approx([0.06, 0.0, -0.1])
    forward, down = X_TC.rotation().col(2), X_TC.rotation().col(1)
    assert forward == pytest.approx([-np.sin(np.deg2rad(15.0)), 0.0, np.cos(np.deg2rad(15.0))])
    assert down[0] < -0.9  # the bottom of the image is on the side of the axis


def test_a_camera_on_the_axis_looks_along_the_approach():
    X_TC = wrist_camera_pose(WristCamera(offset=(0.0, 0.0, -0.05), tilt_deg=0.0))
    assert X_TC.rotation().col(2) == pytest.approx([0.0, 0.0, 1.0])


def test_the_packaged_calibration_is_close_to_the_truth_but_not_the_truth():
    scenario = load_scenario("train:wrist")
    known, true = wrist_parts(resolve(scenario)).hand.camera, true_wrist_model(scenario.cameras.wrist)
    distance, turn = pose_error(RigidTransform(known.X_WC), RigidTransform(true.X_WC))
    assert 0.0 < distance < 0.003 and np.rad2deg(turn) < 0.3


def test_the_image_shows_the_hand_where_the_controller_expects_it(at_start):
    diagram, context = at_start
    image = diagram.GetOutputPort("camera_wrist").Eval(context).data.astype(int)
    assert image.shape == (128, 128, 4)
    orange = (image[..., 0] > 120) & (image[..., 1] < 110) & (image[..., 2] < 60)
    orange[:60] = False  # the fingers are in the lower half, as is no part of the train
    assert orange.sum() > 200
    width = JawState(diagram.GetOutputPort("jaws").Eval(context)).width
    scene = wrist_parts(resolve(load_scenario("train:wrist"))).hand.scene(width)
    assert scene[orange].mean() < 0.02
    assert scene.mean() > 0.6


def test_the_image_moves_with_the_hand(at_start):
    diagram, context = at_start
    before = diagram.GetOutputPort("camera_wrist").Eval(context).data.astype(int)
    moved = context.Clone()
    plant = diagram.world.laboratory.plant
    plant_context = plant.GetMyMutableContextFromRoot(moved)
    q = plant.GetPositions(plant_context, diagram.world.laboratory.arm)
    plant.SetPositions(plant_context, diagram.world.laboratory.arm, q + [0.1, 0.0, 0.0, 0.0, 0.0, 0.0])
    after = diagram.GetOutputPort("camera_wrist").Eval(moved).data.astype(int)
    scene = wrist_parts(resolve(load_scenario("train:wrist"))).hand.scene(0.088) > 0.0
    change = np.abs(after - before)[..., :3].max(axis=2)
    assert np.median(change[scene]) > 1.5 * np.median(change[~scene])


def test_without_a_camera_on_the_hand_nothing_of_it_exists():
    diagram = make_diagram(load_scenario("train:guided", overrides=CAMERAS))
    assert list(diagram.world.cameras) == ["camera_left", "camera_right"]
    assert not diagram.HasOutputPort("camera_wrist") and not diagram.HasOutputPort("wrist")
    assert not diagram.vision.HasInputPort("prediction")
