"""How good a calibration from photographs is, which photographs to take again, and the picture of both."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from scipy.optimize import least_squares

from drake_tracker.calibration.found_boards import CELLS, FoundBoards, ImageShape, covered_cells
from drake_tracker.cameras.boards.board import Board
from drake_tracker.cameras.calibration.camera_calibration import Lens, board_pose, lens_from_corners
from drake_tracker.cameras.calibration.stereo_calibration import sparsity, to_matrices, to_vectors
from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.cameras.triangulation import triangulate
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.files.atomic_file import replacing
from drake_tracker.tasks.style import FILTERED, PLOT_STYLE, PREDICTED, SEEN, SOFT_INK

_WORSE = 3.0
"""Multiple of the median error beyond which a photograph is taken again."""
_LEAST_ERROR = 0.5
"""Error up to which no photograph is taken again [px]."""
_STARTS, _ROUNDS, _LEAST_GROUP = 4, 8, 3
"""Divisions of the photographs that are tried first, rounds that improve each, and photographs of the smaller group."""
_TOGETHER, _APART = 1.12, 5.0
"""Two groups have lenses of their own if all photographs together have this many times their error, and the lenses
differ by this many standard deviations. Photographs of one real lens that are divided for the best have 1.08 times."""
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
    """Returns the quality of each camera."""
    return [
        CameraQuality(lens, *lens_std(lens, views, board), covered_cells(views, shape))
        for lens, views, shape in zip(lenses, boards.views, boards.shapes)
    ]


def pair_rms(cameras: Mapping[str, CameraModel], boards: FoundBoards) -> np.ndarray:
    """Returns how far the triangulated points of each pair of photographs are from their pixels [px rms], (m,)."""
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


def two_groups(lens: Lens, boards: FoundBoards, camera: int, board: Board, options: Mapping[str, Any]) -> str | None:
    """Returns one line if the photographs of a camera fall into two groups with lenses of their own, else None.

    Some were turned by half a turn, or taken with another zoom, focus or camera. Starting from random halves, each
    photograph joins the group whose lens fits it better, until nothing changes.

    Args:
        lens: fitted to all photographs.
        boards: the boards in the photographs.
        camera: index of the camera.
        board: the board.
        options: as for `lens_from_corners`.
    """
    views, shape = boards.views[camera], boards.shapes[camera]
    best, error, found = None, lens.rms / _TOGETHER, 0.0
    for seed in range(_STARTS):
        first, after = None, np.random.default_rng(seed).permutation(len(views)) < len(views) // 2
        for _ in range(_ROUNDS):
            if (after == first).all() or min(after.sum(), (~after).sum()) < _LEAST_GROUP:
                break
            first = after
            parts = [[view for view, member in zip(views, members) if member] for members in (first, ~first)]
            try:
                lenses = [lens_from_corners(part, board, shape, **options) for part in parts]
                errors = np.array([[_rms(view, each, shape, board) for view in views] for each in lenses])
            except (DrakeTrackerError, cv2.error):  # too few photographs for a lens, or one that it cannot have taken
                break
            after = errors[0] < errors[1]
            found = float(np.sqrt(np.mean(np.where(first, *(each.rms**2 for each in lenses)))))
            if found < error:
                best, error = (first, lenses, parts), found
    if best is None:
        return None
    first, lenses, parts = best
    std = np.hypot(*(lens_std(each, part, board)[0] for each, part in zip(lenses, parts)))
    if (np.abs(lenses[0].K - lenses[1].K)[_MATRIX] / std).max() < _APART:
        return None
    fewer = np.flatnonzero(first if first.sum() <= len(first) / 2 else ~first)
    names = [name.split(" and ")[camera] if len(boards.views) > 1 else name for name in boards.names]
    others = f" and {len(fewer) - 4} others" if len(fewer) > 4 else ""
    return (
        f"the photographs fall into two groups: {', '.join(names[k] for k in fewer[:4])}{others} fit one lens, the "
        f"rest fits another ({error:.2f} px, together {lens.rms:.2f} px); some were turned by half a turn, or taken "
        "with another zoom, focus or camera"
    )


def _rms(view: np.ndarray, lens: Lens, shape: ImageShape, board: Board) -> float:
    """Returns the reprojection error of a photograph with a lens [px]."""
    camera = lens.camera(shape)
    X_CB = board_pose(view, camera, board)
    pixels = camera.project(board.points() @ X_CB[:3, :3].T + X_CB[:3, 3])
    return float(np.sqrt(np.nanmean(((pixels - view) ** 2).sum(axis=1))))


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


_EMPTY = "#f3d9d2"
"""Colour of the cells of an image in which the board never was."""


def draw_quality(path: Path, boards: FoundBoards, qualities: Mapping[str, CameraQuality], pairs: np.ndarray) -> None:
    """Draws the quality of a calibration as a picture of 2400 x 1350 px.

    Args:
        path: PNG file to write.
        boards: the boards in the photographs.
        qualities: of each camera, by its name.
        pairs: error of each pair, as from `quality.pair_rms`; empty for a single camera.
    """
    with matplotlib.rc_context(PLOT_STYLE):
        figure = Figure(figsize=(16, 9), facecolor="white")
        FigureCanvasAgg(figure)
        columns = figure.add_gridspec(1, len(qualities), left=0.05, right=0.97, top=0.84, bottom=0.40)
        for k, (name, quality) in enumerate(qualities.items()):
            ax = figure.add_subplot(columns[k])
            _draw_image(ax, boards.views[k], boards.shapes[k], quality.cells)
            ax.set_title(f"{name}: the board covered {100 * quality.cells.mean():.0f} % of the image")
            K, std = quality.lens.K, quality.std
            ax.set_xlabel(
                f"focal length {0.5 * (K[0, 0] + K[1, 1]):.1f} ± {std[:2].max():.1f} px, principal point "
                f"({K[0, 2]:.1f} ± {std[2]:.1f}, {K[1, 2]:.1f} ± {std[3]:.1f}) px"
            )
        ax = figure.add_axes((0.05, 0.10, 0.92, 0.17))
        _draw_errors(ax, boards, qualities, pairs)
        figure.text(0.05, 0.945, "Calibration", fontsize=17, weight="bold", va="center")
        figure.text(
            0.05,
            0.91,
            "One colour for each photograph; in the red cells there was no board: take more photographs there",
            color=SOFT_INK,
            fontsize=12,
            va="center",
        )
        with replacing(path) as beside:
            figure.savefig(beside, dpi=150, format="png")


def _draw_image(ax: Axes, views: tuple[np.ndarray, ...], shape: ImageShape, cells: np.ndarray) -> None:
    """Draws all points of the board in the images of one camera, and the cells without any."""
    height, width = shape
    for row, column in np.argwhere(~cells):
        u, v = column * width / CELLS[1] - 0.5, row * height / CELLS[0] - 0.5
        ax.add_patch(Rectangle((u, v), width / CELLS[1], height / CELLS[0], color=_EMPTY, lw=0))
    colours = matplotlib.colormaps["turbo"](np.linspace(0.05, 0.95, len(views)))
    for view, colour in zip(views, colours):
        ax.plot(*view.T, ".", color=colour, markersize=3)
    ax.set_xlim(-0.5, width - 0.5)
    ax.set_ylim(height - 0.5, -0.5)
    ax.set_aspect("equal")
    for spine in ax.spines.values():
        spine.set_visible(True)


def _draw_errors(ax: Axes, boards: FoundBoards, qualities: Mapping[str, CameraQuality], pairs: np.ndarray) -> None:
    """Draws the errors of each photograph or pair as bars."""
    bars = {name: quality.view_rms for name, quality in qualities.items()}
    if len(pairs):
        bars["points triangulated from both"] = pairs
    width = 0.8 / len(bars)
    for k, ((name, errors), colour) in enumerate(zip(bars.items(), (SEEN, FILTERED, PREDICTED))):
        ax.bar(np.arange(len(errors)) + (k - 0.5 * (len(bars) - 1)) * width, errors, width, color=colour, label=name)
    names = [name.split(" and ")[0] for name in boards.names]
    ax.set_xticks(np.arange(len(names)), [Path(name).stem[-12:] for name in names], rotation=60, fontsize=9)
    ax.set_ylabel("error  [px rms]")
    ax.set_title("Errors of each photograph")
    ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.02), frameon=False, ncols=3, fontsize=10)
