import math

import numpy as np
import pytest

from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.estimation.estimator import check_estimator, make_estimator
from drake_tracker.estimation.sharp_corners import (
    GOOD,
    LENGTH,
    SharpCornersEstimator,
    SharpCornersState,
    faded,
    line_share,
    newest_line,
    persistence_length,
)
from drake_tracker.estimation.sudden_change import with_speed_change_detection

NOISE, SPEED = 0.001, 0.10


def zigzag(times, straight=0.05, angle=math.pi / 2):
    """Places (n, 2) [m] of an object that turns by ``angle`` to and fro after each ``straight`` [m]."""
    s = SPEED * times
    corners = np.arange(0.0, s[-1] + straight, straight)
    headings = angle * (np.arange(len(corners)) % 2)
    steps = straight * np.column_stack([np.cos(headings), np.sin(headings)])
    ends = np.vstack([[0.0, 0.0], np.cumsum(steps, axis=0)])[: len(corners)]
    return np.column_stack([np.interp(s, corners, column) for column in ends.T])


def run(places, times, estimator, seed=0):
    """Yields (number, state) after each measured point."""
    random, state = np.random.default_rng(seed), estimator.initial_state()
    for k, (time, place) in enumerate(zip(times, places)):
        point = np.array([*(place + random.normal(0.0, NOISE, 2)), 0.47])
        state = estimator.update(state, float(time), point)
        yield k, state


def errors(estimator, times, places, ahead, after):
    """Errors [m] of the predictions ``ahead`` [s]."""
    found, steps = [], round(ahead / VISION_PERIOD)
    for k, state in run(places, times, estimator):
        if times[k] > after and k + steps < len(times) and estimator.ready(state):
            predicted = estimator.predict(state, np.array([times[k + steps]]))[0, :2]
            found.append(np.hypot(*(predicted - places[k + steps])))
    return np.array(found)


@pytest.mark.parametrize("kind", ["closed_path", "coordinated_turn"])
def test_at_sharp_corners_errors_are_much_smaller_than_those_of_the_filter_alone(kind):
    times = np.arange(600) * VISION_PERIOD
    places = zigzag(times)
    alone = with_speed_change_detection(make_estimator(kind))
    before = errors(alone, times, places, 0.2, 3.0)
    now = errors(SharpCornersEstimator(alone), times, places, 0.2, 3.0)
    assert np.median(now) < 0.6 * np.median(before) and np.percentile(now, 90) < 0.9 * np.percentile(before, 90)


@pytest.mark.parametrize("radius", [0.06, 0.2, math.inf])
def test_on_a_smooth_path_the_predictions_are_those_of_the_filter_bit_for_bit(radius):
    times = np.arange(500) * VISION_PERIOD
    if math.isinf(radius):
        places = np.column_stack([SPEED * times, 0.0 * times])
    else:
        places = radius * np.column_stack([np.cos(SPEED * times / radius), np.sin(SPEED * times / radius)])
    alone = make_estimator("closed_path")
    estimator = SharpCornersEstimator(alone)
    later = times[-1] + np.array([0.0, 0.25, 0.5])
    (*_, (_, one)), (*_, (_, other)) = run(places, times, alone), run(places, times, estimator)
    assert line_share(other) == 0.0
    assert np.array_equal(alone.predict(one, later), estimator.predict(other, later))
    assert np.array_equal(alone.predict_std(one, later), estimator.predict_std(other, later))


def test_a_learned_path_is_judged_anew():
    """What the filter predicted before it knew the path says nothing about its predictions along it."""
    lap = 12 * 0.08
    times = np.arange(round(2.2 * lap / SPEED / VISION_PERIOD)) * VISION_PERIOD
    s = SPEED * times % lap
    angles = np.linspace(0.0, 2.0 * np.pi, 7)
    corners = lap / 6.0 * np.column_stack([np.cos(angles), np.sin(angles)])
    places = np.column_stack([np.interp(s, np.linspace(0.0, lap, 7), column) for column in corners.T])
    estimator = SharpCornersEstimator(with_speed_change_detection(make_estimator("closed_path")))
    states = [state for _, state in run(places, times, estimator)]
    learned = next(k for k, state in enumerate(states) if state.knows_path)
    assert not any(state.knows_path for state in states[: round(0.9 * lap / SPEED / VISION_PERIOD)])
    assert states[learned].squares == SharpCornersState.squares and line_share(states[-1]) == 0.0


def test_the_line_leads_through_the_newest_centimetre():
    times = np.arange(30) * VISION_PERIOD
    rows = np.column_stack([times, 0.3 * times, np.where(times < 0.3, 0.0, -0.4 * (times - 0.3))])
    start, velocity = newest_line(rows)
    assert start == pytest.approx(rows[-1, 1:], abs=1e-9) and velocity == pytest.approx([0.3, -0.4])
    assert 0.5 * (times[-1] - 0.3) > LENGTH
    assert newest_line(rows[:1]) is None, "too few points"
    assert newest_line(rows * [1.0, 0.0, 0.0]) is None, "at rest"


@pytest.mark.parametrize("persistence", [0.02, 0.05, 0.3])
def test_the_displacement_of_random_paths_is_that_of_their_persistence_length(persistence):
    """Monte Carlo: corners at random, each into any direction."""
    random, step, count = np.random.default_rng(3), persistence / 100.0, 200
    headings = np.zeros(4000)
    along = np.zeros((4000, count))
    for k in range(count):
        turns = random.random(4000) < step / persistence
        headings = np.where(turns, random.uniform(-np.pi, np.pi, 4000), headings)
        along[:, k] = step * np.cos(headings)
    mean, distance = along.sum(axis=1).mean(), step * count
    assert mean == pytest.approx(float(faded(np.array(distance), persistence)), rel=0.06)
    kept = (float(faded(np.array(0.03), persistence)), 0.03)
    state = SharpCornersState(None, np.empty((0, 3)), kept=kept)
    assert persistence_length(state) == pytest.approx(persistence, rel=1e-6)
    assert math.isinf(persistence_length(SharpCornersState(None, np.empty((0, 3)), kept=(0.03, 0.03))))


def test_the_weight_is_that_of_the_smaller_errors():
    def share(filtered, line):
        return line_share(SharpCornersState(None, np.empty((0, 3)), squares=(filtered**2, line**2)))

    assert share(0.99 * GOOD, 0.001) == 0.0
    assert share(0.02, 0.02) == 0.5 and share(0.03, 0.02) > 0.99 and share(0.02, 0.03) < 0.01


def test_it_is_an_estimator():
    check_estimator(SharpCornersEstimator(with_speed_change_detection(make_estimator("closed_path"))))
