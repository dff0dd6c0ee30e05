import numpy as np
import pytest
from variants import variant

from drake_tracker.estimation.config import PhaseFilterConfig
from drake_tracker.estimation.parts.phase_filter import CRUISE, MANOEUVRE, STOP, PhaseFilter, _move, mixed_moments

PERIOD = 1.0 / 60.0


def follow(ways, sigma=0.001, seed=0):
    """Filters measured distances; returns (filter, final modes, probability of cruising over time)."""
    rng = np.random.default_rng(seed)
    phase = PhaseFilter()
    modes = phase.start(ways[0], 0.15, 1e-6, 1e-3)
    cruising = []
    for way in ways[1:]:
        modes = phase.propagate(modes, PERIOD)
        modes = phase.correct(modes, way + sigma * rng.standard_normal(), sigma**2)
        cruising.append(modes[CRUISE].probability)
    return phase, modes, np.array(cruising)


def test_at_constant_speed_it_becomes_sharp():
    phase, modes, cruising = follow(0.15 * PERIOD * np.arange(1200))
    assert cruising[-1] > 0.95
    (s,), (std,) = phase.predict(modes, [0.75])
    assert s == pytest.approx(0.15 * (1199 * PERIOD + 0.75), abs=0.0008)
    assert std < 0.0006


def test_it_notices_braking_and_follows():
    t = PERIOD * np.arange(900)
    ways = np.where(t < 10.0, 0.15 * t, 1.5 + 0.15 * 0.5 * (1.0 - np.exp(-(t - 10.0) / 0.5)))
    phase, modes, cruising = follow(ways)
    assert cruising[550] > 0.9
    assert cruising[600:660].min() < 0.2
    assert phase.predict(modes, [0.5])[0][0] == pytest.approx(ways[-1], abs=0.004)


def test_a_swinging_speed_and_a_stop_are_each_followed():
    """The errors half a second ahead of an object at 0.15 m/s +-15 % in 4 s, and of one that stops within 0.5 s."""
    t = PERIOD * np.arange(1500)
    swinging = 0.15 * (t - 0.15 * np.cos(0.5 * np.pi * t) / (0.5 * np.pi))
    assert late_errors(swinging, 600, 1400) < 0.004
    ramp = np.clip((t - 15.0) / 0.5, 0.0, 1.0)
    speed = 0.15 * 0.5 * (1.0 + np.cos(np.pi * ramp))
    stopping = np.cumsum(speed) * PERIOD
    assert late_errors(stopping, 890, 990) < 0.024


def late_errors(ways, first, last, ahead=30):
    """Returns the rms error [m] of arc lengths expected ``ahead`` points later."""
    phase, rng = PhaseFilter(), np.random.default_rng(4)
    modes, errors = phase.start(ways[0], 0.15, 1e-6, 1e-3), []
    for k, way in enumerate(ways[1:last], 1):
        modes = phase.correct(phase.propagate(modes, PERIOD), way + 0.001 * rng.standard_normal(), 1e-6)
        if k >= first:
            errors.append(phase.predict(modes, [ahead * PERIOD])[0][0] - ways[k + ahead])
    return np.sqrt(np.mean(np.square(errors)))


def test_probabilities_sum_to_one_and_mixing_keeps_mean_and_spread():
    phase = PhaseFilter()
    modes = phase.start(1.0, 0.1, 1e-6, 1e-4)
    modes = phase.correct(phase.propagate(modes, PERIOD), 1.003, 1e-6)
    assert sum(mode.probability for mode in modes) == pytest.approx(1.0)
    s, variance = mixed_moments(modes)
    assert min(m.mean[0] for m in modes) <= s <= max(m.mean[0] for m in modes)
    assert variance > 0.0
    moved, same = mixed_moments(phase.shift(modes, 0.5))
    assert moved == pytest.approx(s + 0.5) and same == pytest.approx(variance)


def test_an_acceleration_fades_as_it_should():
    """The matrix exponential of Van Loan against the closed form of Singer's model."""
    phase = PhaseFilter(variant(PhaseFilterConfig, manoeuvre_noise=0.3, fading=0.5)())
    modes = phase.start(0.0, 0.1, 0.0, 0.0)
    accelerating = modes[MANOEUVRE]._replace(mean=(0.0, 0.1, 0.2), covariance=(0.0,) * 6, probability=1.0)
    modes = tuple(accelerating if mode == MANOEUVRE else modes[mode]._replace(probability=0.0) for mode in range(3))
    tau, f = 0.8, 0.5
    (s,), (std,) = phase.predict(modes, [tau])
    assert s == pytest.approx(0.1 * tau + 0.2 * f * (tau - f * (1.0 - np.exp(-tau / f))))
    u = np.linspace(0.0, tau, 4001)
    reach = f * (tau - u - f * (1.0 - np.exp(-(tau - u) / f)))
    assert std == pytest.approx(np.sqrt(np.trapezoid(0.09 * reach**2, u)), rel=1e-3)


def test_the_scalar_arithmetic_equals_the_matrix_products():
    """A step of each mode against T P T' + Q with the matrices that its numbers represent."""
    phase = PhaseFilter()
    square = np.random.default_rng(3).normal(size=(3, 3))
    before = square @ square.T
    upper = np.triu_indices(3)
    mode = phase.start(0.2, 0.1, 0.0, 0.0)[0]._replace(mean=(0.2, 0.1, 0.3), covariance=tuple(before[upper]))
    for motion in (motion_of(0.4) for motion_of in phase._motions):
        v_to_s, a_to_s, a_to_v, a_to_a, _ = motion
        transition = np.array([[1.0, v_to_s, a_to_s], [0.0, 1.0, a_to_v], [0.0, 0.0, a_to_a]])
        after = _move(mode, motion)
        np.testing.assert_allclose(after.mean, transition @ mode.mean)
        np.testing.assert_allclose(after.covariance, (transition @ before @ transition.T)[upper] + motion.noise)


@pytest.mark.parametrize("mode", [MANOEUVRE, STOP])
def test_a_long_time_is_many_short_ones(mode):
    """The matrix exponential of a long time loses its digits; the product of two halves does not."""
    phase = PhaseFilter()
    start = phase.start(0.0, 0.1, 1e-6, 1e-4)[mode]._replace(mean=(0.0, 0.1, 0.2))
    motion = phase._motions[mode]
    step_by_step = start
    for _ in range(2400):
        step_by_step = _move(step_by_step, motion(0.025))
    at_once = _move(start, motion(60.0))
    np.testing.assert_allclose(at_once.mean, step_by_step.mean, rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(at_once.covariance, step_by_step.covariance, rtol=1e-6, atol=1e-12)


def test_only_the_speed_extrapolates_into_the_past():
    phase = PhaseFilter()
    modes = tuple(mode._replace(mean=(1.0, 0.1, -0.3)) for mode in phase.start(1.0, 0.1, 1e-6, 1e-4))
    (s,), _ = phase.predict(modes, [-2.0])
    assert s == pytest.approx(0.8)
