import os
from pathlib import Path

import cv2
import numpy as np
import pytest

from drake_tracker.cameras.boards.chessboard import Chessboard, draw_board, find_corners
from drake_tracker.cameras.calibration.camera_calibration import calibrate_intrinsics, lens_from_corners, locate_camera
from drake_tracker.cameras.calibration.leave_one_out import left_out_errors
from drake_tracker.cameras.calibration.stereo_calibration import stereo_from_corners
from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.cameras.files.calibration_file import load_calibration, load_pose, save_calibration
from drake_tracker.core.errors import DrakeTrackerError

BOARD = Chessboard(9, 6, 0.03)
SIZE = 240
PHOTOGRAPHS = os.environ.get("DRAKE_TRACKER_TEST_DATA")


def pose(rotation, p):
    X = np.eye(4)
    X[:3, :3] = cv2.Rodrigues(np.array(rotation, dtype=float))[0]
    X[:3, 3] = p
    return X


def camera(X_CW=np.eye(4), f=400.0):
    middle = (SIZE - 1) / 2.0
    return CameraModel([[f, 0.0, middle], [0.0, f, middle], [0.0, 0.0, 1.0]], np.zeros(5), X_CW, SIZE, SIZE)


def photograph(model, X_WB):
    """The image that a camera without distortion takes of the board."""
    picture = draw_board(BOARD)
    texels = picture.shape[1] / (BOARD.columns + 3)
    P = model.K @ (model.X_CW @ X_WB)[:3, [0, 1, 3]]
    scale = BOARD.square / texels
    first = 0.5 * scale - 2.0 * BOARD.square
    H = P @ np.array([[scale, 0.0, first], [0.0, scale, first], [0.0, 0.0, 1.0]])
    return cv2.warpPerspective(picture, H, (SIZE, SIZE), borderValue=40)


HELD = [
    pose([tilt_x, tilt_y, roll], [-0.12, -0.075, depth])
    for tilt_x, tilt_y, roll, depth in (
        (0.5, 0.1, 0.1, 0.62),
        (-0.5, 0.2, -0.1, 0.7),
        (0.1, 0.55, 0.0, 0.66),
        (0.2, -0.5, 0.2, 0.6),
        (-0.3, -0.4, -0.2, 0.75),
        (0.4, 0.4, 0.1, 0.72),
    )
]


def test_finds_focal_length_and_keeps_the_centre():
    images = [photograph(camera(), X) for X in HELD]
    lens = calibrate_intrinsics([*images, np.zeros_like(images[0])], BOARD)
    assert lens.K[0, 0] == lens.K[1, 1] == pytest.approx(400.0, rel=0.004)
    np.testing.assert_array_equal(lens.K[:2, 2], [119.5, 119.5])
    assert lens.rms < 0.15 and not lens.distortion.any()


def test_finds_distortion_from_corners():
    truth = CameraModel(camera().K, [-0.2, 0.05, 0.001, -0.001, 0.0], np.eye(4), SIZE, SIZE)
    views = [truth.project(BOARD.points() @ X[:3, :3].T + X[:3, 3]) for X in HELD]
    lens = lens_from_corners(
        views, BOARD, (SIZE, SIZE), fix_principal_point=False, fix_aspect_ratio=False, radial_terms=2, tangential=True
    )
    np.testing.assert_allclose(lens.K, truth.K, atol=0.1)
    np.testing.assert_allclose(lens.distortion, truth.distortion, atol=0.01)


def test_locates_a_camera_from_a_board_at_a_known_place():
    truth = camera(pose([2.0, 0.1, -0.2], [0.05, -0.02, 0.7]))
    lying = [pose([np.pi, 0.0, 0.0], [-0.12, 0.075, 0.0]), pose([0.0, np.pi, 0.0], [0.12, -0.075, 0.0])]
    lens = calibrate_intrinsics([photograph(camera(), X) for X in HELD], BOARD)
    X_CW, rms = locate_camera([photograph(truth, X) for X in lying], lens, BOARD, lying)
    found = CameraModel(lens.K, lens.distortion, X_CW, SIZE, SIZE)
    points = np.random.default_rng(0).uniform(-0.1, 0.1, (50, 3))
    assert np.abs(found.project(points) - truth.project(points)).max() < 0.4
    assert rms < 0.2


def test_stereo_puts_the_world_in_the_left_camera():
    right = camera(pose([0.0, 0.15, 0.0], [-0.1, 0.0, 0.01]), f=420.0)
    views = [[find_corners(photograph(each, X), BOARD) for X in HELD] for each in (camera(), right)]
    found_left, found_right, rms = stereo_from_corners(*views, BOARD, (SIZE, SIZE))
    np.testing.assert_array_equal(found_left.X_CW, np.eye(4))
    np.testing.assert_allclose(found_right.X_CW, right.X_CW, atol=0.004)
    assert rms < 0.2


def test_says_when_the_board_is_not_found():
    blank = [np.full((SIZE, SIZE), 40, np.uint8)] * 4
    with pytest.raises(DrakeTrackerError, match="9 x 6 board was found in 0 of 4 images"):
        calibrate_intrinsics(blank, BOARD)
    views = [camera().project(BOARD.points() @ X[:3, :3].T + X[:3, 3]) for X in HELD]
    lens = lens_from_corners(views, BOARD, (SIZE, SIZE))
    with pytest.raises(DrakeTrackerError, match="not found in image 0"):
        locate_camera(blank[:1], lens, BOARD, [np.eye(4)])


