"""The estimator of a belt: one speed for all parts, a change of it, a part that slips, an encoder."""

import math

import numpy as np
import pytest

from drake_tracker.core.part_kinds import PartKind
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.estimation.belt import BeltEstimator, BeltState, PartPoint, Travel

NOISE, TURN_NOISE = 0.002, 0.03


def run(distance, count=3, cycles=120, seed=0, slip=None, encoder=False):
    """Feeds noisy points of parts on a belt that has moved by ``distance(t)``; returns the states, one per cycle."""
    rng, estimator, state, states = np.random.default_rng(seed), BeltEstimator(), BeltState(), []
    for k in range(1, cycles + 1):
        t = k * VISION_PERIOD
        points = []
        for n in range(1, count + 1):
            y = -0.4 + 0.1 * n + distance(t) + (slip(t) if slip and n == 1 else 0.0)
            yaw = 0.3 * n + TURN_NOISE * rng.standard_normal()
            noisy = [0.6 + NOISE * rng.standard_normal(), y + NOISE * rng.standard_normal()]
            points.append(PartPoint(n, PartKind.BOX, *noisy, 0.465, yaw, NOISE**2, NOISE**2, TURN_NOISE**2))
        before = t - VISION_PERIOD
        travel = Travel(distance(t) - distance(before), (distance(t) - distance(before)) / VISION_PERIOD)
        state = estimator.update(state, t, points, travel if encoder and k > 1 else None)
        states.append(state)
    return estimator, states


def test_all_parts_measure_the_speed_of_the_belt():
    errors = {
        count: np.std([run(lambda t: 0.15 * t, count, 60, seed)[1][-1].speed - 0.15 for seed in range(20)])
        for count in (1, 8)
    }
    assert errors[8] < 0.75 * errors[1]
    assert errors[8] < 0.001


def test_the_predicted_path_is_right_and_its_standard_deviation_covers_the_error():
    squares = []
    for seed in range(30):
        estimator, states = run(lambda t: 0.2 * t, 3, 90, seed)
        path = estimator.predict(states[-1], 2, np.array([1.5, 2.0, 2.5]))
        truth = -0.2 + 0.2 * np.array([1.5, 2.0, 2.5])
        squares.append(((path.rows[:, 1] - truth) / path.std) ** 2)
        assert path.rows[:, 0] == pytest.approx(0.6, abs=0.002)
        assert path.rows[:, 3] == pytest.approx(0.6, abs=0.03)
    assert 0.1 < np.mean(squares) < 1.5


def test_a_belt_that_stops_is_noticed_within_a_few_points():
    _, states = run(lambda t: 0.15 * min(t, 1.0), 3, 90)
    assert states[59].speed == pytest.approx(0.15, abs=0.01)
    assert abs(states[69].speed) < 0.04
    assert abs(states[72].speed) < 0.02
    assert abs(states[-1].speed) < 0.01


@pytest.mark.parametrize("count", [1, 2])
def test_noise_alone_does_not_look_like_a_belt_that_changes_its_speed(count):
    """With few parts, a mean square above 9 is frequent: with one part it came every six seconds."""
    _, states = run(lambda t: 0.15 * t, count, 3000)
    late = [state.speed for state in states[120:]]
    assert max(late) - min(late) < 0.02


def test_a_stop_is_noticed_with_one_part_too():
    _, states = run(lambda t: 0.15 * min(t, 1.0), 1, 90)
    assert abs(states[74].speed) < 0.03


def test_a_part_that_slips_has_a_speed_of_its_own_and_the_belt_keeps_its_own():
    _, states = run(lambda t: 0.15 * t, 4, 120, slip=lambda t: -0.1 * max(t - 1.0, 0.0))
    final = states[-1]
    assert final.speed == pytest.approx(0.15, abs=0.01)
    assert final.mean[2] == pytest.approx(-0.1, abs=0.02)
    assert not np.any(final.mean[[4, 6, 8]])


def test_a_pushed_part_moves_with_the_belt_again():
    _, states = run(lambda t: 0.15 * t, 4, 180, slip=lambda t: 0.02 * np.clip((t - 1.0) / 0.2, 0.0, 1.0))
    assert states[-1].mean[2] == 0.0
    assert states[-1].mean[1] == pytest.approx(-0.3 + 0.15 * 3.0 + 0.02, abs=0.003)


def test_the_encoder_carries_the_prediction_through_a_stop():
    distance = lambda t: 0.15 * min(t, 1.5)  # noqa: E731
    estimator, states = run(distance, 3, 90, encoder=True)
    stamp, now = states[83].stamp, 1.65
    travel = Travel(distance(now) - distance(stamp), 0.0)
    ahead = estimator.predict(states[83], 1, np.array([now, 2.0]), travel).rows[:, 1]
    assert ahead == pytest.approx([-0.3 + 0.225] * 2, abs=0.002)
    blind = estimator.predict(states[83], 1, np.array([now, 2.0])).rows[:, 1]
    assert blind[1] - ahead[1] > 0.05


def test_parts_come_and_go():
    estimator, state = BeltEstimator(), BeltState()
    point = PartPoint(7, PartKind.ELL, 0.6, -0.4, 0.46, 3.1, 4e-6, 4e-6, 1e-3)
    state = estimator.update(state, 0.1, [point])
    assert state.numbers == (7,)
    turned = point._replace(yaw=-3.1, number=7)
    assert abs(math.remainder(estimator.update(state, 0.2, [turned]).parts[0].yaw - math.pi, 2 * math.pi)) < 0.05
    assert estimator.update(state, 0.1, [point]) is state
    assert estimator.update(state, 1.0, []).numbers == ()
    assert estimator.update(state, 0.2, [point._replace(y=math.nan)]).mean[1] == pytest.approx(-0.4, abs=1e-9)
