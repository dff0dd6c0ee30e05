"""Reads a closed track from a text file with the header x,y."""

import csv
import math
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from drake_tracker.core.errors import DrakeTrackerError


def read_track_file(path: str, samples: int) -> np.ndarray:
    """Returns a finely sampled closed curve through the points of a file, shape (samples, 2) [m].

    A periodic cubic spline makes position, heading and curvature continuous. Its centripetal parameter (the square root
    of the chord) keeps it from overshooting between points at unequal distances.

    Args:
        path: file with the header x,y and one point per line [m]; the last point may repeat the first.
        samples: number of points to return.

    Raises DrakeTrackerError, naming the line where there is one, when the file cannot be used.
    """
    if not path:
        raise DrakeTrackerError("track kind 'csv' needs the name of a file with the header x,y in track.csv")
    points, lines = _read_points(path)
    if len(points) > 1 and points[0] == points[-1]:
        points.pop()
    if len(points) < 3:
        raise DrakeTrackerError(f"track file {path} has {len(points)} points; a closed track needs at least 3")

    closed = np.array(points + points[:1])
    chord = np.hypot(*np.diff(closed, axis=0).T)
    if chord.min() == 0.0:
        line = lines[int(chord.argmin()) + 1]
        raise DrakeTrackerError(f"track file {path}, line {line}: the point is the same as the one before it")
    parameter = np.concatenate([[0.0], np.cumsum(np.sqrt(chord))])
    spline = CubicSpline(parameter, closed, bc_type="periodic")
    return spline(np.linspace(0.0, parameter[-1], samples))


def _read_points(path: str) -> tuple[list[tuple[float, float]], list[int]]:
    """Returns the points of a file [m] and the lines on which they stand."""
    points, lines = [], []
    try:
        with Path(path).open(newline="", encoding="utf-8-sig") as file:
            reader = csv.reader(file)
            header = [name.strip().lower() for name in next(reader, [])]
            if header != ["x", "y"]:
                raise DrakeTrackerError(f"track file {path}, line 1: the header must be x,y, not '{','.join(header)}'")
            for row in reader:
                if any(cell.strip() for cell in row):
                    points.append(_read_row(row, f"track file {path}, line {reader.line_num}"))
                    lines.append(reader.line_num)
    except OSError as error:
        raise DrakeTrackerError(f"track file '{path}' cannot be read: {error.strerror}") from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise DrakeTrackerError(f"track file {path} is not a text file of comma-separated values") from error
    return points, lines


def _read_row(row: list[str], place: str) -> tuple[float, float]:
    try:
        x, y = (float(cell) for cell in row)
    except ValueError:
        raise DrakeTrackerError(f"{place}: '{','.join(row)}' is not two numbers x,y in metres") from None
    if not (math.isfinite(x) and math.isfinite(y)):
        raise DrakeTrackerError(f"{place}: '{','.join(row)}' is not finite")
    return x, y
