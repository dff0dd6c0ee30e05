"""Boards on paper: the page has the size of the paper, and the board on it its true size."""

import re
from pathlib import Path

import numpy as np
import pytest

from drake_tracker import cli
from drake_tracker.calibration.board_page import PAGES, arguments_of, board_figure, parse_board
from drake_tracker.cameras.boards.board_kinds import BOARDS

DPI = 127  # 5 px to a mm
SIZES = {
    "chessboard": ("9x6", 0.025, None),
    "circles": ("7x5", 0.03, None),
    "asymmetric_circles": ("4x9", 0.018, None),
    "charuco": ("8x6", 0.03, 0.02),
    "apriltag": ("6x4", 0.04, None),
}


@pytest.mark.parametrize("kind", SIZES)
def test_the_board_has_its_true_size(kind):
    text, square, marker = SIZES[kind]
    board = parse_board(text, square, kind, marker)
    figure = board_figure(board, "a4")
    figure.set_dpi(DPI)
    figure.canvas.draw()
    picture = np.asarray(figure.canvas.buffer_rgba())[..., 1].copy()
    found = board.find(picture)
    assert found is not None and np.isfinite(found).all()
    millimetres = 1e3 * board.points()[:, :2]
    fit, *_ = np.linalg.lstsq(np.column_stack([millimetres, np.ones(len(found))]), found, rcond=None)
    np.testing.assert_allclose(fit[:2], 5.0 * np.eye(2), atol=0.005)


@pytest.mark.parametrize(("paper", "points"), [("a4", (841.89, 595.28)), ("letter", (792.0, 612.0))])
def test_the_page_has_the_size_of_the_paper(tmp_path, monkeypatch, capsys, paper, points):
    monkeypatch.chdir(tmp_path)
    arguments = "--kind charuco --board 8x6 --square 0.028 --marker 0.02"
    assert cli.main(["board", *arguments.split(), "--paper", paper, "-o", "b.pdf"]) == 0
    content = Path("b.pdf").read_bytes()
    box = re.search(rb"/MediaBox \[ 0 0 ([\d.]+) ([\d.]+) \]", content)
    np.testing.assert_allclose([float(box[1]), float(box[2])], points, atol=0.01)
    assert content.startswith(b"%PDF") and b"/CreationDate" not in content
    assert f"calibrate with {arguments}" in capsys.readouterr().out


@pytest.mark.parametrize("kind", SIZES)
def test_what_the_page_says_describes_the_board(kind):
    text, square, marker = SIZES[kind]
    board = parse_board(text, square, kind, marker)
    words = arguments_of(board).split()
    options = dict(zip(words[::2], words[1::2]))
    side = options.get("--marker")
    again = parse_board(options["--board"], float(options["--square"]), options["--kind"], side and float(side))
    assert again == board and type(board) is BOARDS[kind]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("", "--board is missing"),
        ("--board 9x6", "--square is missing"),
        ("--board 9 --square 0.02", "--board 9: give the inner corners as COLUMNSxROWS"),
        (
            "--board 9x6 --square 0.04",
            "400 x 280 mm large and does not fit on a4 with its margins; take --square 0.026",
        ),
        ("--board 9x6 --square 0.02 -o board.png", "-o board.png: must be a file with the suffix .pdf"),
        ("--board 9x6 --square 0.02 -o no/board.pdf", "must be a file in a folder that exists"),
        ("--board 2x6 --square 0.02", "a board of 2 x 6 inner corners cannot be used"),
        ("--board 9x6 --square nan", "--square nan: the side of a square must lie in"),
        ("--kind charuco --board 60x60 --square 0.003", "a board with 1800 markers is too large; there are 1000"),
        ("--kind apriltag --board 40x30 --square 0.005", "a board with 1200 markers is too large"),
    ],
)
def test_a_wrong_call_is_one_line(tmp_path, monkeypatch, capfd, arguments, message):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["board", *arguments.split()]) == 2
    (line,) = capfd.readouterr().err.splitlines()
    assert line.startswith("drake-tracker: ") and message in line
    assert not list(tmp_path.iterdir())


def test_the_largest_square_that_is_named_fits():
    board = parse_board("9x6", 0.026, "chessboard")
    assert board_figure(board, "a4") is not None and set(PAGES) == {"a4", "a3", "letter"}
