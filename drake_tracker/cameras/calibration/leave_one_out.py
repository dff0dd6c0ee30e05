"""Leave-one-out cross-validation of calibrated cameras, with the board as the reference."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from drake_tracker.cameras.boards.board import Board, neighbours
from drake_tracker.cameras.calibration.camera_calibration import MIN_LENS_VIEWS, board_pose, lens_from_corners
from drake_tracker.cameras.calibration.stereo_calibration import stereo_from_corners
from drake_tracker.cameras.triangulation import triangulate

Report = Callable[[int, int, str], object]
"""Called with (number of views done, number of views, name of the step)."""


def left_out_errors(
    views_left: Sequence[np.ndarray],
    views_right: Sequence[np.ndarray],
    board: Board,
    shape: tuple[int, int],
    shape_right: tuple[int, int] | None = None,
    *,
    most: int | None = None,
    progress: Report | None = None,
    **options: Any,
) -> np.ndarray:
    """Returns the relative error of the square's side for each pair of images that was left out, shape (m,).

    Each pair in turn is left out, the cameras are calibrated from the rest, its points are triangulated, and the mean
    distance between neighbours is compared with the true one. The result is empty when the rest is too few for a lens.

    Args:
        views_left: points (n, 2) [px] of the board in the left image of each pair, NaN for hidden points.
        views_right: points (n, 2) [px] in the right images.
        board: the board.
        shape: (h, w) of the left images [px].
        shape_right: (h, w) of the right images [px], if it differs.
        most: number of pairs to leave out, spread over all of them; None is every pair.
        progress: tells how many pairs are done.
        **options: as for `lens_from_corners`.
    """
    errors = []
    pairs = neighbours(board)
    for k, others in _left_out(len(views_left), most, progress, "calibrating without a pair"):
        left, right, _ = stereo_from_corners(
            [views_left[i] for i in others], [views_right[i] for i in others], board, shape, shape_right, **options
        )
        seen = np.isfinite(views_left[k]).all(axis=1) & np.isfinite(views_right[k]).all(axis=1)
        p_WQ = np.full((len(seen), 3), np.inf)
        for i in np.flatnonzero(seen):
            meeting = triangulate(left, right, views_left[k][i], views_right[k][i])
            if meeting is not None:
                p_WQ[i] = meeting.p_WQ
        usable = pairs[seen[pairs].all(axis=1)]
        if not len(usable) or not np.isfinite(p_WQ[seen]).all():
            errors.append(np.inf)
            continue
        sides = np.linalg.norm(p_WQ[usable[:, 0]] - p_WQ[usable[:, 1]], axis=1)
        errors.append(abs(sides.mean() / board.spacing - 1.0))
    return np.array(errors)


def left_out_reprojection(
    views: Sequence[np.ndarray],
    board: Board,
    shape: tuple[int, int],
    *,
    most: int | None = None,
    progress: Report | None = None,
    **options: Any,
) -> np.ndarray:
    """Returns the reprojection error of each image of a single camera that was left out, shape (m,) [px rms].

    Each image in turn is left out: the lens is calibrated from the other images, and only the pose of the board is
    estimated in the image left out. The result is empty when the rest is too few for a lens.

    Args:
        views: points (n, 2) [px] of the board in each image, NaN for hidden points.
        board: the board.
        shape: (h, w) of the images [px].
        most: number of images to leave out, spread over all of them; None is every image.
        progress: tells how many images are done.
        **options: as for `lens_from_corners`.
    """
    errors = []
    for k, others in _left_out(len(views), most, progress, "calibrating without an image"):
        camera = lens_from_corners([views[i] for i in others], board, shape, **options).camera(shape)
        found = camera.in_frame(board_pose(views[k], camera, board)).project(board.points())
        errors.append(float(np.sqrt(np.nanmean(((found - views[k]) ** 2).sum(axis=1)))))
    return np.array(errors)


def _left_out(count: int, most: int | None, progress: Report | None, what: str) -> Iterator[tuple[int, list[int]]]:
    """Yields (index that is left out, the others), and reports the progress."""
    if count - 1 < MIN_LENS_VIEWS:
        return
    chosen = np.unique(np.linspace(0, count - 1, min(most or count, count)).astype(int))
    for done, k in enumerate(chosen.tolist()):
        if progress is not None:
            progress(done, len(chosen), what)
        yield k, [i for i in range(count) if i != k]
