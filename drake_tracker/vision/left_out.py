"""How good a pair of calibrated cameras is, without anything else to compare it with: squares of pairs left out."""

import numpy as np

from drake_tracker.vision.calibration import MIN_LENS_VIEWS, stereo_from_corners
from drake_tracker.vision.triangulation import triangulate


def left_out_errors(views_left, views_right, board, shape, shape_right=None, *, most=None, progress=None, **options):
    """Returns by what share of a square's side the squares of each pair that was left out come out wrong, (m,).

    One pair after the other is left out, the cameras are calibrated from the rest, its corners are triangulated, and
    the mean distance between neighbours is compared with the square's side. Nothing is returned when the rest is too
    few for a lens.

    Args:
        views_left, views_right: corners (n, 2) [px] of the board in each pair. board: `Chessboard`.
        shape, shape_right, options: as for `stereo_from_corners`.
        most: pairs to leave out, spread over all of them; None is every one.
        progress: called with (pairs left out so far, of how many, what is done).
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
        meetings = [triangulate(left, right, *uv) for uv in zip(views_left[k], views_right[k])]
        if any(meeting is None for meeting in meetings):
            errors.append(np.inf)
            continue
        grid = np.array([meeting.p_WQ for meeting in meetings]).reshape(board.rows, board.columns, 3)
        sides = np.concatenate([np.linalg.norm(np.diff(grid, axis=axis), axis=2).ravel() for axis in (0, 1)])
        errors.append(abs(sides.mean() / board.square - 1.0))
    return np.array(errors)
