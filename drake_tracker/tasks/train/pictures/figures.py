"""The picture of a run: the track from above, the grasp, and over time the probability of success and the errors."""

import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from drake_tracker.core.files.atomic_file import replacing
from drake_tracker.grasp.train.schema import Phase
from drake_tracker.tasks.episode import Log, PhaseSpan, during, predictions_ahead, tool_pose
from drake_tracker.tasks.plots import LONG, SHORT, broken, draw_phases, name_colours, name_limit, time_axis_length
from drake_tracker.tasks.style import (
    FAR_PREDICTED,
    FILTERED,
    HAND,
    PLOT_STYLE,
    PREDICTED,
    RULE,
    SEEN,
    SOFT_INK,
    TRUTH,
    phase_colour,
    track_colour,
)
from drake_tracker.tasks.tracks import logged_tracks
from drake_tracker.tasks.train.closing import clearance, last_closing
from drake_tracker.tasks.train.episode import errors, phase_spans, sighted, train_pose
from drake_tracker.tasks.train.setup import TrainSetup

_APPROACHING = (Phase.TRACK, Phase.INTERCEPT, Phase.CLOSE)
_WAITING = (Phase.ACQUIRE, Phase.TRACK)
_BEFORE, _AFTER = 1.2, 2.2
"""Time shown before and after the jaws begin to close [s]."""
_PROBABILITY = "p_success"
"""Field of the signal ``diagnosis``, which the logs of earlier versions lack."""


def draw_tracking(setup: TrainSetup, log: Log, summary: Mapping[str, Any], path: Path) -> None:
    """Draws a run as one picture, 3200 x 1800 px.

    On the left are the track from above and the grasp; on the right, over time, the phases, the probability that a
    grasp would succeed, and the errors. A log of an earlier version may lack the probability; its plot is then left
    out.

    Args:
        setup: the resolved scenario of the run.
        log: {name: Signal} of the run.
        summary: the return value of `summarise`.
        path: PNG file to write.
    """
    spans = phase_spans(log, setup.scenario.time_step)
    with matplotlib.rc_context(PLOT_STYLE):
        figure = Figure(figsize=(16, 9), facecolor="white")
        FigureCanvasAgg(figure)
        grid = figure.add_gridspec(
            2, 1, left=0.05, right=0.50, top=0.82, bottom=0.075, height_ratios=(1.75, 1.0), hspace=0.52
        )
        _draw_map(figure.add_subplot(grid[0]), setup, log, spans)
        _draw_grasp(figure.add_subplot(grid[1]), setup, log, spans)
        _draw_over_time(figure, setup, log, spans)
        _draw_headline(figure, setup, summary)
        with replacing(path) as beside:
            figure.savefig(beside, dpi=200)


def _draw_over_time(figure: Figure, setup: TrainSetup, log: Log, spans: Sequence[PhaseSpan]) -> None:
    """Draws the right half of the picture: phases, probability of success and errors, on one time axis."""
    known = "diagnosis" in log and _PROBABILITY in log["diagnosis"].names
    heights, gap = ((0.13, 0.3, 1.0, 1.0), 0.46) if known else ((0.13, 1.0, 1.0), 0.3)
    grid = figure.add_gridspec(
        len(heights), 1, left=0.57, right=0.975, top=0.82, bottom=0.075, height_ratios=heights, hspace=gap
    )
    strip, *probability, across, along = (figure.add_subplot(cell) for cell in grid)
    draw_phases(strip, spans)
    for ax in probability:
        _draw_probability(ax, setup, log, spans)
    _draw_errors(across, along, setup, log, spans)


def _draw_headline(figure: Figure, setup: TrainSetup, summary: Mapping[str, Any]) -> None:
    attempts = summary["attempts"]
    if summary["success"]:
        ordinal = "first attempt" if attempts == 1 else f"attempt {attempts}"
        headline = f"Train lifted at the {ordinal}, {summary['time_to_grasp_s']:.1f} s after the start"
    else:
        headline = "Train not lifted"
    title = figure.text(0.05, 0.955, headline, fontsize=21, weight="bold", va="center")
    if summary["failure_reason"]:
        end = title.get_window_extent(figure.canvas.get_renderer()).x1 / figure.bbox.width
        reason = textwrap.fill(summary["failure_reason"], 118)
        figure.text(end + 0.015, 0.954, reason, fontsize=11.5, color=FAR_PREDICTED, va="center")
    track = setup.scenario.track
    facts = [f"scenario {setup.scenario.name}, seed {setup.scenario.seed}", f"{track.kind} at {track.speed:g} m/s"]
    for key, words in (
        ("position_rms_m", "present position {:.1f} mm rms"),
        ("triangulation_rms_m", "triangulation {:.1f} mm rms"),
        ("triangulation_jitter_m", "jitter {:.1f} mm"),
    ):
        if summary[key] is not None:
            facts.append(words.format(1e3 * summary[key]))
    figure.text(0.05, 0.915, "   ·   ".join(facts), fontsize=11.5, color=SOFT_INK, va="center")


