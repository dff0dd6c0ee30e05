"""The confidence interval of a success rate."""

from math import erf, sqrt

Z_95 = 1.959964
"""Quantile of the standard normal distribution that leaves 2.5 % above it, as tables print it."""
CONFIDENCE = erf(Z_95 / sqrt(2.0))
"""Confidence level of the interval: 95 %, as far as `Z_95` is."""


def wilson(successes: int, trials: int) -> tuple[float, float]:
    """Returns the 95 % Wilson interval (low, high) of a success rate; (0, 1) when there was no trial.

    E. B. Wilson, "Probable inference, the law of succession, and statistical inference", Journal of the American
    Statistical Association 22 (1927): the rates for which the observed count is at most `Z_95` standard deviations from
    the expected one.

    Args:
        successes: number of successful trials.
        trials: number of all trials.
    """
    from scipy.stats import binomtest  # slow to load

    if trials == 0:
        return 0.0, 1.0
    interval = binomtest(successes, trials).proportion_ci(CONFIDENCE, method="wilson")
    return float(interval.low), float(interval.high)
