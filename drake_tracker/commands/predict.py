"""``drake-tracker predict``: predicts the path of an object from measured points in a file."""

import csv
import math
from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from drake_tracker.commands.common import NOT_TAKEN, SUCCESS, Commands, add_command, quiet_drake
from drake_tracker.core.errors import DrakeTrackerError

if TYPE_CHECKING:
    from drake_tracker.estimation.points_file import Predictions

FURTHEST_AHEAD = 60.0
"""Longest time ahead [s]."""
_COLUMNS = ("stamp", "predicted_x", "predicted_y", "predicted_z", "predicted_yaw", "std", "error")


def register(commands: Commands) -> None:
    """Adds the command to the parsers ``commands``."""
    command = add_command(
        commands,
        "predict",
        execute,
        help="predict the path of an object from a file of points",
        description="Gives the points of a CSV file to an estimator, one after the other, and compares each prediction "
        "with the point measured later. The header of the file names stamp, time or t [s], and x, y and z, or u and v.",
        next_step="drake-tracker predict FILE --estimator ClosedPath compares another estimator on the same points.",
    )
    command.add_argument("points", metavar="FILE.csv", help="measured points, for example the track.csv of a track")
    command.add_argument(
        "--estimator",
        default="CoordinatedTurn {}",
        metavar="TAG",
        help="as for drake-tracker track: without settings it adapts to the speed and the unit of length",
    )
    command.add_argument("--ahead", type=float, default=0.25, metavar="S", help="time ahead (default: 0.25) [s]")
    command.add_argument("-o", "--out", type=Path, metavar="FILE.csv", help="write the predictions to a new file")


def execute(options: Namespace) -> int:
    """Prints how well the estimator predicts; returns the exit code."""
    quiet_drake()
    import numpy as np

    from drake_tracker.estimation.points_file import predict_points, read_points
    from drake_tracker.own_cameras.scale import ESTIMATOR_SETTINGS, own_estimator
    from drake_tracker.scenarios.reader import read_option

    if not 0.0 <= options.ahead <= FURTHEST_AHEAD:
        raise DrakeTrackerError(f"--ahead {options.ahead:g}: must be from 0 to {FURTHEST_AHEAD:g} s")
    settings = read_option(options.estimator, ESTIMATOR_SETTINGS, "estimator")
    points = read_points(options.points)
    estimator = own_estimator(settings, points.period, points.in_pixels)
    found = predict_points(estimator, points, options.ahead)
    if options.out is not None:
        _write(options.out, found)
    valid = int(np.isfinite(points.positions).all(axis=1).sum())
    print(f"{'points':<18}{valid} of {len(points.stamps)} rows, one in {1e3 * points.period:.1f} ms")
    print(f"{'predictions':<18}{len(found.stamps)}, {options.ahead:g} s ahead")
    errors = found.errors[np.isfinite(found.errors)]
    if len(errors):
        factor, unit = (1.0, "px") if points.in_pixels else (1e3, "mm")
        inside = np.mean(errors <= found.stds[np.isfinite(found.errors)])
        print(f"{'error rms':<18}{factor * np.sqrt(np.mean(errors**2)):.2f} {unit}, against {len(errors)} later points")
        print(f"{'error, 95 %':<18}{factor * np.percentile(errors, 95):.2f} {unit}")
        print(f"{'within the std':<18}{inside:.0%} of the predictions (68 % is expected)")
    if options.out is not None:
        print(f"{'file':<18}{options.out}")
    return SUCCESS if len(found.stamps) else NOT_TAKEN


def _write(path: Path, found: "Predictions") -> None:
    """Writes the predictions to a new file."""
    try:
        with open(path, "x", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(_COLUMNS)
            for stamp, row, std, error in zip(*found, strict=True):
                writer.writerow(
                    [f"{value:.6f}" for value in (stamp, *row, std)] + ["" if math.isnan(error) else f"{error:.6f}"]
                )
    except FileExistsError:
        raise DrakeTrackerError(f"--out {path}: this file exists; name a new one") from None
    except OSError as error:
        raise DrakeTrackerError(f"--out {path}: cannot be written: {error.strerror}") from None
