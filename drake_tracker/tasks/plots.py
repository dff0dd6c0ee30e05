"""Parts of the pictures of all tasks: phases, legends, and the images of the motion detector."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from drake_tracker.core.files.atomic_file import replacing
from drake_tracker.tasks.episode import PhaseSpan
from drake_tracker.tasks.style import PLOT_STYLE, SOFT_INK, phase_colour

SHORT, LONG = 0.25, 0.75
"""Horizons of the predictions shown [s]: the lag of vision, and the time for which a blind grasp must predict."""
_SHORTEST = 0.1
"""Shortest length of a time axis [s]."""


def draw_motion_images(images: Mapping[str, Any], path: Path) -> None:
    """Draws the intermediate images of the motion detector at one instant, like figures 4 and 5 of Allen et al. 1991.

    Args:
        images: {side: MotionImages} of one or more cameras.
        path: PNG file to write.
    """
    columns = (
        ("Smoothed", lambda each: each.smoothed, {"cmap": "gray", "vmin": 0}),
        ("Derivative in time", lambda each: each.difference, {"cmap": "RdBu_r", "vmin": -80, "vmax": 80}),
        ("Motion energy", lambda each: each.motion_energy, {"cmap": "gray", "vmin": 0, "vmax": 255}),
    )
    height, width = next(iter(images.values())).smoothed.shape
    panel = 5.0
    size = (panel * len(columns), panel * height / width * len(images) + 0.7)
    with matplotlib.rc_context(PLOT_STYLE):
        figure = Figure(figsize=size, facecolor="white", layout="constrained")
        FigureCanvasAgg(figure)
        axes = figure.subplots(len(images), len(columns), squeeze=False)
        for row, (side, each) in zip(axes, images.items()):
            for ax, (_, pick, look) in zip(row, columns):
                ax.imshow(pick(each), interpolation="nearest", **look)
                ax.set(xticks=[], yticks=[])
                ax.spines[:].set_visible(False)
            row[0].set_ylabel(f"camera {side}")
        for ax, (title, _, _) in zip(axes[0], columns):
            ax.set_title(title)
        with replacing(path) as beside:
            figure.savefig(beside, dpi=200, bbox_inches="tight", pad_inches=0.08)


def time_axis_length(spans: Sequence[PhaseSpan]) -> float:
    """Returns the length [s] of the time axes of a run."""
    return max(spans[-1].end, _SHORTEST) if spans else _SHORTEST


def draw_phases(ax: Axes, spans: Sequence[PhaseSpan], start: float = 0.0, end: float | None = None) -> None:
    """Draws phases as a coloured strip and writes their names where they fit.

    Args:
        ax: axes of the strip.
        spans: phases of the run.
        start: time at which the axis begins [s].
        end: time at which it ends [s]; None: the end of the last phase.
    """
    for span in spans:
        ax.axvspan(span.start, span.end, color=phase_colour(span.phase), lw=0)
    end = time_axis_length(spans) if end is None else end
    for span in spans:
        name = span.phase.name.lower()
        low, high = max(span.start, start), min(span.end, end)
        if high - low > 0.016 * len(name) * (end - start):
            ax.text(
                0.5 * (low + high),
                0.5,
                name,
                ha="center",
                va="center",
                fontsize=10,
                color="white",
                weight="bold",
                transform=ax.get_xaxis_transform(),
            )
    ax.set(xlim=(start, end), yticks=[], xticks=[])
    ax.spines[:].set_visible(False)
    ax.set_title("Phases", pad=7)


def name_colours(ax: Axes, names: Iterable[tuple[str, str]], y: float = 1.02) -> None:
    """Writes a legend in a row above a plot: names, each in its colour.

    Args:
        ax: axes of the plot.
        names: (name, colour) from left to right.
        y: height of the row as a fraction of the height of the axes.
    """
    figure = ax.figure
    renderer = figure.canvas.get_renderer()
    x = 0.0
    for name, colour in names:
        text = ax.text(x, y, name, transform=ax.transAxes, color=colour, fontsize=10.5, weight="bold", va="bottom")
        box = text.get_window_extent(renderer).transformed(ax.transAxes.inverted())
        x = box.x1 + 0.025


def name_limit(ax: Axes, words: str, height: float, **look: Any) -> None:
    """Writes words above a horizontal line, at its right end.

    Args:
        ax: axes of the plot.
        words: the words.
        height: of the line, in the unit of the axis.
        **look: further keywords of ``annotate``.
    """
    place = {"xycoords": ("axes fraction", "data"), "xytext": (-2, 3), "textcoords": "offset points"}
    ax.annotate(words, (1.0, height), fontsize=9.5, color=SOFT_INK, ha="right", **place, **look)


def broken(times: np.ndarray, *rows: np.ndarray) -> tuple[np.ndarray, ...]:
    """Returns rows to draw as lines, with NaN inserted where the times jump by more than 0.1 s.

    Args:
        times: times of the samples [s], shape (n,).
        *rows: values, each of shape (n,).

    Returns the rows, preceded by the times when there is only one row.
    """
    rows = rows if len(rows) > 1 else (times, *rows)
    gaps = np.nonzero(np.diff(times) > 0.1)[0] + 1
    return tuple(np.insert(np.asarray(row, float), gaps, np.nan) for row in rows)
