"""The options that describe a calibration board."""

from argparse import ArgumentParser


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
