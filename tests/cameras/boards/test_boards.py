"""Every kind of board is found where it is, in order, and says how it can be mistaken."""

import os
from pathlib import Path

import cv2
import numpy as np
import pytest
from board_pictures import draw, held, photograph

from drake_tracker.cameras.boards.board import neighbours
from drake_tracker.cameras.boards.board_kinds import BOARDS, kind_of
from drake_tracker.cameras.boards.chessboard import Chessboard
from drake_tracker.cameras.boards.circle_grid import AsymmetricCircleGrid, CircleGrid
from drake_tracker.cameras.boards.marker_boards import AprilTagGrid, CharucoBoard
from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.core.errors import DrakeTrackerError

K = np.array([[420.0, 0.0, 209.5], [0.0, 420.0, 159.5], [0.0, 0.0, 1.0]])
CAMERA = CameraModel(K, np.zeros(5), np.eye(4), 420, 320)
PHOTOGRAPHS = os.environ.get("DRAKE_TRACKER_TEST_DATA")
EACH = [
    Chessboard(9, 6, 0.03),
    Chessboard(8, 6, 0.03),
    Chessboard(7, 5, 0.03),
    Chessboard(6, 6, 0.03),
    Chessboard(5, 5, 0.03),
    CircleGrid(7, 5, 0.035),
    AsymmetricCircleGrid(4, 11, 0.02),
    CharucoBoard(8, 6, 0.035),
    CharucoBoard(7, 5, 0.035),
    AprilTagGrid(5, 4, 0.05),
]


@pytest.mark.parametrize("board", EACH, ids=lambda board: board.name)
@pytest.mark.parametrize("roll", [0.1, 3.0])
def test_finds_the_points_in_order(board, roll):
    X_CB = held(board, [0.0, 0.0, roll], 0.42)
    X_CB[:3, :3] = held(board, [0.35, -0.3, 0.0], 0.42)[:3, :3] @ X_CB[:3, :3]
    lower, upper = board.shapes().box()
    X_CB[:3, 3] = [0.0, 0.0, 0.42] - X_CB[:3, :3] @ [*(0.5 * (lower + upper)), 0.0]
    found = board.find(photograph(board, CAMERA, X_CB))
    truth = CAMERA.project(board.points() @ X_CB[:3, :3].T + X_CB[:3, 3])
    errors = [np.linalg.norm(found - truth[turn], axis=1) for turn in board.turns()]
    best = min(errors, key=np.nanmean)
    assert np.isfinite(best).mean() > 0.8
    assert np.sqrt(np.nanmean(best**2)) < 0.25, [float(np.nanmean(each)) for each in errors]


@pytest.mark.parametrize(
    "board", [Chessboard(9, 6, 0.03), CharucoBoard(8, 6, 0.03), AprilTagGrid(5, 4, 0.05)], ids=lambda board: board.name
)
@pytest.mark.parametrize("tilt", [1.0, 1.1])
def test_no_point_of_a_board_that_is_seen_at_a_slant_is_off(board, tilt):
    camera = CameraModel(np.array([[760.0, 0, 319.5], [0, 760, 239.5], [0, 0, 1]]), np.zeros(5), np.eye(4), 640, 480)
    X_CB = held(board, [0.0, 0.0, 0.6], 0.75)
    X_CB[:3, :3] = held(board, [tilt, 0.0, 0.0], 0.75)[:3, :3] @ X_CB[:3, :3]
    lower, upper = board.shapes().box()
    X_CB[:3, 3] = [0.0, 0.0, 0.75] - X_CB[:3, :3] @ [*(0.5 * (lower + upper)), 0.0]
    found = board.find(photograph(board, camera, X_CB))
    truth = camera.project(board.points() @ X_CB[:3, :3].T + X_CB[:3, 3])
    errors = min((np.linalg.norm(found - truth[turn], axis=1) for turn in board.turns()), key=np.nanmean)
    assert np.isfinite(errors).mean() > 0.9
    assert np.nanmax(errors) < 0.75


@pytest.mark.parametrize("board", EACH, ids=lambda board: board.name)
def test_no_board_in_an_empty_image(board):
    noise = np.random.default_rng(0).normal(120.0, 3.0, (240, 320))
    assert board.find(noise.astype(np.uint8)) is None


