"""How well views of a board determine a lens: standard deviations from the curvature of the least-squares fit."""

from collections.abc import Sequence

import numpy as np
from scipy.optimize import least_squares

from drake_tracker.cameras.boards.board import Board
from drake_tracker.cameras.calibration.camera_calibration import Lens
from drake_tracker.cameras.calibration.relative_pose import sparsity, to_matrices, to_vectors
from drake_tracker.cameras.camera_model import CameraModel

_MATRIX = ([0, 1, 0, 1], [0, 1, 2, 2])
"""Where K has fx, fy, cx and cy."""


def lens_std(lens: Lens, views: Sequence[np.ndarray], board: Board) -> tuple[np.ndarray, np.ndarray]:
    """Returns the standard deviations of a lens, and the reprojection error of each view.

    The covariance is s^2 (J^T J)^-1, with J the derivative of all reprojection errors by the lens and the poses of the
    board, and s^2 their variance (Hartley and Zisserman 2004, result 5.9). It assumes errors of the points that are
    independent and alike.

    Args:
        lens: fitted to the views.
        views: points (n, 2) [px] of the board in each image, NaN for hidden ones.
        board: the board.

    Returns (std, rms): of fx, fy, cx and cy, shape (4,) [px], and of the views, shape (m,) [px].
    """
    free = np.flatnonzero(lens.distortion)
    count = 4 + len(free)
    seen = [np.isfinite(view).all(axis=1) for view in views]
    which = np.concatenate([np.full(each.sum(), k) for k, each in enumerate(seen)])
    p_BQ = np.concatenate([board.points()[each] for each in seen])
    pixels = np.concatenate([view[each] for view, each in zip(views, seen)])

    def residuals(x: np.ndarray) -> np.ndarray:
        K, distortion = np.eye(3), np.zeros(len(lens.distortion))
        K[_MATRIX] = x[:4]
        distortion[free] = x[4:count]
        X = to_matrices(x[count:].reshape(-1, 6))[which]
        p_CQ = np.einsum("nij,nj->ni", X[:, :3, :3], p_BQ) + X[:, :3, 3]
        camera = CameraModel(K, distortion, np.eye(4), 0, 0, lens.kind)
        return np.nan_to_num(camera.project(p_CQ) - pixels, nan=1e3).ravel()

    affects = sparsity(which, len(views), residuals=2, shared=count)
    start = np.concatenate([lens.K[_MATRIX], lens.distortion[free], to_vectors(lens.X_CB).ravel()])
    fit = least_squares(residuals, start, jac_sparsity=affects, max_nfev=1)
    J = fit.jac.toarray()
    scale = np.maximum(np.linalg.norm(J, axis=0), 1e-12)
    inverse = np.linalg.pinv((J / scale).T @ (J / scale))
    variance = (fit.fun**2).sum() / max(1, len(fit.fun) - len(start))
    std = np.sqrt(variance * np.diag(inverse)[:4]) / scale[:4]
    squares = (fit.fun.reshape(-1, 2) ** 2).sum(axis=1)
    return std, np.sqrt([squares[which == k].mean() for k in range(len(views))])
