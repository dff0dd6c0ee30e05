"""Figures 7 and 12 of Allen et al. 1991: the arc length as the camera loop measures it, and filtered."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from drake_tracker.core.log import Signal
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.estimation.parts.kaiser import moving_average_weights
from drake_tracker.estimation.parts.rice import arc_length_density, recover_arc_length
from drake_tracker.figures.kaiser_response import ATTENUATION
from drake_tracker.figures.paper_style import MINUS, head, quiet_grid, sheet
from drake_tracker.figures.statistics import correlation, kolmogorov_smirnov, rice_distribution
from drake_tracker.tasks.style import FAR_PREDICTED, INK, PREDICTED, SEEN
from drake_tracker.tasks.train.episode import errors, train_pose
from drake_tracker.tasks.train.summary import JITTER_WINDOW, without_mean

START_UP = 1.0
"""Time [s] from the first point until the train has its speed."""
ORDER = 30
"""Order M of the moving averages of s and s^2."""
BINS = 32
"""Number of bins of the histogram in figure 7."""


def measured_points(log: Mapping[str, Signal]) -> tuple[np.ndarray, np.ndarray]:
    """Returns (stamps (n,) [s], xy (n, 2) [m]) of the valid triangulated points once the train has its speed."""
    point = log["point"]
    valid = point["valid"] > 0
    # A point stays in the log until the next one arrives.
    stamps, first = np.unique(point["stamp"][valid], return_index=True)
    kept = stamps >= stamps[:1].sum() + START_UP
    return stamps[kept], point.view("x", "y")[valid][first][kept]


def arc_lengths(stamps: np.ndarray, xy: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns (stamps (k,) [s], s (k,) [m]): lengths of the chords between points of successive frames.

    The stamp of a chord is that of its newer point.

    Args:
        stamps: of the points, shape (n,) [s].
        xy: the points, shape (n, 2) [m].
    """
    follows = np.diff(stamps) < 1.5 * VISION_PERIOD
    return stamps[1:][follows], np.hypot(*np.diff(xy, axis=0).T)[follows]


def filter_arc_lengths(s: ArrayLike, order: int = ORDER, attenuation: float = ATTENUATION) -> np.ndarray:
    """Returns (s_1, s_0, sigma) of section 4.3, shape (3, n) [m], NaN for the first ``order`` samples.

    s_1 and s_2^2 are Kaiser averages of s and s^2 up to each sample. Where their ratio has no root, s_0 is held.

    Args:
        s: measured arc lengths, shape (n,) [m].
        order: of the moving averages.
        attenuation: of their Kaiser window [dB].
    """
    s = np.asarray(s, dtype=float)
    weights = moving_average_weights(order, attenuation)
    out = np.full((3, len(s)), np.nan)
    s_0 = sigma = np.nan
    for k in range(order, len(s)):
        window = s[k - order : k + 1]
        s_1 = weights @ window
        found = recover_arc_length(s_1, weights @ (window * window))
        if found.has_root:
            s_0, sigma = found.s_0, found.sigma
        out[:, k] = s_1, s_0, sigma
    return out


def measured_density(log: Mapping[str, Signal]) -> dict[str, Any]:
    """Returns the numbers of figure 7: histogram of s, its Rice fit by two moments, and the distance between the two.

    They also have the correlation of the tangential and the normal component of the jitter (section 4.1), with the
    normal to the left of travel. The paper reports 0.1 to 0.2, and does not say to which side its normal points, which
    determines the sign.
    """
    stamps, xy = measured_points(log)
    times, s = arc_lengths(stamps, xy)
    fit = recover_arc_length(s.mean(), np.mean(s * s))
    truth = train_pose(log, np.concatenate([times, times - VISION_PERIOD]))[:, :2]
    true = np.hypot(*(truth[: len(times)] - truth[len(times) :]).T)
    counts, edges = np.histogram(s, bins=BINS, range=(0.0, 1.02 * s.max()), density=True)
    jitter = without_mean(stamps, errors(log, stamps, xy))
    tangential, normal = jitter.T
    return {
        "samples": len(s),
        "interval_s": VISION_PERIOD,
        "s_1_m": s.mean(),
        "s_2_m": np.sqrt(np.mean(s * s)),
        "true_s_0_m": np.nanmean(true),
        "fit_s_0_m": fit.s_0,
        "fit_sigma_m": fit.sigma,
        "fit_has_root": fit.has_root,
        "kolmogorov_smirnov": kolmogorov_smirnov(s, lambda x: rice_distribution(x, fit.s_0, max(fit.sigma, 1e-9))),
        "jitter_window_frames": JITTER_WINDOW,
        "jitter_tangential_m": tangential.std(),
        "jitter_normal_m": normal.std(),
        "jitter_correlation": correlation(tangential, normal)._asdict(),
        "edges_m": edges,
        "density_1_m": counts,
        "jitter_tangential_normal_m": jitter,
    }


