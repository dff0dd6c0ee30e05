"""Parts placed by their silhouettes, on drawn masks."""

import cv2
import numpy as np
import pytest
from drawn_belt import CAMERAS, HEIGHT, SIDES, SILHOUETTES, WINDOWS, pose, windows

from drake_tracker.core.part_kinds import PART_SHAPES, PartKind
from drake_tracker.vision.parts.part_fit import fit_part
from drake_tracker.vision.parts.part_silhouette import piece_corners

KINDS = list(PART_SHAPES)


def error(found, true):
    turns = PART_SHAPES[true.kind].turns
    turn = 0.0
    if turns:
        period = 2.0 * np.pi / turns
        turn = (found.yaw - true.yaw + 0.5 * period) % period - 0.5 * period
    return np.array([found.x - true.x, found.y - true.y, turn])


@pytest.mark.parametrize("kind", KINDS)
def test_the_drawn_silhouette_is_the_hull_of_the_corners_of_each_piece(kind):
    part = pose(kind, 0.57, 0.12, 0.7)
    for side, silhouette in zip(SIDES, SILHOUETTES):
        patch = silhouette.patch(part)
        c, s = np.cos(part.yaw), np.sin(part.yaw)
        fine = np.zeros((8 * patch.share.shape[0], 8 * patch.share.shape[1]), np.uint8)
        first = np.array([patch.columns.start, patch.rows.start]) + WINDOWS[side][:2]
        for corners in piece_corners(kind):
            p_WQ = [[part.x + c * x - s * y, part.y + s * x + c * y, HEIGHT + z] for x, y, z in corners]
            pixels = (CAMERAS[side].project(p_WQ) - first + 0.5) * 8.0 - 0.5
            cv2.fillConvexPoly(fine, np.rint(cv2.convexHull(pixels.astype(np.float32))).astype(np.int32), 1)
        assert patch.share.sum() == pytest.approx(fine.sum() / 64.0, rel=0.03)
        origin = [part.x, part.y, HEIGHT + 0.5 * PART_SHAPES[kind].height]
        assert patch.centre + first == pytest.approx(CAMERAS[side].project(origin)[0])
        moved = CAMERAS[side].project(np.array(origin) + [0.002, -0.001, 0.0])[0]
        assert patch.centre + first + patch.jacobian @ [0.002, -0.001] == pytest.approx(moved, abs=0.01)


def test_a_part_outside_of_the_window_has_no_silhouette():
    assert SILHOUETTES[0].patch(pose(PartKind.BOX, 0.6, -3.0)) is None


@pytest.mark.parametrize("kind", KINDS)
def test_a_displaced_part_is_found_to_a_fraction_of_a_pixel(kind):
    rng = np.random.default_rng(int(kind))
    errors = []
    for _ in range(12):
        true = pose(kind, rng.uniform(0.55, 0.65), rng.uniform(-0.4, 0.4), rng.uniform(-np.pi, np.pi))
        start = pose(kind, true.x + rng.uniform(-4e-3, 4e-3), true.y + rng.uniform(-4e-3, 4e-3), true.yaw + 0.15)
        fit = fit_part(windows([true]), start, 4)
        assert fit.misfit < 0.02 and fit.share > 0.99
        errors.append(error(fit.pose, true) / np.sqrt(np.diag(fit.covariance)))
        assert np.abs(error(fit.pose, true)[:2]).max() < 0.0015
        assert abs(error(fit.pose, true)[2]) < np.deg2rad(4.0)
    assert np.sqrt(np.mean(np.square(errors))) < 2.0, "errors are as large as the covariance says"


def test_the_right_kind_fits_best():
    for kind in KINDS:
        true = pose(kind, 0.61, -0.1, 0.5)
        found = windows([true])
        misfits = {other: fit_part(found, pose(other, 0.61, -0.1, 0.5), 5).misfit for other in KINDS}
        assert min(misfits, key=misfits.get) is kind
        assert all(misfit > 0.025 for other, misfit in misfits.items() if other is not kind)


def test_what_the_arm_hides_counts_neither_for_nor_against_a_place():
    true = pose(PartKind.BOX, 0.6, 0.0, 0.3)
    found = []
    for window in windows([true]):
        seen, weight = window.seen.copy(), window.weight.copy()
        patch = window.silhouette.patch(true)
        half = slice(patch.columns.start, int(patch.columns.start + patch.centre[0]))
        weight[patch.rows, half], seen[patch.rows, half] = 0.0, 0.0
        found.append(window._replace(seen=seen, weight=weight))
    fit = fit_part(found, pose(PartKind.BOX, 0.602, 0.002, 0.25), 4)
    assert 0.3 < fit.share < 0.7
    assert np.abs(error(fit.pose, true)[:2]).max() < 0.002
    hidden = [window._replace(weight=np.zeros_like(window.weight)) for window in found]
    assert fit_part(hidden, true, 1) is None


def test_an_empty_place_is_not_filled_and_a_covered_one_is():
    part = pose(PartKind.DISC, 0.6, 0.1)
    empty = fit_part(windows([]), part, 1)
    assert empty.filled < 0.05 and empty.misfit > 0.5
    covered = [window._replace(seen=np.ones_like(window.seen)) for window in windows([])]
    assert fit_part(covered, part, 1).filled > 0.95


def test_a_disc_has_no_direction():
    fit = fit_part(windows([pose(PartKind.DISC)]), pose(PartKind.DISC, 0.602, 0.001, 0.8), 3)
    assert fit.pose.yaw == 0.8 and fit.covariance[2, 2] == 1.0
