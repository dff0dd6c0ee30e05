import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

from drake_tracker.estimation.parts.turn_model import (
    HEADING,
    correct,
    fading_turn,
    position_variances,
    propagate,
    turn_step,
)


@pytest.mark.parametrize("curvature", [5.0, 0.0, -1e-7, -3.0])
def test_jacobian_is_the_derivative(curvature):
    mean, dt, step = np.array([0.1, 0.2, 0.7, 0.15, curvature]), 0.3, 1e-6
    _, jacobian = turn_step(mean, dt)
    for k in range(5):
        e = step * np.eye(5)[k]
        numeric = (turn_step(mean + e, dt)[0] - turn_step(mean - e, dt)[0]) / (2 * step)
        np.testing.assert_allclose(jacobian[:, k], numeric, atol=1e-8)


def test_correction_is_bayes_rule():
    covariance = np.diag([4e-6, 1e-6, 0.1, 0.1, 1.0])
    covariance[0, HEADING] = covariance[HEADING, 0] = 3e-4
    mean, after, left, trace = correct(np.zeros(5), covariance, np.array([1e-3, 0.0]), 4e-6)
    assert mean[0] == pytest.approx(0.5e-3)
    assert mean[HEADING] == pytest.approx(3e-4 / 8e-6 * 1e-3)
    assert after[0, 0] == pytest.approx(2e-6)
    assert after[HEADING, HEADING] == pytest.approx(0.1 - 9e-8 / 8e-6)
    np.testing.assert_allclose(left, [0.5e-3, 0.0])
    assert trace == pytest.approx(2e-6 + 0.8e-6)


@pytest.mark.parametrize("speed", [0.15, -0.3, 1.0])
@pytest.mark.parametrize("curvature", [-20.0, 0.0, 8.0])
def test_a_fading_turn_is_the_integral_of_its_curvature(speed, curvature):
    mean, length, times = np.array([0.1, 0.2, 0.7, speed, curvature]), 0.07, np.array([-0.2, 0.0, 0.25, 1.5])
    found = fading_turn(mean, times, length)
    for row, time in zip(found, times, strict=True):
        way = np.linspace(0.0, speed * time, 200001)
        heading = 0.7 + cumulative_trapezoid(curvature * np.exp(-np.abs(way) / length), way, initial=0.0)
        place = [0.1 + np.trapezoid(np.cos(heading), way), 0.2 + np.trapezoid(np.sin(heading), way)]
        np.testing.assert_allclose(row, [*place, heading[-1]], atol=1e-6)


def test_a_turn_that_fades_slowly_is_an_arc():
    mean, times = np.array([0.1, 0.2, 0.7, 0.15, 6.0]), np.array([0.25, 0.75])
    arcs = [turn_step(mean, time)[0][:3] for time in times]
    np.testing.assert_allclose(fading_turn(mean, times, 1e4), arcs, atol=1e-5)


@pytest.mark.parametrize("curvature", [5.0, 0.0, -3.0])
def test_variances_of_several_times_are_those_of_each(curvature):
    rng = np.random.default_rng(3)
    root = rng.normal(size=(5, 5)) * [0.001, 0.001, 0.1, 0.02, 1.0]
    mean, covariance, times = np.array([0.1, 0.2, 0.7, 0.15, curvature]), root.T @ root, [0.0, 0.05, 0.6, 1.25]
    each = [propagate(mean, covariance, time, 1e-4, 0.5)[1] for time in times]
    sums = [spread[0, 0] + spread[1, 1] for spread in each]
    np.testing.assert_array_equal(position_variances(mean, covariance, times, 1e-4, 0.5), sums)
