"""Detection of a closed path: searches the history for an earlier pass through the object's present position."""

import math
from dataclasses import dataclass

import numpy as np

from drake_tracker.core.frozen_state import FrozenState, read_only

SHORTEST_LAP = 0.25
"""A return to the same position after a shorter distance is not a lap [m]."""
SAME_HEADING = math.radians(25.0)
"""Headings that differ by less belong to the same branch of the path [rad]; the crossing of a figure-eight is passed
with two different headings."""
GATE = 0.008
"""Branches of one path are farther apart than this [m] plus three times the noise of a point."""
OVERLAP = 0.06
"""Distance along which the path must retrace itself before it counts as closed [m]."""
LONGEST_HISTORY = 6000
"""Number of points kept: 100 s at 60 Hz."""

STAMP, S, PX, PY, PZ, FX, FY, YAW = range(8)
"""Columns of a history: time [s], distance travelled [m], measured point (x, y, z) [m], filtered position (x, y) [m],
filtered heading [rad]."""


@dataclass(frozen=True)
class History(FrozenState):
    """The points so far, and the distance since which they retrace an earlier part of the path.

    Attributes:
        rows: shape (n, 8), columns `STAMP` ... `YAW`, oldest first, read-only.
        overlap_from: distance travelled when the retracing began [m]; NaN while there is none.
        lap: newest estimate of the length of a lap [m]; NaN while there is none.
    """

    rows: np.ndarray
    overlap_from: float = math.nan
    lap: float = math.nan

    @property
    def overlap(self) -> float:
        """Distance along which the path has retraced itself so far [m]."""
        return 0.0 if math.isnan(self.overlap_from) else self.rows[-1, S] - self.overlap_from

    def since(self, distance: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Returns the part of the history from a distance on: stamps (n,) [s], distances (n,) [m], points (n, 3) [m].

        Args:
            distance: distance travelled at the first point returned [m].
        """
        rows = self.rows[self.rows[:, S] >= distance]
        return rows[:, STAMP], rows[:, S], rows[:, PX : PZ + 1]


EMPTY = History(read_only(np.zeros((0, 8))))
"""The history before the first point."""


def remember(history: History, row: tuple[float, ...]) -> History:
    """Returns the history with one more row, (8,); the oldest row is dropped beyond `LONGEST_HISTORY`."""
    rows = np.concatenate([history.rows[-(LONGEST_HISTORY - 1) :], [row]])
    return History(read_only(rows), history.overlap_from, history.lap)


def look_back(history: History, sigma: float, shortest: float = SHORTEST_LAP) -> History:
    """Returns the history after a search for an earlier pass through the position of its newest row.

    Args:
        history: what to search, with at least one row.
        sigma: noise of a point, per axis [m].
        shortest: shorter laps are not searched for [m].
    """
    here, rows = history.rows[-1], history.rows
    since = here[S] - rows[:, S]
    away = np.hypot(rows[:, FX] - here[FX], rows[:, FY] - here[FY])
    same = (since >= shortest) & (np.cos(rows[:, YAW] - here[YAW]) >= math.cos(SAME_HEADING))
    gate = GATE + 3.0 * sigma
    if not math.isnan(history.lap):  # stay on the branch found before
        same &= np.abs(since - history.lap) <= 3.0 * gate
    found = np.nonzero(same & (away <= gate))[0]
    if len(found) == 0:
        return History(rows)
    if math.isnan(history.lap):
        # Of several laps in the history use the newest; the nearest could be any of them.
        found = found[since[found] <= since[found].min() + 3.0 * gate]
    nearest = rows[found[np.argmin(away[found])]]
    # The lap ends at the foot of the perpendicular on the branch.
    dx, dy = here[FX] - nearest[FX], here[FY] - nearest[FY]
    lap = here[S] - nearest[S] - (dx * math.cos(nearest[YAW]) + dy * math.sin(nearest[YAW]))
    start = history.overlap_from if not math.isnan(history.lap) else here[S]
    smooth = lap if math.isnan(history.lap) else history.lap + 0.2 * (lap - history.lap)
    return History(rows, start, smooth)
