"""Calibrates your own cameras from photographs of a board, and reports the accuracy of the result."""

import dataclasses
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np

from drake_tracker.calibration.found_boards import (
    LEAST_VIEWS,
    FoundBoards,
    check_coverage,
    find_boards,
    list_photographs,
)
from drake_tracker.calibration.quality import draw_quality, measure_quality, pair_rms, to_retake, two_groups
from drake_tracker.cameras.boards.board import Board
from drake_tracker.cameras.boards.board_kinds import kind_of
from drake_tracker.cameras.calibration.camera_calibration import Lens, board_pose, lens_from_corners
from drake_tracker.cameras.calibration.leave_one_out import left_out_errors, left_out_reprojection
from drake_tracker.cameras.calibration.stereo_calibration import relative_pose
from drake_tracker.cameras.calibration.stereo_pose_consensus import agree, upright
from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.cameras.files.calibration_file import save_calibration
from drake_tracker.cameras.files.camera_files import KALIBR, OWN, save_foreign
from drake_tracker.cameras.lens_models import FISHEYE, PINHOLE
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.progress import StepsProgress

WORST_RMS = 3.0
"""Largest reprojection error [px] of a lens; beyond it the board is a different one, or the pairs are mixed up."""
LEAST_SPREAD = np.radians(15.0)
"""Least angle between the boards of two photographs; boards at similar angles do not determine a lens."""
LEAST_BASELINE = 0.2
"""Least distance between two cameras, in squares of the board."""
BASELINE_TOLERANCE = 0.1
"""Largest relative difference between the distance of the cameras that was measured and the calibrated one."""
MOST_LEFT_OUT = 20
"""Number of pairs that are left out in turn to estimate the accuracy."""
_REAL: dict[str, Any] = {"fix_principal_point": False, "fix_aspect_ratio": False, "tangential": True}
LENSES: dict[str, dict[str, Any]] = {
    PINHOLE: {**_REAL, "radial_terms": 2},
    "rational": {**_REAL, "radial_terms": 3, "rational": True},
    FISHEYE: {"kind": FISHEYE},
}
"""Parameters of a real lens that are estimated besides its focal length, as for `lens_from_corners`."""
X_BP = np.diag([1.0, -1.0, -1.0, 1.0])
"""Takes p_PQ to p_BQ: P is the plane of the board with z towards the viewer, B the frame of the board."""


