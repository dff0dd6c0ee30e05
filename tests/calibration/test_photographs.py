"""The calibration of your own cameras, from image files to a calibration file, through the command line."""

import os
from pathlib import Path

import cv2
import numpy as np
import pytest

from drake_tracker import cli
from drake_tracker.cameras.boards.chessboard import Chessboard, draw_board
from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.cameras.files.calibration_file import load_calibration, load_pose

PHOTOGRAPHS = os.environ.get("DRAKE_TRACKER_TEST_DATA")
BOARD = Chessboard(6, 5, 0.03)
SIZE = (240, 200)


def pose(rotation, p):
    X = np.eye(4)
    X[:3, :3] = cv2.Rodrigues(np.array(rotation, dtype=float))[0]
    X[:3, 3] = p
    return X


K = np.array([[300.0, 0.0, 119.5], [0.0, 300.0, 99.5], [0.0, 0.0, 1.0]])
LEFT = CameraModel(K, np.zeros(5), np.eye(4), *SIZE)
RIGHT = CameraModel(K, np.zeros(5), pose([0.0, 0.15, 0.0], [-0.08, 0.0, 0.01]), *SIZE)
HELD = [
    pose([x, y, roll], [-0.07, -0.06, depth + 0.08])
    for x, y, roll, depth in (
        (0.5, 0.1, 0.1, 0.42),
        (-0.5, 0.2, -0.1, 0.45),
        (0.1, 0.55, 0.0, 0.40),
        (0.2, -0.5, 0.2, 0.44),
        (-0.3, -0.4, -0.2, 0.46),
        (0.4, 0.4, 0.1, 0.42),
        (-0.4, 0.4, 0.15, 0.48),
    )
]


def photograph(model, X_WB):
    """The image that a camera takes of the board."""
    picture = draw_board(BOARD)
    scale = BOARD.square * (BOARD.columns + 3) / picture.shape[1]
    first = 0.5 * scale - 2.0 * BOARD.square
    H = (model.K @ (model.X_CW @ X_WB)[:3, [0, 1, 3]]) @ [[scale, 0.0, first], [0.0, scale, first], [0.0, 0.0, 1.0]]
    return cv2.warpPerspective(picture, H, SIZE, borderValue=40)


@pytest.fixture
def shots(tmp_path, monkeypatch):
    """Folders left and right with seven pairs of a board, and the current folder."""
    monkeypatch.chdir(tmp_path)
    for side, model in (("left", LEFT), ("right", RIGHT)):
        Path(side).mkdir()
        for k, X_WB in enumerate(HELD):
            cv2.imwrite(f"{side}/{k + 6}.png", photograph(model, X_WB))  # 6 to 12: 10 comes after 9
    return tmp_path


def calibrate(*arguments, board="6x5", square="0.03"):
    return cli.main(["calibrate", *arguments, "--board", board, "--square", square, "-o", "rig.yaml"])


def test_a_pair_of_cameras(shots, capsys):
    assert calibrate("left", "right") == 0
    cameras = load_calibration("rig.yaml")
    assert list(cameras) == ["camera_left", "camera_right"]
    np.testing.assert_array_equal(cameras["camera_left"].X_CW, np.eye(4))
    baseline = np.linalg.norm(cameras["camera_right"].X_WC[:3, 3])
    assert baseline == pytest.approx(np.linalg.norm(RIGHT.X_WC[:3, 3]), rel=0.03)
    X_WP = load_pose("rig.yaml", "notes", "X_WP")
    np.testing.assert_allclose(X_WP[:3, 3], HELD[0][:3, 3], atol=0.01)
    assert X_WP[2, 2] < -0.5  # z of the board's plane looks at the camera
    said = capsys.readouterr().out
    assert "(7 pairs)" in said and "relative error of a square in a pair that was left out: 0." in said


def test_the_world_may_be_the_board_of_the_first_pair(shots):
    assert calibrate("left", "right", "--world") == 0
    cameras = load_calibration("rig.yaml")
    p_PQ = BOARD.points() * [1.0, -1.0, 1.0]
    for name, model in (("camera_left", LEFT), ("camera_right", RIGHT)):
        truth = model.project(BOARD.points() @ HELD[0][:3, :3].T + HELD[0][:3, 3])
        assert np.abs(cameras[name].project(p_PQ) - truth).max() < 0.6
        assert cameras[name].X_WC[2, 3] > 0.2  # above the board
    np.testing.assert_array_equal(load_pose("rig.yaml", "notes", "X_WP"), np.eye(4))


def test_a_single_camera(shots):
    assert calibrate("left/*.png", "--world") == 0
    ((name, camera),) = load_calibration("rig.yaml").items()
    assert name == "camera_left" and camera.K[0, 0] == pytest.approx(300.0, rel=0.03)


