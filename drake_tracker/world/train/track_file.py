"""Reads a track from a text file with the header x,y, or x,y,z with heights, or x,y,z,bank."""

import math

import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.files.csv_file import read_rows, shown

LARGEST = 4 * 1024 * 1024
"""Greatest size of a file [bytes], about 200,000 points."""
FARTHEST = 1000.0
"""Greatest coordinate of a point in W [m]."""
COLUMNS = ("x", "y", "z", "bank")
"""Place in W [m], height above the table [m], and lean to the left [deg]; the last one or two may be absent."""
NEAREST = 1e-5
"""Least distance of two neighbouring points [m]."""


def read_track_file(path: str, samples: int, closed: bool = True) -> tuple[np.ndarray, bool]:
    """Returns a finely sampled curve through the points of a file, and whether it is closed.

    The shape of the curve is (samples, number of columns of the file), in the units of `COLUMNS`.

    A cubic spline makes position, heading and curvature continuous: a periodic spline for a closed curve, otherwise a
    spline with "not a knot" ends, which is the same cubic on both sides of the second point and of the last but one.
    Its centripetal parameter (the square root of the chord) keeps it from overshooting between points at unequal
    distances.

    Args:
        path: file with a header, 2 to 4 of `COLUMNS`, and one point per line.
        samples: number of points to return.
        closed: whether the last point is joined to the first. If it repeats the first, the curve is always closed.

    Raises DrakeTrackerError, naming the line where there is one, when the file cannot be used.
    """
    if not path:
        raise DrakeTrackerError("track kind 'csv' needs the name of a file with the header x,y in track.csv")
    points, lines = _read_points(path)
    if len(points) > 1 and math.dist(points[0][:2], points[-1][:2]) < NEAREST:
        points.pop()
        closed = True
    kind, least = ("a closed", 3) if closed else ("an open", 2)
    if len(points) < least:
        counted = "1 point" if len(points) == 1 else f"{len(points)} points"
        raise DrakeTrackerError(f"track file {path} has {counted}; {kind} track needs at least {least}")

    knots = np.array(points + points[:1] if closed else points)
    chord = np.hypot(*np.diff(knots[:, :2], axis=0).T)
    if chord.min() < NEAREST:
        line = lines[int(chord.argmin()) + 1]
        raise DrakeTrackerError(f"track file {path}, line {line}: the point is the same as the one before it")
    parameter = np.concatenate([[0.0], np.cumsum(np.sqrt(chord))])
    from scipy.interpolate import CubicSpline  # slow to load, and only for tracks from files

    spline = CubicSpline(parameter, knots, bc_type="periodic" if closed else "not-a-knot")
    return spline(np.linspace(0.0, parameter[-1], samples)), closed


def _read_points(path: str) -> tuple[list[tuple[float, ...]], list[int]]:
    """Returns the points of a file and the lines on which they stand."""
    points, lines = [], []
    rows = read_rows(path, "track file", LARGEST)
    header = [name.lower() for name in next(rows, (1, []))[1]]
    if not 2 <= len(header) <= len(COLUMNS) or tuple(header) != COLUMNS[: len(header)]:
        raise DrakeTrackerError(
            f"track file {path}, line 1: the header must be x,y or x,y,z or x,y,z,bank, not '{shown(header)}'"
        )
    for line, row in rows:
        points.append(_read_row(row, COLUMNS[: len(header)], f"track file {path}, line {line}"))
        lines.append(line)
    return points, lines


def _read_row(row: list[str], columns: tuple[str, ...], place: str) -> tuple[float, ...]:
    numbers = {2: "two", 3: "three", 4: "four"}[len(columns)]
    try:
        values = tuple(map(float, row))
        if len(values) != len(columns):
            raise ValueError
    except ValueError:
        units = "metres" if len(columns) < len(COLUMNS) else "metres and degrees"
        raise DrakeTrackerError(
            f"{place}: '{shown(row)}' is not {numbers} numbers {','.join(columns)} in {units}"
        ) from None
    if not all(abs(value) <= FARTHEST for value in values):
        raise DrakeTrackerError(f"{place}: '{shown(row)}' is not within {FARTHEST:g} m of the origin of W")
    return values
