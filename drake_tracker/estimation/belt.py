"""The estimator of a belt: the positions of all parts, and the common speed with which the belt carries them.

All parts share the speed of the belt, so that every part measures this speed. A part that slips or is pushed has an
additional own speed. The positions along the belt and the speeds are the state of one Kalman filter; positions across
the belt and directions are filtered part by part, since the belt does not change them.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from scipy.special import chdtri

from drake_tracker.core.frozen_state import FrozenState, read_only
from drake_tracker.core.part_kinds import PART_SHAPES, PartKind
from drake_tracker.estimation.config import Belt

FIRST_SPEED_STD = 0.5
"""Standard deviation of the speed of a belt of which nothing is known yet [m/s]."""
FALSE_ALARM = 1e-6
"""Probability that the innovations of one stamp make a belt of constant speed seem to change it: once in some hours."""
SPEED_CHANGE = 0.1
"""Standard deviation of such a change [m/s]."""
NOTICED_AFTER = 0.03
"""Time [s] for which the belt has already moved at its new speed when that is noticed."""
OWN_SPEED = 0.1
"""Standard deviation of the own speed of a part that leaves the others [m/s]."""
OUTLIER = 5.0
"""A part whose innovation exceeds the median one by more standard deviations than this does not move with the belt."""
OUTLIER_COUNT = 4
"""Number of consecutive outliers after which a part gets an own speed."""
FEWEST = 3
"""Number of parts from which on the median one tells how the belt moves."""
SETTLED = 0.003
"""Own speed [m/s] below which a part moves with the belt again, once the own speed is known well enough."""


class PartPoint(NamedTuple):
    """A part as vision sees it at one stamp.

    Attributes:
        number: identity.
        kind: what it is.
        x: across the belt, in W [m].
        y: along the belt, in W [m].
        z: in W [m].
        yaw: direction of x_P in W [rad].
        var_along: variance of y [m^2].
        var_across: variance of x [m^2].
        var_yaw: variance of the direction [rad^2].
    """

    number: int
    kind: PartKind
    x: float
    y: float
    z: float
    yaw: float
    var_along: float
    var_across: float
    var_yaw: float


@dataclass(frozen=True)
class BeltPart:
    """State of a part besides its position along the belt.

    Attributes:
        number: identity.
        kind: what it is.
        x: across the belt, in W [m].
        x_var: its variance [m^2].
        z: in W [m].
        yaw: direction of x_P in W [rad].
        yaw_var: its variance [rad^2].
        seen: stamp at which it was last seen [s].
        outliers: number of consecutive outliers.
    """

    number: int
    kind: PartKind
    x: float
    x_var: float
    z: float
    yaw: float
    yaw_var: float
    seen: float
    outliers: int = 0


@dataclass(frozen=True, eq=False)
class BeltState(FrozenState):
    """State of a `BeltEstimator`. The arrays are read-only.

    Attributes:
        stamp: capture time of the newest points [s].
        mean: speed of the belt [m/s], then for each part its y in W [m] and its own speed [m/s], shape (1 + 2 n,).
        covariance: of ``mean``, shape (1 + 2 n, 1 + 2 n).
        parts: the parts, in the same order.
    """

    stamp: float = -math.inf
    mean: np.ndarray = field(default_factory=lambda: read_only(np.zeros(1)))
    covariance: np.ndarray = field(default_factory=lambda: read_only(np.full((1, 1), FIRST_SPEED_STD**2)))
    parts: tuple[BeltPart, ...] = ()

    @property
    def numbers(self) -> tuple[int, ...]:
        """Identities of the parts."""
        return tuple(part.number for part in self.parts)

    @property
    def speed(self) -> float:
        """Speed of the belt along y_W [m/s]."""
        return float(self.mean[0])

    @property
    def speed_std(self) -> float:
        """Its standard deviation [m/s]."""
        return math.sqrt(max(self.covariance[0, 0], 0.0))


class Travel(NamedTuple):
    """How far the belt has moved since a stamp, as its encoder measured it, and how fast it moves now.

    Attributes:
        distance: since the stamp [m].
        speed: now [m/s].
    """

    distance: float
    speed: float


class PartPath(NamedTuple):
    """The predicted path of a part.

    Attributes:
        rows: x, y, z in W [m] and yaw [rad], shape (n, 4).
        std: standard deviation of the position along the belt, shape (n,) [m].
    """

    rows: np.ndarray
    std: np.ndarray


class BeltEstimator:
    """Filters the parts on a belt and predicts their paths. It is functional, like every `Estimator`.

    Args:
        settings: the noises.
    """

    def __init__(self, settings: Belt = Belt()) -> None:
        self.settings = settings

    def update(
        self, state: BeltState, stamp: float, points: Sequence[PartPoint], travel: Travel | None = None
    ) -> BeltState:
        """Returns the state after all points of one stamp. A message that is not newer than the state is ignored.

        Args:
            state: the state before.
            stamp: capture time of the points [s].
            points: the parts that are seen.
            travel: what the encoder measured from the stamp of the state to this one; None without an encoder.
        """
        if not math.isfinite(stamp) or stamp <= state.stamp:
            return state
        points = [each for each in points if np.isfinite(each).all()]
        if math.isfinite(state.stamp):
            state = self._propagated(state, stamp, travel)
        state = self._forgotten(replace(state, stamp=stamp))
        known = {part.number for part in state.parts}
        state = self._corrected(state, [each for each in points if each.number in known], travel is not None)
        for each in points:
            if each.number not in known:
                state = _begun(state, each)
        return state

    def predict(self, state: BeltState, number: int, times: np.ndarray, travel: Travel | None = None) -> PartPath:
        """Returns the predicted path of a part.

        Args:
            state: the state to predict from.
            number: of the part.
            times: absolute times, shape (n,), the last one not before the stamp [s].
            travel: what the encoder measured from the stamp of the state to the first of the times; None without one.

        Raises KeyError when there is no such part.
        """
        k = self._place(state, number)
        part, index = state.parts[k], 1 + 2 * k
        tau = np.asarray(times, dtype=float) - state.stamp
        own = state.mean[index + 1]
        if travel is None:
            along = (state.mean[0] + own) * tau
        else:
            along = travel.distance + travel.speed * (tau - tau[0]) + own * tau
        rows = np.column_stack(
            [
                np.full(len(tau), part.x),
                state.mean[index] + along,
                np.full(len(tau), part.z),
                np.full(len(tau), part.yaw),
            ]
        )
        P = state.covariance
        tau = np.maximum(tau, 0.0)
        free = tau if travel is None else tau - tau[0]
        gain = np.zeros((len(tau), len(state.mean)))
        gain[:, 0], gain[:, index], gain[:, index + 1] = free, 1.0, tau
        variance = np.einsum("ni,ij,nj->n", gain, P, gain) + self.settings.speed_noise**2 * free**3 / 3.0
        return PartPath(rows, np.sqrt(np.maximum(variance, 0.0) + self.settings.systematic_std**2))

    def _place(self, state: BeltState, number: int) -> int:
        for k, part in enumerate(state.parts):
            if part.number == number:
                return k
        raise KeyError(number)

    def _propagated(self, state: BeltState, stamp: float, travel: Travel | None) -> BeltState:
        dt, n = stamp - state.stamp, len(state.mean)
        F = np.eye(n)
        F[1::2, 0] = dt
        F[range(1, n, 2), range(2, n, 2)] = dt
        mean = F @ state.mean
        q = self.settings.speed_noise**2
        along, speed = np.zeros(n), np.zeros(n)
        along[1::2], speed[0] = 1.0, 1.0
        cross = np.outer(along, speed)
        Q = dt * np.outer(speed, speed) + dt**2 / 2.0 * (cross + cross.T) + dt**3 / 3.0 * np.outer(along, along)
        P = F @ state.covariance @ F.T + q * Q
        if travel is not None:  # the encoder knows better than the filter how far the belt went
            mean[1::2] = state.mean[1::2] + travel.distance + dt * state.mean[2::2]
            mean[0] = travel.speed
            P[0, :] = P[:, 0] = 0.0
            P[0, 0] = self.settings.encoder_std**2
        drift = self.settings.drift**2 * dt
        P[range(1, n, 2), range(1, n, 2)] += drift
        parts = tuple(
            replace(part, x_var=part.x_var + drift, yaw_var=part.yaw_var + self.settings.turn_drift**2 * dt)
            for part in state.parts
        )
        return BeltState(stamp, read_only(mean), read_only(P), parts)

    def _forgotten(self, state: BeltState) -> BeltState:
        """Returns the state without the parts that have not been seen for too long."""
        keep = [k for k, part in enumerate(state.parts) if state.stamp - part.seen <= self.settings.forget_after]
        if len(keep) == len(state.parts):
            return state
        index = np.array([0, *(i for k in keep for i in (1 + 2 * k, 2 + 2 * k))])
        return replace(
            state,
            mean=read_only(state.mean[index]),
            covariance=read_only(state.covariance[np.ix_(index, index)]),
            parts=tuple(state.parts[k] for k in keep),
        )

    def _corrected(self, state: BeltState, points: Sequence[PartPoint], encoder: bool) -> BeltState:
        if not points:
            return state
        places = [self._place(state, each.number) for each in points]
        index = np.array([1 + 2 * k for k in places])
        mean, P = state.mean.copy(), state.covariance.copy()
        innovation = np.array([each.y for each in points]) - mean[index]
        noise = np.array([each.var_along for each in points])
        std = np.sqrt(P[index, index] + noise)
        outlying = np.abs(innovation - np.median(innovation)) > OUTLIER * std
        if len(points) < FEWEST:
            outlying[:] = False
        used = ~outlying
        surprise = np.sum((innovation[used] / std[used]) ** 2)
        if not encoder and used.any() and surprise > chdtri(np.count_nonzero(used), FALSE_ALARM):
            change = np.zeros(len(mean))
            change[0], change[1::2] = SPEED_CHANGE, SPEED_CHANGE * NOTICED_AFTER
            P += np.outer(change, change)
        parts = list(state.parts)
        for k, each, out in zip(places, points, outlying, strict=True):
            part = _filtered(parts[k], each, state.stamp)
            parts[k] = replace(part, outliers=part.outliers + 1 if out else 0)
            if parts[k].outliers >= OUTLIER_COUNT:
                P[2 + 2 * k, 2 + 2 * k] += OWN_SPEED**2
                P[1 + 2 * k, 1 + 2 * k] += innovation[places.index(k)] ** 2
        used = np.array([not out or parts[k].outliers >= OUTLIER_COUNT for k, out in zip(places, outlying)])
        if used.any():
            mean, P = _kalman(mean, P, index[used], innovation[used], noise[used])
        for k in range(len(parts)):
            own = 2 + 2 * k
            if 0.0 < P[own, own] < SETTLED**2 and abs(mean[own]) < SETTLED:
                mean[own], P[own, :], P[:, own] = 0.0, 0.0, 0.0
        return BeltState(state.stamp, read_only(mean), read_only(P), tuple(parts))


def _kalman(
    mean: np.ndarray, P: np.ndarray, index: np.ndarray, innovation: np.ndarray, noise: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Returns mean and covariance after measurements of some elements, in the form of Joseph.

    Args:
        mean: before, shape (n,).
        P: covariance before, shape (n, n).
        index: the measured elements, shape (m,).
        innovation: measured minus expected values, shape (m,).
        noise: variances of the measurements, shape (m,).
    """
    H = np.zeros((len(index), len(mean)))
    H[range(len(index)), index] = 1.0
    R = np.diag(noise)
    K = np.linalg.solve(H @ P @ H.T + R, H @ P).T
    rest = np.eye(len(mean)) - K @ H
    return mean + K @ innovation, rest @ P @ rest.T + K @ R @ K.T


