import numpy as np
import pytest
from scipy.integrate import quad

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.world.config import SPEED_LAWS
from drake_tracker.world.train.speed_law import (
    GO_TIME,
    RAMP_TIME,
    REST_TIME,
    STOP_AND_GO_PERIOD,
    VARYING_PERIOD,
    check_speed_law,
    distance_at,
    speed_at,
)


@pytest.mark.parametrize("law", SPEED_LAWS)
@pytest.mark.parametrize("time", [0.0, 1.3, 4.2, 5.0, 6.3, 6.5, 17.9])
def test_distance_is_the_integral_of_the_speed(law, time):
    corners = [k * STOP_AND_GO_PERIOD + t for k in range(3) for t in (0.0, 4.0, 4.5, 6.0) if 0 < t + k < time]
    expected, _ = quad(lambda t: speed_at(law, 0.2, 0.15, t), 0.0, time, points=corners or None, limit=200)
    assert distance_at(law, 0.2, 0.15, time) == pytest.approx(expected, abs=1e-8)


def test_constant_is_constant():
    assert {speed_at("constant", 0.15, 0.5, t) for t in (0.0, 1.0, 7.7)} == {0.15}


def test_varying_swings_by_the_variation_about_the_speed():
    speeds = [speed_at("varying", 0.2, 0.15, t) for t in np.linspace(0.0, VARYING_PERIOD, 401)]
    assert max(speeds) == pytest.approx(0.23) and min(speeds) == pytest.approx(0.17)
    assert np.mean(speeds) == pytest.approx(0.2)


def test_stop_and_go_goes_stops_rests_and_starts_smoothly():
    times = np.arange(0.0, 2 * STOP_AND_GO_PERIOD, 1e-3)
    speeds = np.array([speed_at("stop_and_go", 0.2, 0.15, t) for t in times])
    assert np.all(speeds[times < GO_TIME] == 0.2)
    resting = (times > GO_TIME + RAMP_TIME) & (times < GO_TIME + RAMP_TIME + REST_TIME)
    assert np.all(speeds[resting] == 0.0)
    assert np.mean(speeds == 0.0) == pytest.approx(REST_TIME / STOP_AND_GO_PERIOD, abs=1e-3)
    assert speeds.min() >= 0.0 and speeds.max() <= 0.2
    acceleration = np.diff(speeds) / 1e-3
    assert np.abs(acceleration).max() < 0.2 * np.pi / 2 / RAMP_TIME * 1.001
    assert np.abs(np.diff(acceleration)).max() < 0.01  # no jump of the acceleration anywhere


@pytest.mark.parametrize(
    "arguments, named",
    [
        (("sprint", 0.2, 0.1), "sprint"),
        (("constant", -0.1, 0.1), "speed"),
        (("constant", float("nan"), 0.1), "speed"),
        (("constant", 1.5, 0.1), "speed"),
        (("varying", 0.2, 1.0), "variation"),
        (("varying", 0.2, float("nan")), "variation"),
    ],
)
def test_what_cannot_be_is_refused(arguments, named):
    with pytest.raises(DrakeTrackerError, match=named):
        check_speed_law(*arguments)


@pytest.mark.parametrize("law", SPEED_LAWS)
def test_a_delay_shifts_the_law(law):
    for time in (0.0, 1.4):
        assert speed_at(law, 0.2, 0.3, time, 1.5) == distance_at(law, 0.2, 0.3, time, 1.5) == 0.0
    for time in (1.5, 4.0, 9.3):
        assert speed_at(law, 0.2, 0.3, time, 1.5) == speed_at(law, 0.2, 0.3, time - 1.5)
        assert distance_at(law, 0.2, 0.3, time, 1.5) == distance_at(law, 0.2, 0.3, time - 1.5)
