import numpy as np
import pytest

from drake_tracker.estimation.turn_model import HEADING, correct, turn_step


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
