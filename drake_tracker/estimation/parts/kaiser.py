"""The Kaiser window of the moving-average filter (Allen et al. 1991, section 4.3).

With the paper's A = 30 dB and a transition width of 0.05 of the sampling frequency the order is M = 30, which is 31
taps: half a second at 60 Hz, with a group delay of 15 frames. The design formulas are Kaiser's for a windowed sinc.
Used directly as a moving average, as here, the same window has its highest side lobe at -19.5 dB, not -30 dB.

The window is computed here because `numpy.kaiser` and SciPy differ from it in the last bit for most orders, which would
change recorded results.
"""

import numpy as np
from scipy.special import i0

from drake_tracker.core.errors import DrakeTrackerError


def kaiser_beta(attenuation: float) -> float:
    """Returns the shape parameter beta.

    The formula of section 4.3, completed by beta = 0 (a rectangular window) for A <= 21 dB.

    Args:
        attenuation: stopband attenuation A [dB].
    """
    if attenuation >= 50.0:
        return 0.1102 * (attenuation - 8.7)
    if attenuation > 21.0:
        return 0.5842 * (attenuation - 21.0) ** 0.4 + 0.07886 * (attenuation - 21.0)
    return 0.0


def kaiser_order(attenuation: float, transition: float) -> int:
    """Returns the order M, for M + 1 taps: (A - 7.95) / (14.36 transition), rounded down.

    A = 30 dB and 0.05 give 30.7, and the paper uses 30.

    Args:
        attenuation: stopband attenuation A [dB].
        transition: transition width, as a fraction of the sampling frequency.

    Raises:
        DrakeTrackerError: there is no such filter.
    """
    if attenuation <= 7.95 or not 0.0 < transition <= 0.5:
        raise DrakeTrackerError(
            f"kaiser_order: attenuation {attenuation:g} dB and transition {transition:g} give no filter;"
            " use more than 7.95 dB and a transition in (0, 0.5]"
        )
    return int((attenuation - 7.95) / (14.36 * transition))


def kaiser_window(order: int, beta: float) -> np.ndarray:
    """Returns the window w_K(n), n = 0..order, shape (order + 1,): 1 in the middle and 1 / I_0(beta) at both ends.

    Args:
        order: order M.
        beta: shape parameter.
    """
    if order < 1:
        return np.ones(1)
    n = np.arange(order + 1)
    return i0(beta * np.sqrt(1.0 - (1.0 - 2.0 * n / order) ** 2)) / i0(beta)


def moving_average_weights(order: int, attenuation: float) -> np.ndarray:
    """Returns the weights of the moving average, shape (order + 1,): the Kaiser window scaled to a sum of one.

    Args:
        order: order M.
        attenuation: stopband attenuation A [dB].
    """
    window = kaiser_window(order, kaiser_beta(attenuation))
    return window / window.sum()
