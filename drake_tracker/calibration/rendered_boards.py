"""Calibrates a scenario's cameras from rendered images of a chessboard, and reports the accuracy of the result."""

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.math import RigidTransform

from drake_tracker.cameras.boards.chessboard import Chessboard
from drake_tracker.cameras.calibration.camera_calibration import calibrate_intrinsics, locate_camera
from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.cameras.files.calibration_file import save_calibration
from drake_tracker.cameras.triangulation import triangulate
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.system_check import require_renderer
from drake_tracker.tasks import scenario_file
from drake_tracker.tasks.registry import task_of
from drake_tracker.tasks.task import CalibrationPlace
from drake_tracker.world.config import CamerasConfig, LightingConfig
from drake_tracker.world.imaging.calibration_board import BOARD_THICKNESS, CalibrationScene, held_pose, lying_pose
from drake_tracker.world.imaging.cameras import CAMERA_NAMES, camera_poses, describe_rig, true_camera_models

LENS_VIEWS = 16
"""Views of the held board from which a lens is calibrated."""
LYING_YAWS = (0.0, np.pi / 2)
"""Rotations [rad] of the board on the table, from which a camera is located."""
_SQUARE_OF_FIELD = 0.06
"""Side of a square as a fraction of the width of the cameras' field."""
_TILT, _ROLL = 0.6, 0.3
"""Largest tilt and roll of the held board [rad]."""

Volume = Sequence[Sequence[float]]
"""Lowest and highest corner (3,) [m, W] of a box."""


@dataclasses.dataclass(frozen=True)
class CameraCalibration:
    """The calibration of one camera.

    Attributes:
        model: the calibrated camera.
        lens_rms: reprojection error of the views of the held board [px rms].
        place_rms: reprojection error of the views of the lying board [px rms].
    """

    model: CameraModel
    lens_rms: float
    place_rms: float


def calibrate(scenario: Any, path: str | Path | None = None) -> dict[str, CameraModel]:
    """Calibrates the cameras of a scenario, prints the errors, and writes the calibration file.

    Args:
        scenario: of a task with two fixed cameras.
        path: of the file to write; None for the file that the scenario names.

    Returns {name: CameraModel}. Raises DrakeTrackerError for another task, for cameras that do not see the work volume,
    and without a renderer.
    """
    place = task_of(scenario).calibration_place(scenario)
    if place is None:
        raise DrakeTrackerError(
            f"{scenario.name or scenario.task}: this needs a scenario with two fixed cameras; with the ball, each run "
            "finds the board in its image"
        )
    cameras, truth = scenario.cameras, true_camera_models(scenario.cameras)
    path = Path(path or scenario_file(cameras.calibration))
    check_request(scenario, place, path, truth)
    board = board_for(cameras)
    results = calibrate_cameras(cameras, scenario.lighting, table_height=place.height, board=board)
    models = {name: result.model for name, result in results.items()}
    errors = calibration_error(models, truth, place.volume)
    for name, result in results.items():
        print(f"{name}: reprojection {result.lens_rms:.3f} px (lens), {result.place_rms:.3f} px (place)")
    rms = float(np.sqrt((errors**2).sum(axis=1).mean()))
    print(f"3-D error against truth over the work volume: {1e3 * rms:.3f} mm rms ({len(errors)} points)")
    notes = {
        "board": dataclasses.asdict(board),
        "reprojection_rms_px": {
            name: {"lens": round(float(result.lens_rms), 4), "place": round(float(result.place_rms), 4)}
            for name, result in results.items()
        },
        "error_against_truth_rms_m": round(rms, 6),
    }
    save_calibration(path, models, rig=describe_rig(cameras), notes=notes)
    print(f"wrote {path}")
    return models


def board_for(cameras: CamerasConfig) -> Chessboard:
    """Returns the chessboard that suits the width of the cameras' field at the point at which they look."""
    field = 2.0 * cameras.distance * np.tan(np.deg2rad(cameras.fov_deg) / 2.0)
    return Chessboard(square=round(float(_SQUARE_OF_FIELD * field), 3))


def check_request(scenario: Any, place: CalibrationPlace, path: Path, truth: Mapping[str, CameraModel]) -> None:
    """Checks, before anything is rendered, that a calibration is possible.

    Args:
        scenario: of a task with two fixed cameras.
        place: where they are calibrated.
        path: of the file to write.
        truth: {name: CameraModel} of the simulator itself.

    Raises DrakeTrackerError, in one line, when it is not.
    """
    if path.is_dir() or not path.absolute().parent.is_dir():
        raise DrakeTrackerError(f"-o {path}: must be a file in a folder that exists")
    if not len(points_seen(truth, place.volume)):
        raise DrakeTrackerError(
            f"{scenario.where('cameras.look_at')}: no part of {place.volume_setting} is in view of both cameras"
        )
    require_renderer()


