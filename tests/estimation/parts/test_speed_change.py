import numpy as np
import pytest

from drake_tracker.estimation.parts.speed_change import REFERENCE_NOISE, most_likely_change

PERIOD = 1.0 / 60.0
TIMES = PERIOD * np.arange(1, 15)
"""Times of the points after that of the state from which they were expected."""


def leads(gain=0.0, changed=7, jump=0.0, noise=0.0, seed=0):
    """Returns how far points lie ahead: after point ``changed`` the speed gains [m/s], or the object jumps [m]."""
    after = TIMES - TIMES[changed]
    white = np.random.default_rng(seed).standard_normal(len(TIMES))
    return gain * np.maximum(after, 0.0) + jump * (after > 0.0) + noise * white


@pytest.mark.parametrize("gain", [-0.2, -0.1, 0.1])
def test_it_finds_time_and_size_of_a_change(gain):
    change = most_likely_change(TIMES, leads(gain))
    assert change.last == 7
    assert change.gain == pytest.approx(gain, rel=0.02)
    assert change.evidence > 60.0 and change.margin > 15.0


def test_the_evidence_is_that_of_the_likelihood_ratio():
    """Against the difference of the squared residuals of two fits, by least squares with the expectations as rows."""
    along = leads(0.08, 5, noise=0.001, seed=3)
    change = most_likely_change(TIMES, along)

    def squares(*columns):
        design = np.column_stack([np.ones(14), TIMES, *columns]) / REFERENCE_NOISE
        expectations = np.eye(2, design.shape[1]) / np.array([[0.001], [0.010]])
        design, data = np.vstack([design, expectations]), np.append(along / REFERENCE_NOISE, [0.0, 0.0])
        solution = np.linalg.lstsq(design, data, rcond=None)[0]
        return np.sum((data - design @ solution) ** 2), solution[-1]

    with_change, gain = squares(np.maximum(TIMES - TIMES[change.last], 0.0))
    assert change.evidence == pytest.approx(squares()[0] - with_change, rel=1e-6)
    assert change.gain == pytest.approx(gain, rel=1e-6)


def test_a_jump_and_an_outlier_are_no_change():
    for along in (leads(jump=0.02), leads(jump=0.02, changed=12), leads(jump=0.01, changed=10)):
        assert most_likely_change(TIMES, along).margin < 0.0


def test_noise_has_little_evidence():
    evidence = [most_likely_change(TIMES, leads(noise=0.001, seed=seed)).evidence for seed in range(300)]
    assert np.median(evidence) < 3.0 and max(evidence) < 20.0


def test_too_few_points_tell_nothing():
    assert most_likely_change(TIMES[:3], np.array([0.0, 0.01, 0.02])) is None
    assert most_likely_change(TIMES[:4], np.array([0.0, 0.01, 0.02, 0.03])).gain > 0.1
