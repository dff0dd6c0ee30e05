"""The rail against a real plant: a body on four wheel spheres, at the step and contact model of the whole machine."""

import math

import crossing_tracks
import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlantConfig
from pydrake.multibody.tree import BodyIndex
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.timing import TIME_STEP
from drake_tracker.world.config import ChangeSpeed, Reverse, Stop
from drake_tracker.world.scene_object import Ride
from drake_tracker.world.train.rail_system import RailSystem, add_rail
from drake_tracker.world.train.speed_law import distance_at
from drake_tracker.world.train.tracks import make_track

HEIGHT = 0.035  # of the train's reference point above the plane z = 0

WHEELS = "".join(
    f"""
    <collision name="wheel_{x}_{y}">
      <pose>{x} {y} -0.027 0 0 0</pose>
      <geometry><sphere><radius>0.008</radius></sphere></geometry>
      <drake:proximity_properties>
        <drake:mu_static>0.01</drake:mu_static><drake:mu_dynamic>0.01</drake:mu_dynamic>
      </drake:proximity_properties>
    </collision>"""
    for x in (-0.04, 0.04)
    for y in (-0.016, 0.016)
)
SCENE = f"""
<sdf version="1.7" xmlns:drake="https://drake.mit.edu"><world name="laboratory">
<model name="table"><static>true</static><link name="top"><pose>0 0 -0.05 0 0 0</pose>
  <collision name="top"><geometry><box><size>4 4 0.1</size></box></geometry></collision>
</link></model>
<model name="train"><link name="body">
  <inertial><mass>0.25</mass><inertia>
    <ixx>8.5e-5</ixx><iyy>3.5e-4</iyy><izz>3.3e-4</izz><ixy>0</ixy><ixz>0</ixz><iyz>0</iyz>
  </inertia></inertial>{WHEELS}
</link></model>
</world></sdf>"""


class Travel:
    """A train on a track; `to` drives it and returns rows (time, s, lateral, yaw error, speed, z)."""

    def __init__(self, track, start=0.0, lift=0.0, aside=0.0, **law):
        builder = DiagramBuilder()
        self.plant, _ = AddMultibodyPlant(
            MultibodyPlantConfig(time_step=TIME_STEP, discrete_contact_approximation="lagged"), builder
        )
        Parser(self.plant).AddModelsFromString(SCENE, "sdf")
        self.plant.Finalize()
        self.train = self.plant.GetModelInstanceByName("train")
        self.track = track
        self.rail = add_rail(builder, plant=self.plant, train=self.train, ride=Ride(track, start, **law), height=HEIGHT)
        diagram = builder.Build()
        self.simulator = Simulator(diagram)
        self.context = self.plant.GetMyContextFromRoot(self.simulator.get_context())
        x, y, heading = track.pose(start)
        self.plant.SetFreeBodyPose(
            self.plant.GetMyMutableContextFromRoot(self.simulator.get_mutable_context()),
            self.plant.GetBodyByName("body"),
            RigidTransform(
                RollPitchYaw(0.0, 0.0, heading),
                [x - aside * math.sin(heading), y + aside * math.cos(heading), HEIGHT + lift],
            ),
        )

    def to(self, time, period=0.05):
        rows = []
        while self.simulator.get_context().get_time() < time - 1e-9:
            self.simulator.AdvanceTo(self.simulator.get_context().get_time() + period)
            state = self.plant.get_state_output_port(self.train).Eval(self.context)
            qw, _, _, qz, x, y, z, _, _, _, vx, vy, _ = state
            yaw = 2.0 * math.atan2(qz, qw)
            s, lateral = self.track.nearest(x, y, yaw)
            error = math.remainder(yaw - self.track.pose(s)[2], 2 * math.pi)
            rows.append([self.simulator.get_context().get_time(), s, lateral, error, math.hypot(vx, vy), z])
        return np.array(rows)

    def place(self):
        return self.rail.GetMyContextFromRoot(self.simulator.get_context()).get_discrete_state(0).value()[0]

    def set_down(self, x, y, heading, z=HEIGHT):
        context = self.plant.GetMyMutableContextFromRoot(self.simulator.get_mutable_context())
        pose = RigidTransform(RollPitchYaw(0.0, 0.0, heading), [x, y, z])
        self.plant.SetFreeBodyPose(context, self.plant.GetBodyByName("body"), pose)

    def spatial_force(self):
        context = self.rail.GetMyContextFromRoot(self.simulator.get_context())
        (applied,) = self.rail.GetOutputPort("spatial_forces").Eval(context)
        return applied


