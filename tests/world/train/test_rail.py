import math

import pytest

from drake_tracker.world.train.rail import (
    DRIVE_LIMIT,
    END_MARGIN,
    LATERAL_LIMIT,
    LATERAL_STIFFNESS,
    YAW_LIMIT,
    YAW_STIFFNESS,
    held_on_rail,
    rail_force,
)
from drake_tracker.world.train.tracks import make_track

HEIGHT = 0.485
LINE = make_track("line", centre=(0.5, 0.0))  # along +y: to its left is -x


def state(x=0.5, y=0.0, z=HEIGHT, yaw=math.pi / 2, roll=0.0, velocity=(0.0, 0.0), yaw_rate=0.0, norm=1.0):
    """Free-body state of a train that is rolled about its own x axis and then turned by its yaw."""
    cy, sy, cr, sr = math.cos(yaw / 2), math.sin(yaw / 2), math.cos(roll / 2), math.sin(roll / 2)
    quaternion = [norm * q for q in (cy * cr, cy * sr, sy * sr, sy * cr)]
    return [*quaternion, x, y, z, 0.0, 0.0, yaw_rate, *velocity, 0.0]


def force(track, train, speed, height, near=math.nan):
    return rail_force(track, held_on_rail(track, train, height, near), train, speed)


def test_at_rest_in_place_nothing_acts():
    assert force(LINE, state(), 0.0, HEIGHT) == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)


def test_a_spring_pulls_sideways_back_to_the_rail():
    force_x, force_y, torque = force(LINE, state(x=0.501), 0.0, HEIGHT)
    assert (force_x, force_y, torque) == pytest.approx((-0.001 * LATERAL_STIFFNESS, 0.0, 0.0), abs=1e-9)
    assert force(LINE, state(x=0.49), 0.0, HEIGHT)[0] == pytest.approx(LATERAL_LIMIT)


def test_dampers_resist():
    assert force(LINE, state(velocity=(0.1, 0.0)), 0.0, HEIGHT)[0] == pytest.approx(-4.5)
    assert force(LINE, state(yaw_rate=1.0), 0.0, HEIGHT)[2] == pytest.approx(-0.06)


def test_yaw_is_turned_to_the_tangent():
    assert force(LINE, state(yaw=math.pi / 2 + 0.1), 0.0, HEIGHT)[2] == pytest.approx(-0.1 * YAW_STIFFNESS)
    assert force(LINE, state(yaw=math.pi / 2 - 0.5), 0.0, HEIGHT)[2] == pytest.approx(YAW_LIMIT)


def test_a_quaternion_that_is_not_of_unit_length_changes_nothing():
    once = force(LINE, state(x=0.501, yaw=1.5), 0.1, HEIGHT)
    assert force(LINE, state(x=0.501, yaw=1.5, norm=1.1), 0.1, HEIGHT) == pytest.approx(once, abs=1e-12)


def test_the_drive_pushes_along_the_track_towards_the_target_speed():
    assert force(LINE, state(velocity=(0.0, 0.101)), 0.1, HEIGHT)[1] == pytest.approx(-0.06)
    assert force(LINE, state(), 0.1, HEIGHT)[1] == pytest.approx(DRIVE_LIMIT)
    assert force(LINE.reversed(), state(yaw=-math.pi / 2), 0.1, HEIGHT)[1] == pytest.approx(-DRIVE_LIMIT)


def test_at_the_end_of_an_open_track_the_drive_brakes():
    near = force(LINE, state(y=0.45 - END_MARGIN - 0.01, velocity=(0.0, 0.2)), 0.2, HEIGHT)
    assert near[1] == pytest.approx(-DRIVE_LIMIT)
    assert force(LINE, state(y=0.45 - END_MARGIN), 0.2, HEIGHT)[1] == pytest.approx(0.0, abs=1e-9)
    far = force(LINE, state(y=0.2, velocity=(0.0, 0.2)), 0.2, HEIGHT)
    assert far[1] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("roll", [0.0, 0.05])
def test_it_holds_a_train_that_stands_on_it(roll):
    standing = state(x=0.501, z=HEIGHT + 0.001, roll=roll)
    assert force(LINE, standing, 0.0, HEIGHT)[0] == pytest.approx(-2.0, abs=0.01)


@pytest.mark.parametrize(
    "off",
    [{"z": HEIGHT + 0.004}, {"z": HEIGHT + 0.1}, {"roll": 0.28}, {"roll": -1.5}, {"roll": math.pi}, {"x": 0.5311}],
)
def test_it_lets_go_of_a_train_lifted_tilted_or_carried_aside(off):
    values = {"x": 0.501, "velocity": (0.1, 0.1), "yaw": 1.5, **off}
    assert force(LINE, state(**values), 0.2, HEIGHT) == (0.0, 0.0, 0.0)


def test_it_lets_go_without_a_jump():
    forces = [force(LINE, state(x=0.501, z=HEIGHT + 1e-4 * k), 0.0, HEIGHT)[0] for k in range(60)]
    steps = [abs(b - a) for a, b in zip(forces, forces[1:])]
    assert forces[0] == pytest.approx(-2.0) and forces[-1] == 0.0 and max(steps) < 0.11


def test_on_a_curve_the_damper_expects_the_train_to_turn():
    circle = make_track("circle", radius=0.12, centre=(0.0, 0.0))
    x, y, heading = (float(value) for value in circle.pose(0.1))
    along = 0.2 * math.cos(heading), 0.2 * math.sin(heading)
    turning = state(x=x, y=y, yaw=heading, velocity=along, yaw_rate=0.2 / 0.12)
    assert force(circle, turning, 0.2, HEIGHT) == pytest.approx((0.0, 0.0, 0.0), abs=0.02)
    rigid = state(x=x, y=y, yaw=heading, velocity=along)
    assert force(circle, rigid, 0.2, HEIGHT)[2] == pytest.approx(0.06 * 0.2 / 0.12, rel=1e-2)


def test_the_rail_holds_a_train_where_it_was_before():
    """In the middle of an eight, with the heading half-way between the two branches."""
    eight = make_track("figure_eight", centre=(0.0, 0.0))
    first, second = 0.0, 0.5 * eight.length
    middle = 0.5 * (eight.pose(first)[2] + math.remainder(eight.pose(second)[2], 2 * math.pi))
    for near in (first, second):
        standing = state(x=0.0, y=0.0, yaw=middle)
        assert math.remainder(held_on_rail(eight, standing, HEIGHT, near).place - near, eight.length) == pytest.approx(
            0.0, abs=1e-3
        )
        torque = force(eight, standing, 0.0, HEIGHT, near)[2]
        assert math.sin(eight.pose(near)[2] - middle) * torque > 0.0, "it turns towards its own branch"


@pytest.mark.parametrize("values", [{"z": HEIGHT + 0.004}, {"x": 0.55}])
def test_there_is_no_place_off_the_rail(values):
    assert held_on_rail(LINE, state(**values), HEIGHT, 0.45) is None
