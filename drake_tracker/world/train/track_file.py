"""Reads a track from a text file with the header x,y."""

import math

import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.files.csv_file import read_rows, shown

LARGEST = 4 * 1024 * 1024
"""Greatest size of a file [bytes], about 200,000 points."""
FARTHEST = 1000.0
"""Greatest coordinate of a point in W [m]."""
NEAREST = 1e-5
"""Least distance of two neighbouring points [m]."""


def read_track_file(path: str, samples: int, closed: bool = True) -> tuple[np.ndarray, bool]:
    """Returns a finely sampled curve through the points of a file, shape (samples, 2) [m], and whether it is closed.

    A cubic spline makes position, heading and curvature continuous: a periodic spline for a closed curve, otherwise a
    spline with "not a knot" ends, which is the same cubic on both sides of the second point and of the last but one.
    Its centripetal parameter (the square root of the chord) keeps it from overshooting between points at unequal
    distances.

    Args:
        path: file with the header x,y and one point per line [m].
        samples: number of points to return.
        closed: whether the last point is joined to the first. If it repeats the first, the curve is always closed.

    Raises DrakeTrackerError, naming the line where there is one, when the file cannot be used.
    """
    if not path:
        raise DrakeTrackerError("track kind 'csv' needs the name of a file with the header x,y in track.csv")
    points, lines = _read_points(path)
    if len(points) > 1 and math.dist(points[0], points[-1]) < NEAREST:
        points.pop()
        closed = True
    kind, least = ("a closed", 3) if closed else ("an open", 2)
    if len(points) < least:
        counted = "1 point" if len(points) == 1 else f"{len(points)} points"
        raise DrakeTrackerError(f"track file {path} has {counted}; {kind} track needs at least {least}")

    knots = np.array(points + points[:1] if closed else points)
    chord = np.hypot(*np.diff(knots, axis=0).T)
    if chord.min() < NEAREST:
        line = lines[int(chord.argmin()) + 1]
        raise DrakeTrackerError(f"track file {path}, line {line}: the point is the same as the one before it")
    parameter = np.concatenate([[0.0], np.cumsum(np.sqrt(chord))])
    from scipy.interpolate import CubicSpline  # slow to load, and only for tracks from files

    spline = CubicSpline(parameter, knots, bc_type="periodic" if closed else "not-a-knot")
    return spline(np.linspace(0.0, parameter[-1], samples)), closed


def _read_points(path: str) -> tuple[list[tuple[float, float]], list[int]]:
    """Returns the points of a file [m] and the lines on which they stand."""
    points, lines = [], []
    rows = read_rows(path, "track file", LARGEST)
    header = [name.lower() for name in next(rows, (1, []))[1]]
    if header != ["x", "y"]:
        raise DrakeTrackerError(f"track file {path}, line 1: the header must be x,y, not '{shown(header)}'")
    for line, row in rows:
        points.append(_read_row(row, f"track file {path}, line {line}"))
        lines.append(line)
    return points, lines


def _read_row(row: list[str], place: str) -> tuple[float, float]:
    try:
        x, y = (float(cell) for cell in row)
    except ValueError:
        raise DrakeTrackerError(f"{place}: '{shown(row)}' is not two numbers x,y in metres") from None
    if not (abs(x) <= FARTHEST and abs(y) <= FARTHEST):
        raise DrakeTrackerError(f"{place}: '{shown(row)}' is not within {FARTHEST:g} m of the origin of W")
    return x, y