@pytest.mark.parametrize("board", EACH, ids=lambda board: board.name)
def test_its_points_and_its_turns(board):
    pairs = neighbours(board)
    p_BQ = board.points()
    assert len(pairs) >= len(p_BQ) - board.columns - board.rows
    np.testing.assert_allclose(np.linalg.norm(np.diff(p_BQ[pairs], axis=1)[:, 0], axis=1), board.spacing)
    for turn in board.turns():
        assert sorted(turn) == list(range(len(p_BQ)))
        d = np.linalg.norm(np.diff(p_BQ[turn][pairs], axis=1)[:, 0], axis=1)
        np.testing.assert_allclose(d, board.spacing)
    assert type(board) is BOARDS[kind_of(board)]


def test_which_boards_look_the_same_after_a_turn():
    assert [len(board.turns()) for board in EACH] == [1, 2, 2, 4, 4, 2, 1, 1, 1, 1]
    assert len(AsymmetricCircleGrid(4, 10).turns()) == 2


def test_a_part_of_a_board_with_markers_is_enough():
    for board in (CharucoBoard(8, 6, 0.035), AprilTagGrid(5, 4, 0.05)):
        X_CB = held(board, [0.3, 0.2, 0.1], 0.4, aside=(0.13, 0.05))
        found = board.find(photograph(board, CAMERA, X_CB))
        truth = CAMERA.project(board.points() @ X_CB[:3, :3].T + X_CB[:3, 3])
        hidden = np.isnan(found).any(axis=1)
        assert 0.1 < hidden.mean() < 0.7
        assert np.nanmax(np.linalg.norm(found - truth, axis=1)) < 0.6


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Chessboard(2, 9), "a board of 2 x 9 inner corners cannot be used; both must be at least 3"),
        (lambda: CircleGrid(2, 9), "2 x 9 circles is too small"),
        (lambda: AsymmetricCircleGrid(1, 9), "1 x 9 circles is too small"),
        (lambda: CharucoBoard(3, 3), "3 x 3 squares is too small"),
        (lambda: CharucoBoard(8, 6, 0.03, 0.04), "a marker of 0.04 m does not suit squares of 0.03 m"),
        (lambda: CharucoBoard(8, 6, family="9x9"), "--family 9x9: must be one of 4x4, 5x5, 6x6, 7x7"),
        (lambda: CharucoBoard(90, 60), "a board with 2700 markers is too large"),
        (lambda: AprilTagGrid(1, 9), "1 x 9 tags is too small"),
        (lambda: AprilTagGrid(30, 30), "a board with 900 markers is too large; there are 587"),
        (lambda: AprilTagGrid(6, 4, 0.03, 0.03), "a tag of 0.03 m does not suit a distance of 0.03 m"),
    ],
)
def test_refuses_a_board_that_cannot_be(make, message):
    with pytest.raises(DrakeTrackerError, match=message):
        make()


def test_a_large_photograph_is_searched_in_a_smaller_one_and_measured_in_full():
    board = Chessboard(9, 6, 0.03)
    K = np.array([[2400.0, 0.0, 1199.5], [0.0, 2400.0, 899.5], [0.0, 0.0, 1.0]])
    camera = CameraModel(K, np.zeros(5), np.eye(4), 2400, 1800)
    X_CB = held(board, [0.3, -0.3, 0.1], 0.4)
    truth = camera.project(board.points() @ X_CB[:3, :3].T + X_CB[:3, 3])
    picture, first, texel = draw(board)
    H = K @ X_CB[:3, [0, 1, 3]] @ [[texel, 0.0, first[0]], [0.0, texel, first[1]], [0.0, 0.0, 1.0]]
    image = cv2.GaussianBlur(cv2.warpPerspective(picture, H, (2400, 1800), borderValue=90), (0, 0), 1.5)
    assert np.linalg.norm(board.find(image) - truth, axis=1).max() < 0.3


@pytest.mark.skipif(not PHOTOGRAPHS, reason="DRAKE_TRACKER_TEST_DATA names no folder of photographs")
def test_photographs_of_a_grid_of_circles():
    folder = Path(PHOTOGRAPHS) / "circle_grids"
    board = CircleGrid(7, 7, 1.0)
    for k in range(1, 6):
        file = cv2.FileStorage(str(folder / f"circles_corners{k}.dat"), cv2.FILE_STORAGE_READ)
        expected = file.getNode("corners").mat().reshape(-1, 2)
        found = board.find(cv2.imread(str(folder / f"circles{k}.jpg"), cv2.IMREAD_GRAYSCALE))
        error = min(np.linalg.norm(found[turn] - expected, axis=1).max() for turn in board.turns())
        assert error < 1.0