def calibrate_photographs(
    specs: Sequence[str],
    board: Board,
    path: str | Path,
    *,
    world: bool = False,
    lens: str = PINHOLE,
    baseline: float | None = None,
    form: str = OWN,
) -> dict[str, CameraModel]:
    """Calibrates one camera or two from photographs, prints the errors, and writes the calibration file and a picture.

    Args:
        specs: for each camera a folder or a pattern of images; the images of two cameras are paired in their order.
        board: the board.
        path: of the file to write; the picture gets the same name with the suffix .png.
        world: True: W is P, the plane of the board in the first photograph in which it was found: origin at the board's
            first point, x along its columns, z towards the camera. Otherwise W is the frame of the (left) camera, x
            right, y down, z forward.
        lens: one of `LENSES`.
        baseline: distance between two cameras that was measured, to check the size of the board [m].
        form: one of `FORMATS`; only the package's own contains the world frame, the errors and the plane of the board.

    Returns {name: CameraModel}: camera_left and camera_right, or camera_left for a single camera. Raises
    DrakeTrackerError, in one line, when images cannot be read or paired, when too few show the board, and when they do
    not determine the cameras.
    """
    path = Path(path)
    if not path.absolute().parent.is_dir():
        raise DrakeTrackerError(f"-o {path}: there is no folder {path.parent}")
    if path.is_dir():
        raise DrakeTrackerError(f"-o {path}: is a folder; name a file")
    if path.suffix.lower() == ".png":
        raise DrakeTrackerError(f"-o {path}: the suffix .png is for the picture; name the file {path.stem}.yaml")
    if world and form != OWN:
        raise DrakeTrackerError(f"--world: the format {form} has no world frame; leave it out")
    if form == KALIBR and lens == "rational":
        raise DrakeTrackerError("--format kalibr: Kalibr has no rational lens; take --lens pinhole or fisheye")
    rows, options = list_photographs(specs), LENSES[lens]
    with closing(StepsProgress()) as progress:
        boards = find_boards(rows, board, progress)
    boards = dataclasses.replace(boards, views=[tuple(upright(view, board) for view in each) for each in boards.views])
    lenses = fit_lenses(specs, boards, board, options)
    dropped: list[str] = []
    if len(specs) == 2:
        boards, dropped = keep_agreeing(specs, boards, lenses, board)
        if dropped:
            lenses = fit_lenses(specs, boards, board, options)
    cameras, rms = place_cameras(boards, lenses, board)
    if not rms <= WORST_RMS:
        raise DrakeTrackerError(
            f"the reprojection error is {rms:.1f} px, too large for any lens: either the board is not the "
            f"{board.name}, or the images of a pair were not taken at the same time"
        )
    if len(specs) == 2:
        check_baseline(specs, cameras, board, baseline)
    qualities = measure_quality(lenses, boards, board)
    for name, quality in zip(cameras, qualities):
        print(quality.describe(name))
    errors = cross_validate(boards, board, options)
    pairs = pair_rms(cameras, boards) if len(specs) == 2 else np.zeros(0)
    retake = dropped + to_retake(boards, qualities, pairs)
    for k, each in enumerate(lenses):
        groups = two_groups(each, boards, k, board, options)
        retake += [] if groups is None else [f"{specs[k]}: {groups}"]
    print("\n".join(retake), end="\n" if retake else "")
    X_WP = board_pose(boards.views[0][0], cameras["camera_left"], board) @ X_BP
    if world:
        cameras = {name: camera.in_frame(X_WP) for name, camera in cameras.items()}
        X_WP = np.eye(4)
    notes = {
        "board": {"kind": kind_of(board), **dataclasses.asdict(board)},  # type: ignore[call-overload]
        "world": "board" if world else "camera_left",
        "X_WP": np.round(X_WP, 9).tolist(),
        "X_WP_from": boards.names[0],
        "reprojection_rms_px": round(float(rms), 4),
        "error": {name: round(value, 6) for name, value in errors.items()},
        "quality": {name: quality.notes() for name, quality in zip(cameras, qualities)},
        "retake": retake,
    }
    if form == OWN:
        save_calibration(path, cameras, notes=notes)
    written = [path] if form == OWN else save_foreign(path, cameras, form)
    picture = path.with_suffix(".png")
    draw_quality(picture, boards, dict(zip(cameras, qualities)), pairs)
    for file in (*written, picture):
        print(f"wrote {file}")
    return cameras


def fit_lenses(specs: Sequence[str], boards: FoundBoards, board: Board, options: dict[str, Any]) -> list[Lens]:
    """Returns the lens of each camera.

    Raises DrakeTrackerError when the photographs of a camera do not determine it: the board is in one part of the image
    only or at similar angles, or no lens fits.
    """
    lenses = []
    for spec, views, shape in zip(specs, boards.views, boards.shapes):
        check_coverage(spec, views, shape)
        lens = lens_from_corners(views, board, shape, **options)
        if lens.spread < LEAST_SPREAD:
            raise DrakeTrackerError(
                f"{spec}: the board is held at the same angle in all images, within {np.degrees(lens.spread):.0f} deg; "
                "take photographs of it tilted to all sides, by 20 deg and more"
            )
        if not lens.rms <= WORST_RMS:
            raise DrakeTrackerError(
                f"{spec}: the reprojection error is {lens.rms:.1f} px, too large for any lens; is the board the "
                f"{board.name}?"
            )
        lenses.append(lens)
    return lenses


