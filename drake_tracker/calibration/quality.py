"""How good a calibration from photographs is, and which photographs to take again."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from drake_tracker.calibration.found_boards import FoundBoards, covered_cells
from drake_tracker.cameras.boards.board import Board
from drake_tracker.cameras.calibration.camera_calibration import Lens
from drake_tracker.cameras.calibration.stereo_calibration import sparsity, to_matrices, to_vectors
from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.cameras.triangulation import triangulate

_WORSE = 3.0
"""Multiple of the median error beyond which a photograph is taken again."""
_LEAST_ERROR = 0.5
"""Error up to which no photograph is taken again [px]."""
_MATRIX = ([0, 1, 0, 1], [0, 1, 2, 2])
"""Where K has fx, fy, cx and cy."""


@dataclass(frozen=True, eq=False)
class CameraQuality:
    """How good the calibration of one camera is.

    Attributes:
        lens: the calibrated lens.
        std: standard deviations of fx, fy, cx and cy, shape (4,) [px].
        view_rms: reprojection error of each photograph, shape (m,) [px].
        cells: which cells of the image the board covered, see `covered_cells`.
    """

    lens: Lens
    std: np.ndarray
    view_rms: np.ndarray
    cells: np.ndarray

    def describe(self, name: str) -> str:
        """Returns one line about the camera ``name``."""
        K, std = self.lens.K, self.std
        return (
            f"{name}: focal length {0.5 * (K[0, 0] + K[1, 1]):.1f} ± {std[:2].max():.1f} px, principal point "
            f"({K[0, 2]:.1f} ± {std[2]:.1f}, {K[1, 2]:.1f} ± {std[3]:.1f}) px; the board covered "
            f"{100 * self.cells.mean():.0f} % of the image"
        )

    def notes(self) -> dict[str, object]:
        """Returns the numbers for the calibration file."""
        return {
            "focal_length_std_px": np.round(self.std[:2], 3).tolist(),
            "principal_point_std_px": np.round(self.std[2:], 3).tolist(),
            "covered": round(float(self.cells.mean()), 3),
        }


def measure_quality(lenses: Sequence[Lens], boards: FoundBoards, board: Board) -> list[CameraQuality]:
    """Returns the quality of each camera.

    Args:
        lenses: of each camera, fitted to the boards.
        boards: the boards in the photographs.
        board: the board.
    """
    return [
        CameraQuality(lens, *lens_std(lens, views, board), covered_cells(views, shape))
        for lens, views, shape in zip(lenses, boards.views, boards.shapes)
    ]


def pair_rms(cameras: Mapping[str, CameraModel], boards: FoundBoards) -> np.ndarray:
    """Returns how far the triangulated points of each pair of photographs are from their pixels, shape (m,) [px rms].

    Args:
        cameras: the two calibrated cameras.
        boards: the boards in the pairs.
    """
    left, right = cameras.values()
    errors = []
    for views in zip(*boards.views):
        pairs = [pair for pair in zip(*views) if np.isfinite(pair).all()]
        meetings = [triangulate(left, right, *pair) for pair in pairs]
        points = np.array([np.full(3, np.nan) if meeting is None else meeting.p_WQ for meeting in meetings])
        misses = np.array([camera.project(points) for camera in (left, right)]) - np.swapaxes(pairs, 0, 1)
        squares = (misses**2).sum(axis=2)
        errors.append(float(np.sqrt(squares.mean())) if np.isfinite(squares).all() else np.inf)
    return np.array(errors)


def to_retake(boards: FoundBoards, qualities: Sequence[CameraQuality], pairs: np.ndarray) -> list[str]:
    """Returns one line for each photograph or pair that is much worse than the others.

    Args:
        boards: the boards in the photographs.
        qualities: of each camera.
        pairs: as from `pair_rms`, empty for a single camera.
    """
    lines = []
    for k, name in enumerate(boards.names):
        files = name.split(" and ")
        reasons = [
            f"in {file} the points are {_compare(quality.view_rms, k)}: it is blurred, or the board is bent"
            for file, quality in zip(files if len(files) == len(qualities) else [name] * 2, qualities)
            if _is_worse(quality.view_rms, k)
        ]
        if len(pairs) and not reasons and _is_worse(pairs, k):
            reasons.append(f"its images do not fit together, {_compare(pairs, k)}: the board moved between them")
        if reasons:
            lines.append(f"take {name} again: {'; '.join(reasons)}")
    return lines


def _is_worse(errors: np.ndarray, k: int) -> bool:
    return bool(errors[k] > max(_LEAST_ERROR, _WORSE * np.median(errors)))


def _compare(errors: np.ndarray, k: int) -> str:
    return f"{errors[k]:.1f} px off, elsewhere {np.median(errors):.1f} px"


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
