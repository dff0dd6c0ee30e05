"""Tracks with heights: their profile, and the rail that carries a train on them."""

import math

import hard_paths
import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlantConfig
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.timing import TIME_STEP
from drake_tracker.tasks import load_scenario
from drake_tracker.tasks.train.objects import train_objects
from drake_tracker.tasks.train.setup import resolve
from drake_tracker.tasks.train.track_placement import check_track
from drake_tracker.world.scene_object import Ride
from drake_tracker.world.train.hill import GRAVITY, MASS, TRAIN_HEIGHT, held_on_hill, hill_force
from drake_tracker.world.train.plant import train_pose
from drake_tracker.world.train.rail_system import add_rail
from drake_tracker.world.train.track_visual import embankment_mesh
from drake_tracker.world.train.tracks import make_track

OVAL = make_track("oval").raised((0.01, 0.09), math.radians(8.0))
TRAIN = """
<sdf version="1.7"><model name="train"><link name="body"><inertial><mass>0.25</mass>
  <inertia><ixx>8.5e-5</ixx><iyy>3.5e-4</iyy><izz>3.3e-4</izz><ixy>0</ixy><ixz>0</ixz><iyz>0</iyz></inertia>
</inertial></link></model></sdf>"""


def state_at(s, lift=0.0, track=OVAL, aside=0.0):
    """Returns the 13 numbers of a train at rest on a track whose table is the plane z = 0."""
    X_WO = train_pose(track, s, 0.0)
    q, R = X_WO.rotation().ToQuaternion(), X_WO.rotation().matrix()
    p_WO = X_WO.translation() + lift * R[:, 2] + aside * R[:, 1]
    return [q.w(), q.x(), q.y(), q.z(), *p_WO, *np.zeros(6)]


def test_heights_are_met_and_joined_smoothly():
    length = OVAL.length
    height, slope, lean = OVAL.profile(np.array([0.0, 0.25, 0.5, 1.0]) * length)
    np.testing.assert_allclose(height[[0, 2, 3]], [0.01, 0.09, 0.01], atol=1e-5)
    np.testing.assert_allclose(slope[[0, 2]], 0.0, atol=1e-3)
    s = np.linspace(0.0, length, 400, endpoint=False)
    numeric = (OVAL.profile(s + 1e-3)[0] - OVAL.profile(s - 1e-3)[0]) / 2e-3
    np.testing.assert_allclose(OVAL.profile(s)[1], numeric, atol=2e-3)
    assert np.degrees(lean.max()) < 8.01 and np.degrees(OVAL.profile(s)[2].max()) == pytest.approx(8.0, abs=0.1)


def test_an_open_track_begins_and_ends_level_and_at_its_heights():
    track = make_track("line", length=0.9).raised((0.01, 0.05, 0.02), 0.1)
    height, slope, lean = track.profile(np.array([0.0, 0.45, 0.9]))
    np.testing.assert_allclose(height, [0.01, 0.05, 0.02], atol=1e-6)
    np.testing.assert_allclose(slope[[0, 2]], 0.0, atol=2e-3)
    assert not lean.any()


def test_the_same_place_keeps_height_and_bank_when_a_track_is_turned_about_moved_or_travelled_backwards():
    moved = OVAL.rotated(0.7, (0.56, 0.0)).translated((0.02, -0.01))
    s = np.linspace(0.0, 1.0, 7) * OVAL.length
    np.testing.assert_allclose(moved.profile(s), OVAL.profile(s), atol=1e-12)
    height, slope, lean = OVAL.reversed().profile(OVAL.length - s)
    np.testing.assert_allclose((height, -slope, -lean), OVAL.profile(s), atol=1e-6)


@pytest.mark.parametrize(
    "heights, message",
    [
        ((0.01, 0.14), "deg steep at"),
        ((0.01, 0.02, 0.09, 0.02), "mm above the table at"),
        ((0.005, 0.02), "mm above the"),
    ],
)
def test_a_track_that_no_train_can_run_on_is_refused_with_the_place(heights, message):
    with pytest.raises(DrakeTrackerError, match=message):
        make_track("oval").raised(heights, 0.0)


@pytest.mark.parametrize(
    "overrides, message",
    [
        (["track.heights=[0.01, 0.14]"], r"heights.* \(--set\)|heights.*: the track is 18.0 deg steep at \(0.6"),
        (["track.heights=[]", "track.bank_deg=3"], "track.bank_deg.*must be 0 on a level track"),
        (
            ["vision.work_volume=[[0.31, -0.3, 0.45], [0.81, 0.3, 0.55]]"],
            "25 mm above the work volume, which ends at 0.55",
        ),
    ],
)
def test_contradictions_are_named_before_a_run(overrides, message):
    def check():
        scenario = load_scenario("train:hill", overrides=overrides)
        check_track(scenario, *resolve(scenario).placement, resolve(scenario).reach)

    with pytest.raises(DrakeTrackerError, match=message):
        check()


def test_another_trains_own_heights_are_named():
    others = "objects=[!Train {body: striped, track: {kind: oval, heights: [0.01, 0.3]}}]"
    scenario = load_scenario("train:hill", overrides=[others])
    with pytest.raises(DrakeTrackerError, match=r"objects\[0\]\.track\.heights.*deg"):
        train_objects(scenario, *resolve(scenario).placement)


