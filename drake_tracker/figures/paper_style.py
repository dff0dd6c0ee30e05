"""What the figures have in common: their sheet, their titles and their families of colours."""

from contextlib import contextmanager

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure

from drake_tracker.tasks.style import PLOT_STYLE, SOFT_INK

DPI = 150
_PALE, _DEEP = "#a9d8f2", "#00304d"
_LEGEND = {"legend.frameon": False, "legend.fontsize": 10, "legend.handlelength": 1.6}


@contextmanager
def sheet(width, height):
    """Yields an empty Matplotlib `Figure` of width x height [in] in the style of the package.

    It is laid out at the end: ticks are made when they are first needed, and would else take the style of that time.
    """
    with matplotlib.rc_context({**PLOT_STYLE, **_LEGEND}):
        figure = Figure(figsize=(width, height), facecolor="white", layout="constrained", dpi=DPI)
        FigureCanvasAgg(figure)
        figure.get_layout_engine().set(w_pad=0.08, h_pad=0.08, wspace=0.03, hspace=0.03)
        yield figure
        figure.draw_without_rendering()


def save(figure, path):
    """Writes a figure as PNG."""
    with matplotlib.rc_context(PLOT_STYLE):
        figure.savefig(path, dpi=DPI)


def head(axes, title, note=""):
    """Writes a title over an axes, and below it a line that says what is shown."""
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


def shades(count):
    """Returns ``count`` blues from pale to deep, for the curves of one family."""
    pale, deep = np.array(to_rgb(_PALE)), np.array(to_rgb(_DEEP))
    return [to_hex(pale + (deep - pale) * share) for share in np.linspace(0.0, 1.0, max(count, 2))[:count]]


def quiet_grid(axes):
    """Draws a grid that stays behind what is shown."""
    axes.grid(color="#eef0f2", lw=0.8)
    axes.set_axisbelow(True)
