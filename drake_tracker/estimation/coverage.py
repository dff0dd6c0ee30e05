"""How wide an estimator's own idea of its error must be, learned from how its predictions came true.

A filter's covariance is right in the world that it assumes. On a real track its errors are small for a long while and
large where the curvature changes, and noise that is not white is more than it takes it for. So it is scaled: the factor
grows a little with each prediction that turned out worse than its standard deviation and falls with each that did not,
by steps that balance where 68 of 100 lie within.
"""

import math
from dataclasses import dataclass

HORIZON = 0.5
"""Predictions so far ahead [s] are kept and judged."""
SHARE = 0.68
"""Share of errors that should lie within one standard deviation."""
STEP = 0.02
"""Change of the factor's logarithm with each judgement, at most."""
LIMITS = (0.3, 10.0)
KEEP_EVERY = 0.05
"""Least time [s] between two predictions kept."""


@dataclass(frozen=True)
class Coverage:
    """Predictions kept, a tuple of (due time [s], x, y [m], std [m]), oldest first, and the ``factor`` on the std."""

    kept: tuple = ()
    factor: float = 1.0

    def __deepcopy__(self, memo):
        return self

    def forget(self):
        """Returns it without the predictions kept: after a restart they say nothing about what comes."""
        return Coverage((), self.factor)

    def wants(self, stamp):
        """Whether a prediction made at ``stamp`` [s] should be kept."""
        return not self.kept or stamp + HORIZON - self.kept[-1][0] >= KEEP_EVERY

    def keep(self, stamp, x, y, std):
        """Returns it with a prediction made at ``stamp`` [s] of the place (x, y) [m] at `HORIZON` from then; ``std``
        [m] is not yet scaled."""
        return Coverage((*self.kept, (stamp + HORIZON, float(x), float(y), float(std))), self.factor)

    def judge(self, stamp, x, y):
        """Returns it after the place (x, y) [m] filtered at ``stamp`` [s] has judged the predictions due."""
        kept, factor = self.kept, self.factor
        while kept and kept[0][0] <= stamp:
            due, x_then, y_then, std = kept[0]
            kept = kept[1:]
            if stamp - due < KEEP_EVERY:
                missed = math.hypot(x_then - x, y_then - y) > factor * std
                factor *= math.exp(STEP * (SHARE if missed else SHARE - 1.0))
        if kept is self.kept:
            return self
        return Coverage(kept, min(max(factor, LIMITS[0]), LIMITS[1]))
