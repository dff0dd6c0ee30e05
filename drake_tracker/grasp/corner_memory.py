"""What became of predictions behind earlier corners of a path, and whether waiting makes a grasp more likely.

The distance from one corner of a path to the next is no more random than the path: straights of one length are common.
A grasp whose touch is due well behind a corner, and before the next one, succeeds although nobody knows where the next
corner leads.
"""

import math
from typing import NamedTuple

import numpy as np

from drake_tracker.grasp.prediction_memory import STAMP, PredictionMemory, places_seen

CORNER, CHORD = math.radians(30.0), 0.010
"""A corner turns a path by more than this [rad] between two chords of this length [m], one chord apart; chosen."""
FEWEST_CORNERS = 3
"""Number of corners after which an object is known to turn at corners; chosen."""
SPREAD = 0.004
"""Predictions that were due this far [m] from a place count for the place; chosen."""
EVIDENCE = 1.0
"""Number of earlier corners that the probability without corners is worth; chosen."""
SPEED_OVER = 0.5
"""Time over which the speed of the object is measured [s]; chosen."""
KNOWN_BY, RECURS = 1.2, 0.3
"""Distance travelled [m] from which on surprises are no longer a first lap's, and distance [m] within which an object
that goes on to surprise does so again; chosen on walks with the seeds 74100 to 74110 and
closed tracks with 71001 and 73001."""
REPEATED, SAME_PATH, REPEATED_AT = 0.10, 0.015, 11
"""Length of a piece of path [m] that no object but one on a closed track passes twice, within this distance [m] at this
number of places; chosen."""


class Path(NamedTuple):
    """Where an object was seen.

    Attributes:
        stamps: shape (n,) [s].
        places: shape (n, 2) [m].
        travelled: distance from the first place along the path, shape (n,) [m].
    """

    stamps: np.ndarray
    places: np.ndarray
    travelled: np.ndarray

    def at(self, travelled: np.ndarray) -> np.ndarray:
        """Returns the places at distances along the path (...) [m] as complex numbers, shape (...) [m]."""
        x, y = (np.interp(travelled, self.travelled, column) for column in self.places.T)
        return x + 1j * y


def after_corners(
    memory: PredictionMemory, wrong: np.ndarray, ahead: float, duration: float, otherwise: float
) -> float:
    """Returns the probability that a grasp succeeds, from what became of predictions as far behind earlier corners.

    The predictions that were due as far behind earlier corners as the touch will be behind the newest one say more than
    all together. The records count the cases; the other probability counts as `EVIDENCE` cases. An object without
    corners, or on a path that it has passed before, has only the other probability.

    Args:
        memory: predictions made so far.
        wrong: which of its records would have led to a miss, shape (n,) of bool.
        ahead: time for which the predictions were made [s].
        duration: time from the newest measurement to the touch [s].
        otherwise: probability that does not know of corners.
    """
    if not wrong.any():
        return otherwise
    path = path_seen(memory)
    due, corners = corners_due(memory, path, ahead)
    if len(corners) <= FEWEST_CORNERS or is_repeated(path):
        return otherwise
    lately = float(np.interp(path.stamps[-1] - SPEED_OVER, path.stamps, path.travelled))
    behind_corner = path.travelled[-1] - corners[-1] + (path.travelled[-1] - lately) * duration / SPEED_OVER
    shares = [wrong[np.abs(due - place) <= SPREAD] for place in corners[:-1] + behind_corner if place <= due[-1]]
    cases = [1.0 - float(share.mean()) for share in shares if len(share)]
    return (sum(cases) + EVIDENCE * otherwise) / (len(cases) + EVIDENCE)


def is_restless(memory: PredictionMemory, wrong: np.ndarray, ahead: float) -> bool:
    """Returns whether an object goes on to surprise: waiting does not make a grasp more likely to succeed.

    On a closed track, what surprised in the first lap is known in the second.

    Args:
        memory: as for `after_corners`.
        wrong: as for `after_corners`.
        ahead: as for `after_corners`.
    """
    path = path_seen(memory)
    if path.travelled[-1] < KNOWN_BY:
        return False
    due, corners = corners_due(memory, path, ahead)
    return len(corners) > FEWEST_CORNERS and bool(wrong[due >= due[-1] - RECURS].any()) and not is_repeated(path)


def path_seen(memory: PredictionMemory) -> Path:
    """Returns where the object was seen."""
    seen = places_seen(memory)
    steps = np.hypot(*np.diff(seen[:, 1:], axis=0).T)
    return Path(seen[:, 0], seen[:, 1:], np.append(0.0, np.cumsum(steps)))


def corners_due(memory: PredictionMemory, path: Path, ahead: float) -> tuple[np.ndarray, np.ndarray]:
    """Returns where along the path the predictions were due, and behind which of these places corners are seen [m].

    Args:
        memory: as for `after_corners`.
        path: where the object was seen.
        ahead: as for `after_corners`.
    """
    due = np.interp(memory.records[:, STAMP] + ahead, path.stamps, path.travelled)
    now, before = (path.at(end) - path.at(end - CHORD) for end in (due, due - 2.0 * CHORD))
    turned = np.abs(np.angle(now * before.conj())) > CORNER
    found = np.flatnonzero(turned & ~np.append(False, turned[:-1]))
    return due, due[found[np.diff(due[found], prepend=-np.inf) > 2.0 * CHORD]]


def is_repeated(path: Path) -> bool:
    """Returns whether the object has just passed a piece of its own path again, as on a closed track."""
    back, length = np.linspace(0.0, REPEATED, REPEATED_AT), path.travelled[-1]
    near = np.hypot(*(path.places - path.places[-1]).T) <= SAME_PATH
    ends = path.travelled[near & (path.travelled >= REPEATED) & (path.travelled <= length - REPEATED)]
    apart = path.at(ends[:, None] - back) - path.at(length - back)
    return bool(np.any(np.all(np.abs(apart) <= SAME_PATH, axis=1)))
