"""The cube on its rail: what it weighs, how it follows a corner, and which branch of a track it keeps to."""

import math

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from drake_tracker.core.timing import TIME_STEP
from drake_tracker.world.scene_object import Ride
from drake_tracker.world.train.plant import TRAIN_HEIGHT, add_plant, add_table, train_pose
from drake_tracker.world.train.rail import held_on_rail, load_of, rail_force
from drake_tracker.world.train.rail_system import add_rail
from drake_tracker.world.train.tracks import Track, make_track
from drake_tracker.world.train.train_model import add_train

HEIGHT = 0.45 + TRAIN_HEIGHT


@pytest.mark.parametrize("scale", [0.5, 1.0, 1.5])
def test_mass_and_inertia_are_those_of_a_solid_cube_and_known_to_the_rail(scale):
    loads = {}
    for body in ("plain", "cube"):
        plant, _ = add_plant(DiagramBuilder(), time_step=TIME_STEP)
        train = add_train(plant, body=body, scale=scale, name="one")
        plant.Finalize()
        inertia = plant.get_body(*plant.GetBodyIndices(train)).default_spatial_inertia()
        loads[body] = inertia.get_mass(), inertia.CalcRotationalInertia().get_moments()
    mass, moments = loads["cube"]
    assert mass == pytest.approx(0.05 * scale**3)
    assert moments == pytest.approx([mass * (0.030 * scale) ** 2 / 6.0] * 3)
    for body, (mass, moments) in loads.items():
        load = load_of(body, scale)
        assert load.mass == pytest.approx(mass / 0.25)
        assert load.mass * load.turning == pytest.approx(moments[2] / 3.3333e-4, rel=1e-4)
    assert load_of("plain", 1.0) == (0.06, 1.0, 1.0)


@pytest.mark.parametrize("turns", [False, True])
def test_it_follows_corners_and_keeps_or_turns_its_direction(turns):
    s = np.linspace(0.0, 0.15, 151)
    points = np.vstack([np.column_stack([0.4 + s, 0.0 * s]), np.column_stack([0.55 + 0.0 * s, s])[1:]])
    corner = 0.01 * np.array([[math.sin(a), 1.0 - math.cos(a)] for a in np.linspace(0.0, math.pi / 2, 16)])
    points = np.vstack([points[:141], corner + points[140], points[161:] + [0.0, 0.0]])
    track = Track(points, closed=False)
    builder = DiagramBuilder()
    plant, _ = add_plant(builder, time_step=TIME_STEP)
    add_table(plant, height=0.45)
    train = add_train(plant, body="cube")
    plant.Finalize()
    ride = Ride(track, 0.02, speed=0.2, body="cube", turns=turns)
    body = plant.GetBodyByName("train")
    plant.SetDefaultFloatingBaseBodyPose(body, train_pose(track, 0.02, 0.45, turns))
    add_rail(builder, plant=plant, train=train, ride=ride, height=HEIGHT)
    simulator = Simulator(builder.Build())
    context = plant.GetMyContextFromRoot(simulator.get_context())
    places = []
    for time in np.arange(0.1, 1.2, 0.02):
        simulator.AdvanceTo(time)
        X_WB = plant.EvalBodyPoseInWorld(context, body)
        x, y, z = X_WB.translation()
        yaw = math.atan2(X_WB.rotation().matrix()[1, 0], X_WB.rotation().matrix()[0, 0])
        place, lateral = track.locate(x, y, 0.0, 0.0)[:2]
        places.append(place)
        assert abs(lateral) < 1.5e-3 and abs(z - HEIGHT) < 1e-3
        if not turns:
            assert abs(yaw) < math.radians(3.0)
    assert places[-1] > 0.2
    assert yaw == pytest.approx(math.pi / 2 if turns else 0.0, abs=math.radians(1.0))


def test_the_place_in_the_state_chooses_the_branch_and_the_tangent():
    eight = make_track("figure_eight", centre=(0.56, 0.0))
    first = eight.nearest(0.56, 0.0, eight.pose(0.25 * eight.length)[2])[0]
    second = (first + 0.5 * eight.length) % eight.length
    crossing = [1.0, 0.0, 0.0, 0.0, 0.56, 0.0, HEIGHT, *[0.0] * 6]
    for near in (first, second):
        held = held_on_rail(eight, crossing, HEIGHT, near - 0.003, turns=False)
        assert held.place == pytest.approx(near, abs=2e-3)
        force_x, force_y, torque = rail_force(eight, held, crossing, 0.2, turns=False)
        assert math.atan2(force_y, force_x) == pytest.approx(
            math.remainder(float(eight.pose(near)[2]), 2.0 * math.pi), abs=0.05
        )
        assert torque == 0.0
