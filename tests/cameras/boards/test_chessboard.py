import cv2
import numpy as np
import pytest

from drake_tracker.cameras.boards.chessboard import Chessboard, draw_board, find_corners

BOARD = Chessboard(9, 6, 0.05)


def view(turn, size=256, noise=2.0):
    """A small oblique image of the board, turned by ``turn`` half turns, and the pixels of its corners."""
    picture = draw_board(BOARD)
    texels = picture.shape[1] / (BOARD.columns + 3)
    corners = np.array([[0.2, 0.3], [0.9, 0.35], [0.85, 0.8], [0.1, 0.7]]) * size
    u, v = picture.shape[1] - 0.5, picture.shape[0] - 0.5
    H = cv2.getPerspectiveTransform(
        np.float32([[-0.5, -0.5], [u, -0.5], [u, v], [-0.5, v]]), np.float32(np.roll(corners, 2 * turn, axis=0))
    )
    image = cv2.warpPerspective(picture, H, (size, size), borderValue=30).astype(float)
    image += np.random.default_rng(0).normal(0.0, noise, image.shape)
    on_picture = texels * (BOARD.points()[:, :2] / BOARD.square + 2.0) - 0.5
    return np.clip(image, 0, 255).astype(np.uint8), cv2.perspectiveTransform(on_picture[:, None], H)[:, 0]


@pytest.mark.parametrize("turn", [0, 1])
def test_finds_the_corners_in_order_whichever_way_round(turn):
    image, expected = view(turn)
    found = find_corners(image, BOARD)
    miss = np.linalg.norm(found - expected, axis=1)
    assert np.sqrt((miss**2).mean()) < 0.15
    assert np.linalg.norm((found - expected).mean(axis=0)) < 0.04


def test_says_when_there_is_no_board():
    image, _ = view(0)
    assert find_corners(np.full((256, 256), 90, np.uint8), BOARD) is None
    image[:, 128:] = 30
    assert find_corners(image, BOARD) is None


def test_the_board_lies_in_its_plane_row_by_row():
    corners = BOARD.points()
    assert corners.shape == (54, 3)
    np.testing.assert_allclose(corners[[0, 1, 9]], [[0, 0, 0], [0.05, 0, 0], [0, 0.05, 0]])
