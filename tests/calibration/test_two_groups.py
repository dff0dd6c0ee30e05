"""A set of photographs that were not all taken through the same lens."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from drake_tracker.calibration.found_boards import FoundBoards
from drake_tracker.calibration.photographs import LENSES
from drake_tracker.calibration.quality import two_groups
from drake_tracker.cameras.boards.chessboard import Chessboard
from drake_tracker.cameras.calibration.camera_calibration import lens_from_corners
from drake_tracker.cameras.camera_model import CameraModel

BOARD, SHAPE, COUNT = Chessboard(9, 6, 0.025), (480, 640), 16
OPTIONS = LENSES["pinhole"]


def camera(f, cx, cy, k1=-0.25):
    K = np.array([[f, 0.0, cx], [0.0, f, cy], [0.0, 0.0, 1.0]])
    return CameraModel(K, np.array([k1, 0.06, 0.0, 0.0, 0.0]), np.eye(4), *SHAPE[::-1])


def photographs(cameras, seed, noise=0.12):
    """Points of a board that is held in front of a camera, (54, 2) [px], one array for each camera."""
    rng = np.random.default_rng(seed)
    points = BOARD.points() - BOARD.points().mean(axis=0)
    found = []
    while len(found) < len(cameras):
        R = Rotation.from_rotvec(rng.uniform(-0.6, 0.6, 3) * [1.0, 1.0, 0.3]).as_matrix()
        p = rng.uniform([-0.12, -0.08, 0.35], [0.12, 0.08, 0.6])
        pixels = cameras[len(found)].project(points @ R.T + p)
        if (pixels > 5).all() and (pixels < [635, 475]).all():
            found.append(pixels + rng.normal(0.0, noise, pixels.shape))
    return found


def groups(views, beside=()):
    names = [f"{k}.jpg" for k in range(len(views))]
    boards = FoundBoards(names, [tuple(views), *beside], [SHAPE])
    return two_groups(lens_from_corners(views, BOARD, SHAPE, **OPTIONS), boards, 0, BOARD, OPTIONS)


USUAL = camera(800.0, 341.0, 252.0)


@pytest.mark.parametrize(
    "other",
    [camera(800.0, 639.0 - 341.0, 479.0 - 252.0), camera(860.0, 341.0, 252.0), camera(700.0, 322.0, 240.0, -0.1)],
    ids=["half a turn", "zoom", "another camera"],
)
@pytest.mark.parametrize("fewer", [4, 8])
def test_photographs_through_another_lens_are_named(other, fewer):
    which = np.random.default_rng(fewer).permutation(COUNT) < fewer
    said = groups(photographs([other if each else USUAL for each in which], seed=5))
    assert said is not None and "two groups" in said
    named = said.split(": ")[1].split(" fit one lens")[0].split(" and ")[0].split(", ")
    found = {int(name.removesuffix(".jpg")) for name in named}
    members = set(np.flatnonzero(which).tolist())
    assert found <= members or (fewer == 8 and not found & members)


@pytest.mark.parametrize(("seed", "noise"), [(1, 0.05), (2, 0.12), (3, 0.3), (4, 0.6)])
def test_photographs_through_one_lens_are_one_group(seed, noise):
    assert groups(photographs([USUAL] * COUNT, seed, noise)) is None


def test_a_bent_or_blurred_photograph_is_no_group():
    views = photographs([USUAL] * COUNT, seed=6)
    views[3] = views[3] + np.random.default_rng(1).normal(0.0, 2.0, views[3].shape)
    assert groups(views) is None
    assert groups(photographs([USUAL] * 5, seed=7)) is None
