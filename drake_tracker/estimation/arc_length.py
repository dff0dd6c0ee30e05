"""The arc-length filter: a path as arc length s, bending phi and climb dz (Allen et al. 1991, section 4).

Each chord of the measured path is compared with the previous one. Kaiser moving averages of s, s^2 and phi, the Rice
inversion (equations 16-18) and T_delta (equation 6) give a circular arc, which is extrapolated.

Two interpretations of the paper are implemented. The mode ``literal`` uses chords of one frame, as printed: at 0.15 m/s
and 60 Hz a chord is 2.5 mm long, and with 1 mm of noise its direction is mostly noise, so that the prediction 0.25 s
ahead is off by about 50 mm. The mode ``baseline`` uses chords of m frames, long enough for the actual noise, and starts
the arc from an averaged point.

The paper's "multiply v by tau, as well as the bending" is not implemented as a single T_delta, which is no better than
a straight line, but as the power T_delta^n from the chord frame, which is exact on a circle.

The mode ``space`` is the extension to "a full Frenet frame" that section 4.1 announces: chords in space, bending and
torsion, and powers of T_delta that are exact on a helix (docs/explanation/frenet.md). It is `baseline` otherwise.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.frozen_state import FrozenState, read_only
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.estimation.config import ArcLength
from drake_tracker.estimation.parameters import check_integer, check_positive, check_settings
from drake_tracker.estimation.parts.arc import Arc
from drake_tracker.estimation.parts.error_growth import HORIZON, ErrorGrowth
from drake_tracker.estimation.parts.helix import AT_REST, Helix, length_along
from drake_tracker.estimation.parts.helix_fit import fit_torsion, fit_turn, mean_offset, unsmoothed
from drake_tracker.estimation.parts.kaiser import moving_average_weights
from drake_tracker.estimation.parts.rice import ArcLengthEstimate, recover_arc_length

MIN_FRAMES = 9
"""Frames needed to fit an arc: two chords of two frames and a few frames to average."""
MAX_BASELINE = 600
"""Longest baseline that the constructor accepts [frames]."""
IN_SPACE, TORSION_WINDOW, TORSION_BASELINE = 1.1, 2.5, 8
"""In space: orders of bending and direction over those in a plane, because a third axis carries noise; order of torsion
over that of bending, and over its least baseline; chosen on development seeds."""


@dataclass(frozen=True)
class ArcLengthState(FrozenState):
    """State of an `ArcLengthEstimator` (arrays are read-only).

    Attributes:
        stamp: capture time of the newest point [s].
        times: capture times of the points in the window, shape (n,) [s].
        points: the points in the window, shape (n, 3), in W [m].
        arc: the fitted arc, or in space the fitted helix.
        speed: speed, smoothed over a third of a second to choose the baseline by [m/s].
        sigma: noise of a point, per axis, smoothed likewise [m].
        has_root: False while the moments of s fit no Rice distribution and s_0 is held.
        ready: whether the window is long enough for a prediction.
        growth: errors of recent predictions.
    """

    stamp: float
    times: np.ndarray
    points: np.ndarray
    arc: Arc | Helix
    speed: float
    sigma: float
    has_root: bool
    ready: bool
    growth: ErrorGrowth


class ArcLengthEstimator:
    """An `Estimator` that fits a circular arc to the newest points and extrapolates it.

    The error at the horizon of a grasp comes mainly from phi, the error now from the starting point; they therefore
    have moving averages of different orders, where the paper uses 30 for all. In literal mode ``order`` applies to phi
    as well.

    Args:
        settings: see `ArcLength`. A baseline of 0 chooses m = ceil(baseline_factor sqrt(2) sigma / (v T)) within
            ``baseline_range``.
        period: sampling interval T [s]. Points are interpolated linearly on this grid, which bridges missing ones.
        baseline_range: smallest and largest m that may be chosen [frames].

    Raises:
        DrakeTrackerError: a parameter is out of range.
    """

    def __init__(
        self,
        settings: ArcLength = ArcLength(),
        *,
        period: float = VISION_PERIOD,
        baseline_range: tuple[int, int] = (3, 20),
    ) -> None:
        of = "arc_length"
        check_settings(settings, ArcLength, upper_limits={"baseline": MAX_BASELINE})
        if not isinstance(baseline_range, (tuple, list)) or len(baseline_range) != 2:
            raise DrakeTrackerError(f"{of}: baseline_range is {baseline_range!r}; it must be two numbers of frames")
        low, high = baseline_range
        check_integer(of, 1, MAX_BASELINE, baseline_range=high)
        check_integer(of, 1, high, baseline_range=low)
        check_positive(of, period=period)
        if not (settings.ready_after > 4 * period and settings.restart_after > period):
            raise DrakeTrackerError(
                f"{of}: period {period:g} s, ready_after {settings.ready_after:g} s, restart_after "
                f"{settings.restart_after:g} s; ready_after must be above 4 periods and restart_after above one"
            )
        self.settings = settings
        self.period = period
        self._literal, self._in_space = settings.mode == "literal", settings.mode == "space"
        longer = IN_SPACE if self._in_space else 1.0
        self._bending_order = settings.order if self._literal else round(longer * settings.bending_order)
        self._heading_order = round(longer * settings.heading_order)
        self._baseline = 1 if self._literal else settings.baseline
        self._baseline_low, self._baseline_high = low, high
        self._longest = max(settings.order, settings.anchor_order, self._heading_order, self._bending_order)
        self._torsion_order = round(TORSION_WINDOW * self._bending_order) if self._in_space else 0
        self._frames = max(self._longest, self._torsion_order) + 2 * max(self._baseline, high) + 1
        self._ages = read_only(period * np.arange(self._frames))
        orders = range(max(self._longest, self._torsion_order) + 1)
        weights = (moving_average_weights(order, settings.attenuation) for order in orders)
        self._weights = tuple(map(read_only, weights))
        self._smoothing = 1.0 - math.exp(-3.0 * period)

    def initial_state(self) -> ArcLengthState:
        """Returns the state before the first point."""
        return self._fresh_state(heading=0.0, growth=ErrorGrowth())

    def _fresh_state(self, heading: float, growth: ErrorGrowth) -> ArcLengthState:
        """Returns a state without points, with the last heading [rad] and the errors of recent predictions."""
        return ArcLengthState(
            stamp=-math.inf,
            times=read_only(np.zeros(0)),
            points=read_only(np.zeros((0, 3))),
            arc=AT_REST._replace(heading=heading) if self._in_space else Arc(chord_heading=heading, heading=heading),
            speed=0.0,
            sigma=self.settings.start_sigma,
            has_root=False,
            ready=False,
            growth=growth,
        )

    def ready(self, state: ArcLengthState) -> bool:
        """Returns whether there is enough data for a prediction."""
        return state.ready

    def update(self, state: ArcLengthState, stamp: float, p_WQ: np.ndarray | None) -> ArcLengthState:
        """Returns the state after a point, see `Estimator.update`.

        A point that is None, not finite, or not newer than the state leaves the state as it is.
        """
        if p_WQ is None or not np.isfinite(stamp) or not np.all(np.isfinite(p_WQ)) or stamp <= state.stamp:
            return state
        p_WQ = np.asarray(p_WQ, dtype=float)
        restart_after = self.settings.restart_after
        if stamp - state.stamp > restart_after:
            state = self._fresh_state(state.arc.heading, state.growth.forget())
        first = state.times.searchsorted(stamp - self._ages[-1] - restart_after)
        times = np.concatenate([state.times[first:], [stamp]])
        points = np.concatenate([state.points[first:], p_WQ[None, :]])
        frames = min(int((stamp - times[0]) / self.period + 1e-6) + 1, self._frames)
        arc, speed, sigma, has_root, growth = state.arc, state.speed, state.sigma, False, state.growth
        ready = bool(stamp - times[0] >= self.settings.ready_after - 1e-9)
        if frames < MIN_FRAMES:
            arc = self._resting(p_WQ, stamp, arc.heading)
        else:
            fit = self._fit_in_space if self._in_space else self._fit
            arc, speed, sigma, has_root = fit(state, stamp, times, points, frames)
        if ready:
            now, later = arc.at(np.array([stamp, stamp + HORIZON]), self.period)
            growth = growth.update(stamp, now, later)
        return ArcLengthState(
            float(stamp), read_only(times), read_only(points), arc, speed, sigma, has_root, ready, growth
        )

    def _resting(self, p_WQ: np.ndarray, stamp: float, heading: float) -> Arc | Helix:
        """Returns the arc of an object that rests at a point, with a heading [rad]."""
        if self._in_space:
            return AT_REST._replace(anchor=read_only(p_WQ.copy()), time=float(stamp), heading=heading)
        x, y, z = p_WQ.tolist()
        return Arc((x, y, z), stamp, heading, heading=heading)

    def _choose_baseline(self, state: ArcLengthState, frames: int) -> int:
        """Returns the baseline m [frames] for a window of ``frames`` frames."""
        if self._baseline:
            m = self._baseline
        else:
            step = max(state.speed * self.period, 1e-9)
            factor = self.settings.baseline_factor
            m = math.ceil(min(factor * math.sqrt(2.0) * state.sigma / step, self._baseline_high))
            m = max(m, self._baseline_low)
        # While the window fills, at least half of it is left for averaging.
        return min(m, (frames - 1 - min(self._longest, frames // 2)) // 2)

    def _fit(
        self, state: ArcLengthState, stamp: float, times: np.ndarray, points: np.ndarray, frames: int
    ) -> tuple[Arc, float, float, bool]:
        """Returns (arc, speed [m/s], sigma [m], has_root) of the newest ``frames`` frames.

        In the arrays here index 0 is the newest frame.
        """
        m = self._choose_baseline(state, frames)
        frames = min(frames, self._longest + 2 * m + 1)
        grid = stamp - self._ages[frames - 1 :: -1]
        xy = np.interp(grid, times, points[:, 0] + 1j * points[:, 1])[::-1]
        z = np.interp(grid, times, points[:, 2])[::-1]
        chords = xy[:-m] - xy[m:]

        order = min(self.settings.order, len(chords) - 1)
        weights = self._weights[order]
        s = np.abs(chords[: order + 1])
        estimate = recover_arc_length(float(weights @ s), float(weights @ (s * s)))
        s_0 = estimate.s_0 if estimate.has_root else state.arc.s_0 * m / state.arc.baseline
        # Of an object at rest s is pure noise, and whether its ratio has a root is chance; but the mean chord is short.
        at_rest = abs(weights @ chords[: order + 1]) < self.settings.min_speed * m * self.period

        order = min(self._bending_order, len(chords) - m - 1)
        weights = self._weights[order]
        turns = chords[: order + 1] * chords[m : m + order + 1].conj()
        phi_0 = float(weights @ np.arctan2(turns.imag, turns.real))
        # The climb is a slope, so it is averaged over as many frames as the bending.
        dz = float(weights @ (z[: order + 1] - z[m : m + order + 1]))

        # Equation 4, with the speed along the arc instead of its chord.
        speed = s_0 / (m * self.period) * (1.0 if abs(phi_0) < 1e-9 else 0.5 * phi_0 / math.sin(0.5 * phi_0))
        if at_rest:
            s_0 = phi_0 = dz = speed = 0.0
        if self._literal:
            age: float = min(self.settings.order, frames - 2) // 2
            xy_anchor, chord = xy[int(age)], chords[int(age)]
        else:
            xy_anchor, chord, age = self._averaged_anchor(xy, chords, m, s_0, phi_0)
        chord_heading = math.atan2(chord.imag, chord.real) if s_0 > 0.0 else state.arc.heading
        order = min(self.settings.anchor_order, len(z) - 1)
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
        return arc, *self._smoothed(state, speed, estimate)

    def _fit_in_space(
        self, state: ArcLengthState, stamp: float, times: np.ndarray, points: np.ndarray, frames: int
    ) -> tuple[Helix, float, float, bool]:
        """Returns (helix, speed [m/s], sigma [m], has_root) of the newest ``frames`` frames, as `_fit` does."""
        m = self._choose_baseline(state, frames)
        grid = stamp - self._ages[frames - 1 :: -1]
        every = np.column_stack([np.interp(grid, times, column) for column in points.T])[::-1]
        xyz = every[: self._longest + 2 * m + 1]
        chords = xyz[:-m] - xyz[m:]

        order = min(self.settings.order, len(chords) - 1)
        weights, s = self._weights[order], np.linalg.norm(chords[: order + 1], axis=1)
        estimate = recover_arc_length(float(weights @ s), float(weights @ (s * s)), dimensions=3)
        s_0 = estimate.s_0 if estimate.has_root else state.arc.s_0 * m / state.arc.baseline
        mean = weights @ chords[: order + 1]
        if not s_0 > 0.0 or np.linalg.norm(mean) < self.settings.min_speed * m * self.period:
            weights = self._weights[min(self.settings.anchor_order, len(xyz) - 1)]
            anchor = read_only(weights @ xyz[: len(weights)])
            helix = AT_REST._replace(anchor=anchor, time=stamp, heading=state.arc.heading, baseline=m)
            return helix, *self._smoothed(state, 0.0, estimate)

        # Both ends of a chord are noisy, so that its variance is twice that of a point.
        variance = 0.5 * estimate.sigma**2 if estimate.has_root else state.sigma**2
        longer = max(m, self._torsion_order // TORSION_BASELINE)
        order = min(self._torsion_order, len(every) - 2 * longer - 1)
        torsion = 0.0
        if order > self._bending_order:
            torsion = fit_torsion(every, longer, self._weights[order], variance, s_0 * longer / m) * m / longer
        weights = self._weights[min(self._bending_order, len(chords) - m - 1)]
        turn = fit_turn(chords, m, weights, variance, torsion)

        weights = self._weights[min(self.settings.anchor_order, len(chords) - 1)]
        age, ages = 0.5 * (len(weights) - 1), np.arange(len(chords)) - 0.5 * (len(weights) - 1)
        of_heading = self._weights[min(self._heading_order, len(chords) - 1)]
        count = len(of_heading)
        chord = unsmoothed(of_heading @ chords[:count], turn, of_heading, ages[:count] / m)
        chord = chord * (s_0 / max(float(np.linalg.norm(chord)), 1e-12))
        count = len(weights)
        anchor = weights @ xyz[:count] - mean_offset(chord, turn, weights, ages[:count] / m)
        helix = Helix(read_only(anchor), float(stamp - age * self.period), read_only(chord), read_only(turn), s_0, m)
        helix = helix._replace(heading=float(helix.at(np.array([stamp]), self.period)[0, 3]))
        return helix, *self._smoothed(state, length_along(chord, turn) / (m * self.period), estimate)

    def _smoothed(self, state: ArcLengthState, speed: float, estimate: ArcLengthEstimate) -> tuple[float, float, bool]:
        """Returns (speed [m/s], sigma [m], has_root), smoothed because they choose the next baseline."""
        gain = self._smoothing if state.speed > 0.0 else 1.0
        speed = state.speed + gain * (speed - state.speed)
        if not estimate.has_root:
            return speed, state.sigma, False
        sigma_squared = state.sigma**2 + self._smoothing * (0.5 * estimate.sigma**2 - state.sigma**2)
        return speed, math.sqrt(sigma_squared), True

    def _averaged_anchor(
        self, xy: np.ndarray, chords: np.ndarray, m: int, s_0: float, phi_0: float
    ) -> tuple[complex, complex, float]:
        """Returns an averaged point, its averaged chord (both complex, [m]) and their age [frames].

        The mean of points on an arc lies inside the arc; the point is moved back onto it.
        """
        order = min(self.settings.anchor_order, len(chords) - 1)
        weights = self._weights[order]
        age = 0.5 * order
        heading_order = min(self._heading_order, len(chords) - 1)
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

    def predict(self, state: ArcLengthState, times: ArrayLike) -> np.ndarray:
        """Returns the predicted path, shape (n, 4): rows x, y, z in W [m] and yaw [rad].

        yaw is the direction of the tangent, continuous along the rows. While the estimator is not `ready` the newest
        point is held.
        """
        return state.arc.at(np.asarray(times, dtype=float), self.period)

    def predict_std(self, state: ArcLengthState, times: ArrayLike) -> np.ndarray:
        """Returns the expected horizontal error, shape (n,) [m]."""
        horizon = np.asarray(times, dtype=float) - (state.stamp if math.isfinite(state.stamp) else 0.0)
        return state.growth.std(horizon, math.hypot(self.settings.systematic_std, state.sigma))
