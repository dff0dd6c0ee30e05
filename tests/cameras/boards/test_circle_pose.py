import cv2
import numpy as np
import pytest
from ball_pictures import CIRCLES, RADIUS, SIZE, camera_pose, draw_board, intrinsics, random_camera_pose, shoot

from drake_tracker.cameras.boards.circle_finder import find_circles
from drake_tracker.cameras.boards.circle_pose import image_centres, locate_board
from drake_tracker.core.errors import DrakeTrackerError

K = intrinsics()


def pose_error(X_CB, found):
    """Distance [m] between two poses' origins and angle [deg] between their axes."""
    cosine = (np.trace(X_CB[:3, :3].T @ found[:3, :3]) - 1.0) / 2.0
    return np.linalg.norm(found[:3, 3] - X_CB[:3, 3]), np.degrees(np.arccos(min(cosine, 1.0)))


def project(X, p_BQ, K=K):
    p_CQ = p_BQ @ X[:3, :3].T + X[:3, 3]
    return p_CQ[:, :2] / p_CQ[:, 2:] * [K[0, 0], K[1, 1]] + K[:2, 2]


def test_exact_centroids_in_any_order_give_the_pose_exactly():
    rng = np.random.default_rng(0)
    for _ in range(10):
        X_CB = random_camera_pose(rng)
        uv = rng.permutation(image_centres(X_CB, CIRCLES, K, RADIUS))
        found = locate_board(uv, CIRCLES, K, radius=RADIUS)
        metres, degrees = pose_error(X_CB, found.X_CB)
        assert metres < 1e-5 and degrees < 1e-3 and found.rms < 1e-3


def test_the_middle_of_a_circles_image_is_that_of_its_outline():
    X_CB = camera_pose()
    angle = np.linspace(0.0, 2.0 * np.pi, 20000, endpoint=False)
    for centre, middle in zip(CIRCLES, image_centres(X_CB, CIRCLES, K, RADIUS)):
        u, v = project(X_CB, centre + RADIUS * np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])).T
        assert middle == pytest.approx([(u.min() + u.max()) / 2, (v.min() + v.max()) / 2], abs=1e-4)
    off = np.linalg.norm(image_centres(X_CB, CIRCLES, K, RADIUS) - project(X_CB, CIRCLES), axis=1)
    assert 0.01 < off.max() < 0.1


def test_distortion_is_undone():
    X_CB = camera_pose()
    distortion = np.array([-0.2, 0.05, 0.001, -0.001, 0.0])
    uv = cv2.projectPoints(CIRCLES, cv2.Rodrigues(X_CB[:3, :3])[0], X_CB[:3, 3], K, distortion)[0][:, 0]
    metres, degrees = pose_error(X_CB, locate_board(uv, CIRCLES, K, distortion).X_CB)
    assert metres < 5e-5 and degrees < 5e-3


def test_pictures_from_many_places():
    """Ten images of 256 x 256 px with noise: half a millimetre and a tenth of a degree rms."""
    rng = np.random.default_rng(5)
    errors = []
    for _ in range(12):
        X_CB = random_camera_pose(rng)
        board = draw_board(X_CB)
        circles = find_circles([shoot(board, rng) for _ in range(10)])
        found = locate_board(circles, CIRCLES, K, radius=RADIUS)
        errors.append(pose_error(X_CB, found.X_CB))
    metres, degrees = np.sqrt(np.mean(np.square(errors), axis=0))
    assert metres < 0.0005 and degrees < 0.1


