"""The arc-length filter: a path as arc length s, bending phi and climb dz (Allen et al. 1991, section 4).

Each chord of the measured path is compared with the one before it.  Kaiser moving averages of s, s^2 and phi, the Rice
inversion (equations 16-18) and T_delta (equation 6) give a circular arc that is run on into the future.

Two readings of the paper are built.  ``literal`` takes chords of one frame, as printed: at 0.15 m/s and 60 Hz a chord
is 2.5 mm, and with 1 mm of noise its direction is mostly noise, so that 0.25 s ahead it comes out some 50 mm off.
``baseline`` takes chords of m frames, long enough for the noise at hand, and starts the arc from an averaged point.

The paper's "multiply v by tau, as well as the bending" is not done in a single T_delta, which is no better than a
straight line, but as the power T_delta^n from the chord frame, which is exact on a circle.
"""

import math
from dataclasses import dataclass

import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.frozen_state import read_only
from drake_tracker.estimation.arc import Arc, run_arc
from drake_tracker.estimation.error_growth import HORIZON, ErrorGrowth
from drake_tracker.estimation.kaiser import moving_average_weights
from drake_tracker.estimation.parameters import not_negative, positive, whole
from drake_tracker.estimation.rice import recover_arc_length

MODES = ("baseline", "literal")
FEWEST_FRAMES = 9
"""Frames needed to fit an arc at all: two chords of two frames and a few to average."""


@dataclass(frozen=True)
class ArcLengthState:
    """What the filter remembers (arrays are read-only).

    stamp: time of the newest point [s].  times (n,) [s], points (n, 3) [m, W]: the points of the window.
    arc: the fitted `Arc`.
    speed [m/s], sigma [m] (of one point, per axis): smoothed over a third of a second, to choose the baseline by.
    has_root: False while the moments of s fit no Rice distribution and s_0 is held.
    ready: whether the window is long enough for a prediction.
    growth: how well recent predictions came true.
    """

    stamp: float
    times: np.ndarray
    points: np.ndarray
    arc: Arc
    speed: float
    sigma: float
    has_root: bool
    ready: bool
    growth: ErrorGrowth

    def __deepcopy__(self, memo):
        return self