def calibrate_cameras(
    cameras: CamerasConfig,
    lighting: LightingConfig,
    *,
    table_height: float,
    board: Chessboard | None = None,
    lens_views: int = LENS_VIEWS,
    seed: int = 0,
) -> dict[str, CameraCalibration]:
    """Calibrates two cameras from rendered images alone. Returns {name: CameraCalibration}.

    The true pose of a camera serves only to hold the board where the camera can see it, as a person would. The
    calibration knows only the size of the board and where it lies on the table.

    Args:
        cameras: where the cameras stand, their images and their noise.
        lighting: the lamps.
        table_height: height of the table's top in W [m].
        board: the chessboard; None for that of `board_for`.
        lens_views: number of views of the held board per lens.
        seed: of the poses of the held board, and of the sensor noise.

    Raises DrakeTrackerError when the board is not found.
    """
    board = board or board_for(cameras)
    scene = CalibrationScene(board=board, cameras=cameras, lighting=lighting, seed=seed)
    rng = np.random.default_rng(seed)
    frames = iter(range(len(CAMERA_NAMES) * (lens_views + len(LYING_YAWS))))
    lying = [lying_pose(board, [*cameras.look_at[:2], table_height + BOARD_THICKNESS], yaw) for yaw in LYING_YAWS]
    results = {}
    for name, X_WC in camera_poses(cameras).items():
        held = [_draw_held_pose(rng, board, X_WC, cameras) for _ in range(lens_views)]
        images = [scene.render(name, X_WB, next(frames)) for X_WB in held]
        lens = calibrate_intrinsics(images, board, radial_terms=1)
        images = [scene.render(name, X_WB, next(frames)) for X_WB in lying]
        X_CW, rms = locate_camera(images, lens, board, [X_WB.GetAsMatrix4() for X_WB in lying])
        model = CameraModel(lens.K, lens.distortion, X_CW, cameras.width, cameras.height)
        results[name] = CameraCalibration(model, lens.rms, rms)
    return results


def _draw_held_pose(
    rng: np.random.Generator, board: Chessboard, X_WC: RigidTransform, cameras: CamerasConfig
) -> RigidTransform:
    """Returns a random X_WB of a board that fills most of a camera's image, tilted and rolled."""
    depth = cameras.distance * rng.uniform(0.72, 1.0)
    centre = X_WC @ np.array([*rng.uniform(-board.square, board.square, 2), depth])
    tilt, roll = rng.uniform(-_TILT, _TILT, 2), rng.uniform(-_ROLL, _ROLL)
    return held_pose(board, X_WC=X_WC, centre=centre, tilt=tilt, roll=roll)


def points_seen(truth: Mapping[str, CameraModel], volume: Volume) -> np.ndarray:
    """Returns points p_WQ (n, 3) [m] that fill the part of a volume that both cameras see.

    Args:
        truth: {name: CameraModel} of the simulator itself.
        volume: lowest and highest corner (3,) [m, W].
    """
    axes = [np.linspace(low, high, count) for low, high, count in zip(*volume, (7, 7, 3))]
    p_WQ = np.array(np.meshgrid(*axes)).reshape(3, -1).T
    return p_WQ[np.all([truth[name].sees(p_WQ) for name in CAMERA_NAMES], axis=0)]


def calibration_error(
    models: Mapping[str, CameraModel], truth: Mapping[str, CameraModel], volume: Volume
) -> np.ndarray:
    """Returns the errors (n, 3) [m] of points that are triangulated through calibrated cameras.

    The true pixels of `points_seen` are back-projected through the calibrated models; the error is the resulting point
    minus the true one. It is infinite where two rays do not meet.

    Args:
        models: {name: CameraModel} of the calibration.
        truth: {name: CameraModel} of the simulator itself.
        volume: lowest and highest corner (3,) [m, W].
    """
    left, right = CAMERA_NAMES
    p_WQ = points_seen(truth, volume)
    pixels = [truth[name].project(p_WQ) for name in CAMERA_NAMES]
    meetings = [triangulate(models[left], models[right], *uv) for uv in zip(*pixels)]
    found = [np.full(3, np.inf) if meeting is None else meeting.p_WQ for meeting in meetings]
    return np.array(found) - p_WQ
