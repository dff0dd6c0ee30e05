import copy

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.estimation.parts.alpha_beta_gamma_filter import (
    AlphaBetaGammaFilter,
    abg_step,
    alpha_beta_gamma_gains,
    starting_gains,
)


@pytest.mark.parametrize("index", [1e-4, 0.01, 0.2, 1.0, 5.0])
def test_gains_are_those_of_the_steady_kalman_filter(index):
    transition = np.array([[1.0, 1.0, 0.5], [0.0, 1.0, 1.0], [0.0, 0.0, 1.0]])
    input_vector = index * np.array([[0.5], [1.0], [1.0]])
    observed = np.array([[1.0, 0.0, 0.0]])
    prior = solve_discrete_are(transition.T, observed.T, input_vector @ input_vector.T, np.eye(1))
    kalman = (prior @ observed.T / (prior[0, 0] + 1.0)).ravel()
    np.testing.assert_allclose(alpha_beta_gamma_gains(index), kalman, rtol=1e-4)


def test_kalata_relations():
    alpha, beta, gamma = alpha_beta_gamma_gains(0.3)
    assert beta == pytest.approx(2.0 * (2.0 - alpha) - 4.0 * np.sqrt(1.0 - alpha))
    assert gamma == pytest.approx(beta**2 / (2.0 * alpha))
    assert gamma / np.sqrt(1.0 - alpha) == pytest.approx(0.3)


@pytest.mark.parametrize("index", [0.0, -1.0, np.nan, np.inf])
def test_bad_index_is_refused(index):
    with pytest.raises(DrakeTrackerError, match="tracking_index"):
        alpha_beta_gamma_gains(index)


def test_step_works_on_scalars_and_arrays_and_without_a_measurement():
    gains = alpha_beta_gamma_gains(0.2)
    x, v, a = abg_step(1.0, 2.0, 4.0, None, 0.5, gains)
    assert (x, v, a) == (2.5, 4.0, 4.0)
    vector = abg_step(np.ones(2), np.full(2, 2.0), np.full(2, 4.0), np.full(2, 3.0), 0.5, gains)
    scalar = abg_step(1.0, 2.0, 4.0, 3.0, 0.5, gains)
    np.testing.assert_allclose(np.array(vector), np.array([scalar, scalar]).T)
    assert scalar[2] == pytest.approx(4.0 + gains.gamma * 0.5 / 0.25)


def test_step_of_no_time_corrects_the_position_only():
    gains = alpha_beta_gamma_gains(0.2)
    x, v, a = abg_step(0.0, 1.0, 1.0, 1.0, 0.0, gains)
    assert (x, v, a) == (gains.alpha, 1.0, 1.0)


def test_start_is_the_least_squares_parabola():
    steady = alpha_beta_gamma_gains(1e-9)
    values = np.random.default_rng(1000).normal(size=9)
    x = v = a = 0.0
    for count, value in enumerate(values):
        x, v, a = abg_step(x, v, a, value, 1.0, starting_gains(count, steady))
    parabola = np.polyfit(np.arange(9) - 8, values, 2)
    np.testing.assert_allclose([x, v, 0.5 * a], parabola[::-1], atol=1e-10)


def test_filter_follows_a_parabola_exactly_through_missing_points():
    tracker = AlphaBetaGammaFilter(2, 0.1)
    state = tracker.initial_state()

    def truth(t):
        return np.array([1.0 + 2.0 * t - 3.0 * t * t, 0.5 * t])

    for k in range(120):
        t = k / 60.0
        state = tracker.update(state, t, None if k % 7 == 3 and k > 3 else truth(t))
    np.testing.assert_allclose(tracker.predict(state, 2.5)[0], truth(2.5), atol=1e-9)


def test_filter_ignores_what_it_cannot_use_and_restarts_after_a_gap():
    tracker = AlphaBetaGammaFilter(1, 0.1, restart_after=0.5)
    state = tracker.initial_state()
    for k in range(30):
        state = tracker.update(state, k * 0.02, np.array([0.1 * k]))
    assert tracker.update(state, 0.1, np.array([9.0])) is state
    assert tracker.update(state, 0.7, np.array([np.nan])) is state
    assert tracker.update(state, 0.7, None) is state
    assert copy.deepcopy(state) is state and not state.x.flags.writeable
    fresh = tracker.update(state, 5.0, np.array([7.0]))
    assert fresh.count == 1 and fresh.x[0] == 7.0 and fresh.v[0] == 0.0
