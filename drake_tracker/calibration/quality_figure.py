"""The picture of a calibration: where the board was in the images, and the errors of the photographs."""

from collections.abc import Mapping
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from drake_tracker.calibration.found_boards import CELLS, FoundBoards, ImageShape
from drake_tracker.calibration.quality import CameraQuality
from drake_tracker.core.files.atomic_file import replacing
from drake_tracker.tasks.style import FILTERED, PLOT_STYLE, PREDICTED, SEEN, SOFT_INK

_EMPTY = "#f3d9d2"
"""Colour of the cells of an image in which the board never was."""


def draw_quality(path: Path, boards: FoundBoards, qualities: Mapping[str, CameraQuality], pairs: np.ndarray) -> None:
    """Draws the quality of a calibration as a picture of 2400 x 1350 px.

    Args:
        path: PNG file to write.
        boards: the boards in the photographs.
        qualities: of each camera, by its name.
        pairs: error of each pair, as from `quality.pair_rms`; empty for a single camera.
    """
    with matplotlib.rc_context(PLOT_STYLE):
        figure = Figure(figsize=(16, 9), facecolor="white")
        FigureCanvasAgg(figure)
        columns = figure.add_gridspec(1, len(qualities), left=0.05, right=0.97, top=0.84, bottom=0.40)
        for k, (name, quality) in enumerate(qualities.items()):
            ax = figure.add_subplot(columns[k])
            _draw_image(ax, boards.views[k], boards.shapes[k], quality.cells)
            ax.set_title(f"{name}: the board covered {100 * quality.cells.mean():.0f} % of the image")
            K, std = quality.lens.K, quality.std
            ax.set_xlabel(
                f"focal length {0.5 * (K[0, 0] + K[1, 1]):.1f} ± {std[:2].max():.1f} px, principal point "
                f"({K[0, 2]:.1f} ± {std[2]:.1f}, {K[1, 2]:.1f} ± {std[3]:.1f}) px"
            )
        ax = figure.add_axes((0.05, 0.10, 0.92, 0.17))
        _draw_errors(ax, boards, qualities, pairs)
        figure.text(0.05, 0.945, "Calibration", fontsize=17, weight="bold", va="center")
        figure.text(
            0.05,
            0.91,
            "One colour for each photograph; in the red cells there was no board: take more photographs there",
            color=SOFT_INK,
            fontsize=12,
            va="center",
        )
        with replacing(path) as beside:
            figure.savefig(beside, dpi=150, format="png")


def _draw_image(ax: Axes, views: tuple[np.ndarray, ...], shape: ImageShape, cells: np.ndarray) -> None:
    """Draws all points of the board in the images of one camera, and the cells without any."""
    height, width = shape
    for row, column in np.argwhere(~cells):
        u, v = column * width / CELLS[1] - 0.5, row * height / CELLS[0] - 0.5
        ax.add_patch(Rectangle((u, v), width / CELLS[1], height / CELLS[0], color=_EMPTY, lw=0))
    colours = matplotlib.colormaps["turbo"](np.linspace(0.05, 0.95, len(views)))
    for view, colour in zip(views, colours):
        ax.plot(*view.T, ".", color=colour, markersize=3)
    ax.set_xlim(-0.5, width - 0.5)
    ax.set_ylim(height - 0.5, -0.5)
    ax.set_aspect("equal")
    for spine in ax.spines.values():
        spine.set_visible(True)


def _draw_errors(ax: Axes, boards: FoundBoards, qualities: Mapping[str, CameraQuality], pairs: np.ndarray) -> None:
    """Draws the errors of each photograph or pair as bars."""
    bars = {name: quality.view_rms for name, quality in qualities.items()}
    if len(pairs):
        bars["points triangulated from both"] = pairs
    width = 0.8 / len(bars)
    for k, ((name, errors), colour) in enumerate(zip(bars.items(), (SEEN, FILTERED, PREDICTED))):
        ax.bar(np.arange(len(errors)) + (k - 0.5 * (len(bars) - 1)) * width, errors, width, color=colour, label=name)
    names = [name.split(" and ")[0] for name in boards.names]
    ax.set_xticks(np.arange(len(names)), [Path(name).stem[-12:] for name in names], rotation=60, fontsize=9)
    ax.set_ylabel("error  [px rms]")
    ax.set_title("Errors of each photograph")
    ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.02), frameon=False, ncols=3, fontsize=10)
