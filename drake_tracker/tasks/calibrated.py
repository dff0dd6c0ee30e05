"""The calibrated cameras that a scenario names."""

from typing import Any

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.cameras.files.calibration_file import load_calibration
from drake_tracker.core.constants import SIDES
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.tasks.loader import scenario_file
from drake_tracker.world.imaging.cameras import describe_rig


def calibrated_cameras(scenario: Any) -> dict[str, CameraModel]:
    """Returns {side: camera} from the calibration file that a scenario names.

    Args:
        scenario: of a task with two fixed cameras.

    Raises DrakeTrackerError when the file cannot be used, or does not belong to the scenario's cameras.
    """
    path = scenario_file(scenario.cameras.calibration)
    models = load_calibration(path, rig=describe_rig(scenario.cameras))
    cameras = {}
    for side in SIDES:
        camera = models.get(f"camera_{side}")
        if camera is None:
            raise DrakeTrackerError(f"{path}: there is no camera_{side}; found {', '.join(models) or 'none'}")
        if (camera.width, camera.height) != (scenario.cameras.width, scenario.cameras.height):
            raise DrakeTrackerError(
                f"{path}: camera_{side} was calibrated at {camera.width} x {camera.height} px, but the scenario's "
                f"images are {scenario.cameras.width} x {scenario.cameras.height} px (cameras.width, cameras.height)"
            )
        cameras[side] = camera
    return cameras
