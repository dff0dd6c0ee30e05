"""Fits a `MeasuredError` to points that the camera loop measured while the truth was known."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.measured.measured_error import MeasuredError, curvature, heading_bin, pattern_at

HEADINGS = 24
"""Number of headings in the table of the bias: one every 15 deg."""
REACH = 30
"""Cycles over which jitter is assumed to be correlated."""
FEWEST = 300
"""Least number of points at one speed that make a table."""
_PATTERN_SEEDS = range(8)
"""Seeds of the patterns whose mean autocorrelation is used."""
_BACK = 0.1
"""Angle [rad] by which a heading may turn back on a path that turns one way."""
_SMOOTH, _TIE, _LEVEL = 1e-3, 1e-6, 1e-2
"""Penalties on a table's roughness, on its size, and on its dependence on the curvature [1/m^2]."""


@dataclass(frozen=True, eq=False)
class Sighting:
    """One stretch of consecutive cycles of a run, at one speed.

    Attributes:
        xy: true position (n, 2) in W [m].
        yaw: true heading (n,) [rad], continuous.
        speed: (n,) [m/s].
        yaw_rate: (n,) [rad/s].
        error: of the points along, across and vertical (n, 3) [m], NaN in cycles without a point.
    """

    xy: np.ndarray
    yaw: np.ndarray
    speed: np.ndarray
    yaw_rate: np.ndarray
    error: np.ndarray


@dataclass(frozen=True, eq=False)
class SpeedFit:
    """The fit at one speed; the residual is the error minus the bias.

    Attributes:
        bias: as in `MeasuredError`, here (2, h, 3).
        pattern: as in `MeasuredError`, here (3,) [m].
        jitter: as in `MeasuredError`, here (3, 2 q + 1) [m].
        missing: as in `MeasuredError`, here (2,).
        std: standard deviation of the residual (3,) [m].
        returns: fraction (3,) of its variance that repeats a lap later.
        correlation: autocorrelation (k, 3) of the residual, 0 to k - 1 cycles later.
        cross: correlation of the residuals along and across.
        points: number of points.
    """

    bias: np.ndarray
    pattern: np.ndarray
    jitter: np.ndarray
    missing: np.ndarray
    std: np.ndarray
    returns: np.ndarray
    correlation: np.ndarray
    cross: float
    points: int


def fit_speed(sightings: Sequence[Sighting], pixel: float) -> SpeedFit:
    """Returns the `SpeedFit` of sightings at one speed.

    Args:
        sightings: stretches of the runs at this speed.
        pixel: footprint of a pixel [m].

    Raises DrakeTrackerError when there are too few points.
    """
    seen = [np.isfinite(each.error).all(axis=1) for each in sightings]
    count = int(sum(np.count_nonzero(one) for one in seen))
    if count < FEWEST:
        raise DrakeTrackerError(f"only {count} points were found, {FEWEST} are needed; use more seeds or laps")
    bias = fit_bias(sightings, seen)
    rests = [each.error - evaluate_bias(bias, each) for each in sightings]  # NaN stays NaN
    covariance = autocovariance(rests, REACH)
    returns = np.clip(share_that_returns(sightings, rests), 0.0, 0.95)
    # The pattern's own correlation along the paths is subtracted, so that the sum has the measured correlation.
    patterns = [
        np.array([pattern_at(seed, xy, pixel) for xy in each.xy]) for seed in _PATTERN_SEEDS for each in sightings
    ]
    of_pattern = autocovariance(patterns, REACH).mean(axis=1, keepdims=True)
    left = covariance - returns * covariance[0] * of_pattern / of_pattern[0]
    everything = np.concatenate(rests)
    everything = everything[np.isfinite(everything).all(axis=1)]
    return SpeedFit(
        bias=bias,
        pattern=np.sqrt(returns * covariance[0]),
        jitter=moving_average(left),
        missing=drop_outs(seen),
        std=np.sqrt(covariance[0]),
        returns=returns,
        correlation=covariance / covariance[0],
        cross=float(np.corrcoef(everything[:, 0], everything[:, 1])[0, 1]),
        points=count,
    )


def combine(fits: Mapping[float, SpeedFit], pixel: float, seen_from: float) -> MeasuredError:
    """Returns the `MeasuredError` of the fits at several speeds.

    Args:
        fits: {speed [m/s]: SpeedFit}.
        pixel: footprint of a pixel [m].
        seen_from: speed [m/s] below which nothing is seen.
    """
    speeds = sorted(fits)

    def stack(name: str) -> np.ndarray:
        return np.array([getattr(fits[speed], name) for speed in speeds])

    return MeasuredError(
        np.array(speeds), stack("bias"), stack("pattern"), stack("jitter"), stack("missing"), pixel, seen_from
    )


def fit_bias(sightings: Sequence[Sighting], seen: Sequence[np.ndarray]) -> np.ndarray:
    """Returns the least-squares table (2, HEADINGS, 3) of the bias: see `MeasuredError.bias`.

    A heading that was never seen is interpolated from its neighbours; where the curvature never changed, the bias does
    not depend on it.

    Args:
        sightings: stretches of runs.
        seen: for each of them, which cycles have a point, booleans (n,).
    """
    design = np.concatenate([_design(each)[one] for each, one in zip(sightings, seen)])
    error = np.concatenate([each.error[one] for each, one in zip(sightings, seen)])
    one = np.eye(HEADINGS)
    bow = np.roll(one, 1, axis=1) - 2.0 * one + np.roll(one, -1, axis=1)
    rough = _SMOOTH * bow.T @ bow + _TIE * one
    # Small compared with the data of one heading: its number of points, and their mean square curvature.
    share, bend = len(design) / HEADINGS, np.mean(curvature_of(sightings) ** 2)
    nothing = np.zeros_like(one)
    penalty = share * np.block([[rough, nothing], [nothing, bend * rough + _LEVEL * one]])
    return np.linalg.solve(design.T @ design + penalty, design.T @ error).reshape(2, HEADINGS, 3)