def test_the_boards_circles_are_told_from_other_dark_things():
    rng = np.random.default_rng(6)
    X_CB = camera_pose(-30.0, 45.0)
    board = draw_board(X_CB)
    v, u = np.mgrid[:SIZE, :SIZE]
    pegs = rng.uniform([-0.2, 0.2, 0.0], [0.2, 0.7, 0.0], (12, 3))
    for place in project(X_CB, pegs):
        board[np.hypot(u - place[0], v - place[1]) < 2.6] = 40.0
    circles = find_circles([shoot(board, rng) for _ in range(10)])
    assert len(circles) > 10
    metres, degrees = pose_error(X_CB, locate_board(circles, CIRCLES, K, radius=RADIUS).X_CB)
    assert metres < 0.001 and degrees < 0.1
    # A hidden circle is missed, however many other things there are.
    hidden = image_centres(X_CB, CIRCLES, K, RADIUS)[2]
    rest = [circle for circle in circles if np.hypot(*(circle[:2] - hidden)) > 3.0]
    with pytest.raises(DrakeTrackerError, match="not those of the board"):
        locate_board(rest, CIRCLES, K, radius=RADIUS)


def dots(X_CB, p_BQ, radius):
    """Returns the images of circles on the board as measurements (u, v, area) [px], shape (n, 3)."""
    H = K @ np.column_stack([X_CB[:3, 0], X_CB[:3, 1], X_CB[:3, 3]])
    depth = p_BQ @ X_CB[2, :3] + X_CB[2, 3]
    return np.column_stack(
        [image_centres(X_CB, p_BQ, K, radius), np.pi * radius**2 * np.abs(np.linalg.det(H)) / depth**3]
    )


def test_pegs_in_the_right_places_are_not_taken_for_the_circles():
    X_CB, size = camera_pose(-30.0, 45.0), 0.3
    circles = dots(X_CB, CIRCLES, RADIUS)
    pegs = dots(X_CB, size * CIRCLES + [0.0, 0.3, 0.0], size * RADIUS)  # like the whole board, much farther away
    metres, _ = pose_error(X_CB, locate_board(np.vstack([circles, pegs]), CIRCLES, K, radius=RADIUS).X_CB)
    assert metres < 1e-4
    for hidden in range(4):
        with pytest.raises(DrakeTrackerError, match="not those of the board"):
            locate_board(np.vstack([np.delete(circles, hidden, axis=0), pegs]), CIRCLES, K, radius=RADIUS)


def test_a_larger_dark_circle_near_the_board_does_not_matter():
    X_CB = camera_pose(-30.0, 45.0)
    other = dots(X_CB, np.array([[0.5, -0.1, 0.0]]), 3.0 * RADIUS)
    found = locate_board(np.vstack([other, dots(X_CB, CIRCLES, RADIUS)]), CIRCLES, K, radius=RADIUS)
    assert pose_error(X_CB, found.X_CB)[0] < 1e-4


def test_circles_that_are_not_the_boards_are_refused():
    X_CB = camera_pose()
    uv = image_centres(X_CB, CIRCLES, K, RADIUS)
    wrong = uv.copy()
    wrong[2] += (25.0, -10.0)  # another thing taken for a hidden circle
    with pytest.raises(DrakeTrackerError, match="not those of the board") as error:
        locate_board(wrong, CIRCLES, K, radius=RADIUS)
    assert "\n" not in str(error.value)
    with pytest.raises(DrakeTrackerError, match="3 circles were seen and 4 are on the board"):
        locate_board(uv[:3], CIRCLES, K)


def test_a_mirrored_image_is_refused():
    uv = image_centres(camera_pose(), CIRCLES, K, RADIUS)
    with pytest.raises(DrakeTrackerError, match="not those of the board"):
        locate_board(np.column_stack([SIZE - 1 - uv[:, 0], uv[:, 1]]), CIRCLES, K, radius=RADIUS)


def test_circles_in_a_rectangle_cannot_be_ordered():
    rectangle = CIRCLES.copy()
    rectangle[3, 0] = -0.25
    with pytest.raises(DrakeTrackerError, match="two orders of the circles fit"):
        locate_board(project(camera_pose(), rectangle) + [[0.02, 0], [0, 0.02], [-0.02, 0], [0, 0]], rectangle, K)