def _begun(state: BeltState, each: PartPoint) -> BeltState:
    """Returns the state with a new part."""
    n = len(state.mean)
    P = np.zeros((n + 2, n + 2))
    P[:n, :n] = state.covariance
    P[n, n] = each.var_along
    part = BeltPart(each.number, each.kind, each.x, each.var_across, each.z, each.yaw, each.var_yaw, state.stamp)
    return BeltState(
        state.stamp, read_only(np.concatenate([state.mean, [each.y, 0.0]])), read_only(P), (*state.parts, part)
    )


def _filtered(part: BeltPart, each: PartPoint, stamp: float) -> BeltPart:
    """Returns a part after a measurement of its position across the belt and its direction."""
    gain = part.x_var / (part.x_var + each.var_across)
    turns = PART_SHAPES[part.kind].turns
    yaw, yaw_var = part.yaw, part.yaw_var
    if turns:
        turn_gain = yaw_var / (yaw_var + each.var_yaw)
        yaw += turn_gain * math.remainder(each.yaw - yaw, 2.0 * math.pi / turns)
        yaw_var *= 1.0 - turn_gain
    return replace(
        part,
        x=part.x + gain * (each.x - part.x),
        x_var=(1.0 - gain) * part.x_var,
        z=part.z + gain * (each.z - part.z),
        yaw=yaw,
        yaw_var=yaw_var,
        seen=stamp,
    )
