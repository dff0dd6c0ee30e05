"""Calibrates the camera on the hand from rendered images of a chessboard on the table, at several poses of the arm."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from pydrake.math import RigidTransform

from drake_tracker.cameras.boards.board_poses import pose_error
from drake_tracker.cameras.boards.chessboard import Chessboard, find_corners
from drake_tracker.cameras.calibration.camera_calibration import lens_from_corners
from drake_tracker.cameras.calibration.hand_eye_solver import solve_hand_eye
from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.cameras.files.calibration_file import save_calibration
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.system_check import require_renderer
from drake_tracker.tasks import scenario_file
from drake_tracker.tasks.registry import require_task
from drake_tracker.tasks.train.scenario import TrainScenario
from drake_tracker.tasks.train.setup import resolve
from drake_tracker.world.config import WristCamera
from drake_tracker.world.imaging.wrist_calibration_scene import WristCalibrationScene
from drake_tracker.world.imaging.wrist_camera import WRIST_CAMERA, describe_wrist, true_wrist_model

VIEWS = 24
"""Poses of the arm."""
BOARD = Chessboard(columns=7, rows=4, square=0.028)
BOARD_YAW = 0.4
"""Rotation of the board on the table [rad]."""
_SPREAD = 0.35
"""Largest change of a joint from the pose at which the arm begins [rad]."""
_MARGIN = 8
"""Distance of the board from the edge of the image [px]."""
_NEAREST, _FARTHEST = 0.15, 0.40
"""Smallest and greatest distance of the board's middle from the camera [m]."""
_TRIES = 100_000


class WristCalibration(NamedTuple):
    """The calibration of the camera on the hand.

    Attributes:
        model: the camera; its world frame is that of the tool.
        lens_rms: reprojection error of the lens [px rms].
        pose_rms: reprojection error of the pose on the hand [px rms].
        views: images in which the board was found.
    """

    model: CameraModel
    lens_rms: float
    pose_rms: float
    views: int


def calibrate_wrist(scenario: TrainScenario, path: str | Path | None = None) -> CameraModel:
    """Calibrates the camera on the hand, prints the errors, and writes the calibration file.

    Args:
        scenario: of the train, with ``cameras.wrist: !WristCamera``.
        path: of the file to write; None for the file that the scenario names.

    Returns the `CameraModel` in the frame of the tool. Raises DrakeTrackerError for another task, without a camera on
    the hand, and without a renderer.
    """
    require_task(scenario, "train", "only the hand of the train's arm carries a camera")
    config = scenario.cameras.wrist
    if not isinstance(config, WristCamera):
        raise DrakeTrackerError(
            f"{scenario.where('cameras.wrist')} must be !WristCamera: there is no camera on the hand"
        )
    path = Path(path or scenario_file(config.calibration))
    if path.is_dir() or not path.absolute().parent.is_dir():
        raise DrakeTrackerError(f"-o {path}: must be a file in a folder that exists")
    require_renderer()
    result = find_wrist_camera(scenario, config)
    truth = true_wrist_model(config)
    distance, turn = pose_error(RigidTransform(result.model.X_WC), RigidTransform(truth.X_WC))
    print(f"{WRIST_CAMERA}: reprojection {result.lens_rms:.3f} px (lens), {result.pose_rms:.3f} px (pose)")
    print(f"pose on the hand against truth: {1e3 * distance:.2f} mm, {np.rad2deg(turn):.3f} deg ({result.views} views)")
    notes = {
        "frame": "the world of this camera is the frame of the tool",
        "board": {"columns": BOARD.columns, "rows": BOARD.rows, "square": BOARD.square},
        "views": result.views,
        "reprojection_rms_px": {"lens": round(result.lens_rms, 4), "pose": round(result.pose_rms, 4)},
        "error_against_truth": {"position_m": round(distance, 6), "rotation_deg": round(float(np.rad2deg(turn)), 4)},
    }
    save_calibration(path, {WRIST_CAMERA: result.model}, rig=describe_wrist(config), notes=notes)
    print(f"wrote {path}")
    return result.model


def find_wrist_camera(scenario: TrainScenario, config: WristCamera, *, seed: int = 0) -> WristCalibration:
    """Calibrates the camera on the hand from rendered images and the joints of the arm alone.

    The true pose of the camera serves only to choose poses of the arm at which it sees the board, as a person would.

    Args:
        scenario: the arm, the table and the lamps.
        config: the camera.
        seed: of the poses of the arm, and of the sensor noise.

    Raises DrakeTrackerError when too few poses are found at which the camera sees the board.
    """
    reach = resolve(scenario).reach
    model = reach.model
    x, y = (reach.home[:2]).tolist()
    scene = WristCalibrationScene(
        description=reach.description,
        board=BOARD,
        place=(x, y),
        yaw=BOARD_YAW,
        cameras=scenario.cameras,
        wrist=config,
        lighting=scenario.lighting,
        table_height=scenario.table_height,
        seed=seed,
    )
    truth = true_wrist_model(config)
    corners = np.array([scene.X_WB @ corner for corner in BOARD.points()])
    rng = np.random.default_rng(seed)
    poses: list[np.ndarray] = []
    views: list[np.ndarray] = []
    for _ in range(_TRIES):
        if len(views) == VIEWS:
            break
        q = reach.q_initial + rng.uniform(-_SPREAD, _SPREAD, model.num_joints)
        X_WT = model.tool_pose(q).GetAsMatrix4()
        if not _in_view(truth, X_WT, corners):
            continue
        found = find_corners(scene.render(q, scenario.grasp.jaw_opening, len(views)), BOARD)
        if found is not None:
            poses.append(X_WT)
            views.append(found)
    if len(views) < VIEWS:
        raise DrakeTrackerError(
            f"{scenario.where('cameras.wrist')}: the board was found in {len(views)} of {VIEWS} images of the camera "
            "on the hand; offset and tilt_deg may turn it away from the table"
        )
    lens = lens_from_corners(views, BOARD, (config.height, config.width))
    pose = solve_hand_eye(poses, views, BOARD, lens)
    camera = CameraModel(lens.K, lens.distortion, np.linalg.inv(pose.X_TC), config.width, config.height)
    return WristCalibration(camera, lens.rms, pose.rms, len(views))


def _in_view(truth: CameraModel, X_WT: np.ndarray, corners: np.ndarray) -> bool:
    """Returns whether the camera sees a board well.

    Args:
        truth: the camera in the frame of the tool.
        X_WT: (4, 4) pose of the tool [m].
        corners: of the board, shape (n, 3) [m, W].
    """
    p_TQ = (corners - X_WT[:3, 3]) @ X_WT[:3, :3]
    uv = truth.project(p_TQ)
    depth = float((p_TQ @ truth.X_CW[2, :3] + truth.X_CW[2, 3]).mean())
    inside = (uv > _MARGIN).all() and (uv < np.array([truth.width, truth.height]) - _MARGIN).all()
    clear = bool((p_TQ[:, 2] > 0.03).all())  # the board is beyond the fingers
    return bool(inside and clear and _NEAREST < depth < _FARTHEST)