def _draw_map(ax: Axes, setup: TrainSetup, log: Log, spans: Sequence[PhaseSpan]) -> None:
    """Draws the track from above, with the robot below: true, measured, filtered and predicted path, and the hand."""
    start, end = _lap(setup, log, spans)
    truth = log["truth_train_state"]
    ax.plot(truth["y"], truth["x"], color="#e6e8eb", lw=9, zorder=0)

    def inside(times: np.ndarray) -> np.ndarray:
        return (times >= start) & (times <= end)

    point = log["point"]
    seen = (point["valid"] > 0) & inside(point["stamp"]) & sighted(spans, point["stamp"])
    filtered = log["filtered"]
    kept = (filtered["valid"] > 0) & inside(filtered["stamp"]) & sighted(spans, filtered["stamp"])
    times = truth.times[inside(truth.times)]
    train, hand = train_pose(log, times), tool_pose(log, times)
    ax.plot(train[:, 1], train[:, 0], color=TRUTH, lw=1.2, zorder=3)
    ax.plot(point["y"][seen], point["x"][seen], ".", color=SEEN, ms=2.6, zorder=2)
    line = broken(filtered["stamp"][kept], filtered["y"][kept], filtered["x"][kept])
    ax.plot(*line, color=FILTERED, lw=1.8, zorder=4)
    for horizon, colour in ((LONG, FAR_PREDICTED), (SHORT, PREDICTED)):
        ahead = predictions_ahead(log["prediction"], horizon)
        used = inside(ahead.times) & sighted(spans, ahead.stamps)
        ax.plot(*broken(ahead.times[used], ahead.xy[used, 1], ahead.xy[used, 0]), color=colour, lw=1.4, zorder=5)
    ax.plot(hand[:, 1], hand[:, 0], color=HAND, lw=1.6, zorder=6)
    _draw_tracks(ax, log, start, end)
    _, close = last_closing(spans)
    if close is not None:
        ((x, y, _, _),) = tool_pose(log, [close.start])
        ax.plot(y, x, "o", ms=9, mfc="white", mec=HAND, mew=2, zorder=7)
        outward = np.array([y, x]) - np.mean(truth.view("y", "x"), axis=0)
        outward *= np.array([-26.0, 26.0]) / np.linalg.norm(outward)
        side = "left" if outward[0] > 0.0 else "right"
        ax.annotate(
            "jaws close",
            (y, x),
            xytext=outward,
            textcoords="offset points",
            color=HAND,
            weight="bold",
            ha=side,
            va="center",
        )
    ax.set_aspect("equal", adjustable="datalim")
    ax.invert_xaxis()
    ax.margins(0.10)
    ax.set_title(f"From above, {start:.1f} to {end:.1f} s", pad=26)
    name_colours(ax, _NAMES)
    ax.set_ylabel("x  [m], away from the robot")
    ax.set_xlabel("y  [m], to the robot's left", labelpad=2)
    ax.grid(color="#f0f1f3", lw=0.8)
    ax.set_axisbelow(True)


