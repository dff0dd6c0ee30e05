import copy

import numpy as np
import pytest

from drake_tracker.estimation.parts.error_growth import HORIZON, ErrorGrowth


def _run(error, seconds=8.0):
    growth = ErrorGrowth()
    for stamp in np.arange(0.0, seconds, 1.0 / 60.0):
        # Each prediction is off by ``error`` along x.
        growth = growth.update(stamp, (stamp, 0.0), (stamp + HORIZON + error, 0.0))
    return growth


@pytest.mark.parametrize("error", [0.0, 0.01, 0.05])
def test_learns_the_error_of_recent_predictions(error):
    growth = _run(error)
    assert growth.std(HORIZON, 0.0) == pytest.approx(error, rel=0.05, abs=1e-3)
    assert len(growth.kept) <= 32


def test_std_grows_with_the_horizon_from_the_base():
    std = _run(0.01).std(np.array([-0.1, 0.0, 0.25, 0.75]), 0.004)
    assert std[0] == std[1] == pytest.approx(0.004)
    assert np.all(np.diff(std[1:]) > 0.0)


def test_a_gap_is_not_compared_and_forgetting_keeps_the_level():
    growth = _run(0.01)
    later = growth.update(30.0, (5.0, 5.0), (5.0, 5.0))
    assert later.mean_square == growth.mean_square
    assert len(later.kept) == 1
    assert growth.forget().kept == () and growth.forget().mean_square == growth.mean_square
    assert copy.deepcopy(growth) is growth