@pytest.mark.parametrize("s", [0.0, 0.3, 0.7, 1.1])
def test_a_train_at_rest_on_a_slope_is_carried_exactly(s):
    state = state_at(s)
    force, torque = hill_force(OVAL, held_on_hill(OVAL, state, TRAIN_HEIGHT), state, 0.0)
    np.testing.assert_allclose(force, [0.0, 0.0, MASS * GRAVITY], atol=5e-3)
    np.testing.assert_allclose(torque, 0.0, atol=0.02)


def test_the_rail_pushes_and_never_pulls_and_lets_go_of_a_lifted_train():
    for lift in (0.0005, 0.001, 0.003):
        state = state_at(0.3, lift)
        held = held_on_hill(OVAL, state, TRAIN_HEIGHT)
        assert hill_force(OVAL, held, state, 0.0)[0] @ held.frame[2] >= -1e-9
    assert held_on_hill(OVAL, state_at(0.3, 0.0045), TRAIN_HEIGHT) is None
    assert held_on_hill(OVAL, state_at(0.3, aside=0.035), TRAIN_HEIGHT) is None


def test_the_drive_is_limited_by_the_friction_of_the_wheels():
    state = state_at(0.0)
    held = held_on_hill(OVAL, state, TRAIN_HEIGHT)
    assert hill_force(OVAL, held, state, 10.0)[0] @ held.frame[0] < 0.36 * MASS * GRAVITY


@pytest.mark.parametrize("speed", [0.1, 0.2])
def test_a_train_runs_over_the_hill_at_its_speed_and_stays_on_the_rails(speed):
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlant(
        MultibodyPlantConfig(time_step=TIME_STEP, discrete_contact_approximation="lagged"), builder
    )
    Parser(plant).AddModelsFromString(TRAIN, "sdf")
    plant.Finalize()
    train = plant.GetModelInstanceByName("train")
    add_rail(builder, plant=plant, train=train, ride=Ride(OVAL, 0.0, speed=speed), height=TRAIN_HEIGHT)
    simulator = Simulator(builder.Build())
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    plant.SetFreeBodyPose(context, plant.GetBodyByName("body"), train_pose(OVAL, 0.0, 0.0))
    for time in np.arange(1.0, 1.2 * OVAL.length / speed, 0.5):
        simulator.AdvanceTo(float(time))
        pose = plant.EvalBodyPoseInWorld(context, plant.GetBodyByName("body"))
        held = held_on_hill(OVAL, plant.GetPositionsAndVelocities(context, train).tolist(), TRAIN_HEIGHT)
        assert held.grip == 1.0
        assert abs(held.offset[1]) < 1e-3 and abs(held.offset[2]) < 1e-3
        assert pose.IsNearlyEqualTo(RigidTransform(train_pose(OVAL, held.place, 0.0)), 0.03)
        velocity = plant.GetVelocities(context, train)[3:]
        assert np.linalg.norm(velocity) == pytest.approx(speed, rel=0.03)


def test_the_embankment_carries_the_track_and_stands_on_the_table():
    vertices, faces = embankment_mesh(OVAL)
    assert vertices[:, 2].min() < 0.0 and vertices[:, 2].max() == pytest.approx(0.09, abs=0.005)
    assert all(len(face) == 4 for face in faces)
    normals = [np.cross(vertices[b] - vertices[a], vertices[c] - vertices[a]) for a, b, c, _ in faces]
    assert all(normal[2] > 0.0 for normal in normals[::3])  # the top looks up


def test_a_file_may_give_heights_and_bank(tmp_path):
    angle = np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False)
    rows = np.column_stack([0.56 + 0.16 * np.cos(angle), 0.22 * np.sin(angle), 0.05 - 0.04 * np.cos(angle)])
    file = tmp_path / "hill.csv"
    np.savetxt(file, np.column_stack([rows, np.full(60, 4.0)]), delimiter=",", header="x,y,z,bank", comments="")
    track = make_track("csv", csv=str(file))
    places = [track.locate(x, y, 0.0, 0.0)[0] for x, y, _ in rows]
    np.testing.assert_allclose(track.profile(np.array(places))[0], rows[:, 2], atol=2e-4)
    np.testing.assert_allclose(track.profile(np.array(places))[2], np.radians(4.0), atol=1e-9)
    np.savetxt(file, np.column_stack([rows, np.full(60, -60.0)]), delimiter=",", header="x,y,z,bank", comments="")
    with pytest.raises(DrakeTrackerError, match=r"track file .*hill.csv leans by 60.0 deg at \(0"):
        make_track("csv", csv=str(file))
    np.savetxt(file, rows, delimiter=",", header="x,y,z", comments="")
    assert not make_track("csv", csv=str(file)).profile(0.3)[2]
    np.savetxt(file, rows - [0.0, 0.0, 0.005], delimiter=",", header="x,y,z", comments="")
    with pytest.raises(DrakeTrackerError, match=r"track file .*hill.csv comes down to 5.0 mm above the table at \(0.7"):
        make_track("csv", csv=str(file))


@pytest.mark.parametrize("seed", range(74200, 74240))
def test_hills_of_the_benchmark_can_be_run(seed):
    heights, bank = hard_paths.draw_hill(seed)
    track = make_track("oval").raised(heights, math.radians(bank))
    height, slope, _ = track.profile(np.linspace(0.0, track.length, 400))
    assert height.min() >= 0.01 and np.ptp(height) <= 0.081
    assert np.degrees(np.arctan(np.abs(slope).max())) < 15.0 and 0.0 <= bank <= 10.0
    assert np.ptp(height) > 0.03