def _draw_tracks(ax: Axes, log: Log, start: float, end: float) -> None:
    """Draws the paths of the objects that vision tracked between two times [s], and their numbers.

    The target is drawn as in every run, and only its number is added. A path is dotted where the object was not seen.
    """
    for track in logged_tracks(log):
        shown = (track.times >= start) & (track.times <= end)
        if not shown.any():
            continue
        target, times, xyz, seen = track.target_share >= 0.5, track.times[shown], track.xyz[shown], track.seen[shown]
        colour = TRUTH if target else track_colour(track.number)
        if not target:
            # Wide and pale, since objects on the same track follow the same path.
            for used, style, width, alpha in ((seen, "-", 6.0, 0.35), (~seen, ":", 2.0, 1.0)):
                line = broken(times[used], xyz[used, 1], xyz[used, 0])
                ax.plot(*line, color=colour, ls=style, lw=width, alpha=alpha, zorder=1)
            ax.plot(xyz[-1, 1], xyz[-1, 0], "o", ms=6, mfc=colour if seen[-1] else "white", mec=colour, zorder=7)
        ax.annotate(
            f"object {track.number}" + (" (target)" if target else ""),
            (xyz[-1, 1], xyz[-1, 0]),
            xytext=(8, 8),
            textcoords="offset points",
            color=colour,
            weight="bold",
            fontsize=9.5,
            bbox={"facecolor": "white", "alpha": 0.75, "lw": 0, "pad": 1.0},
            zorder=8,
        )


_NAMES = (
    ("train", TRUTH),
    ("triangulated", SEEN),
    ("filtered", FILTERED),
    (f"predicted {SHORT} s ahead", PREDICTED),
    (f"{LONG} s ahead", FAR_PREDICTED),
    ("hand", HAND),
)


def _lap(setup: TrainSetup, log: Log, spans: Sequence[PhaseSpan]) -> tuple[float, float]:
    """Returns start and end [s] of the time that the map shows: the last lap before the jaws closed."""
    truth = log["truth_train_state"]
    _, close = last_closing(spans)
    times = truth.times if close is None else truth.times[truth.times <= close.end]
    if len(times) == 0:
        return 0.0, 0.0
    track, _ = setup.placement
    distance = np.cumsum(np.hypot(*np.diff(truth.view("x", "y")[: len(times)], axis=0).T)[::-1])
    back = np.searchsorted(distance, track.length) if track.closed else len(distance)
    return times[max(len(times) - 1 - back, 0)], times[-1]


def _draw_probability(ax: Axes, setup: TrainSetup, log: Log, spans: Sequence[PhaseSpan]) -> None:
    """Draws the probability that a grasp would succeed, and the value from which on the hand descends.

    It is shown until the jaws hold in a guided descent, and until the launch before a blind one, which cannot change.
    """
    diagnosis, config = log["diagnosis"], setup.grasp
    phases = (Phase.ACQUIRE, *_APPROACHING) if config.descent == "guided" else _WAITING
    shown = during(spans, diagnosis.times, *phases)
    times, percent = broken(diagnosis.times[shown], 100.0 * diagnosis[_PROBABILITY][shown])
    ax.plot(times, percent, color=PREDICTED, lw=1.6, zorder=3)
    ax.fill_between(times, percent, color=PREDICTED, alpha=0.10, lw=0, zorder=2)
    if config.gate == "probability":
        threshold = 100.0 * config.launch_probability
        ax.axhline(threshold, color=SOFT_INK, lw=0.9, ls=(0, (4, 3)), zorder=1)
        note = f"the hand descends from {threshold:g} % on, later after surprises"
    else:
        note = f"not used: grasp.gate is {config.gate}"
    ax.text(1.0, 1.12, note, transform=ax.transAxes, ha="right", color=SOFT_INK, fontsize=10)
    _shade_grasps(ax, spans)
    ax.set(xlim=(0.0, time_axis_length(spans)), ylim=(0.0, 104.0), yticks=(0, 50, 100), ylabel="%")
    ax.set_title("Probability of success", pad=8)
    ax.tick_params(labelbottom=False)


def _shade_grasps(ax: Axes, spans: Sequence[PhaseSpan]) -> None:
    """Shades the phases after the launch, each in its colour."""
    for span in spans:
        if span.phase not in _WAITING:
            ax.axvspan(span.start, span.end, color=phase_colour(span.phase), alpha=0.12, lw=0, zorder=0)


