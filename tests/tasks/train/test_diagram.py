import numpy as np
import pytest
import yaml
from pydrake.systems.framework import Diagram

from drake_tracker import DrakeTrackerError, list_scenarios, load_scenario, make_diagram
from drake_tracker.core.messages import Centroid, message_size
from drake_tracker.link.link_system import LinkSystem
from drake_tracker.tasks.loader import scenario_file
from drake_tracker.tasks.train.setup import resolve

NAMES = [name for name, _ in list_scenarios() if name.startswith("train")]


@pytest.mark.parametrize("name", NAMES)
def test_every_scenario_of_the_package_builds(name):
    hand_eye = make_diagram(load_scenario(name))
    assert isinstance(hand_eye, Diagram)
    assert [part.get_name() for part in hand_eye.GetSystems()] == ["world", "vision", "host", "link", "arm"]


def test_the_package_has_these_scenarios():
    assert {"train", "train:interlaced"} <= set(NAMES)


def test_settings_reach_their_subsystems():
    overrides = [
        *("vision.lag_cycles=30", "time_step=0.0016666666666666668", "estimator=!AlphaBetaGamma {ready_after: 2.0}"),
        *("link=!Lossy {drop: 0.5}", "cameras.render_window=false", "cameras.noise=0", "cameras.render_processes=0"),
    ]
    hand_eye = make_diagram(load_scenario("train:learned", overrides=overrides))
    delay = hand_eye.vision.GetSubsystemByName("motion_left_lag")
    # Of the 30 cycles, images every other cycle account for 2; the delay line stores the other 28 and the current one.
    assert delay.CreateDefaultContext().get_discrete_state(0).size() == (28 + 1) * message_size(Centroid)
    assert hand_eye.world.laboratory.plant.time_step() == pytest.approx(1 / 600)
    assert isinstance(hand_eye.link, LinkSystem)
    assert "camera_left_noise" not in [part.get_name() for part in hand_eye.world.GetSystems()]
    context = hand_eye.CreateDefaultContext()
    assert hand_eye.GetOutputPort("camera_left").Eval(context).data.shape == (256, 256, 4)


@pytest.fixture(scope="module")
def two_seeds():
    return [make_diagram(load_scenario("train:learned", seed=seed)) for seed in (1, 2)]


def test_seeds_move_the_train(two_seeds):
    def train(hand_eye):
        return hand_eye.GetOutputPort("truth_train_state").Eval(hand_eye.CreateDefaultContext())

    one, two = map(train, two_seeds)
    assert np.linalg.norm(one[4:6] - two[4:6]) > 0.02
    assert np.array_equal(train(make_diagram(load_scenario("train:learned", seed=1))), one)


def test_the_controller_does_not_depend_on_the_seed(two_seeds):
    """The controller does not know the track: its windows and its waiting pose follow from the work volume only."""
    for port in ("arm_state", "q_commanded", "status"):
        a, b = (hand_eye.GetOutputPort(port).Eval(hand_eye.CreateDefaultContext()) for hand_eye in two_seeds)
        assert np.array_equal(a, b), port
    windows = [[camera.window for camera in hand_eye.world.cameras.values()] for hand_eye in two_seeds]
    assert windows[0] == windows[1]


def test_the_hand_waits_over_the_middle_of_the_work_volume():
    scenario = load_scenario("train:learned")
    x, y, z, _ = resolve(scenario).home
    assert (x, y) == pytest.approx((0.56, 0.0)) and z == pytest.approx(0.485)
    hand_eye = make_diagram(scenario)
    q = hand_eye.GetOutputPort("arm_state").Eval(hand_eye.CreateDefaultContext())[:6]
    tool = hand_eye.arm.model.tool_pose(q)
    assert tool.translation() == pytest.approx([x, y, z + scenario.grasp.hover_height], abs=1e-5)
    assert tool.rotation().matrix()[:, 2] == pytest.approx([0.0, 0.0, -1.0], abs=1e-5)


def error_of(*overrides, name="train:learned"):
    """The line with which a scenario is rejected."""
    with pytest.raises(DrakeTrackerError) as error:
        make_diagram(load_scenario(name, overrides=overrides))
    (line,) = str(error.value).split("\n")
    return line