@pytest.mark.skipif(not PHOTOGRAPHS, reason="DRAKE_TRACKER_TEST_DATA names no folder of photographs")
def test_photographs_squares_of_a_pair_that_was_left_out():
    folder = Path(PHOTOGRAPHS) / "stereo_chessboard"
    board = Chessboard(9, 6, 1.0)
    left, right = (
        [cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) for path in sorted(folder.glob(f"{side}*.jpg"))]
        for side in ("left", "right")
    )
    assert len(left) == len(right) == 13
    shape = left[0].shape
    left, right = ([find_corners(image, board) for image in images] for images in (left, right))
    assert all(corners is not None for corners in left + right)
    free = {"fix_principal_point": False, "fix_aspect_ratio": False, "radial_terms": 2, "tangential": True}
    assert stereo_from_corners(left, right, board, shape, **free)[2] < 0.3
    errors = left_out_errors(left, right, board, shape, **free)
    assert len(errors) == 13
    assert np.mean(errors) <= 0.002
    assert np.max(errors) <= 0.006


def stored(path, **changes):
    save_calibration(path, {"camera_left": camera(pose([0.1, 0.2, 0.3], [1.0, 2.0, 3.0]))}, rig={"fov_deg": 30.0})
    text = path.read_text(encoding="utf-8")
    for old, new in changes.values():
        assert old in text
        text = text.replace(old, new, 1)
    path.write_text(text, encoding="utf-8")
    return path


def test_a_file_gives_back_the_cameras(tmp_path):
    truth = camera(pose([0.1, 0.2, 0.3], [1.0, 2.0, 3.0]))
    cameras = load_calibration(stored(tmp_path / "cameras.yaml"), rig={"fov_deg": 30.0})
    assert list(cameras) == ["camera_left"]
    found = cameras["camera_left"]
    assert (found.width, found.height) == (SIZE, SIZE)
    np.testing.assert_allclose(found.X_CW, truth.X_CW, atol=1e-8)
    np.testing.assert_allclose(found.K, truth.K, atol=1e-8)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("width: 240", "width: -3"), r"cameras.yaml: cameras.camera_left.width is -3; it must be a whole number"),
        (("400.0", ".nan"), r"cameras.yaml: cameras.camera_left.K must contain 3 x 3 finite numbers"),
        (("distortion: [0.0,", "distortion: [bent,"), r"camera_left.distortion must contain 5 or 8 finite numbers"),
        (("X_CW:", "X_CV:"), r"camera_left.X_CW must contain 4 x 4 finite numbers"),
        (("3.0]", "3.0"), r"cameras.yaml line \d+: "),
        (("cameras:", "lenses:"), r"cameras.yaml: cameras is missing"),
        (("[400.0,", "[-400.0,"), r"camera_left.K must be \[\[fx"),
        (("0.0, 0.0, 1.0]\n    distortion", "0.0, 0.0, 2.0]\n    distortion"), r"camera_left.K must be"),
        (("[0.0, 0.0, 0.0, 1.0]", "[0.0, 0.0, 0.0, 2.0]"), r"camera_left.X_CW must be a rotation"),
    ],
)
def test_a_broken_file_is_named_with_the_key(tmp_path, change, message):
    with pytest.raises(DrakeTrackerError, match=message) as error:
        load_calibration(stored(tmp_path / "cameras.yaml", change=change))
    assert "\n" not in str(error.value)


def test_a_missing_file_and_a_mirrored_camera_are_refused(tmp_path):
    with pytest.raises(DrakeTrackerError, match="nowhere.yaml: the calibration cannot be read"):
        load_calibration(tmp_path / "nowhere.yaml")
    path = tmp_path / "mirror.yaml"
    save_calibration(path, {"camera_left": camera(np.diag([-1.0, 1.0, 1.0, 1.0]))})
    with pytest.raises(DrakeTrackerError, match="X_CW must be a rotation"):
        load_calibration(path)


@pytest.mark.parametrize("rig", [{"fov_deg": 17.0}, {"distance": 1.4}])
def test_a_calibration_of_another_rig_is_refused(tmp_path, rig):
    with pytest.raises(DrakeTrackerError, match=f"rig.{next(iter(rig))} = .* calibrate"):
        load_calibration(stored(tmp_path / "cameras.yaml"), rig=rig)


def test_a_pose_of_a_file_is_found_by_its_keys(tmp_path):
    path = tmp_path / "plane.yaml"
    X = pose([0.1, 0.2, 0.3], [1.0, 2.0, 3.0])
    path.write_text(f"notes: {{X_WP: {X.tolist()}, X_WQ: {(2 * X).tolist()}}}", encoding="utf-8")
    np.testing.assert_allclose(load_pose(path, "notes", "X_WP"), X)
    for keys in (("X_WP",), ("notes", "X_WQ"), ("notes", "X_WP", "more")):
        with pytest.raises(DrakeTrackerError, match=f"plane.yaml: {'.'.join(keys)} must contain 4 x 4 numbers"):
            load_pose(path, *keys)


def test_a_file_that_cannot_be_written_is_one_line(tmp_path):
    with pytest.raises(DrakeTrackerError, match="cameras.yaml: cannot be written: No such file or directory"):
        save_calibration(tmp_path / "nowhere" / "cameras.yaml", {})
