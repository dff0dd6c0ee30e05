"""Calibrates a scenario's cameras from rendered images of a chessboard, and says how good the result is."""

import dataclasses
from pathlib import Path

import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.machine import require_renderer
from drake_tracker.tasks import scenario_file
from drake_tracker.vision.calibration import calibrate_intrinsics, locate_camera, save_calibration
from drake_tracker.vision.camera_model import CameraModel
from drake_tracker.vision.chessboard import Chessboard
from drake_tracker.vision.triangulation import triangulate
from drake_tracker.world.calibration_board import BOARD_THICKNESS, CalibrationScene, held_pose, lying_pose
from drake_tracker.world.cameras import CAMERA_NAMES, camera_poses, describe_rig, true_camera_models

LENS_VIEWS = 16
LYING_YAWS = (0.0, np.pi / 2)
_SQUARE_OF_FIELD = 0.06
_TILT = 0.6
_ROLL = 0.3


@dataclasses.dataclass(frozen=True)
class CameraCalibration:
    """One camera's result: model, and the reprojection errors [px rms] of its lens and of its place."""

    model: CameraModel
    lens_rms: float
    place_rms: float


def calibrate(scenario, path=None):
    """Calibrates the cameras of a `TrainScenario`, prints the errors, and writes the calibration file.

    ``path`` is the file to write; None is the one that the scenario names. Returns {name: CameraModel}. Raises
    DrakeTrackerError for another task, for cameras that do not see the work volume, and without a renderer.
    """
    if scenario.task != "train":
        raise DrakeTrackerError(
            f"{scenario.name}: only the train's two cameras are calibrated; the ball's finds its board in each run"
        )
    cameras, truth = scenario.cameras, true_camera_models(scenario.cameras)
    path = Path(path or scenario_file(cameras.calibration))
    check_request(scenario, path, truth)
    board = board_for(cameras)
    results = calibrate_cameras(cameras, scenario.lighting, scenario.table_height, board=board)
    models = {name: result.model for name, result in results.items()}
    errors = calibration_error(models, truth, scenario.vision.work_volume)
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


def board_for(cameras):
    """Returns the `Chessboard` that suits the width of the cameras' field at the point they look at."""
    field = 2.0 * cameras.distance * np.tan(np.deg2rad(cameras.fov_deg) / 2.0)
    return Chessboard(square=round(float(_SQUARE_OF_FIELD * field), 3))


def check_request(scenario, path, truth):
    """Raises DrakeTrackerError, in one line, when `calibrate` cannot do what it is asked."""
    if path.is_dir() or not path.absolute().parent.is_dir():
        raise DrakeTrackerError(f"-o {path}: must be a file in a folder that exists")
    if not len(points_seen(truth, scenario.vision.work_volume)):
        raise DrakeTrackerError(
            f"{scenario.where('cameras.look_at')}: no part of vision.work_volume is in both cameras' view"
        )
    require_renderer()


def calibrate_cameras(cameras, lighting, table_height, *, board=None, lens_views=LENS_VIEWS, seed=0):
    """Returns {name: CameraCalibration}, found from rendered images alone.

    Parameters:
        cameras, lighting: the scenario's ``cameras`` and ``lighting``.
        table_height: height of the table's top [m].
        board: the `Chessboard`; None is `board_for` the cameras.
        lens_views: how many views of the held board each lens is calibrated from.
        seed: draws the poses of the held board and the sensor noise.

    The camera's true pose serves only to hold the board where the camera can see it, as a person would. What the
    calibration is told is the size of the board and where it lies on the table. Raises DrakeTrackerError when the board
    is not found.
    """
    board = board or board_for(cameras)
    scene = CalibrationScene(board, cameras, lighting, seed=seed)
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


def _draw_held_pose(rng, board, X_WC, cameras):
    """Draws X_WB of a board that fills most of a camera's image, tilted and rolled."""
    depth = cameras.distance * rng.uniform(0.72, 1.0)
    centre = X_WC @ np.array([*rng.uniform(-board.square, board.square, 2), depth])
    return held_pose(board, X_WC, centre, rng.uniform(-_TILT, _TILT, 2), rng.uniform(-_ROLL, _ROLL))


def points_seen(truth, volume):
    """Returns points p_WQ (n, 3) [m] that fill ``volume``, two corners (3,) [m, W], as far as both cameras see it."""
    axes = [np.linspace(low, high, count) for low, high, count in zip(*volume, (7, 7, 3))]
    p_WQ = np.array(np.meshgrid(*axes)).reshape(3, -1).T
    return p_WQ[np.all([truth[name].sees(p_WQ) for name in CAMERA_NAMES], axis=0)]


def calibration_error(models, truth, volume):
    """Returns the errors p_WQ' - p_WQ (n, 3) [m] of `points_seen` that are triangulated through calibrated cameras.

    Their true pixels are back-projected through ``models``; ``models`` and ``truth`` are {name: CameraModel}.
    """
    left, right = CAMERA_NAMES
    p_WQ = points_seen(truth, volume)
    pixels = [truth[name].project(p_WQ) for name in CAMERA_NAMES]
    found = [triangulate(models[left], models[right], *uv).p_WQ for uv in zip(*pixels)]
    return np.array(found) - p_WQ
