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
DRIFT_TIME = 0.25
"""Time over which points must lie on one side to count as a drift [s]."""
CHANCE_DRIFT = 3.0
"""Square of a drift, in standard deviations, that is attributed to noise."""
DRIFT_SPEED_NOISE = 0.03
"""Process noise of the speed for each standard deviation of drift beyond that [m/s/sqrt(s)]."""
MAX_SPEED_NOISE = 0.2
"""Largest process noise of the speed, enough for a stop within half a second [m/s/sqrt(s)]."""

CHANCE_CLIMB = 100.0
"""The same as `CHANCE_DRIFT` for the height, whose noise is correlated; beyond it the object is on a hill; chosen."""
DRIFT_CLIMB_NOISE, MAX_CLIMB_NOISE = 0.01, 0.15
"""Process noise of the climb for each standard deviation of drift beyond that, and its limit [m/s/sqrt(s)]; chosen."""


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


def update_drift(drift: float, lead: float, dt: float) -> float:
    """Returns the drift after a point: an average of leads, scaled to unit variance while the filter is right.

    Args:
        drift: drift before the point.
        lead: how far the point lies ahead of its expected position, in standard deviations.
        dt: time since the previous point [s].
    """
    kept = math.exp(-dt / DRIFT_TIME)
    return kept * drift + math.sqrt(1.0 - kept * kept) * lead


def adapted_speed_noise(drift: float, least: float) -> float:
    """Returns the process noise of the speed [m/s/sqrt(s)].

    Args:
        drift: the present drift.
        least: process noise of the speed without a drift [m/s/sqrt(s)].
    """
    beyond = max(drift**2 - CHANCE_DRIFT, 0.0)
    raised = math.sqrt(least**2 + DRIFT_SPEED_NOISE**2 * beyond)
    return max(min(raised, MAX_SPEED_NOISE), least)


def adapted_climb_noise(drift: float, least: float) -> float:
    """Returns the process noise of the climb [m/s/sqrt(s)].

    Args:
        drift: the present drift of the height.
        least: process noise of the climb on a level path [m/s/sqrt(s)].
    """
    beyond = max(drift**2 - CHANCE_CLIMB, 0.0)
    return max(min(math.sqrt(least**2 + DRIFT_CLIMB_NOISE**2 * beyond), MAX_CLIMB_NOISE), least)
