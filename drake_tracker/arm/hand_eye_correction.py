"""The visual edge of the transform graph: the cameras' measurements of the hand correct the target of the hand.

In figure 11 of Allen et al. 1991 the object's pose comes from the cameras, and the hand's pose from the joints. If the
calibration of the cameras is wrong, the hand misses the object by the error of vision. Section 7 of the paper proposes
to let the cameras also watch the hand, and to update Drive by these measurements. An error of the calibration displaces
the hand almost as much as the object below it. The hand as seen minus the hand as measured by the joints is therefore
the error of vision at this place. It is subtracted from the object's position, so that Drive closes on the vector from
the hand to the object *as vision sees both*.
"""

import math
from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np

from drake_tracker.arm.config import HandEyeConfig
from drake_tracker.core.frozen_state import FrozenState, read_only
from drake_tracker.core.messages import HandPoint, ServoTarget

LEAST = 9
"""Number of the newest measurements whose median counts; as many are needed before the first correction."""
OUTLIERS = 30
"""Outliers in a row after which all earlier measurements are forgotten: half a second."""
REMEMBERED = 1.5
"""Time for which the arm remembers where its tool was [s]: more than the lag of vision and the delay of the link."""
_POSITION = [ServoTarget.get_fields().index(name) for name in "xyz"]
_VELOCITY = [ServoTarget.get_fields().index(name) for name in ("vx", "vy", "vz")]


class Doubt(IntEnum):
    """Why a measurement of the hand is not used, as logged.

    NOT_FINITE: its numbers are none. UNKNOWN_TIME: the arm does not remember where its tool was then. TOO_LARGE: it is
    too far from where the joints tell. OUTLIER: it contradicts the measurements before it.
    """

    NONE = 0
    NOT_FINITE = 1
    UNKNOWN_TIME = 2
    TOO_LARGE = 3
    OUTLIER = 4


@dataclass(frozen=True)
class HandEyeCorrectionState(FrozenState):
    """The arm's memory of the measurements of its hand.

    Attributes:
        times: times at which the tool was measured [s], shape (n,), ascending.
        tools: its positions p_WT, shape (n, 3) [m].
        stamp: of the newest measurement by vision [s].
        differences: the newest accepted differences between hand seen and hand measured, shape (k, 3) [m].
        outliers: number of outliers in a row.
        seen: time at which a measurement was accepted last [s].
        updated: time of the last update [s].
        goal: what the correction tends to, shape (3,) [m].
        correction: what is subtracted from the target, shape (3,) [m].
        rate: its rate, shape (3,) [m/s].
        used: whether the correction rests on recent measurements.
        accepted: number of measurements accepted so far.
        rejected: number of measurements rejected so far.
        reason: why the newest of these was rejected.
    """

    times: np.ndarray
    tools: np.ndarray
    stamp: float
    differences: np.ndarray
    outliers: int
    seen: float
    updated: float
    goal: np.ndarray
    correction: np.ndarray
    rate: np.ndarray
    used: bool
    accepted: int
    rejected: int
    reason: Doubt


