"""The error of an estimator's recent predictions, and what it implies for the next prediction.

An estimator cannot see its own model error, but it can store predictions and compare them with later points. The error
of extrapolating a path of changing curvature grows between the first power of the horizon (heading error) and the
second (curvature error); the power 3/2 lies between them.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drake_tracker.core.frozen_state import FrozenState

HORIZON = 0.5
"""Horizon at which predictions are kept and compared [s]."""
GROWTH_POWER = 1.5
"""Power of the horizon with which the standard deviation grows."""
_TIME_CONSTANT = 1.0
"""Time constant of the mean square error [s]."""


@dataclass(frozen=True)
class ErrorGrowth(FrozenState):
    """Pending predictions, and the mean square error of past predictions.

    Attributes:
        kept: tuple of (due time [s], x [m], y [m]), oldest first.
        mean_square: mean square error at `HORIZON` [m^2]. It starts at (30 mm)^2, a cautious guess that counts until
            the first predictions are due.
    """

    kept: tuple[tuple[float, float, float], ...] = ()
    mean_square: float = 0.03**2

    def forget(self) -> "ErrorGrowth":
        """Returns a copy without predictions: after a restart they say nothing about the new path."""
        return ErrorGrowth((), self.mean_square)

    def update(
        self, stamp: float, position: Sequence[float] | np.ndarray, predicted: Sequence[float] | np.ndarray
    ) -> "ErrorGrowth":
        """Returns a copy that has compared the predictions that are due, and keeps a new one.

        Args:
            stamp: time of the update [s].
            position: filtered (x, y) at that time [m].
            predicted: (x, y) predicted for `HORIZON` later [m].
        """
        kept = self.kept
        mean_square = self.mean_square
        due = 0
        while due < len(kept) and kept[due][0] <= stamp:
            due += 1
        if due:
            time, x, y = kept[due - 1]
            if stamp - time < 0.05:
                square = (x - position[0]) ** 2 + (y - position[1]) ** 2
                gap = max(kept[due][0] - time, 1e-3) if due < len(kept) else 1.0 / 60.0
                mean_square += (1.0 - np.exp(-gap / _TIME_CONSTANT)) * (square - mean_square)
        added = (float(stamp + HORIZON), float(predicted[0]), float(predicted[1]))
        return ErrorGrowth((*kept[due:], added), float(mean_square))

    def std(self, horizon: np.ndarray, base: float) -> np.ndarray:
        """Returns the expected error [m], of the shape of ``horizon``.

        Args:
            horizon: times ahead of the newest point [s].
            base: expected error at horizon zero [m].
        """
        ratio = np.maximum(horizon, 0.0) / HORIZON
        return np.sqrt(base**2 + self.mean_square * ratio ** (2.0 * GROWTH_POWER))
