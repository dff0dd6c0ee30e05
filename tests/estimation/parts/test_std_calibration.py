import numpy as np
import pytest

from drake_tracker.estimation.parts.std_calibration import HORIZON, KEEP_EVERY, LIMITS, SHARE, StdCalibration


def judged(true_std, claimed_std, count=4000, seed=0):
    """Repeated predictions of a position with a normally distributed error."""
    rng = np.random.default_rng(seed)
    coverage, hits = StdCalibration(), []
    for k in range(count):
        stamp = k * KEEP_EVERY
        error = true_std * rng.standard_normal()
        if coverage.kept and coverage.kept[0][0] <= stamp:
            hits.append(abs(error) <= coverage.factor * claimed_std)
        coverage = coverage.judge(stamp, error, 0.0)
        if coverage.wants(stamp):
            coverage = coverage.keep(stamp, 0.0, 0.0, claimed_std)
    return coverage, np.array(hits)


@pytest.mark.parametrize("true_std", [0.5, 1.0, 3.0])
def test_two_thirds_of_the_errors_lie_within(true_std):
    coverage, hits = judged(true_std, 1.0)
    assert np.mean(hits[1000:]) == pytest.approx(SHARE, abs=0.03)
    assert coverage.factor == pytest.approx(true_std, rel=0.25)  # 68 % of normal errors lie within 1 std


def test_the_factor_stays_within_its_limits():
    assert judged(1000.0, 1.0)[0].factor == LIMITS[1]
    assert judged(1e-6, 1.0)[0].factor == LIMITS[0]


def test_predictions_overdue_after_a_gap_are_dropped_without_judgement():
    coverage = StdCalibration().keep(0.0, 0.0, 0.0, 1.0)
    late = coverage.judge(HORIZON + 2.0, 50.0, 0.0)
    assert late.kept == () and late.factor == 1.0
    assert coverage.forget().kept == ()
