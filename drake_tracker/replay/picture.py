"""The picture of a replay: the errors of run and replay over time, and the predictions of both from above."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from drake_tracker.core.files.atomic_file import replacing
from drake_tracker.core.log import Signal
from drake_tracker.replay.judge import HORIZONS, Judge
from drake_tracker.replay.recording import Recording
from drake_tracker.tasks.plots import LONG, broken, draw_phases, name_colours
from drake_tracker.tasks.style import FAR_PREDICTED, PLOT_STYLE, PREDICTED, RULE, SOFT_INK, TRUTH

RECORDED, REPLAYED = FAR_PREDICTED, PREDICTED
_Log = tuple[Mapping[str, Signal], str, float]
"""(log, colour, width of its lines)."""
_MOST_WORDS = 150
"""Greatest number of characters in the line that lists the changes."""


def draw_replay(
    judge: Judge, recording: Recording, replayed: Mapping[str, Signal], result: Mapping[str, Any], path: Path
) -> None:
    """Draws a replay as one picture, 2400 x 1350 px.

    Args:
        judge: judge of the run.
        recording: the recording.
        replayed: {name: Signal} of the replay.
        result: what `replay_run` returns.
        path: PNG file to write.
    """
    logs = ((recording.log, RECORDED, 2.4), (replayed, REPLAYED, 1.0))
    with matplotlib.rc_context(PLOT_STYLE):
        figure = Figure(figsize=(16, 9), facecolor="white")
        FigureCanvasAgg(figure)
        _draw_map(figure.add_axes((0.05, 0.075, 0.38, 0.70)), judge, recording, logs)
        strip, *rows = figure.add_gridspec(
            1 + len(HORIZONS), 1, left=0.50, right=0.975, top=0.815, bottom=0.075, height_ratios=(0.13, 1.0, 1.0),
            hspace=0.35,
        )  # fmt: skip
        draw_phases(figure.add_subplot(strip), judge.spans, 0.0, recording.end)
        axes = [figure.add_subplot(row) for row in rows]
        for ax, horizon in zip(axes, HORIZONS):
            _draw_errors(ax, judge, logs, horizon, recording.end)
        axes[0].tick_params(labelbottom=False)
        axes[-1].set_xlabel("time  [s]")
        _draw_headline(figure, recording, result)
        with replacing(path) as beside:
            figure.savefig(beside, dpi=150)


def _draw_map(ax: Axes, judge: Judge, recording: Recording, logs: Sequence[_Log]) -> None:
    """Draws the track from above: the true path, and the predictions at the longer horizon."""
    times = recording.log[recording.task.replayed[0]].times
    xy = judge.true_xy(times[judge.free(times)])
    ax.plot(xy[:, 1], xy[:, 0], color=TRUTH, lw=1.6, zorder=4)
    for log, colour, width in logs:
        ahead = judge.predictions(log, LONG)
        ax.plot(*broken(ahead.times, ahead.xy[:, 1], ahead.xy[:, 0]), color=colour, lw=width, zorder=2)
    ax.set_aspect("equal", adjustable="datalim")
    ax.invert_xaxis()
    ax.margins(0.08)
    ax.set_title(f"From above, predicted {LONG:g} s ahead", pad=26)
    name_colours(ax, (("truth", TRUTH), ("recorded", RECORDED), ("replayed", REPLAYED)))
    ax.set(xlabel="y  [m], to the robot's left", ylabel="x  [m], away from the robot")
    ax.grid(color="#f0f1f3", lw=0.8)
    ax.set_axisbelow(True)


def _draw_errors(ax: Axes, judge: Judge, logs: Sequence[_Log], horizon: float, end: float) -> None:
    largest = [1.0]
    for log, colour, width in logs:
        times, error = judge.ahead(log, horizon)
        ax.plot(*broken(times, 1e3 * error), color=colour, lw=width)
        largest.append(1e3 * np.percentile(error, 99) if len(error) else 0.0)
    ax.axhline(0.0, color=RULE, lw=0.8, zorder=0)
    ax.set(xlim=(0.0, end), ylim=(0.0, 1.15 * max(largest)), ylabel="mm")
    ax.set_title(f"Error of the prediction {horizon:g} s ahead", pad=10)
    ax.grid(axis="y", color="#f0f1f3", lw=0.8)
    ax.set_axisbelow(True)


def _draw_headline(figure: Figure, recording: Recording, result: Mapping[str, Any]) -> None:
    far = f"prediction_{LONG:g}_s_rms_m"
    before, after = (result[which][far] for which in ("recorded", "replayed"))
    if result["identical"]:
        headline = "All signals are bit-identical"
    elif before is None or after is None:
        headline = "There is no prediction to judge"
    else:
        headline = f"Error {LONG:g} s ahead: {1e3 * before:.1f} mm recorded, {1e3 * after:.1f} mm replayed"
    figure.text(0.05, 0.955, headline, fontsize=21, weight="bold", va="center")
    facts = f"{recording.folder}, from {recording.start}, {result['real_time_factor']:.0f} times real time"
    figure.text(0.05, 0.915, facts, fontsize=11.5, color=SOFT_INK, va="center")
    given = recording.scenario.origins  # another kind of a role changes more settings than the user named
    named = {key: pair for key, pair in result["changes"].items() if given.get(key, "").startswith("--set")}
    changes = "   ·   ".join(f"{key}: {_show(old)} → {_show(new)}" for key, (old, new) in named.items())
    words = changes if len(changes) <= _MOST_WORDS else changes[: _MOST_WORDS - 1] + "…"
    figure.text(0.05, 0.885, words or "no changed settings", fontsize=11.5, color=REPLAYED, va="center")


def _show(value: Any) -> str:
    return "-" if value is None else f"{value:g}" if isinstance(value, float) else str(value)
