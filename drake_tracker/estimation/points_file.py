"""Measured points in a CSV file, and the predictions of an estimator from them: an estimator without cameras."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.files.csv_file import read_rows, shown
from drake_tracker.estimation.estimator import Estimator

LARGEST = 256 * 1024 * 1024
"""Greatest size of a file [bytes], about three million points."""
FARTHEST = 1e6
"""Greatest coordinate of a point."""
LATEST = 1e11
"""Latest time [s]: above seconds since 1970, below milliseconds since 1970."""
STAMPS = ("stamp", "time", "t")
"""Names that the column of times may have."""
AXES = (("x", "y"), ("u", "v"))
"""Names that the columns of positions may have; a column z is optional."""
NEIGHBOURS = 2.5
"""Longest time between two points across which a position is interpolated [median periods]."""


class Points(NamedTuple):
    """The points of a file.

    Attributes:
        stamps: capture times, increasing, shape (n,) [s].
        positions: shape (n, 3) in the unit of the file, NaN in rows without a valid point.
        in_pixels: whether the columns are u and v.
    """

    stamps: np.ndarray
    positions: np.ndarray
    in_pixels: bool

    @property
    def period(self) -> float:
        """Median time between two rows [s]."""
        return float(np.median(np.diff(self.stamps)))


class Predictions(NamedTuple):
    """Predictions for one time ahead.

    Attributes:
        stamps: capture time of the newest point of each prediction, shape (n,) [s].
        rows: x, y, z and yaw [rad] predicted for the time ahead, shape (n, 4).
        stds: expected error of the position, shape (n,).
        errors: distance of the prediction from the measured path, NaN where the path has no points, shape (n,).
    """

    stamps: np.ndarray
    rows: np.ndarray
    stds: np.ndarray
    errors: np.ndarray


def read_points(path: str) -> Points:
    """Returns the points of a file.

    The header names a column of times (`STAMPS`, in seconds from any origin) and columns x and y, optionally z, or u
    and v. Other columns are ignored, except ``valid``: a row with 0 there, or an empty position, has no point.

    Raises DrakeTrackerError, naming the line where there is one, when the file cannot be used.
    """
    rows = read_rows(path, "points file", LARGEST)
    header = [name.lower() for name in next(rows, (1, []))[1]]
    stamp = next((name for name in STAMPS if name in header), None)
    axes = next((pair for pair in AXES if set(pair) <= set(header)), None)
    if stamp is None or axes is None:
        raise DrakeTrackerError(
            f"points file {path}, line 1: the header must name, separated by commas, a time (stamp, time or t) and x,y "
            f"or u,v, not '{shown(header)}'"
        )
    names = (stamp, *axes, *(name for name in ("z", "valid") if name in header))
    columns = {name: header.index(name) for name in names}
    table = np.array(list(_numbers(rows, columns, path))).reshape(-1, len(names))
    if len(table) < 2:
        raise DrakeTrackerError(f"points file {path} has {len(table)} rows with a time; predictions need at least two")
    height = table[:, names.index("z")] if "z" in columns else np.zeros(len(table))
    positions = np.column_stack([table[:, 1:3], height])
    unseen = ~np.isfinite(positions).all(axis=1)
    if "valid" in columns:
        unseen |= table[:, names.index("valid")] == 0.0
    positions[unseen] = np.nan
    return Points(table[:, 0], positions, axes == ("u", "v"))


def _numbers(rows: Iterator[tuple[int, list[str]]], columns: dict[str, int], path: str) -> Iterator[list[float]]:
    """Yields the numbers of each row, NaN for an empty cell. The first number, the time, increases."""
    last = -np.inf
    for line, row in rows:
        place = f"points file {path}, line {line}"
        try:
            values = [float(row[column]) if row[column] else np.nan for column in columns.values()]
        except (ValueError, IndexError):
            raise DrakeTrackerError(f"{place}: '{shown(row)}' must have numbers for {','.join(columns)}") from None
        if not abs(values[0]) <= LATEST or any(abs(value) > FARTHEST for value in values[1:]):
            raise DrakeTrackerError(f"{place}: '{shown(row)}' has no time in seconds, or a number above {FARTHEST:g}")
        if values[0] <= last:
            raise DrakeTrackerError(
                f"{place}: the time {values[0]:.12g} s does not follow that of the row before, {last:.12g} s; a file "
                "has the points of one object, in the order of their times"
            )
        last = values[0]
        yield values


def predict_points(estimator: Estimator[Any], points: Points, ahead: float) -> Predictions:
    """Returns the prediction of an estimator after each valid point, once the estimator is ready.

    Args:
        estimator: any object with the methods of `Estimator`.
        points: given to the estimator one after the other.
        ahead: time ahead of the newest point [s].
    """
    state = estimator.initial_state()
    stamps, rows, stds = [], [], []
    for stamp, since, position in zip(points.stamps, points.stamps - points.stamps[0], points.positions, strict=True):
        seen = bool(np.isfinite(position).all())
        state = estimator.update(state, float(since), position if seen else None)
        if seen and estimator.ready(state):
            times = np.array([since + ahead])
            stamps.append(stamp)
            rows.append(estimator.predict(state, times)[0])
            stds.append(estimator.predict_std(state, times)[0])
    predicted = np.array(rows).reshape(-1, 4)
    errors = np.linalg.norm(predicted[:, :3] - _measured(points, np.array(stamps) + ahead), axis=1)
    return Predictions(np.array(stamps), predicted, np.array(stds), errors)


def _measured(points: Points, times: np.ndarray) -> np.ndarray:
    """Returns the measured positions at ``times`` (n,) [s], interpolated between near points, else NaN."""
    seen = np.isfinite(points.positions).all(axis=1)
    stamps, positions = points.stamps[seen], points.positions[seen]
    if len(stamps) == 0:
        return np.full((len(times), 3), np.nan)
    after = np.clip(np.searchsorted(stamps, times), 1, max(len(stamps) - 1, 1))
    measured = np.column_stack([np.interp(times, stamps, axis) for axis in positions.T])
    near = (times >= stamps[0]) & (times <= stamps[-1])
    near &= stamps[np.minimum(after, len(stamps) - 1)] - stamps[after - 1] <= NEIGHBOURS * points.period
    measured[~near] = np.nan
    return measured