def draw_measured_density(numbers: Mapping[str, Any]) -> Figure:
    """Returns figure 7."""
    edges = 1e3 * numbers["edges_m"]
    s = np.linspace(1e-6, edges[-1], 400)
    s_0, sigma = 1e3 * numbers["fit_s_0_m"], 1e3 * max(numbers["fit_sigma_m"], 1e-6)
    with sheet(13.0, 5.2) as figure:
        axes, right = figure.subplots(1, 2, width_ratios=(1.5, 1.0))
        _draw_jitter(right, numbers)
        axes.stairs(1e-3 * numbers["density_1_m"], edges, fill=True, color="#d6dadf", label="measured")
        axes.plot(
            s,
            arc_length_density(s, s_0, sigma),
            color=PREDICTED,
            lw=2.4,
            label=f"Rice, $s_0$ = {s_0:.2f} mm, $\\sigma$ = {sigma:.2f} mm",
        )
        for value, colour, look, name in (
            (numbers["true_s_0_m"], INK, "-", "true arc length"),
            (numbers["fit_s_0_m"], PREDICTED, (0, (4, 2)), "recovered $s_0$"),
            (numbers["s_1_m"], FAR_PREDICTED, (0, (1, 1)), "plain mean $s_1$"),
        ):
            axes.axvline(1e3 * value, color=colour, ls=look, lw=1.8, label=f"{name}: {1e3 * value:.2f} mm")
        axes.set(
            xlim=(0, edges[-1]), xlabel="arc length $s$ between images 1/60 s apart  [mm]", ylabel="density  [1/mm]"
        )
        axes.set_ylim(0, 1.4 * max(1e-3 * numbers["density_1_m"].max(), arc_length_density(s, s_0, sigma).max()))
        quiet_grid(axes)
        axes.legend(loc="upper right")
        head(
            axes,
            "Figure 7 · Arc length as the cameras measure it",
            f"{numbers['samples']} chords of one frame; Kolmogorov-Smirnov distance from the Rice density "
            f"{numbers['kolmogorov_smirnov']:.3f}.",
        )
    return figure


def _draw_jitter(axes: Axes, numbers: Mapping[str, Any]) -> None:
    """Draws the noise of section 4.1: each point along and across the track."""
    tangential, normal = 1e3 * numbers["jitter_tangential_normal_m"].T
    found = numbers["jitter_correlation"]
    limit = 1.1 * max(np.abs(tangential).max(initial=0.5), np.abs(normal).max(initial=0.5))
    axes.plot(tangential, normal, ".", color=PREDICTED, ms=5, alpha=0.4, mew=0)
    axes.set(
        xlim=(-limit, limit),
        ylim=(-limit, limit),
        xlabel="tangential noise $n_t$  [mm]",
        ylabel="normal noise $n_n$  [mm]",
    )
    axes.set_aspect("equal", anchor="NW")
    quiet_grid(axes)
    head(
        axes,
        "Its noise",
        f"Correlation {found['coefficient']:+.2f}, 95 % interval {found['low']:+.2f} to {found['high']:+.2f}.".replace(
            "-", MINUS
        ),
    )


def filtered_arc(log: Mapping[str, Signal]) -> dict[str, Any]:
    """Returns the numbers of figure 12: s, s_1, s_0 and the true chord [m] over time [s]."""
    times, s = arc_lengths(*measured_points(log))
    s_1, s_0, sigma = filter_arc_lengths(s)
    truth = train_pose(log, np.concatenate([times, times - VISION_PERIOD]))[:, :2]
    true = np.hypot(*(truth[: len(times)] - truth[len(times) :]).T)
    full = np.isfinite(s_0)
    return {
        "order": ORDER,
        "attenuation_db": ATTENUATION,
        "mean_s_1_m": _mean(s_1),
        "mean_s_0_m": _mean(s_0),
        "mean_sigma_m": _mean(sigma),
        "mean_true_m": _mean(true),
        "bias_s_1": _mean(s_1[full] / true[full]) - 1.0,
        "bias_s_0": _mean(s_0[full] / true[full]) - 1.0,
        "scatter_s_m": np.std(s),
        "scatter_s_0_m": np.std(s_0[full]),
        "time_s": times,
        "s_m": s,
        "s_1_m": s_1,
        "s_0_m": s_0,
        "true_m": true,
    }


def _mean(row: np.ndarray) -> float:
    row = row[np.isfinite(row)]
    return float(row.mean()) if len(row) else float("nan")


def draw_filtered_arc(numbers: Mapping[str, Any], longest: float = 8.0) -> Figure:
    """Returns figure 12: input and output of the filter, and below them the output enlarged.

    Args:
        numbers: from `filtered_arc`.
        longest: time that is shown at most [s].
    """
    start = max(numbers["time_s"][-1] - longest, numbers["time_s"][0])
    shown = numbers["time_s"] >= start
    times = numbers["time_s"][shown]
    s, s_1, s_0, true = (1e3 * numbers[key][shown] for key in ("s_m", "s_1_m", "s_0_m", "true_m"))
    with sheet(12.0, 6.4) as figure:
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=(1.35, 1.0))
        above.plot(times, s, color=SEEN, lw=0.9, label="measured $s$")
        for axes in (above, below):
            axes.plot(times, true, color=INK, lw=1.3, label="true")
        below.plot(times, s_1, color=FAR_PREDICTED, lw=1.8, label="averaged: $s_1$")
        for axes in (above, below):
            axes.plot(times, s_0, color=PREDICTED, lw=2.2, label="filtered: $s_0$")
            axes.set_ylabel("arc length  [mm]")
            quiet_grid(axes)
        above.set_ylim(bottom=0)
        above.legend(ncols=3, loc="lower left")
        below.legend(ncols=3, loc="lower left")
        values = np.concatenate([s_1, s_0, true])
        values = values[np.isfinite(values)]
        space = 0.35 * np.ptp(values)
        below.set(
            xlim=(times[0], times[-1]), xlabel="time  [s]", ylim=(values.min() - space - 0.05, values.max() + 0.05)
        )
        head(
            above,
            "Figure 12 · The arc length before and after the filter",
            "Chords of one frame, 1/60 s. On average "
            f"$s_1$ differs from the true length by {100 * numbers['bias_s_1']:+.1f} %, "
            f"$s_0$ by {100 * numbers['bias_s_0']:+.1f} %.",
        )
    return figure
