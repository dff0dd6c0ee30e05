"""Constants and messages of the guarded move that touches the board (Nashman and Chaconas 1990, section 3)."""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np


class TouchPhase(IntEnum):
    """What the arm is doing: values of `TouchReport`'s ``phase`` field."""

    TRAVEL = 0
    ABOVE = 1
    DOWN = 2
    UP = 3
    DONE = 4
    MISSED = 5


@dataclass(frozen=True)
class TouchParameters:
    """How the arm touches.

    descent_speed, travel_speed: of the probe [m/s]. clearance: above the jogged poses on the way from one to the next,
    so that the probe passes over the board's pegs [m]. reach_below: how far below the jogged pose the board is sought
    [m]. threshold: force [N] that counts as a touch when it is felt in so many ``samples`` in a row. settle: rest over
    the mark before the descent [s]. force_time_constant: of the force's low-pass [s].
    """

    descent_speed: float = 0.006
    travel_speed: float = 0.5
    clearance: float = 0.03
    reach_below: float = 0.04
    threshold: float = 2.5
    samples: int = 2
    settle: float = 0.1
    force_time_constant: float = 0.005


@dataclass(frozen=True)
class TouchState:
    """Everything the touching remembers.

    since: when the phase began [s]. rest_force: felt in free air [N]. felt: samples above the threshold in a row.
    last_free: where the probe was when it last felt nothing, p_WP [m] in W. points: touched so far, shape (k, 3).
    """

    phase: TouchPhase
    mark: int
    motion: int
    duration: float
    since: float
    force: float
    rest_force: float
    felt: int
    last_free: np.ndarray
    points: np.ndarray

    def __deepcopy__(self, memo):
        return self
