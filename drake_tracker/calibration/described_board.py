"""The board that the command line describes."""

import dataclasses
import re
from collections.abc import Callable
from typing import Any

from drake_tracker.cameras.boards.board import Board
from drake_tracker.cameras.boards.board_kinds import BOARDS
from drake_tracker.core.errors import DrakeTrackerError

LARGEST_SQUARE = 1.0
"""Largest side of a square [m]; a larger number is probably in millimetres."""
WIDEST = 3.0
"""Greatest width of a board [m]."""


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