@pytest.mark.parametrize("direction", ["forward", "backward"])
@pytest.mark.parametrize("kind", ["oval", "figure_eight"])
def test_it_follows_the_track_at_its_speed(kind, direction):
    track = make_track(kind, centre=(0.0, 0.0))
    track = track.reversed() if direction == "backward" else track
    duration = 1.05 * track.length / 0.2
    ride = Travel(track, start=0.1, speed=0.2).to(duration)
    settled = ride[ride[:, 0] > 0.5]
    assert np.abs(settled[:, 2]).max() < 1e-3
    assert np.abs(settled[:, 3]).max() < math.radians(1.0)
    np.testing.assert_allclose(settled[:, 4], 0.2, rtol=0.02)
    assert np.abs(settled[:, 5] - HEIGHT).max() < 1e-3
    # Its way never jumps, not even at the crossing, and covers the whole track.
    way = np.unwrap(ride[:, 1], period=track.length)
    assert way[-1] - way[0] == pytest.approx(0.2 * (duration - 0.05), rel=0.02)
    assert np.diff(way).min() > 0.0


def test_it_stops_and_goes():
    track = make_track("oval", centre=(0.0, 0.0))
    ride = Travel(track, speed=0.15, speed_law="stop_and_go").to(8.0)
    resting = ride[(ride[:, 0] > 4.7) & (ride[:, 0] < 5.9)]
    assert np.abs(resting[:, 4]).max() < 2e-3
    assert ride[-1, 1] == pytest.approx(distance_at("stop_and_go", 0.15, 0.0, 8.0), rel=0.02)


def test_at_the_end_of_a_line_it_stands():
    ride = Travel(make_track("line", centre=(0.0, 0.0)), start=0.6, speed=0.2).to(3.0)
    assert ride[-1, 1] == pytest.approx(0.84, abs=2e-3)
    assert ride[-1, 4] < 5e-3


@pytest.mark.parametrize("speed, aside, turned", [(0.1, 0.2, 4.0), (0.2, 0.5, 6.0)])
def test_it_follows_a_random_walk_and_stops_at_its_end(speed, aside, turned):
    """Corners of 10 mm, the tightest allowed: distance from the track in mm, error of the heading in deg."""
    track = make_track("random_walk", length=0.7, corner_radius=0.01, walk_seed=(2,))
    assert np.abs(track.curvature(np.linspace(0.0, track.length, 701))).max() > 95.0
    ride = Travel(track, speed=speed).to(0.7 / speed + 1.0, period=0.02)
    assert np.abs(ride[:, 2]).max() < 1e-3 * aside
    assert np.abs(ride[:, 3]).max() < math.radians(turned)
    assert np.abs(ride[:, 5] - HEIGHT).max() < 1e-3
    assert np.diff(ride[:, 1]).min() > -1e-4 and ride[-1, 1] == pytest.approx(track.length - 0.06, abs=2e-3)
    assert ride[-1, 4] < 5e-3


@pytest.mark.parametrize("kind, seed", [("walk", 4), ("figure eight", 1), ("Lissajous", 2), ("double loop", 3)])
def test_it_keeps_to_its_branch_where_a_track_crosses_or_touches_itself(kind, seed, tmp_path):
    track = crossing_tracks.drawn(kind, np.random.default_rng([seed]), tmp_path / "track.csv")
    found = crossing_tracks.judged(track, 0.35, crossing_tracks.travel(track, 0.35, share=0.6))
    assert found["jumps"] == 0 and found["aside_mm"] < 3.0
    if kind == "walk":
        assert found["memoryless"] > 0, "the nearest of all branches is often another one"


def test_a_copy_of_a_context_continues_in_the_same_way():
    track = make_track("figure_eight", centre=(0.0, 0.0))
    ride = Travel(track, start=0.2, speed=0.2)
    ride.to(0.5)
    copy = Simulator(ride.simulator.get_system(), ride.simulator.get_context().Clone())
    copy.AdvanceTo(0.7)
    ride.to(0.7)
    get = ride.simulator.get_system().GetMutableSubsystemContext
    states = [get(ride.plant, sim.get_mutable_context()) for sim in (copy, ride.simulator)]
    first, second = (ride.plant.get_state_output_port(ride.train).Eval(context) for context in states)
    np.testing.assert_array_equal(first, second)
    places = [
        ride.rail.GetMyContextFromRoot(sim.get_context()).get_discrete_state(0).value()[0]
        for sim in (copy, ride.simulator)
    ]
    assert places[0] == places[1] == pytest.approx(0.2 + 0.7 * 0.2, abs=0.02)


def test_a_train_that_is_lifted_or_set_elsewhere_is_found_again():
    track = make_track("stadium", centre=(0.0, 0.0))
    ride = Travel(track, start=0.1, speed=0.0)
    ride.to(0.05)
    x, y, heading = track.pose(0.6)
    ride.set_down(x, y, heading, z=HEIGHT + 0.05)
    ride.to(0.06, period=TIME_STEP)
    assert math.isnan(ride.place())
    ride.set_down(x, y, heading)
    ride.to(0.07, period=TIME_STEP)
    assert ride.place() == pytest.approx(0.6, abs=1e-3)
    ride.set_down(*track.pose(0.3))  # without being lifted
    ride.to(0.08, period=TIME_STEP)
    assert ride.place() == pytest.approx(0.3, abs=1e-3)


