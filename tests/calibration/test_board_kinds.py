"""Calibration with every kind of board and lens, and photographs of which some or all cannot be used."""

import argparse
from pathlib import Path

import cv2
import numpy as np
import pytest
from board_pictures import held, photograph, pose

from drake_tracker import cli
from drake_tracker.calibration.found_boards import FoundBoards
from drake_tracker.calibration.photographs import LENSES
from drake_tracker.calibration.quality import CameraQuality, to_retake
from drake_tracker.cameras.boards.board_kinds import BOARDS
from drake_tracker.cameras.boards.chessboard import Chessboard
from drake_tracker.cameras.boards.circle_grid import AsymmetricCircleGrid, CircleGrid
from drake_tracker.cameras.boards.marker_boards import AprilTagGrid, CharucoBoard
from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.cameras.files.camera_files import FORMATS, load_cameras
from drake_tracker.commands import calibrate as calibrate_command

SIZE = (320, 240)
K = np.array([[260.0, 0.0, 161.0], [0.0, 260.0, 118.0], [0.0, 0.0, 1.0]])
PINHOLE = CameraModel(K, [-0.1, 0.02, 0.0, 0.0, 0.0], np.eye(4), *SIZE)
FISHEYE = CameraModel(K * [[0.8, 1, 1], [1, 0.8, 1], [1, 1, 1]], [0.05, -0.02, 0.0, 0.0], np.eye(4), *SIZE, "fisheye")
BESIDE = pose([0.02, 0.15, 0.01], [-0.06, 0.0, 0.01])
UPSIDE_DOWN = pose([0.05, -0.08, 3.1], [0.06, 0.0, 0.01])
HOLDS = [
    ([0.5, 0.1, 0.1], 0.30, (-0.02, -0.02)),
    ([-0.5, 0.2, -0.1], 0.30, (0.02, 0.0)),
    ([0.1, 0.55, 0.0], 0.28, (0.0, 0.02)),
    ([0.2, -0.5, 0.2], 0.30, (0.03, -0.01)),
    ([-0.3, -0.4, -0.2], 0.32, (-0.02, 0.02)),
    ([0.4, 0.4, 0.1], 0.29, (0.0, -0.02)),
]
EVEN = Chessboard(8, 6, 0.02)


def shoot(board, left, X_RL=None, holds=HOLDS, noise=1.0):
    """Writes the photographs of a rig of one camera or two to the folders left and right."""
    rig = {"left": left}
    if X_RL is not None:
        rig["right"] = CameraModel(left.K, left.distortion, X_RL, *SIZE, left.lens)
    for side, camera in rig.items():
        Path(side).mkdir(exist_ok=True)
        for k, hold in enumerate(holds):
            image = photograph(board, camera, held(board, *hold), noise, seed=k)
            cv2.imwrite(f"{side}/{k}.png", image)
    return rig


def calibrate(arguments):
    return cli.main(["calibrate", *arguments.split(), "-o", "rig.yaml"])


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture(scope="module")
def pairs(tmp_path_factory):
    """Photographs of a chessboard that looks the same after half a turn, by a camera and one that is upside down."""
    folder = tmp_path_factory.mktemp("pairs")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        shoot(EVEN, PINHOLE, UPSIDE_DOWN)
    return folder


@pytest.fixture
def even(pairs, folder):
    for side in ("left", "right"):
        Path(side).mkdir()
        for file in (pairs / side).iterdir():
            (folder / side / file.name).write_bytes(file.read_bytes())
    return folder


EVEN_BOARD = "left right --board 8x6 --square 0.02"


def test_a_board_of_even_sides_and_a_camera_upside_down(even, capsys):
    assert calibrate(EVEN_BOARD) == 0
    cameras, _ = load_cameras(["rig.yaml"])
    np.testing.assert_allclose(cameras["camera_right"].X_CW, UPSIDE_DOWN, atol=0.02)
    said = capsys.readouterr().out
    assert "camera_left: focal length 2" in said and " ± " in said and "of the image" in said
    assert "in a pair that was left out: 0." in said
    picture = cv2.imread("rig.png")
    assert picture.shape == (1350, 2400, 3) and picture.std() > 20


