"""Calibrates your own cameras from photographs of a chessboard, and reports the accuracy of the result."""

import dataclasses
import re
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np

from drake_tracker.calibration.found_boards import FoundBoards, find_boards, list_photographs
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.progress import StepsProgress
from drake_tracker.vision.calibration import board_pose, lens_from_corners, stereo_from_corners
from drake_tracker.vision.calibration_file import save_calibration
from drake_tracker.vision.camera_model import CameraModel
from drake_tracker.vision.chessboard import Chessboard
from drake_tracker.vision.left_out import left_out_errors

WORST_RMS = 3.0
"""Largest reprojection error [px] of a lens; beyond it the board is a different one, or the pairs are mixed up."""
LEAST_SPREAD = np.radians(15.0)
"""Least angle between the boards of two photographs; boards at similar angles do not determine a lens."""
LEAST_BASELINE = 0.2
"""Least distance between two cameras, in squares of the board."""
LARGEST_SQUARE = 1.0
"""Largest side of a square [m]; a larger number is probably in millimetres."""
MOST_LEFT_OUT = 20
"""Number of pairs that are left out in turn to estimate the accuracy."""
LENS_OPTIONS: dict[str, Any] = {
    "fix_principal_point": False,
    "fix_aspect_ratio": False,
    "radial_terms": 2,
    "tangential": True,
}
"""Parameters of a real lens that are estimated besides its focal length, as for `lens_from_corners`."""
X_BP = np.diag([1.0, -1.0, -1.0, 1.0])
"""Takes p_PQ to p_BQ: P is the plane of the board with z towards the viewer, B the frame of `Chessboard`."""


def parse_board(text: str, square: float | None) -> Chessboard:
    """Returns the chessboard that the command line describes.

    Args:
        text: number of inner corners, for example "9x6".
        square: side of a square [m].

    Raises DrakeTrackerError when either is missing or wrong.
    """
    match = re.fullmatch(r"(\d{1,3})x(\d{1,3})", text)
    if not match:
        raise DrakeTrackerError(f"--board {text}: give the inner corners as COLUMNSxROWS, for example 9x6")
    if square is None:
        raise DrakeTrackerError("--square is missing: the side of one square of the board [m], for example 0.025")
    if not 1e-4 <= square <= LARGEST_SQUARE:
        raise DrakeTrackerError(f"--square {square:g}: the side of a square must lie in 0.0001..{LARGEST_SQUARE:g} m")
    return Chessboard(int(match[1]), int(match[2]), square)


def calibrate_photographs(
    specs: Sequence[str], board: Chessboard, path: str | Path, *, world: bool = False
) -> dict[str, CameraModel]:
    """Calibrates one camera or two from photographs, prints the errors, and writes the calibration file.

    Args:
        specs: for each camera a folder or a pattern of images; the images of two cameras are paired in their order.
        board: the chessboard.
        path: of the file to write.
        world: True: W is P, the plane of the board in the first photograph in which it was found: origin at the board's
            first inner corner, x along its columns, z towards the camera. Otherwise W is the frame of the (left)
            camera, x right, y down, z forward.

    Returns {name: CameraModel}: camera_left and camera_right, or camera_left for a single camera. Raises
    DrakeTrackerError, in one line, when images cannot be read or paired, when too few show the board, and when the
    board cannot be the one that was described.
    """
    if not Path(path).absolute().parent.is_dir():
        raise DrakeTrackerError(f"-o {path}: there is no folder {Path(path).parent}")
    if Path(path).is_dir():
        raise DrakeTrackerError(f"-o {path}: is a folder; name a file")
    rows = list_photographs(specs)
    with closing(StepsProgress()) as progress:
        boards = find_boards(rows, board, progress)
    check_spread(specs, boards, board)
    cameras, rms = calibrate_one(boards, board) if len(specs) == 1 else calibrate_pair(boards, board)
    if not rms <= WORST_RMS:
        raise DrakeTrackerError(
            f"the reprojection error is {rms:.1f} px, too large for any lens: either the board does not have "
            f"{board.columns} x {board.rows} inner corners, or the images of a pair were not taken at the same time"
        )
    errors = pair_errors(specs, boards, board, cameras["camera_right"]) if len(specs) == 2 else {}
    X_WP = board_pose(boards.views[0][0], cameras["camera_left"], board) @ X_BP
    if world:
        cameras = {name: dataclasses.replace(camera, X_CW=camera.X_CW @ X_WP) for name, camera in cameras.items()}
        X_WP = np.eye(4)
    notes = {
        "board": dataclasses.asdict(board),
        "world": "board" if world else "camera_left",
        "X_WP": np.round(X_WP, 9).tolist(),
        "X_WP_from": boards.names[0],
        "reprojection_rms_px": round(float(rms), 4),
        "error": {name: round(value, 6) for name, value in errors.items()},
    }
    save_calibration(path, cameras, notes=notes)
    print(f"wrote {path}")
    return cameras


