"""Tests of estimators at other rates than 60 points a second."""

import functools

import numpy as np
import pytest

from drake_tracker.estimation.estimator import make_estimator

AHEAD = 0.25
"""Time ahead at which the error is compared, the lag of vision [s]."""


def place(time):
    return np.array([0.56 + 0.2 * np.cos(0.75 * time), 0.2 * np.sin(0.75 * time), 0.47])


@functools.cache
def error(name, rate, **options):
    """Root mean square error [m] ahead on a circle, with 1 mm of noise, of two seeds."""
    squares = []
    for seed in range(2):
        noise, estimator = np.random.default_rng(seed), make_estimator(name, **options)
        state = estimator.initial_state()
        for stamp in np.arange(1, 9 * rate) / rate:
            state = estimator.update(state, stamp, place(stamp) + noise.normal(0.0, 1e-3, 3))
            if stamp > 3.0 and estimator.ready(state):
                predicted = estimator.predict(state, np.array([stamp + AHEAD]))[0, :3]
                squares.append(np.sum((predicted - place(stamp + AHEAD))[:2] ** 2))
    return np.sqrt(np.mean(squares))


@pytest.mark.parametrize("name", ["alpha_beta_gamma", "arc_length", "coordinated_turn"])
@pytest.mark.parametrize("rate", [15, 30, 120])
def test_points_at_another_rate_at_most_double_the_error(name, rate):
    assert error(name, rate) < 2.0 * error(name, 60)


@pytest.mark.parametrize("rate", [5, 15, 120])
def test_alpha_beta_gamma_needs_no_period(rate):
    """The default is tuned for 60 Hz, and follows the interval at which points arrive."""
    assert error("alpha_beta_gamma", rate) < 1.2 * error("alpha_beta_gamma", rate, period=1.0 / rate)
    assert error("alpha_beta_gamma", rate) < 2.0 * error("alpha_beta_gamma", 60)