def test_exchanged_pairs_are_left_out_and_named(even, capsys):
    for k, source in ((6, 0), (7, 1), (8, 2)):  # more pairs, so that two wrong ones are few
        for side in ("left", "right"):
            image = cv2.imread(f"{side}/{source}.png").astype(int)
            cv2.imwrite(f"{side}/{k}.png", (image + 1).clip(0, 255))
    Path("right/3.png").rename("right/kept.png")
    Path("right/4.png").rename("right/3.png")
    Path("right/kept.png").rename("right/4.png")
    assert calibrate(EVEN_BOARD) == 0
    said = capsys.readouterr().out
    for k in (3, 4):
        assert f"take left/{k}.png and right/{k}.png again: in it the cameras stand differently, by" in said
    assert "(7 pairs)" in said


def test_a_pair_of_fisheyes_and_a_board_with_markers(folder):
    board = CharucoBoard(7, 6, 0.036, 0.028, "5x5")
    shoot(board, FISHEYE, BESIDE)
    options = "--kind charuco --board 7x6 --square 0.036 --marker 0.028 --family 5x5"
    assert calibrate(f"left right {options} --lens fisheye --baseline 0.061") == 0
    cameras, _ = load_cameras(["rig.yaml"])
    assert cameras["camera_left"].lens == "fisheye"
    assert cameras["camera_left"].K[0, 0] == pytest.approx(FISHEYE.K[0, 0], rel=0.03)
    np.testing.assert_allclose(cameras["camera_right"].X_WC[:3, 3], -BESIDE[:3, :3].T @ BESIDE[:3, 3], atol=0.004)


@pytest.mark.parametrize(
    ("board", "options"),
    [
        (CircleGrid(7, 5, 0.024), "--kind circles --board 7x5 --square 0.024"),
        (AsymmetricCircleGrid(4, 9, 0.014), "--kind asymmetric_circles --board 4x9 --square 0.014"),
        (AprilTagGrid(5, 4, 0.033), "--kind apriltag --board 5x4 --square 0.033"),
        (Chessboard(7, 5, 0.024), "--board 7x5 --square 0.024 --lens rational"),
    ],
    ids=["circles", "asymmetric_circles", "apriltag", "rational"],
)
def test_a_single_camera(folder, capsys, board, options):
    shoot(board, PINHOLE)
    assert calibrate(f"left {options} --format ros") == 0
    cameras, kind = load_cameras(["rig.yaml"])
    assert kind == "ros" and list(cameras) == ["camera_left"]
    assert cameras["camera_left"].K[0, 0] == pytest.approx(260.0, rel=0.04)
    assert "reprojection in an image that was left out: 0." in capsys.readouterr().out


def test_a_photograph_that_is_worse_than_the_others_is_to_be_taken_again():
    boards = FoundBoards([f"left/{k}.png and right/{k}.png" for k in range(6)], [(), ()], [(240, 320)] * 2)
    sharp, blurred = np.full(6, 0.2), np.array([0.2, 0.2, 1.4, 0.2, 0.2, 0.2])
    moved = np.array([0.1, 0.1, 0.1, 0.1, 2.0, 0.1])
    qualities = [CameraQuality(None, np.zeros(4), rms, np.ones((6, 8))) for rms in (sharp, blurred)]
    assert to_retake(boards, qualities, moved) == [
        "take left/2.png and right/2.png again: in right/2.png the points are 1.4 px off, elsewhere 0.2 px: it is "
        "blurred, or the board is bent",
        "take left/4.png and right/4.png again: its images do not fit together, 2.0 px off, elsewhere 0.1 px: the "
        "board moved between them",
    ]
    assert to_retake(boards, [CameraQuality(None, np.zeros(4), sharp, np.ones((6, 8)))] * 2, sharp) == []


def shuffled():
    for k, other in enumerate([3, 0, 4, 1, 5, 2]):
        Path(f"right/{k}.png").rename(f"right/{other}x.png")


