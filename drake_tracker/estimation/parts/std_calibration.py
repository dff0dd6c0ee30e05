"""Scales an estimator's standard deviation so that 68 % of the errors lie within it, learned from past predictions.

A filter's covariance is correct only in the world that the filter assumes. On a real track the errors are small for a
long time and large where the curvature changes, and coloured noise is larger than the filter expects. The standard
deviation is therefore multiplied by a factor. The factor grows a little with each prediction whose error exceeded its
standard deviation, and falls with each other one; the steps balance when 68 % of the errors lie within.
"""

import math
from dataclasses import dataclass

from drake_tracker.core.frozen_state import FrozenState

HORIZON = 0.5
"""Predictions this far ahead are kept and judged [s]."""
SHARE = 0.68
"""Share of errors that should lie within one standard deviation."""
STEP = 0.02
"""Largest change of the factor's logarithm with one judgement."""
LIMITS = (0.3, 10.0)
"""Smallest and largest factor."""
KEEP_EVERY = 0.05
"""Least time between two kept predictions [s]."""


@dataclass(frozen=True)
class StdCalibration(FrozenState):
    """Predictions that are not due yet, and the factor learned so far.

    Attributes:
        kept: tuple of (due time [s], x [m], y [m], std [m]), oldest first.
        factor: multiplies the filter's standard deviation.
    """

    kept: tuple[tuple[float, float, float, float], ...] = ()
    factor: float = 1.0

    def forget(self) -> "StdCalibration":
        """Returns a copy without predictions: after a restart they say nothing about the new path."""
        return StdCalibration((), self.factor)

    def wants(self, stamp: float) -> bool:
        """Returns whether a prediction made at ``stamp`` [s] should be kept."""
        return not self.kept or stamp + HORIZON - self.kept[-1][0] >= KEEP_EVERY

    def keep(self, stamp: float, x: float, y: float, std: float) -> "StdCalibration":
        """Returns a copy that keeps one more prediction.

        Args:
            stamp: time at which the prediction was made [s].
            x: x predicted for `HORIZON` later [m].
            y: y predicted for `HORIZON` later [m].
            std: its standard deviation, not yet scaled [m].
        """
        return StdCalibration((*self.kept, (stamp + HORIZON, float(x), float(y), float(std))), self.factor)

    def judge(self, stamp: float, x: float, y: float) -> "StdCalibration":
        """Returns a copy that has judged the predictions that are due.

        A prediction that is overdue by `KEEP_EVERY` or more is dropped without judgement.

        Args:
            stamp: time now [s].
            x: filtered x now [m].
            y: filtered y now [m].
        """
        kept, factor = self.kept, self.factor
        while kept and kept[0][0] <= stamp:
            due, x_then, y_then, std = kept[0]
            kept = kept[1:]
            if stamp - due < KEEP_EVERY:
                missed = math.hypot(x_then - x, y_then - y) > factor * std
                factor *= math.exp(STEP * (SHARE if missed else SHARE - 1.0))
        if kept is self.kept:
            return self
        return StdCalibration(kept, min(max(factor, LIMITS[0]), LIMITS[1]))
