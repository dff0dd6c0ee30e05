"""Further objects of the train's laboratory: they move as their settings say, and nothing else changes."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from drake_tracker import DrakeTrackerError, RunOptions, load_scenario, simulate
from drake_tracker.core.log import load_log
from drake_tracker.core.setting import replace_settings
from drake_tracker.scenarios.reader import describe_settings
from drake_tracker.tasks import save_scenario
from drake_tracker.tasks.task import BODY_STATE
from drake_tracker.tasks.train.diagram import make_world
from drake_tracker.tasks.train.objects import train_objects
from drake_tracker.tasks.train.setup import resolve
from drake_tracker.world.config import TRAIN_SIZE
from drake_tracker.world.train.driven_objects import PARKED, REACHING, RollingBall, WavingHand
from drake_tracker.world.train.objects_config import OBJECTS, Ball, Hand, Train
from drake_tracker.world.train.plant import TRAIN_HEIGHT

REST = 0.45 + TRAIN_HEIGHT
SPEED = 0.15


class Laboratory:
    """The world of a scenario without cameras, in which the arm stands still."""

    def __init__(self, *overrides, spec="train"):
        self.scenario = load_scenario(spec, overrides=list(overrides))
        setup = resolve(self.scenario)
        self.track, self.start = setup.placement
        self.world = make_world(setup, windows={})
        self.plant = self.world.laboratory.plant
        self.simulator = Simulator(self.world)
        self.context = self.simulator.get_mutable_context()
        self.world.GetInputPort("arm_desired_state").FixValue(self.context, [*setup.reach.q_initial, *np.zeros(6)])
        self.world.GetInputPort("arm_feedforward").FixValue(self.context, np.zeros(6))
        self.world.GetInputPort("gripper_desired_state").FixValue(self.context, [0.044, 0.0])

    def train(self):
        return self.world.GetOutputPort("truth_train_state").Eval(self.context).copy()

    def states(self):
        return self.world.GetOutputPort("truth_object_states").Eval(self.context).reshape(-1, 13).copy()

    def watch(self, duration, period=0.1):
        """Simulates; returns the states of the first train (n, 13) and of the objects (n, objects, 13) over time."""
        trains, objects = [], []
        for time in np.arange(0.0, duration + 1e-9, period):
            self.simulator.AdvanceTo(time)
            trains.append(self.train())
            objects.append(self.states())
        return np.array(trains), np.array(objects)

    def beside(self, state, track=None):
        """Distance of a train from its track [m]."""
        x, y, heading = state[4], state[5], 2.0 * np.arctan2(state[3], state[0])
        return abs((track or self.track).nearest(x, y, heading)[1])


def test_the_default_scenario_has_the_bodies_and_systems_of_a_world_without_objects():
    world = Laboratory().world
    assert not world.HasOutputPort("truth_object_states")
    assert world.laboratory.object_bodies == ()
    plant = world.laboratory.plant
    assert (plant.num_bodies(), plant.num_model_instances(), plant.num_positions()) == (13, 6, 15)
    assert world.laboratory.scene_graph.model_inspector().num_geometries() == 39
    assert [part.get_name() for part in world.GetSystems()] == ["plant", "scene_graph", "rail", "judge", "jaw_sensor"]


def test_objects_leave_the_draws_of_the_first_train_alone():
    alone = Laboratory()
    crowded = Laboratory("objects=[!Ball {}, !Hand {}, !Train {track: {kind: circle, radius: 0.08}}]")
    assert np.array_equal(alone.train(), crowded.train())
    assert np.array_equal(alone.track.points, crowded.track.points)


@pytest.fixture(scope="module")
def crowd():
    """A laboratory with every kind of object, watched for 5 s."""
    laboratory = Laboratory(
        "objects=[!Train {ahead: -0.6}, !Ball {at: 1.0, place: [0.83, 0.0]}, !Hand {at: 0.5, for: 4.0},"
        " !Train {body: round, start_delay: 2.0, speed: 0.1, track: {kind: circle, radius: 0.09, centre: [0.53, 0.0],"
        " centre_range: 0.0}}]",
        "track.centre_range=0.0",
        "track.semi_axes=[0.2, 0.24]",
    )
    return laboratory, *laboratory.watch(5.0)


def test_every_kind_is_tested(crowd):
    assert {type(item) for item in crowd[0].scenario.objects} == set(OBJECTS.makers)


def test_names_are_unique_and_states_are_in_the_order_of_the_list(crowd):
    laboratory, _, objects = crowd
    bodies = laboratory.world.laboratory.object_bodies
    names = [laboratory.plant.GetModelInstanceName(body.model_instance()) for body in bodies]
    assert names == ["train_0", "ball_1", "hand_2", "train_3"]
    context = laboratory.plant.GetMyContextFromRoot(laboratory.context)
    for body, state in zip(bodies, objects[-1]):
        assert body.EvalPoseInWorld(context).translation() == pytest.approx(state[4:7])
    # Of a free body, the port has the layout of truth_train_state.
    free = laboratory.plant.get_state_output_port(bodies[0].model_instance()).Eval(context)
    free[:4] *= np.sign(free[0]) / np.linalg.norm(free[:4])
    assert objects[-1][0] == pytest.approx(free, abs=1e-9)


def test_nothing_blows_up(crowd):
    _, trains, objects = crowd
    assert np.isfinite(trains).all() and np.isfinite(objects).all()
    assert np.abs(objects[..., 10:]).max() < 1.5


def test_the_second_train_runs_behind_the_first_on_the_same_rails(crowd):
    laboratory, trains, objects = crowd
    track = laboratory.track
    x, y, _ = track.pose(laboratory.start - 0.6)
    assert objects[0, 0, 4:7] == pytest.approx([x, y, REST], abs=1e-3)
    for first, other in zip(trains[10:], objects[10:, 0]):
        assert laboratory.beside(other) < 1e-3
        assert other[6] == pytest.approx(REST, abs=1e-3)
        assert np.hypot(*other[10:12]) == pytest.approx(SPEED, rel=0.03)
        s = [track.nearest(state[4], state[5], 2.0 * np.arctan2(state[3], state[0]))[0] for state in (first, other)]
        assert (s[0] - s[1]) % track.length == pytest.approx(0.6, abs=0.005)


def test_a_train_with_its_own_track_stands_until_its_delay_is_over(crowd):
    laboratory, _, objects = crowd
    states = objects[:, 3]
    ride = train_objects(laboratory.scenario, laboratory.track, laboratory.start)[3].motion
    assert ride.track.length == pytest.approx(2.0 * np.pi * 0.09, rel=1e-3)
    assert np.abs(states[5:20, 10:12]).max() < 1e-3
    assert np.hypot(*states[-1, 10:12]) == pytest.approx(0.1, rel=0.03)
    assert max(laboratory.beside(state, ride.track) for state in states) < 1e-3


def test_the_ball_rolls_to_and_fro(crowd):
    _, _, objects = crowd
    config, ball = Ball(at=1.0, place=(0.83, 0.0)), objects[:, 1]
    times = np.arange(len(ball)) * 0.1
    expected = -config.amplitude * np.cos(np.maximum(times - config.at, 0.0) * config.speed / config.amplitude)
    assert ball[:, 4] == pytest.approx(config.place[0], abs=1e-4)
    assert ball[:, 5] == pytest.approx(config.place[1] + expected, abs=2e-3)
    assert ball[:, 6] == pytest.approx(0.45 + config.radius + 0.001, abs=1e-4)
    assert ball[:10, 11] == pytest.approx(0.0, abs=1e-6)
    assert np.abs(ball[:, 11]).max() == pytest.approx(config.speed, rel=0.05)


def test_the_hand_reaches_in_moves_and_leaves(crowd):
    _, _, objects = crowd
    config, x = Hand(), objects[:, 2, 4]
    inside = x[15:35]
    assert x[0] == pytest.approx(config.place[0] + PARKED, abs=1e-3)
    assert inside.min() == pytest.approx(config.place[0] - config.amplitude, abs=0.01)
    assert inside.max() == pytest.approx(config.place[0] + config.amplitude, abs=0.01)
    assert x[-1] == pytest.approx(config.place[0] + PARKED, abs=5e-3)


@pytest.mark.parametrize("motion", [RollingBall(Ball(at=0.7), 0, 0.45).motion, WavingHand(Hand(), 0, 0.45).motion])
def test_the_speed_of_a_slide_is_the_derivative_of_its_position(motion):
    for time in (0.3, 1.1, 3.2, 3.0 + 0.9 * REACHING, 5.3, 7.4, 9.0):
        slope = (motion(time + 1e-5)[0] - motion(time - 1e-5)[0]) / 2e-5
        assert motion(time)[1] == pytest.approx(slope, abs=1e-6)


def test_the_ball_is_clear_of_the_default_train_whatever_the_seed():
    """The inner side of the train is half its width, and 6 mm of chord, inside of its rail."""
    config = Ball()
    y = config.place[1] + np.linspace(-config.amplitude, config.amplitude, 15)
    path = np.column_stack([np.full_like(y, config.place[0]), y])
    for seed in range(12):
        track = resolve(load_scenario("train:learned", seed=seed)).track
        distances = np.hypot(*(path[:, None] - track.points[None]).transpose(2, 0, 1))
        assert distances.min() - config.radius - 0.026 > 0.02, seed


def test_two_trains_on_one_rail_bump_and_stay_on_it():
    laboratory = Laboratory("objects=[!Train {ahead: -0.25, speed: 0.35}]")
    trains, objects = laboratory.watch(6.0, period=0.02)
    gaps = np.hypot(*(objects[:, 0, 4:6] - trains[:, 4:6]).T)
    assert np.isfinite(gaps).all()
    assert 0.9 * TRAIN_SIZE[0] < gaps.min() < 1.02 * TRAIN_SIZE[0]
    pushed = np.hypot(*trains[150:, 10:12].T)
    assert pushed.mean() > 1.2 * SPEED, "the faster train pushes the first one"
    for state in (*trains[::10], *objects[::10, 0]):
        assert laboratory.beside(state) < 5e-3 and state[6] == pytest.approx(REST, abs=2e-3)
    assert np.abs(objects[:, 0, 10:]).max() < 1.0


@pytest.mark.parametrize("scale", [0.5, 1.5])
def test_a_train_of_another_length_runs_as_smoothly(scale):
    laboratory = Laboratory(f"train.scale={scale}", "objects=[!Ball {}]")
    trains, _ = laboratory.watch(3.0, period=0.05)
    body = laboratory.world.laboratory.train_body
    assert body.default_mass() == pytest.approx(0.25 * scale)
    moments = body.default_spatial_inertia().CalcRotationalInertia().get_moments()
    length = TRAIN_SIZE[0] * scale
    assert moments[2] == pytest.approx(0.25 * scale * (length**2 + 0.04**2) / 12.0)
    assert np.hypot(*trains[20:, 10:12].T) == pytest.approx(SPEED, rel=0.03)
    assert np.abs(np.diff(trains[20:, 9])).max() < 0.1, "the yaw rate has no jitter"
    assert max(laboratory.beside(state) for state in trains) < 1e-3
    assert trains[:, 6] == pytest.approx(REST, abs=1e-3)


def test_the_first_train_stands_until_its_delay_is_over():
    laboratory = Laboratory("train.start_delay=1.0", "objects=[!Ball {}]")
    trains, _ = laboratory.watch(2.0)
    assert np.abs(trains[5:11, 10:12]).max() < 1e-3
    assert np.hypot(*trains[-1, 10:12]) == pytest.approx(SPEED, rel=0.03)


@pytest.mark.parametrize(
    "item, message",
    [
        (
            "!Train {track: {kind: circle, radius: 0.09, event: !Stop {at: 3}}}",
            "objects[0].track.event = !Stop: only the first train can have an event",
        ),
        ("!Train {ahead: 0.05}", "objects[0].ahead = 0.05: the train would start 0.050 m from another train"),
        ("!Train {track: {kind: line, length: 1.2}}", "objects[0].track.kind = line: rails or train would be beyond"),
        ("!Train {track: {semi_axes: [0.3, 0.3]}}", "objects[0].track.kind (default) = oval: the track passes"),
        ("!Ball {place: [0.9, 0.0], heading_deg: 0.0}", "objects[0].place: the ball would roll to (0.970, 0.000) m"),
    ],
)
def test_an_object_without_a_place_is_refused(item, message):
    with pytest.raises(DrakeTrackerError) as caught:
        Laboratory(f"objects=[{item}]")
    assert message in str(caught.value) and "\n" not in str(caught.value)


def test_a_train_beyond_the_end_of_an_open_track_is_refused():
    with pytest.raises(DrakeTrackerError, match=r"objects\[0\].ahead \(default\) = -0.6: the train would start"):
        Laboratory("objects=[!Train {}]", spec="train:line")


def test_objects_are_written_and_read_again(tmp_path):
    objects = "[!Train {track: {kind: circle}, speed: 0.2}, !Train {}, !Ball {radius: 0.03}, !Hand {for: null}]"
    scenario = load_scenario("train:learned", overrides=[f"objects={objects}"])
    assert scenario.objects[3].duration is None
    path = tmp_path / "mine.yaml"
    save_scenario(scenario, path)
    assert load_scenario(str(path)).objects == scenario.objects
    rows = {key: value for key, value, *_ in describe_settings(scenario)}
    assert rows["objects[0].track.kind"] == "circle" and rows["objects[1].track"] == "empty"


def test_the_true_states_are_logged(tmp_path):
    scenario = load_scenario("train:two", duration=0.2, overrides=["vision=!Measured {}"])
    simulate(scenario, out=tmp_path / "run", options=RunOptions(record=False))
    signal = load_log(tmp_path / "run" / "log.npz")["truth_object_states"]
    assert signal.names == tuple(f"{field}_0" for field in BODY_STATE)
    assert signal.data.shape == (13, 13) and np.isfinite(signal.data).all()
    assert signal["z_0"] == pytest.approx(REST, abs=1e-3)


def test_the_packaged_scenarios_with_objects():
    two = Laboratory(spec="train:two")
    length = two.track.length
    assert 0.4 * length < (-two.scenario.objects[0].ahead) % length < 0.6 * length
    (ball,) = load_scenario("train:visitor").objects
    assert ball == replace_settings(Ball(), {"at": 3.0})
    assert isinstance(two.scenario.objects[0], Train)
