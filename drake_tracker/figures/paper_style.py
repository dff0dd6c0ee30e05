"""The common style of the figures: sheet, titles, families of colours."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure

from drake_tracker.core.files.atomic_file import replacing
from drake_tracker.tasks.style import PLOT_STYLE, SOFT_INK

DPI = 150
MINUS = "\N{MINUS SIGN}"
_PALE, _DEEP = "#a9d8f2", "#00304d"
_LEGEND = {"legend.frameon": False, "legend.fontsize": 10, "legend.handlelength": 1.6}


@contextmanager
def sheet(width: float, height: float) -> Iterator[Figure]:
    """Yields an empty Matplotlib `Figure` in the style of the package.

    The figure is laid out before the context ends, because Matplotlib makes ticks when they are first needed, in the
    style of that time.

    Args:
        width: [in].
        height: [in].
    """
    with matplotlib.rc_context({**PLOT_STYLE, **_LEGEND}):
        figure = Figure(figsize=(width, height), facecolor="white", layout="constrained", dpi=DPI)
        FigureCanvasAgg(figure)
        figure.get_layout_engine().set(w_pad=0.08, h_pad=0.08, wspace=0.03, hspace=0.03)
        yield figure
        figure.draw_without_rendering()


def save(figure: Figure, path: Path) -> None:
    """Writes a figure as PNG."""
    with matplotlib.rc_context(PLOT_STYLE), replacing(path) as beside:
        figure.savefig(beside, dpi=DPI)


def head(axes: Axes, title: str, note: str = "") -> None:
    """Writes a title above an axes and, below the title, one line about the content."""
    axes.set_title(title, pad=28 if note else 12)
    if note:
        axes.annotate(
            note,
            (0.0, 1.0),
            xycoords="axes fraction",
            xytext=(0, 9),
            textcoords="offset points",
            color=SOFT_INK,
            fontsize=10.5,
        )


def shades(count: int) -> list[str]:
    """Returns ``count`` blues from pale to deep, for the curves of one family."""
    pale, deep = np.array(to_rgb(_PALE)), np.array(to_rgb(_DEEP))
    return [to_hex(pale + (deep - pale) * share) for share in np.linspace(0.0, 1.0, max(count, 2))[:count]]


def quiet_grid(axes: Axes) -> None:
    """Draws a pale grid behind the content."""
    axes.grid(color="#eef0f2", lw=0.8)
    axes.set_axisbelow(True)
