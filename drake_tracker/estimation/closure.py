"""Has the path come round? A search of what was driven for the place where the object is now."""

import math
from dataclasses import dataclass

import numpy as np

from drake_tracker.core.frozen_state import read_only

SHORTEST_LAP = 0.25
"""A way back to the same place that is shorter [m] is no lap."""
SAME_HEADING = math.radians(25.0)
"""Directions this near belong to one branch of the path: a figure-eight's crossing is passed in two directions."""
GATE = 0.008
"""Branches of one path are farther apart than this [m] and three times the noise of a point."""
OVERLAP = 0.06
"""Way [m] along which the path must run over itself before it is taken for closed."""
LONGEST_HISTORY = 6000
"""Points kept: 100 s at 60 Hz."""

STAMP, S, PX, PY, PZ, FX, FY, YAW = range(8)
"""Columns of a history: time [s], way driven [m], the point measured (x, y, z) [m], the filtered place (x, y) [m] and
heading [rad]."""


@dataclass(frozen=True)
class History:
    """What was driven, rows (n, 8), oldest first (read-only); and since when it runs over itself.

    overlap_from: arc length [m] at which it began to, NaN while it does not. lap: newest guess of the lap's length [m].
    """

    rows: np.ndarray
    overlap_from: float = math.nan
    lap: float = math.nan

    def __deepcopy__(self, memo):
        return self

    @property
    def overlap(self):
        """Way [m] along which the path has run over itself so far."""
        return 0.0 if math.isnan(self.overlap_from) else self.rows[-1, S] - self.overlap_from

    def since(self, way):
        """Returns (stamps (n,) [s], ways (n,) [m], points (n, 3) [m]) from ``way`` [m] on."""
        rows = self.rows[self.rows[:, S] >= way]
        return rows[:, STAMP], rows[:, S], rows[:, PX : PZ + 1]


EMPTY = History(read_only(np.zeros((0, 8))))


def remember(history, row):
    """Returns the history with one more row (8,)."""
    rows = np.concatenate([history.rows[-(LONGEST_HISTORY - 1) :], [row]])
    return History(read_only(rows), history.overlap_from, history.lap)


def look_back(history, sigma, shortest=SHORTEST_LAP):
    """Returns the history after a look for the place where its newest row is.

    ``sigma``: noise of a point [m]. ``shortest``: laps shorter than this [m] are not looked for.
    """
    here, rows = history.rows[-1], history.rows
    driven = here[S] - rows[:, S]
    away = np.hypot(rows[:, FX] - here[FX], rows[:, FY] - here[FY])
    same = (driven >= shortest) & (np.cos(rows[:, YAW] - here[YAW]) >= math.cos(SAME_HEADING))
    gate = GATE + 3.0 * sigma
    if not math.isnan(history.lap):  # go on along the branch found before, and along no other
        same &= np.abs(driven - history.lap) <= 3.0 * gate
    found = np.nonzero(same & (away <= gate))[0]
    if len(found) == 0:
        return History(rows)
    if math.isnan(history.lap):
        # Of several laps in the history the newest is taken: not the nearest, which may be any.
        found = found[driven[found] <= driven[found].min() + 3.0 * gate]
    nearest = rows[found[np.argmin(away[found])]]
    # To the foot of the perpendicular on the branch.
    dx, dy = here[FX] - nearest[FX], here[FY] - nearest[FY]
    lap = here[S] - nearest[S] - (dx * math.cos(nearest[YAW]) + dy * math.sin(nearest[YAW]))
    start = history.overlap_from if not math.isnan(history.lap) else here[S]
    smooth = lap if math.isnan(history.lap) else history.lap + 0.2 * (lap - history.lap)
    return History(rows, start, smooth)