def check_spread(specs: Sequence[str], boards: FoundBoards, board: Chessboard) -> None:
    """Raises DrakeTrackerError when the board is held at similar angles in all photographs of a camera."""
    for spec, views, shape in zip(specs, boards.views, boards.shapes):
        spread = lens_from_corners(views, board, shape, **LENS_OPTIONS).spread
        if spread < LEAST_SPREAD:
            raise DrakeTrackerError(
                f"{spec}: the board is held at the same angle in all images, within {np.degrees(spread):.0f} deg; take "
                "photographs of it tilted to all sides, by 20 deg and more"
            )


def calibrate_one(boards: FoundBoards, board: Chessboard) -> tuple[dict[str, CameraModel], float]:
    """Returns ({"camera_left": CameraModel}, reprojection error [px]) of a single camera, and prints the error."""
    (views,), (shape,) = boards.views, boards.shapes
    lens = lens_from_corners(views, board, shape, **LENS_OPTIONS)
    print(f"lens: reprojection {lens.rms:.3f} px rms ({len(views)} images)")
    return {"camera_left": CameraModel(lens.K, lens.distortion, np.eye(4), *shape[::-1])}, lens.rms


def calibrate_pair(boards: FoundBoards, board: Chessboard) -> tuple[dict[str, CameraModel], float]:
    """Returns ({name: CameraModel}, reprojection error [px]) of two cameras, and prints the error."""
    (views_left, views_right), (shape_left, shape_right) = boards.views, boards.shapes
    left, right, rms = stereo_from_corners(views_left, views_right, board, shape_left, shape_right, **LENS_OPTIONS)
    print(f"both cameras: reprojection {rms:.3f} px rms ({len(boards.names)} pairs)")
    return {"camera_left": left, "camera_right": right}, rms


def pair_errors(specs: Sequence[str], boards: FoundBoards, board: Chessboard, right: CameraModel) -> dict[str, float]:
    """Returns the relative errors of a square in pairs that were left out of the calibration, and prints them.

    Args:
        specs: the images of both cameras, for messages.
        boards: the boards in the pairs.
        board: the chessboard.
        right: the calibrated right camera, in the frame of the left.

    Returns {"square_left_out_mean": ..., "square_left_out_worst": ...}, empty when there are too few pairs. Raises
    DrakeTrackerError when both cameras are at the same place.
    """
    baseline = np.linalg.norm(right.X_WC[:3, 3])
    if baseline < LEAST_BASELINE * board.square:
        raise DrakeTrackerError(f"{specs[0]} and {specs[1]}: both cameras are at the same place; are they two cameras?")
    print(f"distance between the cameras: {baseline:.4g} m")
    (views_left, views_right), (shape_left, shape_right) = boards.views, boards.shapes
    with closing(StepsProgress()) as progress:
        errors = left_out_errors(
            views_left,
            views_right,
            board,
            shape_left,
            shape_right,
            most=MOST_LEFT_OUT,
            progress=progress,
            **LENS_OPTIONS,
        )
    if not len(errors):
        return {}
    print(
        f"relative error of a square in a pair that was left out: {100 * errors.mean():.2f} % on average, "
        f"{100 * errors.max():.2f} % at worst"
    )
    return {"square_left_out_mean": float(errors.mean()), "square_left_out_worst": float(errors.max())}
