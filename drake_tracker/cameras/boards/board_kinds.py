"""The kinds of boards, by the name that the command line gives them."""

from collections.abc import Mapping

from drake_tracker.cameras.boards.board import Board
from drake_tracker.cameras.boards.chessboard import Chessboard
from drake_tracker.cameras.boards.circle_grid import AsymmetricCircleGrid, CircleGrid
from drake_tracker.cameras.boards.marker_boards import AprilTagGrid, CharucoBoard

BOARDS: Mapping[str, type[Board]] = {
    "chessboard": Chessboard,
    "circles": CircleGrid,
    "asymmetric_circles": AsymmetricCircleGrid,
    "charuco": CharucoBoard,
    "apriltag": AprilTagGrid,
}
"""{name: class of the board}; the first is the default."""


def kind_of(board: Board) -> str:
    """Returns the name of a board's kind."""
    return next(name for name, kind in BOARDS.items() if type(board) is kind)
