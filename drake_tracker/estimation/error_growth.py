"""How far off the predictions of an estimator have been lately, and what that says of the next one.

An estimator cannot see its own model error, but it can keep what it predicted and compare when the time has come.  The
error of extrapolating a path of changing curvature grows between the horizon's first power (heading error) and its
second (curvature error); the power 3/2 lies between them.
"""

from dataclasses import dataclass

import numpy as np

HORIZON = 0.5
"""Horizon at which predictions are kept and compared [s]."""
GROWTH_POWER = 1.5
"""Power of the horizon with which the standard deviation grows."""
_MEMORY = 1.0
"""Time constant of the mean square [s]."""


@dataclass(frozen=True)
class ErrorGrowth:
    """Kept predictions, a tuple of (due time [s], x [m], y [m]), and the mean square error [m^2] at `HORIZON`.

    The start, 30 mm, is a guess on the careful side that counts until predictions have come due.
    """

    kept: tuple = ()
    mean_square: float = 0.03**2

    def __deepcopy__(self, memo):
        return self

    def forget(self):
        """Returns it without the predictions kept: after a restart they say nothing about the new path."""
        return ErrorGrowth((), self.mean_square)

    def update(self, stamp, position, predicted):
        """Returns it after an update at ``stamp`` [s].

        ``position``: filtered (x, y) [m] now; ``predicted``: (x, y) [m] predicted for `HORIZON` from now.
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
                mean_square += (1.0 - np.exp(-gap / _MEMORY)) * (square - mean_square)
        added = (float(stamp + HORIZON), float(predicted[0]), float(predicted[1]))
        return ErrorGrowth(kept[due:] + (added,), float(mean_square))

    def std(self, horizon, base):
        """Returns the expected error [m] at horizons [s], shape of ``horizon``; ``base`` [m] is that at zero."""
        ratio = np.maximum(horizon, 0.0) / HORIZON
        return np.sqrt(base**2 + self.mean_square * ratio ** (2.0 * GROWTH_POWER))
