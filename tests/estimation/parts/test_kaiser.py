import numpy as np
import pytest
from scipy.signal import freqz
from scipy.signal.windows import kaiser as scipy_kaiser

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.estimation.parts.kaiser import kaiser_beta, kaiser_order, kaiser_window, moving_average_weights


@pytest.mark.parametrize("order", [1, 2, 7, 30, 101])
@pytest.mark.parametrize("attenuation", [15.0, 30.0, 60.0])
def test_window_agrees_with_numpy_and_scipy(order, attenuation):
    beta = kaiser_beta(attenuation)
    window = kaiser_window(order, beta)
    np.testing.assert_allclose(window, np.kaiser(order + 1, beta), atol=1e-12)
    np.testing.assert_allclose(window, scipy_kaiser(order + 1, beta), atol=1e-12)


def test_published_design():
    # A = 30 dB and a transition of .05 give M = 30 (section 4.3); beta by hand from the middle branch.
    assert kaiser_order(30.0, 0.05) == 30
    assert kaiser_beta(30.0) == pytest.approx(0.5842 * 9.0**0.4 + 0.07886 * 9.0)
    assert kaiser_beta(60.0) == pytest.approx(0.1102 * 51.3)
    assert kaiser_beta(21.0) == kaiser_beta(8.0) == 0.0


def test_moving_average_keeps_a_constant_and_delays_a_ramp_by_half_the_order():
    weights = moving_average_weights(30, 30.0)
    assert weights.shape == (31,)
    assert weights.sum() == pytest.approx(1.0)
    assert weights @ np.arange(31) == pytest.approx(15.0)


def test_highest_side_lobe_of_the_bare_window():
    weights = moving_average_weights(30, 30.0)
    _, response = freqz(weights, worN=8192)
    gain = 20.0 * np.log10(np.abs(response) + 1e-12)
    first_null = np.argmax(np.diff(gain) > 0.0)
    assert gain[first_null:].max() == pytest.approx(-19.5, abs=0.2)


def test_impossible_design_is_refused():
    with pytest.raises(DrakeTrackerError, match="transition"):
        kaiser_order(30.0, 0.0)
