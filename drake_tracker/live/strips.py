"""What the strips of the live view show, and how it follows from the ports of a run: arithmetic alone.

Errors are measured against the simulator's truth, which the loop never sees: the page is an onlooker.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from drake_tracker.core.messages import Prediction, evaluate_prediction

FAINT, BRIGHT = "faint", "bright"
"""How a line is drawn: what was measured or asked for, and what came of it."""


@dataclass(frozen=True)
class Strip:
    """One strip of the page: ``title``, what it shows (``meaning``), ``unit``, the ``top`` of its scale, the number of
    ``decimals``, and its ``lines``, each (name, `FAINT` or `BRIGHT`).
    """

    title: str
    meaning: str
    unit: str
    top: float
    decimals: int = 1
    lines: tuple = (("", BRIGHT),)


TRACKING = Strip("Tracking error", "hand to train, horizontal", "mm", 60.0)
PREDICTION = Strip("Prediction error", "predicted present to the true one", "mm", 30.0)
ARC_LENGTH = Strip("Arc length", "point to point: measured, filtered", "mm", 10.0, 2, (("", FAINT), ("", BRIGHT)))
JAWS = Strip("Jaw width", "asked for, felt", "mm", 100.0, 1, (("", FAINT), ("", BRIGHT)))
TIME_LEFT = Strip("Time left", "until the ball is over the cup", "s", 2.0, 2)
STRIPS = {
    "train": (TRACKING, PREDICTION, ARC_LENGTH, JAWS),
    "ball": (
        Strip("Tracking error", "cup to where the ball is expected", "mm", 200.0),
        PREDICTION,
        Strip("Arc length", "point to point: measured, filtered", "mm", 80.0, 1, ARC_LENGTH.lines),
        TIME_LEFT,
    ),
}
"""The strips of a task, from top to bottom."""
SPANS = {"train": 20.0, "ball": 10.0}
"""Simulated time [s] in view."""
_NEWEST = 0.6
"""Greatest age [s] of a point whose arc length is shown: twice the lag, and a little more."""


class Sights(NamedTuple):
    """What the strips are made of: instant ``now`` [s]; p_WT and the object's true p_WQ [m]; vectors of messages:
    ``packet``, ``filtered`` (valid, speed), ``command``; ``points``: the two newest valid `TrackPoint`s, or fewer;
    ``jaws``: a `JawState` or None; ``diagnosis``: a `CatchDiagnosis` or None.
    """

    now: float
    p_WT: np.ndarray
    p_WQ: np.ndarray
    packet: np.ndarray
    filtered: tuple
    command: tuple
    points: tuple
    jaws: tuple = None
    diagnosis: tuple = None


def measure(sights):
    """Returns the values of a task's strips, in the order of `STRIPS`, one for each line; None where not known.

    A task with jaws is the train, one with a `CatchDiagnosis` the ball.
    """
    if sights.diagnosis is None:
        tracking = _apart(sights.p_WT, sights.p_WQ)
        last = [1e3 * sights.command.jaw_width, 1e3 * sights.jaws.width]
    else:
        expected = sights.diagnosis
        known = expected.known and expected.time_left >= 0.0
        tracking = _apart(sights.p_WT, (expected.x, expected.y)) if known else None
        last = [expected.time_left if known else None]
    return [_tidy(value) for value in (tracking, _prediction_error(sights), *_arc_lengths(sights), *last)]


def _prediction_error(sights):
    if sights.command.frozen or not Prediction(sights.packet).valid:
        return None
    return _apart(evaluate_prediction(sights.packet, sights.now), sights.p_WQ)


def _arc_lengths(sights):
    """Returns the arc length [mm] between the two newest points as measured, and as the filter has it."""
    if len(sights.points) < 2 or sights.now - sights.points[-1].stamp > _NEWEST:
        return None, None
    earlier, later = sights.points
    measured = np.linalg.norm([later.x - earlier.x, later.y - earlier.y, later.z - earlier.z])
    time = later.stamp - earlier.stamp
    return 1e3 * measured, 1e3 * sights.filtered.speed * time if sights.filtered.valid else None


def _apart(first, second):
    """Returns the horizontal distance [mm] of two places (x, y, ...) [m]."""
    return 1e3 * float(np.hypot(first[0] - second[0], first[1] - second[1]))


def _tidy(value):
    return round(float(value), 3) if value is not None and np.isfinite(value) else None