class ArcLength:
    """The estimator; functional, all memory is in the `ArcLengthState` that `update` returns.

    Args:
        mode: "baseline" or "literal".
        period: sampling interval T [s].  Points are resampled to this grid, so missing ones are bridged linearly.
        attenuation: A of the Kaiser windows [dB].
        order: order M of the moving averages of s and s^2 (and of phi in literal mode); the paper's 30.
        anchor_order, heading_order, bending_order: orders for the starting point, its chord's direction, and phi.
            The error at the horizon of a grasp comes from phi, that now from the point; the paper has 30 for all.
        baseline: m [frames]; 0 chooses ceil(baseline_factor sqrt(2) sigma / (v T)) within baseline_range.
        baseline_factor: chord length over the noise of a chord that is aimed at.
        baseline_range: smallest and largest m.
        start_sigma: noise of a point [m, per axis] supposed at first.
        systematic_std: error of a point [m] that the filter cannot see, for `predict_std`.
        min_speed: below it [m/s] the object rests: its position and last heading are held.
        restart_after: a gap between points [s] after which the window starts afresh.
        ready_after: time span of points [s] needed for a prediction.
    """

    def __init__(
        self,
        mode="baseline",
        *,
        period=1.0 / 60.0,
        attenuation=30.0,
        order=30,
        anchor_order=10,
        heading_order=20,
        bending_order=40,
        baseline=0,
        baseline_factor=8.0,
        baseline_range=(3, 20),
        start_sigma=0.002,
        systematic_std=0.005,
        min_speed=0.02,
        restart_after=0.3,
        ready_after=0.6,
    ):
        if mode not in MODES:
            raise DrakeTrackerError(f"arc_length: mode is {mode!r}; allowed are {', '.join(MODES)}")
        of = "arc_length"
        whole(of, 2, 600, order=order, anchor_order=anchor_order, heading_order=heading_order)
        whole(of, 2, 600, bending_order=bending_order)
        whole(of, 0, 600, baseline=baseline)
        if not isinstance(baseline_range, (tuple, list)) or len(baseline_range) != 2:
            raise DrakeTrackerError(f"{of}: baseline_range is {baseline_range!r}; it must be two numbers of frames")
        low, high = baseline_range
        whole(of, 1, 600, baseline_range=high)
        whole(of, 1, high, baseline_range=low)
        positive(of, period=period, baseline_factor=baseline_factor, start_sigma=start_sigma)
        positive(of, ready_after=ready_after, restart_after=restart_after)
        not_negative(of, attenuation=attenuation, systematic_std=systematic_std, min_speed=min_speed)
        if not (ready_after > 4 * period and restart_after > period):
            raise DrakeTrackerError(
                f"{of}: period {period:g} s, ready_after {ready_after:g} s, restart_after {restart_after:g} s;"
                " ready_after must be above 4 periods and restart_after above one"
            )
        self.literal = mode == "literal"
        self.period = period
        self.order, self.anchor_order, self.heading_order = order, anchor_order, heading_order
        self.bending_order = bending_order
        if self.literal:
            self.bending_order, baseline = order, 1
        self.baseline, self.baseline_factor = baseline, baseline_factor
        self.baseline_low, self.baseline_high = low, high
        self.start_sigma = start_sigma
        self.systematic_std = systematic_std
        self.min_speed = min_speed
        self.restart_after = restart_after
        self.ready_after = ready_after
        longest = self._longest = max(order, anchor_order, heading_order, bending_order)
        self._frames = longest + 2 * max(baseline, high) + 1
        self._ages = read_only(period * np.arange(self._frames))
        self._weights = tuple(read_only(moving_average_weights(n, attenuation)) for n in range(longest + 1))
        self._smoothing = 1.0 - math.exp(-3.0 * period)

    def initial_state(self):
        return self._fresh_state(heading=0.0, growth=ErrorGrowth())

    def _fresh_state(self, heading, growth):
        return ArcLengthState(
            stamp=-math.inf,
            times=read_only(np.zeros(0)),
            points=read_only(np.zeros((0, 3))),
            arc=Arc(chord_heading=heading, heading=heading),
            speed=0.0,
            sigma=self.start_sigma,
            has_root=False,
            ready=False,
            growth=growth,
        )

    def ready(self, state):
        """Returns whether there is enough data for a prediction."""
        return state.ready

    def update(self, state, stamp, p_WQ):
        """Returns the state after a point p_WQ, shape (3,) [m, W], captured at ``stamp`` [s].

        A point that is None, not finite, or not newer than the newest one returns the state as it is.
        """
        if p_WQ is None or not np.isfinite(stamp) or not np.all(np.isfinite(p_WQ)) or stamp <= state.stamp:
            return state
        p_WQ = np.asarray(p_WQ, dtype=float)
        if stamp - state.stamp > self.restart_after:
            state = self._fresh_state(state.arc.heading, state.growth.forget())
        first = state.times.searchsorted(stamp - self._ages[-1] - self.restart_after)
        times = np.concatenate([state.times[first:], [stamp]])
        points = np.concatenate([state.points[first:], p_WQ[None, :]])
        frames = min(int((stamp - times[0]) / self.period + 1e-6) + 1, self._frames)
        arc, speed, sigma, has_root, growth = state.arc, state.speed, state.sigma, False, state.growth
        ready = bool(stamp - times[0] >= self.ready_after - 1e-9)
        if frames < FEWEST_FRAMES:
            arc = Arc(tuple(p_WQ.tolist()), stamp, arc.heading, heading=arc.heading)
        else:
            arc, speed, sigma, has_root = self._fit(state, stamp, times, points, frames)
        if ready:
            now, later = run_arc(arc, np.array([stamp, stamp + HORIZON]), self.period)
            growth = growth.update(stamp, now, later)
        return ArcLengthState(
            float(stamp), read_only(times), read_only(points), arc, speed, sigma, has_root, ready, growth
        )

    def _choose_baseline(self, state, frames):
        if self.baseline:
            m = self.baseline
        else:
            step = max(state.speed * self.period, 1e-9)
            m = math.ceil(min(self.baseline_factor * math.sqrt(2.0) * state.sigma / step, self.baseline_high))
            m = max(m, self.baseline_low)
        # While the window fills, at least half of it is left for averaging.
        return min(m, (frames - 1 - min(self._longest, frames // 2)) // 2)

    def _fit(self, state, stamp, times, points, frames):
        """Returns (arc, speed, sigma, has_root) of the newest ``frames`` frames; in arrays index 0 is the newest."""
        m = self._choose_baseline(state, frames)
        frames = min(frames, self._longest + 2 * m + 1)
        grid = stamp - self._ages[frames - 1 :: -1]
        xy = np.interp(grid, times, points[:, 0] + 1j * points[:, 1])[::-1]
        z = np.interp(grid, times, points[:, 2])[::-1]
        chords = xy[:-m] - xy[m:]

        order = min(self.order, len(chords) - 1)
        weights = self._weights[order]
        s = np.abs(chords[: order + 1])
        estimate = recover_arc_length(weights @ s, weights @ (s * s))
        s_0 = estimate.s_0 if estimate.has_root else state.arc.s_0 * m / state.arc.baseline
        # Of an object at rest s is noise alone, its ratio has a root or none by chance; the mean chord is short.
        at_rest = abs(weights @ chords[: order + 1]) < self.min_speed * m * self.period

        order = min(self.bending_order, len(chords) - m - 1)
        weights = self._weights[order]
        turns = chords[: order + 1] * chords[m : m + order + 1].conj()
        phi_0 = float(weights @ np.arctan2(turns.imag, turns.real))
        # The climb is a slope, so it is averaged as long as the bending.
        dz = float(weights @ (z[: order + 1] - z[m : m + order + 1]))

        # Speed along the arc, not along its chord.
        speed = s_0 / (m * self.period) * (1.0 if abs(phi_0) < 1e-9 else 0.5 * phi_0 / math.sin(0.5 * phi_0))
        if at_rest:
            s_0 = phi_0 = dz = speed = 0.0
        if self.literal:
            age = min(self.order, frames - 2) // 2
            xy_anchor, chord = xy[age], chords[age]
        else:
            xy_anchor, chord, age = self._averaged_anchor(xy, chords, m, s_0, phi_0)
        if s_0 > 0.0:
            chord_heading = math.atan2(chord.imag, chord.real)
        else:
            chord_heading = state.arc.heading
        order = min(self.anchor_order, len(z) - 1)
        z_anchor = float(self._weights[order] @ z[: order + 1]) + dz * (0.5 * order - age) / m
        arc = Arc(
            anchor=(float(xy_anchor.real), float(xy_anchor.imag), z_anchor),
            time=float(stamp - age * self.period),
            chord_heading=chord_heading,
            s_0=s_0,
            phi_0=phi_0,
            dz=dz,
            baseline=m,
            heading=chord_heading + phi_0 * (0.5 + age / m),
        )
        # Smoothed: the next baseline is chosen by them.
        gain = self._smoothing if state.speed > 0.0 else 1.0
        speed = state.speed + gain * (speed - state.speed)
        if not estimate.has_root:
            return arc, speed, state.sigma, False
        sigma_squared = state.sigma**2 + self._smoothing * (0.5 * estimate.sigma**2 - state.sigma**2)
        return arc, speed, math.sqrt(sigma_squared), True

    def _averaged_anchor(self, xy, chords, m, s_0, phi_0):
        """Returns an averaged point, its averaged chord (both complex, [m]) and their age in frames.

        The mean of points of an arc lies inside it; the point is put back on the arc.
        """
        order = min(self.anchor_order, len(chords) - 1)
        weights = self._weights[order]
        age = 0.5 * order
        heading_order = min(self.heading_order, len(chords) - 1)
        turn = phi_0 / m
        chord = self._weights[heading_order] @ chords[: heading_order + 1]
        chord = chord * np.exp(1j * turn * (0.5 * heading_order - age))
        point = weights @ xy[: order + 1]
        if abs(turn) > 1e-7 and chord != 0.0:
            # Radius times (1 - mean cosine) towards the centre, to the left of the tangent in a left turn.
            shrink = weights @ (2.0 * np.sin(0.5 * turn * (np.arange(order + 1) - age)) ** 2)
            radius = s_0 / (2.0 * math.sin(0.5 * phi_0))
            point = point - 1j * radius * shrink * chord / abs(chord) * np.exp(0.5j * phi_0)
        return point, chord, age

    def predict(self, state, times):
        """Returns rows x, y, z [m, W], yaw [rad] at absolute ``times`` [s], shape (n, 4).

        yaw is the tangent's direction, continuous along the rows.  While not `ready` the newest point is held.
        """
        return run_arc(state.arc, np.asarray(times, dtype=float), self.period)

    def predict_std(self, state, times):
        """Returns the expected horizontal error [m] at absolute ``times`` [s], shape (n,)."""
        horizon = np.asarray(times, dtype=float) - (state.stamp if math.isfinite(state.stamp) else 0.0)
        return state.growth.std(horizon, math.hypot(self.systematic_std, state.sigma))
