"""Leave-one-out cross-validation of a pair of calibrated cameras, with the chessboard's squares as the reference."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from drake_tracker.vision.calibration import MIN_LENS_VIEWS, stereo_from_corners
from drake_tracker.vision.chessboard import Chessboard
from drake_tracker.vision.triangulation import triangulate


def left_out_errors(
    views_left: Sequence[np.ndarray],
    views_right: Sequence[np.ndarray],
    board: Chessboard,
    shape: tuple[int, int],
    shape_right: tuple[int, int] | None = None,
    *,
    most: int | None = None,
    progress: Callable[[int, int, str], object] | None = None,
    **options: Any,
) -> np.ndarray:
    """Returns the relative error of the square's side for each pair of images that was left out, shape (m,).

    Each pair in turn is left out, the cameras are calibrated from the rest, its corners are triangulated, and the mean
    distance between neighbours is compared with the square's side. The result is empty when the rest is too few for a
    lens.

    Args:
        views_left: corners (n, 2) [px] of the board in the left image of each pair.
        views_right: corners (n, 2) [px] in the right images.
        board: the chessboard.
        shape: (h, w) of the left images [px].
        shape_right: (h, w) of the right images [px], if it differs.
        most: number of pairs to leave out, spread over all of them; None is every pair.
        progress: called with (number of pairs done, number of pairs, what is being done).
        **options: as for `lens_from_corners`.
    """
    count = len(views_left)
    if count - 1 < MIN_LENS_VIEWS:
        return np.zeros(0)
    errors = []
    chosen = np.unique(np.linspace(0, count - 1, min(most or count, count)).astype(int))
    for done, k in enumerate(chosen):
        if progress is not None:
            progress(done, len(chosen), "calibrating without a pair")
        others = [i for i in range(count) if i != k]
        left, right, _ = stereo_from_corners(
            [views_left[i] for i in others], [views_right[i] for i in others], board, shape, shape_right, **options
        )
        pairs = list(zip(views_left[k], views_right[k]))
        meetings = [meeting for uv in pairs if (meeting := triangulate(left, right, *uv)) is not None]
        if len(meetings) < len(pairs):
            errors.append(np.inf)
            continue
        grid = np.array([meeting.p_WQ for meeting in meetings]).reshape(board.rows, board.columns, 3)
        sides = np.concatenate([np.linalg.norm(np.diff(grid, axis=axis), axis=2).ravel() for axis in (0, 1)])
        errors.append(abs(sides.mean() / board.square - 1.0))
    return np.array(errors)
