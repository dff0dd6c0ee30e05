"""Makes the camera on the hand from a scenario, as the controller knows it."""

from drake_tracker.arm.arm_model import make_arm_model
from drake_tracker.arm.arm_shape import ArmShape
from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.cameras.files.calibration_file import load_calibration
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.diagrams.arms import arm_of
from drake_tracker.tasks.loader import scenario_file
from drake_tracker.tasks.train.scenario import TrainScenario
from drake_tracker.vision.hand.hand_view import HandView
from drake_tracker.vision.hand.wrist_view import WristView
from drake_tracker.vision.hand.wrist_view_diagram import WristParts
from drake_tracker.world.config import WristCamera
from drake_tracker.world.imaging.wrist_camera import WRIST_CAMERA, describe_wrist

_GRIP_TOLERANCE = 0.002
"""Jaws that are open wider than the object by less than this touch it [m]."""


def has_wrist(scenario: TrainScenario) -> bool:
    """Returns whether the hand carries a camera."""
    return isinstance(scenario.cameras.wrist, WristCamera)


def wrist_images(scenario: TrainScenario) -> dict[str, tuple[int, int]]:
    """Returns {name of the port: (width, height) [px]} of the camera on the hand; empty without one."""
    config = scenario.cameras.wrist
    return {WRIST_CAMERA: (config.width, config.height)} if isinstance(config, WristCamera) else {}


def wrist_parts(scenario: TrainScenario) -> WristParts:
    """Returns the camera on the hand and what finds the object in its images.

    Args:
        scenario: with ``cameras.wrist: !WristCamera``.

    Raises DrakeTrackerError when the calibration file cannot be used, or does not belong to this camera.
    """
    description = arm_of(scenario)
    hand = HandView(load_wrist_camera(scenario), make_arm_model(description), ArmShape(description))
    view = WristView(scenario.table_height, scenario.grasp.object_width)
    return WristParts(view, hand, scenario.grasp.object_width + _GRIP_TOLERANCE)


def load_wrist_camera(scenario: TrainScenario) -> CameraModel:
    """Returns the calibrated camera on the hand. Its world frame is that of the tool: its ``X_CW`` is X_CT.

    Args:
        scenario: with ``cameras.wrist: !WristCamera``.

    Raises DrakeTrackerError when the file cannot be used, or does not belong to this camera.
    """
    config = scenario.cameras.wrist
    assert isinstance(config, WristCamera)
    path = scenario_file(config.calibration)
    models = load_calibration(path, rig=describe_wrist(config))
    camera = models.get(WRIST_CAMERA)
    if camera is None:
        raise DrakeTrackerError(f"{path}: there is no {WRIST_CAMERA}; found {', '.join(models) or 'none'}")
    return camera
