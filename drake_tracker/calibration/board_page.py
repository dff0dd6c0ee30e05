"""Prints a calibration board to scale, as a PDF page."""

import dataclasses
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.path import Path as Outline

from drake_tracker.cameras.boards.board import Board
from drake_tracker.cameras.boards.board_kinds import BOARDS, kind_of
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.files.atomic_file import replacing

PAGES = {"a4": (210.0, 297.0), "a3": (297.0, 420.0), "letter": (215.9, 279.4)}
"""Width and height of an upright page [mm]: ISO 216, ANSI/ASME Y14.1."""
MARGIN = 8.0
"""Strip along the edges of a page that printers leave white [mm]."""
_FOOT = 12.0
"""Strip above the lower margin for the scale bar and the caption [mm]."""
_BAR = 50.0
"""Length of the scale bar [mm]."""
_MM_PER_INCH = 25.4
LARGEST_SQUARE = 1.0
"""Largest side of a square [m]; a larger number is probably in millimetres."""
WIDEST = 3.0
"""Greatest width of a board [m]."""


def arguments_of(board: Board) -> str:
    """Returns the options of ``drake-tracker calibrate`` that describe a board."""
    words = [f"--kind {kind_of(board)}", f"--board {board.columns}x{board.rows}", f"--square {board.square:.6g}"]
    for name in ("marker", "family"):
        default = {field.name: field.default for field in dataclasses.fields(board)}  # type: ignore[arg-type]
        value = getattr(board, name, None)
        if value is not None and value != default[name]:
            words.append(f"--{name} {value}")
    return " ".join(words)


def page_for(board: Board, paper: str) -> tuple[float, float]:
    """Returns the width and height of the page [mm] on which a board fits, upright or on its side.

    Args:
        board: the board.
        paper: key of `PAGES`.

    Raises DrakeTrackerError when it does not fit.
    """
    lower, upper = board.shapes().box()
    size = 1e3 * (upper - lower)
    upright = PAGES[paper]
    for page in (upright, upright[::-1]):
        room = np.array(page) - [2.0 * MARGIN, 2.0 * MARGIN + _FOOT]
        if (size <= room + 1e-6).all():
            return page
    widest = max(min((np.array(page) - [2 * MARGIN, 2 * MARGIN + _FOOT]) / size) for page in (upright, upright[::-1]))
    raise DrakeTrackerError(
        f"this board is {size[0]:.0f} x {size[1]:.0f} mm large and does not fit on {paper} with its margins; take "
        f"--square {np.floor(1e4 * widest * board.square) / 1e4:g} or less, fewer columns and rows, or larger paper"
    )


def board_figure(board: Board, paper: str) -> Figure:
    """Returns the page with a board in its middle, a scale bar, and the ``calibrate`` command, at a scale of one to
    one.

    Args:
        board: the board.
        paper: key of `PAGES`.

    Raises DrakeTrackerError when it does not fit.
    """
    width, height = page_for(board, paper)
    figure = Figure(figsize=(width / _MM_PER_INCH, height / _MM_PER_INCH), facecolor="white")
    FigureCanvasAgg(figure)
    ax = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    ax.set_xlim(0.0, width)
    ax.set_ylim(height, 0.0)
    ax.axis("off")
    shapes = board.shapes()
    lower, upper = shapes.box()
    first = 0.5 * (np.array([width, height - _FOOT]) - 1e3 * (upper - lower)) - 1e3 * lower
    # One outline for everything that is black: between separate ones, viewers show hairlines.
    outlines = [_rectangle(*(1e3 * each + [*first, 0.0, 0.0])) for each in shapes.rectangles]
    outlines += [Outline.circle(tuple(1e3 * each[:2] + first), 1e3 * each[2]) for each in shapes.circles]
    ax.add_patch(PathPatch(Outline.make_compound_path(*outlines), facecolor="black", linewidth=0.0, snap=False))
    foot = height - MARGIN - 0.5 * _FOOT
    ax.add_patch(PathPatch(_rectangle(MARGIN + 2.0, foot - 0.5, _BAR, 1.0), facecolor="black", linewidth=0.0))
    small = {"fontsize": 7.5, "color": "0.25", "va": "center", "family": "DejaVu Sans"}
    command = f"drake-tracker calibrate LEFT RIGHT {arguments_of(board)} -o stereo.yaml"
    ax.text(MARGIN + 2.0, foot - 3.0, f"{_BAR:.0f} mm: print at 100 %, then measure this bar and --square", **small)
    ax.text(MARGIN + 2.0, foot + 3.0, command, **small)
    return figure


def print_board(board: Board, path: Path, paper: str) -> None:
    """Writes a page with a board to a PDF file.

    Args:
        board: the board.
        path: the file.
        paper: key of `PAGES`.

    Raises DrakeTrackerError when the board does not fit or the file cannot be written.
    """
    if path.suffix.lower() != ".pdf":
        raise DrakeTrackerError(f"-o {path}: must be a file with the suffix .pdf")
    if path.is_dir() or not path.absolute().parent.is_dir():
        raise DrakeTrackerError(f"-o {path}: must be a file in a folder that exists")
    figure = board_figure(board, paper)
    with matplotlib.rc_context({"pdf.fonttype": 42}), replacing(path) as beside:
        figure.savefig(beside, format="pdf", metadata={"CreationDate": None, "Title": board.name})


def _rectangle(x: float, y: float, width: float, height: float) -> Outline:
    """Returns the outline of a rectangle; all are drawn in the same direction."""
    corners = [(x, y), (x + width, y), (x + width, y + height), (x, y + height), (x, y)]
    return Outline(corners, closed=True)


def parse_board(
    text: str, square: float | None, kind: str = "chessboard", marker: float | None = None, family: str | None = None
) -> Board:
    """Returns the board that the command line describes.

    Args:
        text: number of columns and rows, for example "9x6": inner corners, circles, squares or tags.
        square: distance at which the pattern repeats [m].
        kind: key of `BOARDS`.
        marker: side of a marker [m]; None for the default of the board.
        family: of the markers of a ChArUco board; None for its default.

    Raises DrakeTrackerError when one of them is missing, wrong, or does not belong to the kind of board.
    """
    match = re.fullmatch(r"(\d{1,3})x(\d{1,3})", text)
    if not match:
        what = "inner corners" if kind == "chessboard" else "size"
        raise DrakeTrackerError(f"--board {text}: give the {what} as COLUMNSxROWS, for example 9x6")
    if square is None:
        raise DrakeTrackerError("--square is missing: the side of one square of the board [m], for example 0.025")
    if not 1e-4 <= square <= LARGEST_SQUARE:
        raise DrakeTrackerError(f"--square {square:g}: the side of a square must lie in 0.0001..{LARGEST_SQUARE:g} m")
    fields = {field.name for field in dataclasses.fields(BOARDS[kind])}  # type: ignore[arg-type]
    extra: dict[str, Any] = {}
    for name, value in (("marker", marker), ("family", family)):
        if value is None:
            continue
        if name not in fields:
            raise DrakeTrackerError(f"--{name} {value}: a board of the kind {kind} has no such setting")
        extra[name] = value
    make: Callable[..., Board] = BOARDS[kind]
    board = make(int(match[1]), int(match[2]), square, **extra)
    lower, upper = board.shapes().box()
    if (width := float(max(upper - lower))) > WIDEST:
        raise DrakeTrackerError(
            f"--board {text} --square {square:g}: this board would be {width:.1f} m wide; is the square in metres?"
        )
    return board