def test_a_track_that_arm_or_cameras_do_not_reach():
    assert "outside the ellipse" in error_of("track.centre=[0.56,0.3]")
    wide = "vision.work_volume=[[0.2,-0.6,0.45],[1.2,0.6,0.505]]"
    assert "out of the arm's reach" in error_of(wide, "track.centre=[0.72,0.2]", "track.centre_range=0")


def test_a_threshold_that_is_too_high():
    line = error_of("vision.method.detector.preset=paper_literal")
    assert (
        "vision.method.detector" in line and "track.speed 0.15 m/s" in line and "the threshold needs at least" in line
    )
    assert "the threshold needs at least" in error_of("vision.method.detector.threshold_px=50")
    assert "the threshold needs at least" in error_of("track.speed=0.001")


def test_a_train_at_rest_is_allowed():
    make_diagram(load_scenario("train:learned", overrides=["track.speed=0"]))


@pytest.mark.parametrize(
    "override, key",
    [
        ("cameras.fov_deg=25", "fov_deg"),
        ("cameras.distance=1.5", "distance"),
        ("cameras.azimuth_deg=[40,-40]", "azimuth_deg"),
        ("cameras.look_at=[0.5,0,0.47]", "look_at"),
        ("cameras.width=128", "width"),
    ],
)
def test_a_calibration_of_other_cameras(override, key):
    line = error_of(override)
    assert "train_cameras.yaml" in line and f"rig.{key}" in line


def test_a_calibration_file_that_does_not_exist(tmp_path):
    line = error_of(f"cameras.calibration={tmp_path / 'none.yaml'}")
    assert "none.yaml" in line


def test_a_calibration_without_one_of_the_cameras(tmp_path):
    data = yaml.safe_load(scenario_file("train_cameras.yaml").read_text())
    del data["cameras"]["camera_right"]
    file = tmp_path / "one.yaml"
    file.write_text(yaml.safe_dump(data))
    assert "there is no camera_right; found camera_left" in error_of(f"cameras.calibration={file}")


def test_the_users_own_calibration_is_used(tmp_path):
    data = yaml.safe_load(scenario_file("train_cameras.yaml").read_text())
    data["cameras"]["camera_left"]["K"][0][0] = 500.0
    file = tmp_path / "mine.yaml"
    file.write_text(yaml.safe_dump(data))
    cameras = resolve(load_scenario("train:learned", overrides=[f"cameras.calibration={file}"])).cameras
    assert cameras["left"].K[0, 0] == 500.0


def test_a_work_volume_that_the_hand_does_not_reach():
    far = "vision.work_volume=[[0.9,-0.3,0.45],[1.4,0.3,0.5]]"
    assert "the arm cannot bring its tool to" in error_of(far, "track.kind=line")


def test_an_impossible_lag_is_rejected_with_the_name_of_its_setting():
    assert "vision.lag_cycles = 2 must be at least 3" in error_of("vision.lag_cycles=2")


def test_a_wrong_estimator_setting_gives_one_line():
    assert "mode" in error_of("estimator=!ArcLength {mode: sideways}")


def test_the_operator_can_select_the_target_where_vision_tracks_several_objects():
    overrides = ["vision.method=!SilhouetteTracker {target: !Selected {}}"]
    several, single = (make_diagram(load_scenario("train:learned", overrides=each)) for each in (overrides, []))
    assert several.GetInputPort("selected").size() == 1 and several.HasInputPort("operator")
    assert not single.HasInputPort("selected") and single.HasInputPort("operator")


def test_an_event_after_the_launch_knows_what_the_hand_does():
    measured = "vision=!Measured {}"
    hand_eye = make_diagram(
        load_scenario("train:learned", overrides=[measured, "track.event=!Stop {after_launch: 0.1}"])
    )
    launch, context = hand_eye.world.GetInputPort("launch"), hand_eye.CreateDefaultContext()
    seen = launch.Eval(hand_eye.world.GetMyContextFromRoot(context))
    np.testing.assert_array_equal(seen, hand_eye.GetOutputPort("command").Eval(context))
    assert not make_diagram(load_scenario("train:learned", overrides=[measured])).world.HasInputPort("launch")
