"""The picture of a track of your own cameras: its path, and its coordinates over time."""

import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from drake_tracker.core.files.atomic_file import replacing
from drake_tracker.own_cameras.table import HORIZON, axes_of, split_objects
from drake_tracker.tasks.style import FILTERED, PLOT_STYLE, PREDICTED, SEEN, SOFT_INK
from drake_tracker.vision.image_tracks.track_2d import TrackState2D

TROUBLE = "#c2410c"
"""Colour of the marks."""
OBJECTS = ("#5b6470", "#0b6e99", "#2e7d32", "#ad1457", "#6a3fb5")
"""Colours of several objects, by their number."""
MOST_NAMED = 6
"""Largest number of objects whose colours are explained."""
LEVEL = 1e-3
"""Share of the largest extent of a path below which a coordinate counts as constant."""
LONGEST_TITLE = 110
"""Characters of a title that fit."""
FROM_ABOVE = {"camera_left": ("x", "z"), "board": ("x", "y")}
"""Axes of the view from above for each kind of world frame W: y points down in a camera frame."""


def draw_track_picture(
    data: Mapping[str, np.ndarray],
    path: str | Path,
    *,
    world: str = "board",
    title: str = "",
    period: float = 1.0 / 60.0,
    marks: Mapping[str, Sequence[float]] | None = None,
) -> None:
    """Draws a track as a picture of 2400 x 1350 px.

    Args:
        data: columns of the track, see `TrackTable.data`.
        path: PNG file to write.
        world: key of `FROM_ABOVE`.
        title: line of text.
        period: period of the images [s]; lines are interrupted where images are missing.
        marks: for each kind of trouble the stamps of its images [s], drawn as a strip below the lines.
    """
    axes, unit = axes_of(data)
    spatial = unit == "m"
    across, up = FROM_ABOVE[world] if spatial else ("u", "v")
    with matplotlib.rc_context(PLOT_STYLE):
        figure = Figure(figsize=(16, 9), facecolor="white")
        canvas = FigureCanvasAgg(figure)
        ax = figure.add_axes((0.06, 0.09, 0.40, 0.74))
        _draw_lines(ax, data, across, up, period)
        ax.set_aspect("equal", adjustable="datalim")
        ax.set_xlabel(f"{across}  [{unit}]")
        ax.set_ylabel(f"{up}  [{unit}]")
        ax.set_title("From above" if spatial else "In the image")
        if not spatial:
            ax.invert_yaxis()
        rows = figure.add_gridspec(len(axes), 1, left=0.54, right=0.97, top=0.83, bottom=0.09, hspace=0.25).subplots(
            sharex=True, squeeze=False
        )[:, 0]
        for row, name in zip(rows, axes):
            _draw_lines(row, data, "stamp", name, period)
            row.set_ylabel(f"{name}  [{unit}]")
            _show_level(row, data, name, axes)
        rows[0].set_title("Over time")
        rows[-1].set_xlabel("time  [s]")
        figure.text(0.06, 0.945, _shortened(title), fontsize=17, weight="bold", va="center", parse_math=False)
        _draw_marks(rows[-1], data, marks or {})
        numbers = [number for number in split_objects(data) if number]
        names = [("measured", SEEN)]
        if numbers:
            names = [(f"object {number}", _colour(number)) for number in numbers[:MOST_NAMED]]
            names += [("filtered as a line", SOFT_INK), (f"predicted {HORIZON:g} s earlier", SEEN)]
        else:
            names += [("filtered", FILTERED), (f"predicted {HORIZON:g} s earlier", PREDICTED)]
        x = 0.06
        for name, colour in names:
            text = figure.text(x, 0.9, name, color=colour, fontsize=12, weight="bold", va="center")
            x = text.get_window_extent(canvas.get_renderer()).x1 / figure.bbox.width + 0.02
        count, valid = (len(np.unique(stamps)) for stamps in (data["stamp"], data["stamp"][data["valid"] > 0]))
        figure.text(x, 0.9, f"{valid} of {count} images with a result", color=SOFT_INK, fontsize=12, va="center")
        with replacing(path) as beside, warnings.catch_warnings():
            warnings.filterwarnings("ignore", message="Glyph .* missing")  # in the name of a source
            figure.savefig(beside, dpi=150)


def _show_level(ax: Axes, data: Mapping[str, np.ndarray], name: str, axes: Sequence[str]) -> None:
    """Widens the range of a coordinate that does not change, such as the height of an object that moves on a plane."""
    path = np.column_stack([data[axis][data["valid"] > 0] for axis in axes])
    if not len(path):
        return
    extents = np.ptp(path, axis=0)
    own = extents[axes.index(name)]
    if own < LEVEL * extents.max():
        middle, half = float(np.median(path[:, axes.index(name)])), 0.05 * float(extents.max())
        ax.set_ylim(middle - half, middle + half)


def _shortened(title: str) -> str:
    """Returns a title that fits into the picture."""
    return title if len(title) <= LONGEST_TITLE else f"{title[: LONGEST_TITLE // 2]}…{title[-LONGEST_TITLE // 2 :]}"


def _draw_marks(ax: Axes, data: Mapping[str, np.ndarray], marks: Mapping[str, Sequence[float]]) -> None:
    """Draws a strip for each kind of trouble that there was, and for hidden objects, below the lines."""
    hidden = data["stamp"][data["state"] == TrackState2D.HIDDEN] if "state" in data else np.zeros(0)
    strips = [(kind, stamps) for kind, stamps in {**marks, "hidden": hidden}.items() if len(stamps)]
    low, high = ax.get_ylim()
    ax.set_ylim(low - 0.14 * len(strips) * (high - low), high)
    for number, (kind, stamps) in enumerate(strips):
        height = 0.03 + 0.12 * number
        ax.plot(stamps, np.full(len(stamps), height), "|", color=TROUBLE, ms=6, transform=ax.get_xaxis_transform())
        words = f"{kind} ({len(np.unique(stamps))})"
        ax.text(0.995, height + 0.02, words, color=TROUBLE, fontsize=9, ha="right", va="bottom", transform=ax.transAxes)


def _colour(number: float) -> str:
    """Returns the colour of an object."""
    return OBJECTS[int(number) % len(OBJECTS)]


def _draw_lines(ax: Axes, data: Mapping[str, np.ndarray], across: str, up: str, period: float) -> None:
    """Draws measured points, and filtered and predicted lines, of two columns."""

    def column(part: Mapping[str, np.ndarray], prefix: str, name: str) -> np.ndarray:
        if name == "stamp":
            return part["stamp"] + (HORIZON if prefix == "predicted_" else 0.0)
        return part[prefix + name]

    ids = np.nan_to_num(data.get("id", np.zeros(len(data["stamp"]))))
    divided = len(np.unique(ids[ids > 0.0])) > 1
    for number in np.unique(ids) if divided else [0.0]:
        own = ids == number if divided else np.full(len(ids), True)
        colour = _colour(number) if number else SEEN
        ax.plot(column(data, "", across)[own], column(data, "", up)[own], ".", color=colour, ms=3.5, zorder=2)
    for prefix, usual in (("predicted_", PREDICTED), ("filtered_", FILTERED)):
        for number, part in split_objects(data).items():
            several = {"filtered_": _colour(number), "predicted_": SEEN}
            colour = several[prefix] if number else usual
            gaps = np.flatnonzero(np.diff(part["stamp"]) > 2.5 * period) + 1
            lines = (np.insert(column(part, prefix, name), gaps, np.nan) for name in (across, up))
            ax.plot(*lines, color=colour, lw=1.6, zorder=3)
