"""Makes the vision of the train from a scenario: cameras, windows, and the diagram that outputs points."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from pydrake.systems.framework import Diagram

from drake_tracker.arm.arm_shape import ArmShape
from drake_tracker.arm.marker_kinematics import MarkerKinematics
from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.core.constants import SIDES
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.diagrams.arms import arm_of
from drake_tracker.faults.fault import CalibrationFault, PointFault, calibrated_with, faults_at
from drake_tracker.faults.point_faults_system import PointFaultsSystem
from drake_tracker.measured.measured_error_file import load_error
from drake_tracker.measured.measured_several_diagram import MeasuredSeveralDiagram
from drake_tracker.measured.measured_vision_system import MeasuredVisionDiagram
from drake_tracker.tasks.calibrated import calibrated_cameras
from drake_tracker.tasks.loader import scenario_file
from drake_tracker.tasks.train.faults import train_faults
from drake_tracker.tasks.train.looks import object_looks
from drake_tracker.tasks.train.scenario import Measured, Rendered, TrainScenario
from drake_tracker.tasks.train.wrist_parts import has_wrist, wrist_parts
from drake_tracker.vision.centroid.detectors import make_detector
from drake_tracker.vision.centroid.normal_flow_parameters import NormalFlowParameters
from drake_tracker.vision.centroid.vision_diagram import VisionDiagram
from drake_tracker.vision.config import Several
from drake_tracker.vision.hand.hand_markers import MarkerSearch
from drake_tracker.vision.hand_vision_diagram import HandVisionDiagram
from drake_tracker.vision.region_of_interest import RegionOfInterest, project_region
from drake_tracker.vision.several_vision_diagram import SeveralVisionDiagram
from drake_tracker.world.imaging.cameras import describe_rig, renderable_window
from drake_tracker.world.imaging.image_pipeline import MOST_LATENCY, ImagePipeline, process_count
from drake_tracker.world.train.plant import TRAIN_HEIGHT

RenderedWindow = tuple[int, int, int, int]
"""(u0, v0, width, height) of the part of the full image that is rendered [px]."""
RenderedVision = VisionDiagram | SeveralVisionDiagram | HandVisionDiagram
"""A vision that reads images."""


def image_pipeline(scenario: TrainScenario) -> ImagePipeline | None:
    """Returns how the images of a scenario are made beside the simulation, or None if they are not.

    The lag of the vision hides the latency of the images: all of it but one cycle may be used up by them. A vision of
    several objects describes its newest image, a motion detector the middle one of three.

    Raises DrakeTrackerError when the environment variable for the number of processes is wrong.
    """
    if isinstance(scenario.vision, Measured):
        return None
    processes = process_count(scenario.cameras.render_processes)
    newest = 0 if tracks_several(scenario) else flow_parameters(scenario).stride
    latency = min(scenario.vision.lag_cycles - newest - 1, MOST_LATENCY)
    return ImagePipeline(latency, processes) if processes > 0 and latency > 0 else None


def make_vision(
    scenario: TrainScenario, pipeline: ImagePipeline | None = None
) -> tuple[Diagram, dict[str, RenderedWindow]]:
    """Returns the vision of a scenario and the windows to render.

    Args:
        scenario: the scenario.
        pipeline: how its images are made, or None.

    Returns (diagram of the vision, {name of the camera: window to render}). The dict is empty with measured vision.

    Raises DrakeTrackerError when the vision cannot be built, or would never see the train.
    """
    if isinstance(scenario.vision, Measured):
        return measured_vision(scenario), {}
    return rendered_vision(scenario, image_latency=0 if pipeline is None else pipeline.latency)


def rendered_vision(scenario: TrainScenario, **settings: Any) -> tuple[RenderedVision, dict[str, RenderedWindow]]:
    """Returns the vision of a scenario with ``vision: !Rendered`` and the windows to render.

    Args:
        scenario: the scenario.
        **settings: further arguments of `VisionDiagram`.

    Returns (diagram, {name of the camera: window to render}).

    Raises DrakeTrackerError when the vision cannot be built, or would never see the train.
    """
    rendered = rendered_windows(scenario)
    return image_vision(scenario, rendered, **settings), {f"camera_{side}": rendered[side] for side in SIDES}


def rendered_windows(scenario: TrainScenario) -> dict[str, RenderedWindow]:
    """Returns {side: window of the full image that a scenario renders}: all of it if vision must see the hand."""
    config = scenario.cameras
    if not config.render_window or sees_hand(scenario):
        return dict.fromkeys(SIDES, (0, 0, config.width, config.height))
    windows = look_windows(scenario, load_cameras(scenario))
    return {side: renderable_window(windows[side].bounds, config.width, config.height) for side in SIDES}


def look_windows(scenario: TrainScenario, cameras: Mapping[str, CameraModel]) -> dict[str, RegionOfInterest]:
    """Returns {side: window in which a scenario's vision searches for motion}.

    Args:
        scenario: the scenario.
        cameras: {side: calibrated camera}.
    """
    vision = scenario.vision
    return {side: project_region(cameras[side], vision.work_volume, vision.outline) for side in SIDES}


def image_vision(scenario: TrainScenario, rendered: Mapping[str, RenderedWindow], **settings: Any) -> RenderedVision:
    """Returns the vision of a scenario with ``vision: !Rendered``.

    Args:
        scenario: the scenario.
        rendered: {side: window of the full image that the images show}.
        **settings: further arguments of `VisionDiagram` or `SeveralVisionDiagram`.

    Raises DrakeTrackerError when the train is too slow to be seen, or when the lag is too short for the detector.
    """
    vision = object_vision(scenario, rendered, **settings)
    if not sees_hand(scenario):
        return vision
    description = arm_of(scenario)
    return HandVisionDiagram(
        vision,
        MarkerKinematics(description),
        load_cameras(scenario),
        rendered,
        0.5 * (scenario.vision.work_volume[0][2] + scenario.vision.work_volume[1][2]),
        len(description.q_start),
        MarkerSearch(reach=scenario.hand_eye.reach),
        keep=scenario.hand_eye.keep,
        lag_cycles=scenario.vision.lag_cycles,
        image_latency=settings.get("image_latency", 0),
    )


def object_vision(
    scenario: TrainScenario, rendered: Mapping[str, RenderedWindow], **settings: Any
) -> VisionDiagram | SeveralVisionDiagram:
    """Returns the vision of the object of a scenario with ``vision: !Rendered``.

    Args:
        scenario: the scenario.
        rendered: {side: window of the full image that the images show}.
        **settings: further arguments of `VisionDiagram` or `SeveralVisionDiagram`.

    Raises DrakeTrackerError when the train is too slow to be seen, or when the lag is too short for the detector.
    """
    config = rendered_config(scenario)
    if isinstance(config.tracker, Several):
        return several_vision(scenario, config.tracker, rendered, **settings)
    cameras, flow = load_cameras(scenario), flow_parameters(scenario)
    check_visible(scenario, cameras, flow)
    windows = look_windows(scenario, cameras)
    lag, volume = config.lag_cycles, config.work_volume
    if lag <= flow.stride:
        raise DrakeTrackerError(
            f"{scenario.where('vision.lag_cycles')} = {lag} must be at least {flow.stride + 1}: the newest image is "
            f"captured {flow.stride} cycles after the middle one, and computing takes one cycle"
        )
    detectors = {side: make_detector(config.detector, window=windows[side].mask(rendered[side])) for side in SIDES}
    return VisionDiagram(cameras, detectors, image_windows=rendered, lag_cycles=lag, work_volume=volume, **settings)


def tracks_several(scenario: TrainScenario) -> bool:
    """Returns whether the vision of a scenario, rendered or measured, tracks several objects."""
    return isinstance(scenario.vision.tracker, Several)


def sees_hand(scenario: TrainScenario) -> bool:
    """Returns whether the vision of a scenario measures the hand by its markers."""
    return isinstance(scenario.vision, Rendered) and arm_of(scenario).markers


def arm_signals(scenario: TrainScenario) -> tuple[str, ...]:
    """Returns the outputs of the arm that the vision of a scenario reads.

    It masks the arm in the images, and knows from them where a camera on the hand is.
    """
    vision = scenario.vision
    if not (isinstance(vision, Rendered) and isinstance(vision.tracker, Several)):
        return ()
    return ("arm_state", "jaws") if vision.tracker.mask_arm or has_wrist(scenario) else ()


def several_vision(
    scenario: TrainScenario, tracker: Several, rendered: Mapping[str, RenderedWindow], **settings: Any
) -> SeveralVisionDiagram:
    """Returns the vision of a scenario that tracks several objects.

    Args:
        scenario: the scenario.
        tracker: settings of the tracker.
        rendered: {side: window of the full image that the images show}.
        **settings: further arguments of `SeveralVisionDiagram`.

    Raises DrakeTrackerError when a file is missing or a setting is out of range.
    """
    cameras = load_cameras(scenario)
    if has_wrist(scenario):
        settings["wrist"] = wrist_parts(scenario)
    arm = None
    if tracker.mask_arm:
        description = arm_of(scenario)
        arm = (ArmShape(description), len(description.q_start))
    return SeveralVisionDiagram(
        cameras,
        tracker,
        windows=look_windows(scenario, cameras),
        image_windows=rendered,
        arm=arm,
        lag_cycles=scenario.vision.lag_cycles,
        work_volume=scenario.vision.work_volume,
        time_step=scenario.time_step,
        **settings,
    )


def measured_vision(scenario: TrainScenario) -> MeasuredVisionDiagram | MeasuredSeveralDiagram:
    """Returns the vision of a scenario with ``vision: !Measured``, which replaces the cameras.

    Raises DrakeTrackerError when its file cannot be used, or when it would never see the train.
    """
    config = scenario.vision
    assert isinstance(config, Measured)
    error = load_error(scenario_file(config.file), rig=describe_rig(scenario.cameras))
    if 0.0 < scenario.track.speed < error.seen_from:
        raise DrakeTrackerError(
            f"{scenario.where('track.speed')} = {scenario.track.speed:g} m/s: the measured vision sees nothing below "
            f"{error.seen_from:.3f} m/s"
        )
    if isinstance(config.tracker, Several):
        looks = object_looks(scenario)
        faults = [system for system in (point_faults(scenario) for _ in looks) if system is not None]
        return MeasuredSeveralDiagram(
            error, config.tracker, looks, config.lag_cycles, config.work_volume, scenario.seed, faults=faults
        )
    return MeasuredVisionDiagram(
        error, config.lag_cycles, config.work_volume, scenario.seed, faults=point_faults(scenario)
    )


def point_faults(scenario: TrainScenario) -> PointFaultsSystem | None:
    """Returns what goes wrong with the points of measured vision, or None when nothing does.

    Raises DrakeTrackerError when a fault cannot happen in the scenario, or the calibration file cannot be used.
    """
    faults = train_faults(scenario)
    if not faults_at(faults, PointFault) and not faults_at(faults, CalibrationFault):
        return None
    return PointFaultsSystem(faults, calibrated_cameras(scenario), scenario.vision.work_volume)


def load_cameras(scenario: TrainScenario) -> dict[str, CameraModel]:
    """Returns {side: camera as the controller knows it}: that of the calibration file, with faults of the calibration.

    Raises DrakeTrackerError when the file cannot be used, or does not belong to the scenario's cameras.
    """
    return calibrated_with(train_faults(scenario), calibrated_cameras(scenario))


def rendered_config(scenario: TrainScenario) -> Rendered:
    """Returns the vision settings of a scenario. Raises DrakeTrackerError when it does not render images."""
    if not isinstance(scenario.vision, Rendered):
        raise DrakeTrackerError(f"{scenario.where('vision')} must be !Rendered: this needs images")
    return scenario.vision


def flow_parameters(scenario: TrainScenario) -> NormalFlowParameters:
    """Returns the parameters of a scenario's motion detector."""
    return rendered_config(scenario).detector.resolve()


def check_visible(
    scenario: TrainScenario, cameras: Mapping[str, CameraModel], parameters: NormalFlowParameters
) -> None:
    """Checks that the train moves fast enough in the images to exceed the detector's threshold.

    Args:
        scenario: the scenario.
        cameras: {side: calibrated camera}.
        parameters: parameters of the motion detector.

    Raises DrakeTrackerError when the train is too slow.
    """
    if scenario.track.speed == 0.0:
        return
    needed = parameters.smallest_visible_speed()
    for side, camera in cameras.items():
        fastest = scenario.track.speed * largest_scale(scenario, camera)
        if fastest < needed:
            raise DrakeTrackerError(
                f"{scenario.where('vision.detector')}: at track.speed {scenario.track.speed:g} m/s the train moves at "
                f"most {fastest:.1f} px/s in the {side} image, but the threshold needs at least {needed:.1f} px/s; "
                "lower the threshold, reduce the cameras' field of view or increase the speed"
            )


def slowest_seen(
    scenario: TrainScenario, cameras: Mapping[str, CameraModel], parameters: NormalFlowParameters
) -> float:
    """Returns the speed below which the train is invisible in one of the images, for all headings [m/s].

    Args:
        scenario: the scenario.
        cameras: {side: calibrated camera}.
        parameters: parameters of the motion detector.
    """
    needed = parameters.smallest_visible_speed()
    return max(needed / largest_scale(scenario, camera) for camera in cameras.values())


def largest_scale(scenario: TrainScenario, camera: CameraModel) -> float:
    """Returns the scale of an image at the centre of the track, in the direction in which it is largest [px/m].

    Args:
        scenario: the scenario with the track.
        camera: the camera.
    """
    centre = np.array([*scenario.track.centre, scenario.table_height + TRAIN_HEIGHT])
    headings = np.linspace(0.0, np.pi, 36)
    step = 0.01
    ends = centre + step * np.column_stack([np.cos(headings), np.sin(headings), np.zeros_like(headings)])
    return np.max(np.linalg.norm(camera.project(ends) - camera.project(centre[None]), axis=1)) / step