def curvature_of(sightings: Sequence[Sighting]) -> np.ndarray:
    """Returns the curvatures (n,) [1/m] of all sightings, concatenated."""
    return np.concatenate([curvature(each.speed, each.yaw_rate) for each in sightings])


def evaluate_bias(table: np.ndarray, sighting: Sighting) -> np.ndarray:
    """Returns the bias (n, 3) [m] of a table (2, HEADINGS, 3) along a `Sighting`."""
    return _design(sighting) @ table.reshape(2 * HEADINGS, 3)


def _design(sighting: Sighting) -> np.ndarray:
    """Returns the matrix (n, 2 HEADINGS) that takes a table to the bias along a `Sighting`."""
    count = len(sighting.yaw)
    first, second, weight = heading_bin(sighting.yaw, HEADINGS)
    design = np.zeros((count, HEADINGS))
    design[np.arange(count), first] = 1.0 - weight
    design[np.arange(count), second] += weight
    bend = curvature(sighting.speed, sighting.yaw_rate)
    return np.hstack([design, bend[:, None] * design])


def autocovariance(stretches: Sequence[np.ndarray], reach: int) -> np.ndarray:
    """Returns the autocovariance (reach + 1, m) of stretches (n, m), 0 to ``reach`` cycles later.

    It is about zero, not about the mean of each stretch, and ignores NaN.
    """
    sums = np.zeros((reach + 1, stretches[0].shape[1]))
    counts = np.zeros_like(sums)
    for rows in stretches:
        for lag in range(min(reach + 1, len(rows))):
            product = rows[: len(rows) - lag] * rows[lag:]
            sums[lag] += np.nansum(product, axis=0)
            counts[lag] += np.count_nonzero(np.isfinite(product), axis=0)
    return sums / np.maximum(counts, 1)


def moving_average(covariance: np.ndarray) -> np.ndarray:
    """Returns the weights (m, 2 q + 1) of the symmetric moving average of white noise with a given autocovariance.

    The weights are the inverse transform of the root of the spectrum. Negative power, which no covariance has, is set
    to zero; the variance is kept.

    Args:
        covariance: shape (q + 1, m), 0 to q cycles later.
    """
    reach = len(covariance) - 1
    taper = 1.0 - np.arange(reach + 1)[:, None] / (reach + 1)  # at large lags a covariance from few data is uncertain
    size = 8 * (reach + 1)
    whole = np.zeros((size, covariance.shape[1]))
    whole[: reach + 1] = covariance * taper
    whole[size - reach :] = whole[1 : reach + 1][::-1]
    power = np.maximum(np.fft.rfft(whole, axis=0).real, 0.0)
    kernel = np.fft.irfft(np.sqrt(power), n=size, axis=0)
    kernel = np.concatenate([kernel[-reach:], kernel[: reach + 1]]).T
    energy = np.sum(kernel**2, axis=1)
    wanted = np.maximum(covariance[0], 0.0)
    return kernel * np.sqrt(wanted / np.maximum(energy, 1e-30))[:, None]


def share_that_returns(sightings: Sequence[Sighting], rests: Sequence[np.ndarray]) -> np.ndarray:
    """Returns the fraction (3,) of the variance that repeats at the same heading one turn later.

    It is zero when no heading was passed twice.

    Args:
        sightings: stretches of runs.
        rests: their residuals (n, 3) [m], NaN in cycles without a point.
    """
    product, square = np.zeros(3), np.zeros(3)
    for each, rest in zip(sightings, rests):
        turned = (each.yaw - each.yaw[0]) * np.sign(each.yaw[-1] - each.yaw[0])
        forward = np.maximum.accumulate(turned)
        if turned[-1] <= 2.0 * np.pi or np.max(forward - turned) > _BACK:
            continue  # no whole turn, or not always in the same sense
        turned = forward + 1e-9 * np.arange(len(forward))
        again = np.nonzero(turned >= 2.0 * np.pi)[0]
        now = rest[again]
        before = np.column_stack([np.interp(turned[again] - 2.0 * np.pi, turned, column) for column in rest.T])
        good = np.isfinite(now).all(axis=1) & np.isfinite(before).all(axis=1)
        product += np.sum(now[good] * before[good], axis=0)
        square += 0.5 * np.sum(now[good] ** 2 + before[good] ** 2, axis=0)
    return product / np.maximum(square, 1e-30)


def drop_outs(seen: Sequence[np.ndarray]) -> np.ndarray:
    """Returns (fraction of the cycles without a point, mean length of such a gap [cycles], 1 when there is none)."""
    missing = np.concatenate([~one for one in seen])
    begins = sum(np.count_nonzero(np.diff((~one).astype(int), prepend=0) > 0) for one in seen)
    return np.array([missing.mean(), missing.sum() / begins if begins else 1.0])
