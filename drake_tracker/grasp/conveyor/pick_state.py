"""What the pick machine remembers, and what it knows at a tick."""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from drake_tracker.core.frozen_state import read_only
from drake_tracker.core.messages import PickOrder, message_size
from drake_tracker.grasp.conveyor.pick_schema import PickPhase
from drake_tracker.grasp.gate import Gate
from drake_tracker.grasp.operator_override import OperatedState

_NO_ORDER = read_only(np.zeros(message_size(PickOrder)))


@dataclass(frozen=True, kw_only=True)
class PickState(OperatedState):
    """All that the machine remembers.

    Attributes:
        phase: the phase.
        order: the `PickOrder` vector in work, read-only; all zeros without one.
        done: number of the last job that was done or failed.
        gripped_since: time since when the jaws have measured a grip [s], infinity while they do not.
        attempts: number of picks begun.
        picked: number of parts that the jaws held after the lift.
        placed: number of parts put down.
        failed: number of orders that failed.
        carried: number of the last job whose part the hand began to carry.
        put_down: number of the last job whose part the jaws let go in its cell.
        gate: why the hand waits above a part.
        p_success: probability that a pick would succeed.
        branch: half turns of the jaws when they took the part, or when the operator took control.
    """

    phase: PickPhase = PickPhase.WAIT
    order: np.ndarray = field(default_factory=lambda: _NO_ORDER)
    done: int = 0
    gripped_since: float = math.inf
    attempts: int = 0
    picked: int = 0
    placed: int = 0
    failed: int = 0
    carried: int = 0
    put_down: int = 0
    gate: Gate = Gate.NOT_TRACKING
    p_success: float = 0.0
    branch: float = 0.0


@dataclass(frozen=True)
class PickObservation:
    """What the arm's computer knows at a tick.

    Attributes:
        time: time of the tick [s].
        target: a `ServoTarget`.
        packet: the `Prediction` vector on which the target rests.
        order: the newest `PickOrder`.
        jaws: a `JawState`.
        status: a `ToolStatus`.
        arm_state: measured joint positions and velocities, shape (2 n,) [rad, rad/s].
        operator: an `OperatorCommand`.
    """

    time: float
    target: Any
    packet: np.ndarray
    order: Any
    jaws: Any
    status: Any
    arm_state: np.ndarray
    operator: Any