def test_a_pair_without_the_board_is_named_and_skipped(shots, capsys):
    cv2.imwrite("right/8.png", np.full(SIZE[::-1], 90, np.uint8))
    assert calibrate("left", "right") == 0
    said = capsys.readouterr().out
    assert "skipped left/8.png and right/8.png: no board in right/8.png" in said and "(6 pairs)" in said


@pytest.mark.parametrize(
    ("spoil", "arguments", "options", "message"),
    [
        (lambda: Path("right/9.png").unlink(), "left right", {}, "left has 7 images and right has 6"),
        (lambda: Path("right/9.png").write_text("no"), "left right", {}, "right/9.png: this image cannot be read"),
        (lambda: smaller("left/9.png"), "left right", {}, "left/9.png has 120 x 100 px, those before have 240 x 200"),
        (lambda: None, "left right", {"board": "9x6"}, "the 9 x 6 board was found in 0 of 7 pairs"),
        (lambda: None, "left right", {"board": "6by5"}, "--board 6by5: give the inner corners as COLUMNSxROWS"),
        (lambda: None, "left right", {"board": "6x4x2"}, "--board 6x4x2"),
        (lambda: None, "left right", {"board": "6x2"}, "a board of 6 x 2 inner corners cannot be used"),
        (lambda: None, "left right", {"board": "7x6"}, "a board with 6 x 5 inner corners is there"),
        (lambda: None, "left right", {"square": "0.6"}, "this board would be 4.2 m wide; is the square in metres?"),
        (lambda: None, "left right", {"square": "0"}, "--square 0: the side of a square must lie in 0.0001..1 m"),
        (lambda: None, "left right", {"square": "30"}, "--square 30: the side of a square must lie in 0.0001..1 m"),
        (lambda: None, "left left", {}, "left and left: these are the same images"),
        (
            lambda: alike(0),
            "left right",
            {},
            "was found in 1 of 7 pairs of images; at least 5 are needed; 6 of them are",
        ),
        (lambda: None, "left nowhere", {}, "nowhere: there is no such folder of images"),
        (lambda: None, "left right left", {}, "3 image sets; give one or two"),
        (lambda: None, "left right --set a=b", {}, "--set changes a scenario"),
    ],
)
def test_bad_input_is_one_line_and_leaves_the_file_that_was_there(shots, capfd, spoil, arguments, options, message):
    Path("rig.yaml").write_text("as it was")
    spoil()
    assert calibrate(*arguments.split(), **options) == 2
    (line,) = capfd.readouterr().err.splitlines()
    assert line.startswith("drake-tracker: ") and message in line
    assert Path("rig.yaml").read_text() == "as it was"


def alike(k):
    """Every pair shows the board as the ``k``-th does."""
    for side in ("left", "right"):
        for n in range(len(HELD)):
            Path(f"{side}/{n + 6}.png").write_bytes(Path(f"{side}/{k + 6}.png").read_bytes())


def smaller(path):
    cv2.imwrite(path, cv2.resize(cv2.imread(path), None, fx=0.5, fy=0.5))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("left right", "photographs need --board"),
        ("left right --board 6x5 -o rig.yaml", "--square is missing"),
        ("left right --board 6x5 --square 0.03", "-o FILE is missing"),
        ("left right --board 6x5 --square 0.03 -o nowhere/rig.yaml", "there is no folder nowhere"),
    ],
)
def test_what_is_missing_is_named(shots, capsys, arguments, message):
    assert cli.main(["calibrate", *arguments.split()]) == 2
    assert message in capsys.readouterr().err


def test_a_file_that_cannot_be_written_is_one_line(shots, capfd, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    Path("rig.yaml").write_text("as it was")
    assert calibrate("left") == 2
    assert "rig.yaml: cannot be written: No space left on device" in capfd.readouterr().err
    assert {path.name for path in shots.iterdir()} == {"left", "right", "rig.yaml"}


@pytest.mark.skipif(not PHOTOGRAPHS, reason="DRAKE_TRACKER_TEST_DATA names no folder of photographs")
def test_photographs_a_square_of_a_pair_left_out_is_off_by_a_few_thousandths(tmp_path, capsys):
    folder = Path(PHOTOGRAPHS) / "stereo_chessboard"
    file = tmp_path / "stereo.yaml"
    arguments = ["calibrate", f"{folder}/left*.jpg", f"{folder}/right*.jpg", "--board", "9x6", "--square", "0.025"]
    assert cli.main([*arguments, "-o", str(file)]) == 0
    said = capsys.readouterr().out
    mean, worst = (float(text.split()[-1]) for text in said.split("left out:")[1].split("%")[:2])
    assert mean <= 0.2 and worst <= 0.6
    cameras = load_calibration(file)
    assert np.linalg.norm(cameras["camera_right"].X_WC[:3, 3]) == pytest.approx(0.0833, abs=0.0005)
