"""How well a lens is determined, and how pairs of images agree, from exact projections with noise."""

import numpy as np
import pytest
from board_pictures import held, pose

from drake_tracker.calibration.quality import lens_std
from drake_tracker.cameras.boards.chessboard import Chessboard
from drake_tracker.cameras.boards.marker_boards import CharucoBoard
from drake_tracker.cameras.calibration.camera_calibration import lens_from_corners
from drake_tracker.cameras.calibration.stereo_calibration import stereo_from_corners
from drake_tracker.cameras.calibration.stereo_pose_consensus import agree, upright
from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.core.errors import DrakeTrackerError

BOARD = Chessboard(8, 6, 0.03)
K = np.array([[520.0, 0.0, 322.0], [0.0, 520.0, 238.0], [0.0, 0.0, 1.0]])
LEFT = CameraModel(K, np.zeros(5), np.eye(4), 640, 480)
RIGHT = CameraModel(K, np.zeros(5), pose([0.03, 0.2, 0.02], [-0.12, 0.01, 0.02]), 640, 480)
FREE = {"fix_principal_point": False, "fix_aspect_ratio": False, "radial_terms": 2, "tangential": True}


def poses(count, seed=0, tilt=0.6):
    rng = np.random.default_rng(seed)
    turns = rng.uniform(-tilt, tilt, (count, 3)) * [1.0, 1.0, 0.5]
    return [held(BOARD, turn, rng.uniform(0.45, 0.7), rng.uniform(-0.08, 0.08, 2)) for turn in turns]


def views(camera, held_at, board=BOARD, noise=0.1, seed=0):
    rng = np.random.default_rng([seed, round(1e3 * camera.X_CW[0, 3] + 1e3)])
    return [
        camera.project(board.points() @ X[:3, :3].T + X[:3, 3]) + rng.normal(0.0, noise, (len(board.points()), 2))
        for X in held_at
    ]


@pytest.mark.parametrize("options", [FREE, {"kind": "fisheye"}], ids=["pinhole", "fisheye"])
def test_standard_deviations_are_those_of_repeated_calibrations(options):
    fisheye = CameraModel(0.6 * K + 0.4 * np.eye(3), np.full(4, 0.01), np.eye(4), 640, 480, "fisheye")
    camera = fisheye if "kind" in options else LEFT
    found, said = [], []
    for seed in range(12):
        seen = views(camera, poses(8), seed=seed)
        lens = lens_from_corners(seen, BOARD, (480, 640), **options)
        std, rms = lens_std(lens, seen, BOARD)
        found.append(lens.K[[0, 1, 0, 1], [0, 1, 2, 2]])
        said.append(std)
        assert np.sqrt(np.mean(rms**2)) == pytest.approx(lens.rms, rel=0.1)
    # 12 repetitions give a standard deviation to 21 %, within a factor of 2 almost always.
    ratio = np.std(found, axis=0, ddof=1) / np.mean(said, axis=0)
    assert (ratio > 0.5).all() and (ratio < 2.0).all(), ratio


def test_a_symmetric_board_is_matched_in_every_pair():
    held_at = poses(7)
    left, right = views(LEFT, held_at), views(RIGHT, held_at)
    turned = [view[BOARD.turns()[k % 2]] for k, view in enumerate(right)]
    agreement = agree(left, turned, (LEFT, RIGHT), BOARD)
    np.testing.assert_array_equal(agreement.views_right, right)
    assert agreement.agrees.all() and np.degrees(agreement.angles.max()) < 3.0
    found = stereo_from_corners(left, agreement.views_right, BOARD, (480, 640), **FREE)[1]
    np.testing.assert_allclose(found.X_CW, RIGHT.X_CW, atol=0.01)


def test_pairs_that_allow_two_answers_are_refused():
    still = poses(1) * 6
    with pytest.raises(DrakeTrackerError, match="8 x 6 board looks the same after half a turn"):
        agree(views(LEFT, still), views(RIGHT, still), (LEFT, RIGHT), BOARD)
    marked = CharucoBoard(8, 6, 0.03)
    assert agree(views(LEFT, still, marked), views(RIGHT, still, marked), (LEFT, RIGHT), marked).agrees.all()


def test_a_pair_of_other_instants_does_not_agree():
    held_at = poses(7)
    right = views(RIGHT, held_at)
    right[2] = views(RIGHT, poses(1, seed=9))[0]
    agreement = agree(views(LEFT, held_at), right, (LEFT, RIGHT), BOARD)
    assert np.flatnonzero(~agreement.agrees).tolist() == [2]


def test_the_first_end_of_a_symmetric_board_is_on_the_left():
    (view,) = views(LEFT, poses(1), noise=0.0)
    for turn in BOARD.turns():
        np.testing.assert_array_equal(upright(view[turn], BOARD), view)
