"""Colours and fonts of the pictures and videos of a run.

The colours are those of Okabe and Ito, "Color Universal Design" (2008), which are distinguishable with every kind of
colour vision.
"""

import threading
from enum import IntEnum
from functools import cache, lru_cache
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.ft2font import FT2Font

INK, SOFT_INK, RULE = "#1b1f24", "#5f6670", "#c9cdd3"
"""Text, secondary text and rules on white."""
TRUTH, SEEN, FILTERED = "#1b1f24", "#8a9099", "#56b4e9"
"""Colours of the object's true path, its measured points and its filtered path."""
PREDICTED, FAR_PREDICTED, HAND = "#0072b2", "#d55e00", "#009e73"
"""Colours of the object predicted a short and a long time ahead, and of the hand."""

PHASE_COLOURS = {
    "ACQUIRE": "#9aa1ab",
    "TRACK": "#56b4e9",
    "INTERCEPT": "#e69f00",
    "CLOSE": "#d55e00",
    "LIFT": "#009e73",
    "HOLD": "#007a5a",
    "RETREAT": "#cc79a7",
    "HOVER": "#0072b2",
    "WAIT": "#9aa1ab",
    "FOLLOW": "#56b4e9",
    "SETTLE": "#e69f00",
    "CUP": "#d55e00",
    "RAISE": "#009e73",
    "STOPPED": "#8c2d04",
    "MANUAL": "#5e3c99",
}
"""{name of a phase: its colour}. Phases of different tasks with the same name have the same colour."""
TRACK_COLOURS = ("#4f7a00", "#b0457f", "#6a51c7", "#8a4b2f", "#7d7a00", "#1b6f7a", "#a8324a", "#5f6670")
"""Colours of tracked objects on white, in the order of their numbers; they are used again after the last one. None is a
colour of the curves."""
TRACK_LIGHTS = ("#37e0a6", "#ff86c0", "#b9a2ff", "#ff7d52", "#c5e65a", "#66b8ff", "#e0a58c", "#ccd2da")
"""The same on dark ground."""
_OTHER_PHASES = ("#9aa1ab", "#56b4e9", "#e69f00", "#d55e00", "#009e73", "#007a5a", "#cc79a7", "#0072b2")

PLOT_STYLE = {
    "font.family": "DejaVu Sans",
    "font.size": 11,
    "text.color": INK,
    "axes.edgecolor": RULE,
    "axes.labelcolor": SOFT_INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 13,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.titlepad": 12,
    "xtick.color": SOFT_INK,
    "ytick.color": SOFT_INK,
    "lines.solid_capstyle": "round",
}
"""Matplotlib settings of all plots: fonts, axes and lines."""


def phase_colour(phase: IntEnum) -> str:
    """Returns the colour of a phase of any task, "#rrggbb". A phase that is not listed gets a colour by its number."""
    return PHASE_COLOURS.get(phase.name, _OTHER_PHASES[phase % len(_OTHER_PHASES)])


def track_colour(number: int) -> str:
    """Returns the colour of a tracked object on white, "#rrggbb", by the number of its track, from 1 on."""
    return TRACK_COLOURS[(number - 1) % len(TRACK_COLOURS)]


def track_light(number: int) -> str:
    """Returns the colour of a tracked object on dark ground, "#rrggbb", by the number of its track, from 1 on."""
    return TRACK_LIGHTS[(number - 1) % len(TRACK_LIGHTS)]


_FONTS = Path(matplotlib.get_data_path()) / "fonts" / "ttf"


@cache
def bgr(colour: str) -> tuple[int, ...]:
    """Returns a colour "#rrggbb" as (blue, green, red), as OpenCV expects it."""
    return tuple(int(colour[k : k + 2], 16) for k in (5, 3, 1))


def draw_text(
    image: np.ndarray,
    text: str,
    x: int,
    y: int,
    size: int,
    colour: str = "#ffffff",
    bold: bool = False,
    numbers: bool = False,
) -> int:
    """Writes a line of text into an image.

    Args:
        image: image, BGR uint8 of shape (h, w, 3), changed in place. Text beyond its border is clipped.
        text: one line of text.
        x: column at which the baseline starts [px].
        y: row of the baseline [px].
        size: font size [px].
        colour: colour of the text, "#rrggbb".
        bold: whether the font is bold.
        numbers: whether the text contains numbers that are new in each image; this costs less.

    Returns the column at which the text ends [px].
    """
    coverage, left, ascent = (_compose if numbers else _typeset)(text, size, bold)
    height, width, _ = coverage.shape
    top, start = y - ascent, x + left
    rows = slice(max(top, 0), min(top + height, image.shape[0]))
    columns = slice(max(start, 0), min(start + width, image.shape[1]))
    if rows.start < rows.stop and columns.start < columns.stop:
        cut = coverage[rows.start - top : rows.stop - top, columns.start - start : columns.stop - start]
        patch = image[rows, columns]
        patch[:] = patch + cut * (np.array(bgr(colour), np.float32) - patch)
    return start + width


_typesetting = threading.Lock()
"""A font holds the text that it draws. Several threads share the font, because video and live page draw at the same
time."""


@lru_cache(maxsize=512)
def _typeset(text: str, size: int, bold: bool) -> tuple[np.ndarray, int, int]:
    """Returns a line of text as an image.

    Returns (coverage of each pixel from 0 to 1, shape (h, w, 1); column of its left edge relative to the start of the
    baseline [px]; rows above the baseline [px]).
    """
    with _typesetting:
        font = _font(size, bold)
        font.set_text(text, 0.0)
        font.draw_glyphs_to_bitmap(antialiased=True)
        coverage = np.asarray(font.get_image(), np.float32)[:, :, None] / 255.0
        _, height = font.get_width_height()
        left, _ = font.get_bitmap_offset()
        # The bitmap has an empty border of one pixel.
        return coverage, round(left / 64) - 1, round((height - font.get_descent()) / 64) + 1


def _compose(text: str, size: int, bold: bool) -> tuple[np.ndarray, int, int]:
    """Returns the same as `_typeset`, from characters that are typeset one by one, without kerning."""
    pen, placed = 0, []
    for character in text:
        coverage, left, ascent = _typeset(character, size, bold)
        placed.append((coverage, pen + left, ascent))
        pen += _advance(character, size, bold)
    first, top = min(left for _, left, _ in placed), max(ascent for _, _, ascent in placed)
    last = max(left + coverage.shape[1] for coverage, left, _ in placed)
    bottom = max(coverage.shape[0] - ascent for coverage, _, ascent in placed)
    line = np.zeros((top + bottom, last - first, 1), np.float32)
    for coverage, left, ascent in placed:
        height, width, _ = coverage.shape
        part = line[top - ascent : top - ascent + height, left - first : left - first + width]
        np.maximum(part, coverage, out=part)
    return line, first, top


@lru_cache(maxsize=512)
def _advance(character: str, size: int, bold: bool) -> int:
    """Returns the distance from a character to the next one [px]."""
    with _typesetting:
        return round(_font(size, bold).load_char(ord(character)).horiAdvance / 64)


@lru_cache(maxsize=16)
def _font(size: int, bold: bool) -> FT2Font:
    font = FT2Font(str(_FONTS / ("DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf")))
    font.set_size(size, 72.0)
    return font
