import numpy as np
import pytest
from variants import variant

from drake_tracker import DrakeTrackerError
from drake_tracker.world.conveyor.belt_motion import make_belt_motion
from drake_tracker.world.conveyor.conveyor_config import BELT_MOTIONS, BeltConfig


@pytest.fixture(params=BELT_MOTIONS)
def motion(request):
    return make_belt_motion(variant(BeltConfig, first_duration=3.0, second_duration=1.5)(motion=request.param))


def test_the_distance_is_the_integral_of_the_speed(motion):
    times = np.linspace(0.0, 25.0, 50001)
    speed = np.array([motion.speed(time) for time in times])
    integral = np.sum(0.5 * (speed[1:] + speed[:-1])) * (times[1] - times[0])
    assert motion.distance(25.0) == pytest.approx(integral, abs=1e-5)
    assert motion.distance(0.0) == motion.distance(-1.0) == motion.speed(0.0) == 0.0


def test_the_speed_never_changes_faster_than_the_acceleration(motion):
    times = np.arange(0.0, 25.0, 0.001)
    speed = np.array([motion.speed(time) for time in times])
    assert np.abs(np.diff(speed)).max() <= 0.5e-3 + 1e-9
    assert speed.min() >= 0.0


def test_the_time_at_a_distance_is_the_first_one(motion):
    for distance in np.linspace(0.0, 3.0, 301):
        time = motion.time_at(distance)
        assert motion.distance(time) == pytest.approx(distance, abs=1e-9)
        assert time == 0.0 or motion.distance(time - 1e-3) < distance


def test_stop_and_go_stands_and_two_speed_does_not():
    belts = [variant(BeltConfig, second_speed=0.25)(motion=motion) for motion in ("stop_and_go", "two_speed")]
    lowest, highest = zip(
        *[(min(v), max(v)) for v in ([make_belt_motion(b).speed(t) for t in np.arange(1.0, 30.0, 0.1)] for b in belts)]
    )
    assert lowest == pytest.approx([0.0, 0.15]) and highest == pytest.approx([0.15, 0.25])


def test_equal_speeds_are_one_speed():
    motion = make_belt_motion(variant(BeltConfig, second_speed=0.15)(motion="two_speed"))
    assert motion.mean_speed == pytest.approx(0.15)
    assert motion.distance(100.0) == pytest.approx(0.15 * (100.0 - 0.15))


def test_an_unknown_motion_is_refused():
    with pytest.raises(DrakeTrackerError, match="belt.motion is 'backwards'"):
        make_belt_motion(BeltConfig(motion="backwards"))
