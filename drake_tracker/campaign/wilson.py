"""The interval of a rate."""

Z_95 = 1.959964
"""Quantile of the normal distribution that leaves 2.5 % above it."""


def wilson(successes, trials, z=Z_95):
    """Returns the Wilson interval (low, high) of a rate, of 95 % by default; (0, 1) when there was no trial.

    E. B. Wilson, "Probable inference, the law of succession, and statistical inference", Journal of the American
    Statistical Association 22 (1927): the rates from which what was seen lies at most z deviations away.
    """
    if trials == 0:
        return 0.0, 1.0
    p = successes / trials
    centre = p + z * z / (2 * trials)
    spread = z * (p * (1 - p) / trials + z * z / (4 * trials * trials)) ** 0.5
    scale = 1 + z * z / trials
    return (centre - spread) / scale, (centre + spread) / scale