def test_it_draws_a_train_set_beside_it_onto_it():
    track = make_track("stadium", centre=(0.0, 0.0))
    rows = Travel(track, start=0.1, aside=0.003, speed=0.1).to(0.5)
    assert abs(rows[-1, 2]) < 1e-4


def test_the_force_is_applied_at_the_trains_origin_and_vanishes_once_it_is_lifted():
    track = make_track("oval", centre=(0.0, 0.0))
    ride = Travel(track, speed=0.2)
    applied = ride.spatial_force()
    assert applied.body_index == ride.plant.GetBodyByName("body").index()
    np.testing.assert_array_equal(applied.p_BoBq_B, np.zeros(3))
    _, _, heading = track.pose(0.0)
    np.testing.assert_allclose(
        applied.F_Bq_W.translational(), [0.6 * math.cos(heading), 0.6 * math.sin(heading), 0.0], atol=1e-3
    )
    lifted = Travel(track, lift=0.005, speed=0.2).spatial_force()
    np.testing.assert_array_equal(lifted.F_Bq_W.get_coeffs(), np.zeros(6))


def test_ports_and_refusals():
    rail = RailSystem(Ride(make_track("oval"), speed=0.1), 1, HEIGHT)
    assert rail.GetInputPort("train_state").size() == 13
    assert rail.GetOutputPort("spatial_forces").get_name() == "spatial_forces"
    with pytest.raises(DrakeTrackerError, match="speed_law"):
        RailSystem(Ride(make_track("oval"), speed=0.1, speed_law="sprint"), 1, HEIGHT)


def command(frozen):
    """An `ArmCommand` that descends or does not."""
    return np.array([0.0, 1.0, 0.3, 1.0, 0.1, float(frozen), 0.08])


EVENTS = {
    "stop": (Stop(at=1.0), 0.0),
    "reverse": (Reverse(at=1.0), -0.2),
    "half the speed": (ChangeSpeed(at=1.0, factor=0.5), 0.1),
}


@pytest.mark.parametrize("name", EVENTS)
def test_an_event_changes_the_speed_at_its_time(name):
    event, after = EVENTS[name]
    ride = Travel(make_track("circle", radius=0.2, centre=(0.0, 0.0)), speed=0.2, event=event)
    rows = ride.to(1.0)
    assert rows[-1, 4] == pytest.approx(0.2, abs=0.012)
    rows = ride.to(2.0)
    assert np.diff(rows[-6:, 1]) / 0.05 == pytest.approx(after, abs=0.012)


def test_an_event_ends():
    ride = Travel(make_track("circle", radius=0.2, centre=(0.0, 0.0)), speed=0.2, event=Stop(at=0.8, duration=0.4))
    assert ride.to(1.15)[-1, 4] < 0.004
    assert ride.to(2.0)[-1, 4] == pytest.approx(0.2, abs=0.012)


def test_an_event_begins_after_the_launch():
    """The hand descends from 0.5 s on for the first time, and once more later, which changes nothing."""
    circle = make_track("circle", radius=0.2, centre=(0.0, 0.0))
    rail = RailSystem(Ride(circle, speed=0.2, event=Stop(after_launch=0.3)), BodyIndex(1), HEIGHT)
    builder = DiagramBuilder()
    builder.AddSystem(rail)
    times = [0.0, 0.5, 0.9, 1.5, 1.8, 3.0]
    phases = np.array([command(k % 2) for k in range(6)]).T
    hand = builder.AddSystem(TrajectorySource(PiecewisePolynomial.ZeroOrderHold(times, phases)))
    turned = [math.cos(math.pi / 4), 0, 0, math.sin(math.pi / 4)]
    train = builder.AddSystem(ConstantVectorSource([*turned, 0.2, 0, HEIGHT, 0, 0, 1.0, 0, 0.2, 0]))
    builder.Connect(hand.get_output_port(), rail.GetInputPort("launch"))
    builder.Connect(train.get_output_port(), rail.GetInputPort("train_state"))
    simulator = Simulator(builder.Build())
    drives = {}
    for k in range(1, 30):
        simulator.AdvanceTo(0.1 * k)
        context = rail.GetMyContextFromRoot(simulator.get_context())
        drives[k] = rail.GetOutputPort("spatial_forces").Eval(context)[0].F_Bq_W.translational()[1]
    assert max(abs(drives[k]) for k in range(1, 8)) < 0.01
    assert all(drives[k] < -0.1 for k in range(9, 30)), "it brakes"


def test_an_event_needs_a_time():
    circle = make_track("circle", radius=0.2, centre=(0.0, 0.0))
    for event in (Stop(), Reverse(at=1.0, after_launch=0.1)):
        with pytest.raises(DrakeTrackerError, match="needs either 'at' or 'after_launch'"):
            RailSystem(Ride(circle, speed=0.2, event=event), BodyIndex(1), HEIGHT)
