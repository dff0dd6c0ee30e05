"""``drake-tracker board``: prints a calibration board to scale."""

from argparse import ArgumentParser, Namespace
from pathlib import Path

from drake_tracker.commands.common import SUCCESS, Commands, add_command
from drake_tracker.core.errors import DrakeTrackerError


def register(commands: Commands) -> None:
    """Adds the command to the parsers ``commands``."""
    command = add_command(
        commands,
        "board",
        execute,
        help="print a calibration board to scale",
        description="Writes a PDF page with a calibration board in its true size, a scale bar, and the command for "
        "drake-tracker calibrate.",
        next_step="drake-tracker calibrate LEFT RIGHT with the options on the page, after photographs of the board.",
    )
    add_board(command)
    command.add_argument("--paper", choices=("a4", "a3", "letter"), default="a4", help="size of the paper")
    command.add_argument("-o", "--out", type=Path, default=Path("board.pdf"), metavar="FILE", help="PDF file to write")


def execute(options: Namespace) -> int:
    """Prints the board; returns the exit code."""
    if options.board is None:
        raise DrakeTrackerError("board: --board is missing: columns and rows, for example 8x6")

    from drake_tracker.calibration.board_page import arguments_of, parse_board, print_board

    board = parse_board(options.board, options.square, options.kind, options.marker, options.family)
    print_board(board, options.out, options.paper)
    print(f"wrote {options.out}: {board.name}; print it at 100 %, glue it onto something flat, and measure it")
    print(f"calibrate with {arguments_of(board)}")
    return SUCCESS


def add_board(command: ArgumentParser) -> None:
    """Adds the options that describe a board."""
    command.add_argument(
        "--kind",
        choices=("chessboard", "circles", "asymmetric_circles", "charuco", "apriltag"),
        default="chessboard",
        metavar="KIND",
        help="chessboard, circles, asymmetric_circles, charuco or apriltag",
    )
    command.add_argument(
        "--board",
        metavar="CxR",
        help="columns and rows, for example 9x6: inner corners of a chessboard, squares of a ChArUco board, circles, "
        "or tags",
    )
    command.add_argument(
        "--square",
        type=float,
        metavar="M",
        help="side of a square; distance between circles (rows of an asymmetric grid), or from tag to tag [m]",
    )
    command.add_argument("--marker", type=float, metavar="M", help="side of a marker or a tag [m]")
    command.add_argument("--family", metavar="NAME", help="markers of a ChArUco board: 4x4, 5x5, 6x6 or 7x7")