class HandEyeCorrection:
    """Arithmetic of the correction.

    The correction follows the median of the newest measurements at a limited rate, as a critically damped system of
    second order: neither the correction nor its rate ever jumps.

    Args:
        settings: the filter's time constant, and what counts as implausible.
    """

    def __init__(self, settings: HandEyeConfig = HandEyeConfig()) -> None:
        self._settings = settings

    def initial_state(self) -> HandEyeCorrectionState:
        """Returns the state before the first measurement."""
        none, zero = read_only(np.zeros((0, 3))), read_only(np.zeros(3))
        times = read_only(np.zeros(0))
        return HandEyeCorrectionState(
            times, none, -math.inf, none, 0, 0.0, 0.0, zero, zero, zero, False, 0, 0, Doubt.NONE
        )

    def remember(self, state: HandEyeCorrectionState, time: float, p_WT: np.ndarray) -> HandEyeCorrectionState:
        """Returns the state after the joints were measured.

        Args:
            state: the state before.
            time: of the measurement [s].
            p_WT: position of the tool by the joints, shape (3,) [m].
        """
        kept = state.times > time - REMEMBERED
        return replace(
            state,
            times=read_only(np.append(state.times[kept], time)),
            tools=read_only(np.vstack([state.tools[kept], p_WT])),
        )

    def update(self, state: HandEyeCorrectionState, time: float, measurement: np.ndarray) -> HandEyeCorrectionState:
        """Returns the state after a tick.

        Args:
            state: the state before.
            time: of the tick [s].
            measurement: the newest `HandPoint` vector that has arrived; a vector that was used before is ignored.
        """
        hand = HandPoint(measurement)
        if hand.valid and hand.stamp != state.stamp:
            state = self._measured(replace(state, stamp=float(hand.stamp)), time, hand)
        if state.used and time - state.seen > self._settings.keep:
            state = replace(state, used=False, differences=read_only(np.zeros((0, 3))))
        elif not state.used and len(state.differences) >= LEAST:
            state = replace(state, used=True)
        wanted = np.median(state.differences, axis=0) if state.used else np.zeros(3)
        return self._step(state, time, wanted)

    def shifted(self, state: HandEyeCorrectionState, target: np.ndarray) -> np.ndarray:
        """Returns a `ServoTarget` vector with the correction subtracted from its position, and its rate from the speed.

        Args:
            state: the state.
            target: the `ServoTarget` vector by vision; an invalid target is returned unchanged.
        """
        if not (self._settings.correct and ServoTarget(target).valid):
            return target
        new = np.array(target)
        new[_POSITION] -= state.correction
        new[_VELOCITY] -= state.rate
        return new

    def report(self, state: HandEyeCorrectionState) -> np.ndarray:
        """Returns the `HandCorrection` vector of a state."""
        counts = [float(state.used), state.accepted, state.rejected, float(state.reason)]
        return np.concatenate([[state.updated], state.correction, counts])

    def _measured(self, state: HandEyeCorrectionState, time: float, hand: HandPoint) -> HandEyeCorrectionState:
        """Returns the state after a new measurement of the hand."""
        doubt, difference = self._compare(state, hand)
        if doubt is Doubt.OUTLIER and state.outliers + 1 >= OUTLIERS:  # it was the earlier ones that were wrong
            doubt = Doubt.NONE
            state = replace(state, differences=read_only(np.zeros((0, 3))))
        if doubt is not Doubt.NONE:
            outliers = state.outliers + (doubt is Doubt.OUTLIER)
            return replace(state, outliers=outliers, rejected=state.rejected + 1, reason=doubt)
        differences = read_only(np.vstack([state.differences[-LEAST + 1 :], difference]))
        return replace(state, differences=differences, outliers=0, seen=time, accepted=state.accepted + 1)

    def _compare(self, state: HandEyeCorrectionState, hand: HandPoint) -> tuple[Doubt, np.ndarray]:
        """Returns whether a measurement can be used, and the hand seen minus the hand measured, shape (3,) [m]."""
        p_WT = np.array([hand.x, hand.y, hand.z])
        nothing = np.zeros(3)
        if not (np.isfinite(p_WT).all() and math.isfinite(hand.stamp)):
            return Doubt.NOT_FINITE, nothing
        if not len(state.times) or not state.times[0] <= hand.stamp <= state.times[-1]:
            return Doubt.UNKNOWN_TIME, nothing
        difference = p_WT - [np.interp(hand.stamp, state.times, axis) for axis in state.tools.T]
        if np.linalg.norm(difference) > self._settings.largest:
            return Doubt.TOO_LARGE, nothing
        known = len(state.differences) >= LEAST
        if known and np.linalg.norm(difference - np.median(state.differences, axis=0)) > self._settings.outlier:
            return Doubt.OUTLIER, nothing
        return Doubt.NONE, difference

    def _step(self, state: HandEyeCorrectionState, time: float, wanted: np.ndarray) -> HandEyeCorrectionState:
        """Returns the state after the correction moved towards the desired correction, shape (3,) [m], until ``time``
        [s]."""
        tau, dt = self._settings.time_constant, time - state.updated
        way = wanted - state.goal
        goal = state.goal + way * min(1.0, self._settings.largest_rate * dt / max(float(np.linalg.norm(way)), 1e-9))
        away = state.correction - goal
        slope = state.rate + away / tau
        decay = math.exp(-dt / tau)
        correction = goal + (away + slope * dt) * decay
        rate = (state.rate - slope * dt / tau) * decay
        return replace(
            state, updated=time, goal=read_only(goal), correction=read_only(correction), rate=read_only(rate)
        )


def describe_doubt(reason: float) -> str | None:
    """Returns in words why a measurement of the hand was rejected, None for no reason."""
    return _WORDS.get(Doubt(int(reason)))


_WORDS = {
    Doubt.NOT_FINITE: "numbers that are not finite",
    Doubt.UNKNOWN_TIME: "a stamp at which the arm does not know its pose",
    Doubt.TOO_LARGE: "the hand is seen too far from where its joints tell",
    Doubt.OUTLIER: "it contradicts the measurements before it",
}
