"""The receiver of the link: rejects, counts and remembers packets of predicted path that the arm must not follow.

A packet may come from any program that joins the link. A packet that breaks a rule is never used; the arm continues
with the last packet that broke no rule. Each rule follows from the definition of the message, or from the possible
motions of an object.
"""

import math
from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np

from drake_tracker.arm.config import PacketGuardConfig
from drake_tracker.core.constants import GRAVITY
from drake_tracker.core.frozen_state import FrozenState, read_only
from drake_tracker.core.messages import (
    KNOT_COUNT,
    KNOT_FIELDS,
    KNOT_SPACING,
    PacketReport,
    Prediction,
    message_size,
    prediction_end,
    prediction_knots,
)

LARGEST_ACCELERATION = GRAVITY
"""Largest acceleration of the object [m/s^2]: free fall. A train that friction keeps on its track cannot exceed it."""
LARGEST_TURN = math.pi
"""Largest change of direction from knot to knot [rad]: a direction that is continuous along the path has no larger."""
LARGEST_YAW = 1e6
"""Largest direction [rad]. Ten hours, the longest run, at a lap of 0.2 s add up to this."""
STANDARD_DEVIATIONS = 2.0
"""A path may lead below the table by this many of its own standard deviations."""
ROUNDING = 1e-6
"""Bound on the rounding errors of times [s] and of directions [rad]; stamps may count from 1970."""
_LARGEST_STD = 1e3
"""Largest standard deviation [m]; a larger one says nothing about any place in a laboratory."""
_LARGEST_SEQ = 2.0**53
"""Largest whole number up to which a float counts without gaps."""
_MIDDLES = KNOT_SPACING * (np.arange(KNOT_COUNT - 1) + 0.5)
"""Times from the stamp to the middle between two knots [s], at which the mean speed between them holds."""
_Z, _YAW, _STD = (KNOT_FIELDS.index(name) for name in ("z", "yaw", "std"))


class Rejection(IntEnum):
    """Why a packet is rejected, as logged; the first rule that it breaks counts."""

    NONE = 0
    NOT_FINITE = 1
    MALFORMED = 2
    SPACING = 3
    FIRST_TIME = 4
    FUTURE = 5
    PAST = 6
    OUTSIDE = 7
    BELOW_TABLE = 8
    TOO_FAST = 9
    TURNING = 10


REASONS = {
    Rejection.NOT_FINITE: "a number is not finite",
    Rejection.MALFORMED: "the message has other fields, or values that they cannot have",
    Rejection.SPACING: f"the knots are not {KNOT_SPACING:g} s apart",
    Rejection.FIRST_TIME: "the first knot is not at the stamp",
    Rejection.FUTURE: "the stamp is later than the arm's clock",
    Rejection.PAST: "the predicted path is over",
    Rejection.OUTSIDE: "the path begins outside the volume in which the object is seen",
    Rejection.BELOW_TABLE: "the path leads below the table",
    Rejection.TOO_FAST: "the path is faster than the object can be",
    Rejection.TURNING: "the direction is not continuous along the path",
}
"""The meaning of each rejection, in words."""


@dataclass(frozen=True)
class GuardState(FrozenState):
    """State of the receiver.

    Attributes:
        offered: the `Prediction` vector received last, read-only.
        accepted: the newest `Prediction` vector that broke no rule, read-only; all zeros before the first.
        counts: number of packets accepted (`Rejection.NONE`) and rejected, by `Rejection`.
        reason: why the newest rejected packet was rejected.
    """

    offered: np.ndarray
    accepted: np.ndarray
    counts: tuple[int, ...] = (0,) * len(Rejection)
    reason: Rejection = Rejection.NONE


