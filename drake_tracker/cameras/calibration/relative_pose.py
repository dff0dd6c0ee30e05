"""The pose of one camera relative to another from views of one board, for every lens."""

from collections.abc import Sequence

import cv2
import numpy as np
from scipy.optimize import least_squares
from scipy.sparse import csr_matrix

from drake_tracker.cameras.boards.board import Board
from drake_tracker.cameras.camera_model import CameraModel


def fit_relative_pose(
    cameras: Sequence[CameraModel], pairs: Sequence[Sequence[np.ndarray]], board: Board, X_LB: np.ndarray
) -> tuple[np.ndarray, float]:
    """Returns (X_RL, rms): the pose that best explains the points of a board in pairs of images.

    The sum of squares of all reprojection errors is minimised over X_RL and the board's pose in each pair; the lenses
    are kept.

    Args:
        cameras: the left camera, in its own frame, and the right one, near its pose.
        pairs: for both cameras the points (n, 2) [px] in each image, NaN for hidden ones; the same ones in both.
        board: the board.
        X_LB: near poses of the board in the frame of the left camera, shape (m, 4, 4) [m].

    Returns the matrix (4, 4) that takes p_LQ to p_RQ [m], and the reprojection error of both cameras [px].
    """
    seen = [np.isfinite(view).all(axis=1) for view in pairs[0]]
    which = np.concatenate([np.full(each.sum(), k) for k, each in enumerate(seen)])
    p_BQ = np.concatenate([board.points()[each] for each in seen])
    pixels = [np.concatenate([view[each] for view, each in zip(views, seen)]) for views in pairs]

    def residuals(x: np.ndarray) -> np.ndarray:
        poses = to_matrices(x.reshape(-1, 6))
        X = poses[1:][which]
        p_LQ = np.einsum("nij,nj->ni", X[:, :3, :3], p_BQ) + X[:, :3, 3]
        right = cameras[1].in_frame(cameras[1].X_WC @ poses[0])
        misses = [camera.project(p_LQ) - uv for camera, uv in zip((cameras[0], right), pixels)]
        return np.nan_to_num(np.concatenate(misses, axis=1), nan=1e3).ravel()

    affects = sparsity(which, len(X_LB), residuals=4, shared=6)
    start = to_vectors(np.concatenate([[cameras[1].X_CW], X_LB])).ravel()
    fit = least_squares(residuals, start, jac_sparsity=affects, x_scale="jac")
    rms = float(np.sqrt((fit.fun**2).sum() / (2 * len(which))))
    return to_matrices(fit.x[np.newaxis, :6])[0], rms


def sparsity(which: np.ndarray, views: int, *, residuals: int, shared: int) -> csr_matrix:
    """Returns which residuals depend on which parameters: on those that all views share, and on the pose of their view.

    Args:
        which: the view of each point, shape (n,).
        views: number of views.
        residuals: number of residuals of a point.
        shared: number of parameters that all views share; six for each view follow them.
    """
    own = np.kron(which[:, np.newaxis] == np.arange(views), np.ones((residuals, 6), dtype=bool))
    return csr_matrix(np.hstack([np.ones((len(own), shared), dtype=bool), own]).astype(int))


def to_vectors(X: np.ndarray) -> np.ndarray:
    """Returns poses (m, 4, 4) as rotation vectors and positions, shape (m, 6)."""
    return np.array([np.concatenate([cv2.Rodrigues(each[:3, :3])[0].ravel(), each[:3, 3]]) for each in X])


def to_matrices(vectors: np.ndarray) -> np.ndarray:
    """Returns poses from rotation vectors and positions (m, 6), shape (m, 4, 4)."""
    X = np.tile(np.eye(4), (len(vectors), 1, 1))
    X[:, :3, :3] = [cv2.Rodrigues(each[:3])[0] for each in vectors]
    X[:, :3, 3] = vectors[:, 3:]
    return X