def keep_agreeing(
    specs: Sequence[str], boards: FoundBoards, lenses: Sequence[Lens], board: Board
) -> tuple[FoundBoards, list[str]]:
    """Returns (the pairs that agree on how the cameras stand, one line for each other pair).

    Raises DrakeTrackerError when too few pairs agree.
    """
    alone = [lens.camera(shape) for lens, shape in zip(lenses, boards.shapes)]
    views_left, views_right = boards.views
    agreement = agree(views_left, views_right, alone, board)
    kept = np.flatnonzero(agreement.agrees)
    if len(kept) < max(LEAST_VIEWS, len(agreement.agrees) // 2 + 1):
        raise DrakeTrackerError(
            f"{specs[0]} and {specs[1]}: only {len(kept)} of {len(agreement.agrees)} pairs agree on how the cameras "
            "stand; were both images of a pair taken at the same time, and are they in the same order?"
        )
    lines = [
        f"take {name} again: in it the cameras stand differently, by {np.degrees(angle):.0f} deg; its images were not "
        "taken at the same time, or belong to different pairs"
        for name, angle, agrees in zip(boards.names, agreement.angles, agreement.agrees)
        if not agrees
    ]
    views = [tuple(each[k] for k in kept) for each in (views_left, agreement.views_right)]
    return FoundBoards([boards.names[k] for k in kept], views, boards.shapes), lines


def place_cameras(boards: FoundBoards, lenses: Sequence[Lens], board: Board) -> tuple[dict[str, CameraModel], float]:
    """Returns ({name: CameraModel} in the frame of the left camera, reprojection error [px]), and prints the error."""
    count = len(boards.names)
    if len(lenses) == 1:
        print(f"lens: reprojection {lenses[0].rms:.3f} px rms ({count} images)")
        return {"camera_left": lenses[0].camera(boards.shapes[0])}, lenses[0].rms
    left, right = lenses
    (views_left, views_right), (shape, shape_right) = boards.views, boards.shapes
    X_RL, rms = relative_pose(left, right, views_left, views_right, board, shape, shape_right)
    print(f"both cameras: reprojection {rms:.3f} px rms ({count} pairs)")
    return {"camera_left": left.camera(shape), "camera_right": right.camera(shape_right, X_RL)}, rms


def check_baseline(specs: Sequence[str], cameras: dict[str, CameraModel], board: Board, measured: float | None) -> None:
    """Prints the distance between two cameras.

    Raises DrakeTrackerError when the value is no number, or contradicts the measurement.
    """
    p_LR = cameras["camera_right"].X_WC[:3, 3]
    baseline = float(np.linalg.norm(p_LR))
    if baseline < LEAST_BASELINE * board.square:
        raise DrakeTrackerError(f"{specs[0]} and {specs[1]}: both cameras are at the same place; are they two cameras?")
    if measured is not None and abs(baseline / measured - 1.0) > BASELINE_TOLERANCE:
        raise DrakeTrackerError(
            f"--baseline {measured:g}: the cameras are {baseline:.4g} m apart with --square {board.square:g}; measure "
            f"the board again, at this distance its square would be {board.square * measured / baseline:.4g} m"
        )
    print(f"distance between the cameras: {baseline:#.4g} m")
    if -p_LR[0] > 0.5 * baseline:
        print("the second camera is on the left of the first one: if you name the left one first, exchange them")


def cross_validate(boards: FoundBoards, board: Board, options: dict[str, Any]) -> dict[str, float]:
    """Returns the errors in photographs that were left out of the calibration, and prints them.

    Returns {"square_left_out_mean": ..., "square_left_out_worst": ...}, relative errors of a square, for two cameras,
    {"reprojection_left_out_px": ...} for one, and nothing when there are too few photographs.
    """
    with closing(StepsProgress()) as progress:
        if len(boards.views) == 1:
            errors = left_out_reprojection(
                boards.views[0], board, boards.shapes[0], most=MOST_LEFT_OUT, progress=progress, **options
            )
        else:
            left, right = boards.views
            shape, shape_right = boards.shapes
            errors = left_out_errors(
                left, right, board, shape, shape_right, most=MOST_LEFT_OUT, progress=progress, **options
            )
    if not len(errors):
        return {}
    if len(boards.views) == 1:
        rms = float(np.sqrt((errors**2).mean()))
        print(f"reprojection in an image that was left out: {rms:.3f} px rms")
        return {"reprojection_left_out_px": rms}
    print(
        f"relative error of a square in a pair that was left out: {100 * errors.mean():.2f} % on average, "
        f"{100 * errors.max():.2f} % at worst"
    )
    return {"square_left_out_mean": float(errors.mean()), "square_left_out_worst": float(errors.max())}
