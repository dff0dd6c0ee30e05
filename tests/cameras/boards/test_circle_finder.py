import os
from pathlib import Path

import cv2
import numpy as np
import pytest
from ball_pictures import CIRCLES, RADIUS, camera_pose, draw_board, intrinsics, shoot

from drake_tracker.cameras.boards.circle_finder import CircleMeasurement, best_measurement, find_circles, measure_circle
from drake_tracker.cameras.boards.circle_pose import image_centres
from drake_tracker.core.errors import DrakeTrackerError

PHOTOGRAPHS = os.environ.get("DRAKE_TRACKER_TEST_DATA")
X_CB = camera_pose()


def image_jacobian(p_BQ, step=1e-4):
    """Change of a point's pixel with its x and y on the board (2, 2) [px/m]."""
    around = p_BQ + step * np.array([(1, 0, 0), (0, 1, 0), (-1, 0, 0), (0, -1, 0)])
    uv = image_centres(X_CB, around, intrinsics(), 0.0)
    return (uv[:2] - uv[2:]).T / (2 * step)


CENTRES = image_centres(X_CB, CIRCLES, intrinsics(), RADIUS)
ELLIPSES = [np.pi * RADIUS**2 * abs(np.linalg.det(jacobian)) for jacobian in map(image_jacobian, CIRCLES)]
"""Areas of the circles' images [px]."""


@pytest.fixture(scope="module")
def board():
    return draw_board(X_CB)


def nearest(found, uv=CENTRES):
    """Distance of each of the places (n, 2) from the nearest measurement [px]."""
    return np.linalg.norm(np.array(found)[:, np.newaxis, :2] - uv, axis=2).min(axis=0)


def square_window(uv, half=8):
    u, v = np.rint(uv).astype(int)
    return (u - half, v - half, 2 * half + 1, 2 * half + 1)


def test_finds_the_four_circles(board):
    rng = np.random.default_rng(0)
    assert nearest(find_circles(shoot(board, rng))).max() < 0.15
    found = find_circles([shoot(board, rng) for _ in range(10)])
    assert len(found) == 4 and nearest(found).max() < 0.1
    for u, v, area in found:  # of the ellipse
        k = np.argmin(np.hypot(CENTRES[:, 0] - u, CENTRES[:, 1] - v))
        assert area == pytest.approx(ELLIPSES[k], rel=0.05)


def test_pegs_marks_and_an_uneven_light_do_not_mislead(board):
    v, u = np.mgrid[: board.shape[0], : board.shape[1]]
    cluttered = board * (0.6 + 0.4 * u / board.shape[1])
    for place in ((120.0, 120.0), (140.0, 150.0), (100.0, 130.0), (125.0, 160.0), (135.0, 105.0)):
        cluttered[np.hypot(u - place[0], v - place[1]) < 2.2] = 40.0
    found = find_circles(shoot(cluttered, np.random.default_rng(1)))
    assert nearest(found).max() < 0.15
    assert [circle.area for circle in found] == sorted((circle.area for circle in found), reverse=True)


def test_a_hidden_circle_is_missed_and_said(board):
    u, v = np.rint(CENTRES[1]).astype(int)
    hidden = board.copy()
    hidden[v - 12 : v + 13, u - 12 : u + 13] = 120.0
    with pytest.raises(DrakeTrackerError, match="found 3 of 4 dark circles; one may be hidden") as error:
        find_circles(shoot(hidden, np.random.default_rng(2)))
    assert "\n" not in str(error.value)
    with pytest.raises(DrakeTrackerError, match="found 0 of 4"):
        find_circles(np.full((100, 100), 200, np.uint8))


def test_a_board_partly_out_of_view_is_said(board):
    u = int(CENTRES[:, 0].max()) - 1
    with pytest.raises(DrakeTrackerError, match="found 3 of 4 dark circles; .* the whole board"):
        find_circles(shoot(board[:, :u], np.random.default_rng(2)))


def test_windows_of_an_operator(board):
    rng = np.random.default_rng(3)
    images = [shoot(board, rng) for _ in range(10)]
    found = [best_measurement([measure_circle(image, square_window(uv), 110) for image in images]) for uv in CENTRES]
    assert nearest(found).max() < 0.4
    assert all(circle.area == int(circle.area) for circle in found)


def test_the_measurement_with_the_largest_area_counts():
    found = [CircleMeasurement(1.0, 1.0, 60.0), CircleMeasurement(1.1, 0.9, 64.0), CircleMeasurement(1.0, 1.0, 62.0)]
    assert best_measurement(found) is found[1]


def test_windows_that_cannot_be_used(board):
    image = shoot(board, np.random.default_rng(4))
    u, v = np.rint(CENTRES[0]).astype(int)
    middle = np.rint(CENTRES.mean(axis=0)).astype(int)
    for window, message in (
        (square_window(middle, 6), "contains no whole circle darker than 110"),
        ((u, v - 8, 17, 17), "contains no whole circle"),  # cut in half
        ((5, 5, 240, 240), "contains 4 dark areas; it must contain one circle"),
        ((250, 10, 20, 20), "is not inside the image of 256 x 256 px"),
    ):
        image[image < 90] = np.where(image[image < 90] < 45, 20, 180)  # A bright floor.
        with pytest.raises(DrakeTrackerError, match=message) as error:
            measure_circle(image, window, 110)
        assert "\n" not in str(error.value)


@pytest.mark.skipif(not PHOTOGRAPHS, reason="DRAKE_TRACKER_TEST_DATA names no folder of photographs")
def test_photographs_agree_with_the_reference():
    folder = Path(PHOTOGRAPHS) / "circle_grids"
    for number in range(1, 6):
        image = cv2.imread(str(folder / f"circles{number}.jpg"), cv2.IMREAD_GRAYSCALE)
        storage = cv2.FileStorage(str(folder / f"circles_corners{number}.dat"), cv2.FILE_STORAGE_READ)
        reference = storage.getNode("corners").mat().reshape(-1, 2)
        found = find_circles(image, len(reference))
        assert nearest(found, reference).max() < 0.5 and len(found) < len(reference) + 5
        u, v = np.rint(reference[24]).astype(int)
        spacing = int(np.sort(np.linalg.norm(reference - reference[24], axis=1))[1])
        half = spacing // 2
        patch = image[v - half : v + half + 1, u - half : u + half + 1]
        threshold = (int(patch.min()) + int(np.median(patch))) / 2
        circle = measure_circle(image, (u - half, v - half, 2 * half + 1, 2 * half + 1), threshold)
        assert np.hypot(circle.u - reference[24, 0], circle.v - reference[24, 1]) < 0.5