def _draw_errors(across: Axes, along: Axes, setup: TrainSetup, log: Log, spans: Sequence[PhaseSpan]) -> None:
    """Draws the errors over time, across the track in the upper plot and along it in the lower one."""
    point = log["point"]
    seen = (point["valid"] > 0) & sighted(spans, point["stamp"])
    lines = [(point["stamp"][seen], point.view("x", "y")[seen], SEEN)]
    for horizon, colour in ((LONG, FAR_PREDICTED), (SHORT, PREDICTED)):
        ahead = predictions_ahead(log["prediction"], horizon)
        used = sighted(spans, ahead.stamps)
        lines.append((ahead.times[used], ahead.xy[used], colour))
    tool = log["tool"]
    near = during(spans, tool.times, *_APPROACHING) & (tool.times >= _arrival(setup, spans))
    lines.append((tool.times[near], tool.view("x", "y")[near], HAND))
    largest = [10.0]
    for times, xy, colour in lines:
        error = 1e3 * errors(log, times, xy)
        largest.append(np.nanpercentile(np.abs(error), 97) if np.isfinite(error).any() else 0.0)
        for ax, column in ((along, 0), (across, 1)):
            if colour == SEEN:
                ax.plot(times, error[:, column], ".", color=colour, ms=1.8, zorder=1)
            else:
                ax.plot(*broken(times, error[:, column]), color=colour, lw=1.3, zorder=2)
    limit = min(max(1.25 * max(largest), 1e3 * clearance(setup) * 1.3), 80.0)
    total = time_axis_length(spans)
    for ax, title in ((across, "Error across the track"), (along, "Error along the track")):
        ax.set(xlim=(0.0, total), ylim=(-limit, limit), ylabel="mm")
        ax.axhline(0.0, color=RULE, lw=0.8, zorder=0)
        ax.set_title(title, pad=10)
        _shade_grasps(ax, spans)
    fits = 1e3 * clearance(setup)
    for side in (-fits, fits):
        across.axhline(side, color=SOFT_INK, lw=0.9, ls=(0, (4, 3)), zorder=0)
    box = {"facecolor": "white", "alpha": 0.75, "lw": 0, "pad": 1.0}
    name_limit(across, f"open jaws: {fits:.0f} mm", fits, bbox=box)
    across.tick_params(labelbottom=False)
    along.set_xlabel("time  [s]")
    for ax, words in ((across, "left of the train is positive"), (along, "ahead of the train is positive")):
        ax.text(1.0, 1.045, words, transform=ax.transAxes, ha="right", color=SOFT_INK, fontsize=10)


def _arrival(setup: TrainSetup, spans: Sequence[PhaseSpan]) -> float:
    """Returns the time [s] at which the hand was over the train for the first time."""
    starts = [span.start for span in spans if span.phase == Phase.TRACK]
    return starts[0] + setup.grasp.approach_duration if starts else np.inf


def _draw_grasp(ax: Axes, setup: TrainSetup, log: Log, spans: Sequence[PhaseSpan]) -> None:
    """Draws the heights of jaws and train and the opening of the jaws, around the last attempt or, without an attempt,
    over the whole run.
    """
    _, close = last_closing(spans)
    tool, jaws = log["tool"], log["jaws"]
    total = time_axis_length(spans)
    zero, start, end = 0.0, 0.0, total
    if close is not None:
        zero = close.start
        start, end = max(0.0, zero - _BEFORE), min(total, zero + _AFTER)
    for span in spans:
        low, high = max(span.start, start), min(span.end, end)
        if low < high:
            ax.axvspan(low - zero, high - zero, color=phase_colour(span.phase), alpha=0.16, lw=0)
            if high - low > 0.06 * (end - start):
                ax.text(
                    0.5 * (low + high) - zero,
                    1.02,
                    span.phase.name.lower(),
                    ha="center",
                    va="bottom",
                    fontsize=9.5,
                    color=SOFT_INK,
                    transform=ax.get_xaxis_transform(),
                )
    shown, opened = ((signal.times >= start) & (signal.times <= end) for signal in (tool, jaws))
    times = tool.times[shown]
    table = setup.scenario.table_height
    curves = [
        ("jaws, above the table", times, 1e3 * (tool["z"][shown] - table), HAND),
        ("train, above the table", times, 1e3 * (train_pose(log, times)[:, 2] - table), TRUTH),
        ("opening of the jaws", jaws.times[opened], 1e3 * jaws["width"][opened], FAR_PREDICTED),
    ]
    for _, x, y, colour in curves:
        ax.plot(x - zero, y, color=colour, lw=2)
    name_colours(ax, [(name, colour) for name, _, _, colour in curves], y=1.135)
    ax.set(xlim=(start - zero, end - zero), ylabel="mm")
    ax.set_ylim(bottom=0.0)
    ax.set_xlabel("time from the start of closing  [s]" if close is not None else "time  [s]", labelpad=2)
    ax.set_title("The grasp" if close is not None else "The hand", pad=42)