def everywhere(change):
    for file in [*Path("left").iterdir(), *Path("right").iterdir()]:
        cv2.imwrite(str(file), change(cv2.imread(str(file), cv2.IMREAD_GRAYSCALE)))


def shrunk(image):
    """The image in the lower right corner of a larger one."""
    larger = np.full((image.shape[0] * 3, image.shape[1] * 3), 90, np.uint8)
    larger[-image.shape[0] :, -image.shape[1] :] = image
    return larger


def parallel():
    for side, shift in (("left", 0.0), ("right", 0.04)):
        for k in range(6):
            X = held(EVEN, [0.3, 0.1, 0.0], 0.3, (0.01 * k - 0.025 - shift, 0.02 * (k % 3) - 0.02))
            cv2.imwrite(f"{side}/{k}.png", photograph(EVEN, PINHOLE, X, seed=k))


@pytest.mark.parametrize(
    ("spoil", "arguments", "message"),
    [
        (
            shuffled,
            EVEN_BOARD,
            "pairs agree on how the cameras stand; were both images of a pair taken at the same time",
        ),
        (lambda: everywhere(shrunk), EVEN_BOARD, "in one part of the image only, the lower right ("),
        (parallel, EVEN_BOARD, "held at the same angle in all images"),
        (None, EVEN_BOARD + " --baseline 0.6", "--baseline 0.6: the cameras are 0.06"),
        (None, EVEN_BOARD + " --baseline -1", "--baseline -1: a distance above 0 m between two cameras"),
        (None, "left --board 8x6 --square 0.02 --baseline 0.6", "--baseline 0.6: a distance above 0 m between two"),
        (
            None,
            EVEN_BOARD + " --kind charuco",
            "the ChArUco board of 8 x 6 squares was found in 0 of 6 pairs",
        ),
        (None, EVEN_BOARD + " --kind apriltag", "at least 5 are needed; --board counts tags"),
        (None, EVEN_BOARD + " --marker 0.01", "--marker 0.01: a board of the kind chessboard has no such setting"),
        (None, EVEN_BOARD + " --kind apriltag --family 4x4", "--family 4x4: a board of the kind apriltag has no such"),
        (None, EVEN_BOARD + " --kind charuco --marker 0.5", "a marker of 0.5 m does not suit squares of 0.02 m"),
        (None, EVEN_BOARD + " --kind charuco --family 9x9", "--family 9x9: must be one of 4x4, 5x5, 6x6, 7x7"),
        (None, EVEN_BOARD + " --world --format ros", "--world: the format ros has no world frame; leave it out"),
        (None, EVEN_BOARD + " --lens rational --format kalibr", "--format kalibr: Kalibr has no rational lens"),
        (None, EVEN_BOARD.replace("0.02", "20"), "--square 20: the side of a square must lie in 0.0001..1 m"),
        (None, EVEN_BOARD.replace("8x6", "8X6"), "--board 8X6: give the inner corners as COLUMNSxROWS"),
    ],
)
def test_unusable_data_is_refused_with_a_reason_in_one_line(even, capfd, spoil, arguments, message):
    if spoil:
        spoil()
    assert calibrate(arguments) == 2
    (line,) = capfd.readouterr().err.splitlines()
    assert line.startswith("drake-tracker: ") and message in line
    assert not Path("rig.yaml").exists() and not Path("rig.png").exists()


def test_the_options_name_every_kind():
    parser = argparse.ArgumentParser()
    calibrate_command.register(parser.add_subparsers())
    actions = parser._subparsers._group_actions[0].choices["calibrate"]._option_string_actions
    for option, names in (("--kind", BOARDS), ("--lens", LENSES), ("--format", FORMATS)):
        assert list(actions[option].choices) == list(names)


def test_the_picture_does_not_replace_the_file(even, capfd):
    assert cli.main(["calibrate", *EVEN_BOARD.split(), "-o", "rig.png"]) == 2
    assert "-o rig.png: the suffix .png is for the picture; name the file rig.yaml" in capfd.readouterr().err
