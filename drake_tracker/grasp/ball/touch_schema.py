"""Phases and state of the guarded move that touches the board (Nashman and Chaconas 1990, section 3)."""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from drake_tracker.core.frozen_state import FrozenState


class TouchPhase(IntEnum):
    """What the arm is doing: values of `TouchReport`'s ``phase`` field."""

    TRAVEL = 0
    ABOVE = 1
    DOWN = 2
    UP = 3
    DONE = 4
    MISSED = 5


@dataclass(frozen=True)
class TouchState(FrozenState):
    """Everything the touching remembers.

    Attributes:
        phase: what the arm is doing.
        mark: number of the current mark.
        motion: number of straight-line motions begun.
        duration: duration of the motion under way [s].
        since: time at which the phase began [s].
        force: filtered force against the approach [N].
        rest_force: the same in free air, before the descent [N].
        felt: consecutive samples above the threshold.
        last_free: position of the probe when it last felt nothing, p_WP in W, shape (3,) [m].
        points: positions touched so far, p_WP in W, shape (k, 3) [m].
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