class PacketGuard:
    """Arithmetic of the receiver.

    Args:
        settings: the limits.
        volume: lowest and highest corner in W of the box in which the object is seen, shape (2, 3) [m].
        table_height: height of the table top in W [m]; None where an object may fall below it.
    """

    def __init__(self, settings: PacketGuardConfig, volume: np.ndarray, table_height: float | None = None) -> None:
        self.settings = settings
        low, high = np.asarray(volume, dtype=float)
        self.low, self.high = low - settings.margin, high + settings.margin
        self.table_height = table_height
        self._speeds = settings.max_speed + LARGEST_ACCELERATION * _MIDDLES

    def initial_state(self) -> GuardState:
        """Returns the state before the first packet."""
        nothing = read_only(np.zeros(message_size(Prediction)))
        return GuardState(nothing, nothing)

    def update(self, state: GuardState, time: float, packet: np.ndarray) -> GuardState:
        """Returns the state after looking at the link. The same packet again is not counted again.

        Args:
            state: the state before.
            time: time on the arm's clock [s].
            packet: the newest `Prediction` vector on the link; one with ``valid`` = 0 is no packet.
        """
        packet = np.asarray(packet)
        if _same(packet, state.offered) or Prediction(packet).valid == 0.0:
            return state
        rejection = self.check(packet, time)
        counts = tuple(count + (reason == rejection) for reason, count in enumerate(state.counts))
        state = replace(state, offered=read_only(packet.copy()), counts=counts)
        if rejection:
            return replace(state, reason=rejection)
        return replace(state, accepted=state.offered) if _stamp(packet) > _stamp(state.accepted) else state

    def accepted(self, state: GuardState, time: float, packet: np.ndarray) -> np.ndarray:
        """Returns the newest `Prediction` vector that the arm may follow, that on the link included.

        Args:
            state: the state.
            time: time on the arm's clock [s].
            packet: the newest `Prediction` vector on the link.
        """
        return self.update(state, time, packet).accepted

    def check(self, packet: np.ndarray, time: float) -> Rejection:
        """Returns the first rule that a packet breaks, `Rejection.NONE` if it breaks none.

        - Every number is finite. ``valid`` is 1; ``seq`` is a count; no standard deviation is negative or above 1 km.
        - The knots are `KNOT_SPACING` apart, and the first one is at the stamp.
        - The stamp is not later than the arm's clock, and the path is not over.
        - The path begins where the object can be seen.
        - A path leads below the table by at most two of its own standard deviations, and never by more than the
          tolerance: extrapolated heights have errors.
        - It begins at no more than the largest speed, and gains no more than `LARGEST_ACCELERATION`, since an estimator
          may extrapolate the acceleration that it sees.
        - Its direction changes by at most half a turn from knot to knot.

        Args:
            packet: a `Prediction` vector that is not all zeros.
            time: time on the arm's clock [s].
        """
        if not np.isfinite(packet).all():
            return Rejection.NOT_FINITE if np.isfinite(Prediction(packet).valid) else Rejection.MALFORMED
        fields, knots = Prediction(packet), prediction_knots(packet)
        std, yaw = knots[:, _STD], knots[:, _YAW]
        if fields.valid != 1.0 or not 0.0 <= fields.seq <= _LARGEST_SEQ or std.min() < 0.0 or std.max() > _LARGEST_STD:
            return Rejection.MALFORMED
        if abs(fields.spacing - KNOT_SPACING) > ROUNDING:
            return Rejection.SPACING
        if abs(fields.first_time - fields.stamp) > ROUNDING:
            return Rejection.FIRST_TIME
        if fields.stamp > time + self.settings.clock_tolerance:
            return Rejection.FUTURE
        if prediction_end(packet) < time:
            return Rejection.PAST
        p_WQ = knots[:, :3]
        if (p_WQ[0] < self.low).any() or (p_WQ[0] > self.high).any():
            return Rejection.OUTSIDE
        if self.table_height is not None:
            allowed = np.minimum(STANDARD_DEVIATIONS * std, self.settings.table_tolerance)
            if (p_WQ[:, 2] < self.table_height - allowed).any():
                return Rejection.BELOW_TABLE
        with np.errstate(over="ignore", invalid="ignore"):  # knots of 1e308
            if not (np.linalg.norm(np.diff(p_WQ, axis=0), axis=1) <= self._speeds * KNOT_SPACING).all():
                return Rejection.TOO_FAST
            if np.abs(yaw).max() > LARGEST_YAW or np.abs(np.diff(yaw)).max() > LARGEST_TURN + ROUNDING:
                return Rejection.TURNING
        return Rejection.NONE

    @staticmethod
    def report(state: GuardState) -> np.ndarray:
        """Returns the `PacketReport` vector of a state."""
        received, rejected = sum(state.counts), sum(state.counts[1:])
        return np.array([received, rejected, state.reason, *state.counts[1:]], dtype=float)


def describe_rejections(report: np.ndarray) -> dict[str, int]:
    """Returns {reason, in lower case: number of rejected packets} of a `PacketReport` vector, without zeros."""
    counts = {reason.name.lower(): int(getattr(PacketReport(report), reason.name.lower())) for reason in REASONS}
    return {name: count for name, count in counts.items() if count}


def _same(packet: np.ndarray, other: np.ndarray) -> bool:
    """Returns whether two packets are the same bit for bit: NaN is equal to itself here."""
    return packet.tobytes() == other.tobytes()


def _stamp(packet: np.ndarray) -> float:
    return Prediction(packet).stamp
