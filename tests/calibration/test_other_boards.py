"""Tests of photographs that show another board than the one that was named."""

import cv2
import numpy as np
import pytest
from board_pictures import draw

from drake_tracker.calibration.found_boards import find_boards, list_photographs
from drake_tracker.cameras.boards.chessboard import Chessboard
from drake_tracker.cameras.boards.marker_boards import AprilTagGrid, CharucoBoard
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.progress import StepsProgress


def legacy():
    board = CharucoBoard(6, 8)
    board._opencv.setLegacyPattern(True)
    return board._opencv.generateImage((480, 640), marginSize=40)


def picture(board):
    image = draw(board)[0]
    return cv2.resize(image, None, fx=640 / image.shape[1], fy=640 / image.shape[1], interpolation=cv2.INTER_AREA)


@pytest.mark.parametrize(
    ("shown", "board", "message"),
    [
        (picture(CharucoBoard(8, 6)), CharucoBoard(6, 8), "a board with --board 8x6 is there"),
        (picture(CharucoBoard(8, 6, family="5x5")), CharucoBoard(8, 6), "a board with --family 5x5 is there"),
        (legacy(), CharucoBoard(6, 8), "a board in the layout of OpenCV before 4.6, which is not supported, is there"),
        (255 - picture(Chessboard(8, 5)), Chessboard(8, 5), "this board with black and white exchanged is there"),
        (picture(AprilTagGrid(5, 3)), AprilTagGrid(3, 5), "a board with --board 5x3 is there"),
        (picture(Chessboard(7, 5)), Chessboard(8, 6), "a board with 7 x 5 inner corners is there"),
    ],
)
def test_the_board_that_is_there_is_named(tmp_path, shown, board, message):
    for number in range(5):
        noisy = shown.astype(int) + np.random.default_rng(number).integers(-2, 3, shown.shape)
        assert cv2.imwrite(str(tmp_path / f"{number}.png"), np.clip(noisy, 0, 255).astype(np.uint8))
    with pytest.raises(DrakeTrackerError, match=f"was found in 0 of 5 images; at least 5 are needed; {message}"):
        find_boards(list_photographs([str(tmp_path)]), board, StepsProgress())
