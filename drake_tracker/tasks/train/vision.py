"""Makes the vision of the train: the diagram that turns images, or the truth with measured error, into points."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from pydrake.systems.framework import Diagram

from drake_tracker.arm.arm_model import make_arm_model
from drake_tracker.arm.arm_shape import ArmShape
from drake_tracker.arm.marker_kinematics import MarkerKinematics
from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.cameras.files.calibration_file import load_calibration
from drake_tracker.core.colour import rgb
from drake_tracker.core.constants import SIDES
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.faults.fault import CalibrationFault, PointFault, faults_at
from drake_tracker.faults.point_faults_system import PointFaultsSystem
from drake_tracker.measured.config import SeveralObjects
from drake_tracker.measured.measured_error_file import load_error
from drake_tracker.measured.measured_error_system import MeasuredErrorSystem
from drake_tracker.measured.measured_tracks import MeasuredTracker, ObjectLook
from drake_tracker.measured.measured_tracks_system import MeasuredTracksSystem
from drake_tracker.measured.measured_vision_diagram import MeasuredVisionDiagram
from drake_tracker.tasks.loader import scenario_file
from drake_tracker.tasks.train.scenario import Measured
from drake_tracker.tasks.train.setup import TrainSetup
from drake_tracker.vision.centroid.detectors import make_detector
from drake_tracker.vision.centroid.normal_flow_parameters import NormalFlowParameters
from drake_tracker.vision.centroid.vision_diagram import VisionDiagram
from drake_tracker.vision.hand.arm_silhouette import HandView
from drake_tracker.vision.hand.hand_markers import MarkerSearch
from drake_tracker.vision.hand.wrist_view import WristView
from drake_tracker.vision.hand.wrist_view_diagram import WristParts
from drake_tracker.vision.hand_vision_diagram import HandVisionDiagram
from drake_tracker.vision.several_vision_diagram import SeveralVisionDiagram
from drake_tracker.vision.silhouettes.config import SilhouetteTracker
from drake_tracker.world.config import WristCamera, body_size
from drake_tracker.world.imaging.cameras import ImageWindow, describe_rig
from drake_tracker.world.imaging.wrist_camera import WRIST_CAMERA, describe_wrist
from drake_tracker.world.train.driven_objects import HAND_LENGTH, HAND_THICKNESS, HAND_WIDTH
from drake_tracker.world.train.objects_config import Ball, Hand
from drake_tracker.world.train.plant import TRAIN_HEIGHT
from drake_tracker.world.train.train_model import train_colour

RenderedVision = VisionDiagram | SeveralVisionDiagram | HandVisionDiagram
"""A vision that reads images."""
_GRIP_TOLERANCE = 0.002
"""Jaws that are open wider than the object by less than this touch it [m]."""


def make_vision(setup: TrainSetup) -> Diagram:
    """Returns the vision of a run.

    Args:
        setup: the resolved scenario.

    Raises DrakeTrackerError when the vision cannot be built, or would never see the train.
    """
    return measured_vision(setup) if setup.measured else image_vision(setup, image_latency=setup.image_latency)


def image_vision(setup: TrainSetup, **settings: Any) -> RenderedVision:
    """Returns a vision that reads the rendered images.

    Args:
        setup: the resolved scenario.
        **settings: further arguments of `VisionDiagram` or `SeveralVisionDiagram`.

    Raises DrakeTrackerError when the train is too slow to be seen, or when the lag is too short for the detector.
    """
    vision = object_vision(setup, setup.windows, **settings)
    if not setup.sees_hand:
        return vision
    low, high = setup.scenario.vision.work_volume
    return HandVisionDiagram(
        vision,
        MarkerKinematics(setup.arm),
        setup.cameras,
        setup.windows,
        0.5 * (low[2] + high[2]),
        len(setup.arm.q_start),
        MarkerSearch(reach=setup.scenario.hand_eye.reach),
        keep=setup.scenario.hand_eye.keep,
        lag_cycles=setup.scenario.vision.lag_cycles,
        image_latency=settings.get("image_latency", 0),
        update_cycles=setup.update_cycles,
    )


def object_vision(
    setup: TrainSetup, windows: Mapping[str, ImageWindow], **settings: Any
) -> VisionDiagram | SeveralVisionDiagram:
    """Returns the vision of the object, which does not look for the hand.

    Args:
        setup: the resolved scenario.
        windows: {side: window of the full image that the images show}.
        **settings: further arguments of `VisionDiagram` or `SeveralVisionDiagram`.

    Raises DrakeTrackerError when the train is too slow to be seen, or when the lag is too short for the detector.
    """
    config = setup.rendered
    if isinstance(config.method, SilhouetteTracker):
        return _several_vision(setup, config.method, windows, **settings)
    flow = config.method.detector.resolve()
    check_visible(setup, flow)
    lag, volume = config.lag_cycles, config.work_volume
    if lag <= flow.stride:
        raise DrakeTrackerError(
            f"{setup.scenario.where('vision.lag_cycles')} = {lag} must be at least {flow.stride + 1}: the newest image "
            f"is captured {flow.stride} cycles after the middle one, and computing takes one cycle"
        )
    masks = {side: setup.search_windows[side].mask(windows[side]) for side in SIDES}
    detectors = {side: make_detector(config.method.detector, window=masks[side]) for side in SIDES}
    return VisionDiagram(
        setup.cameras, detectors, image_windows=windows, lag_cycles=lag, work_volume=volume, **settings
    )


def _several_vision(
    setup: TrainSetup, tracker: SilhouetteTracker, windows: Mapping[str, ImageWindow], **settings: Any
) -> SeveralVisionDiagram:
    """Returns the vision that tracks several objects, with arguments as for `object_vision`."""
    scenario = setup.scenario
    if setup.has_wrist:
        settings["wrist"] = wrist_parts(setup)
    return SeveralVisionDiagram(
        setup.cameras,
        tracker,
        windows=setup.search_windows,
        image_windows=windows,
        arm=(ArmShape(setup.arm), len(setup.arm.q_start)),
        lag_cycles=scenario.vision.lag_cycles,
        work_volume=scenario.vision.work_volume,
        time_step=scenario.time_step,
        **settings,
    )


def wrist_parts(setup: TrainSetup) -> WristParts:
    """Returns the camera on the hand, and the System that finds the object in its images.

    Args:
        setup: the resolved scenario of a hand with a camera.

    Raises DrakeTrackerError when the calibration file cannot be used, or does not belong to this camera.
    """
    config, grasp = setup.scenario.cameras.wrist, setup.grasp
    assert isinstance(config, WristCamera)
    path = scenario_file(config.calibration)
    models = load_calibration(path, rig=describe_wrist(config))
    camera = models.get(WRIST_CAMERA)  # its world frame is that of the tool: its X_CW is X_CT
    if camera is None:
        raise DrakeTrackerError(f"{path}: there is no {WRIST_CAMERA}; found {', '.join(models) or 'none'}")
    hand = HandView(camera, make_arm_model(setup.arm), ArmShape(setup.arm))
    view = WristView(setup.scenario.table_height, grasp.object_width)
    return WristParts(view, hand, grasp.object_width + _GRIP_TOLERANCE)


def measured_vision(setup: TrainSetup) -> MeasuredVisionDiagram:
    """Returns the vision of a scenario with ``vision: !Measured``, which replaces the cameras.

    Args:
        setup: the resolved scenario.

    Raises DrakeTrackerError when its file cannot be used, or when it would never see the train.
    """
    scenario, config = setup.scenario, setup.scenario.vision
    assert isinstance(config, Measured)
    error = load_error(scenario_file(config.file), rig=describe_rig(scenario.cameras))
    if 0.0 < scenario.track.speed < error.seen_from:
        raise DrakeTrackerError(
            f"{scenario.where('track.speed')} = {scenario.track.speed:g} m/s: the measured vision sees nothing below "
            f"{error.seen_from:.3f} m/s"
        )
    volume, seed, lag = config.work_volume, scenario.seed, config.lag_cycles
    if not isinstance(config.method, SeveralObjects):
        faults = [system for system in [_point_faults(setup)] if system is not None]
        return MeasuredVisionDiagram([MeasuredErrorSystem(error, volume, seed)], lag, faults=faults)
    looks = tuple(_look(each) for each in (scenario.train, *scenario.objects))
    sources = [
        MeasuredErrorSystem(error, volume, seed, number=number, further=len(looks) - 1) for number in range(len(looks))
    ]
    tracking = MeasuredTracksSystem(MeasuredTracker(error, looks, config.method), len(looks), config.method.target)
    faults = [system for system in (_point_faults(setup) for _ in looks) if system is not None]
    return MeasuredVisionDiagram(sources, lag, tracking=tracking, faults=faults)


def _point_faults(setup: TrainSetup) -> PointFaultsSystem | None:
    """Returns the faults of the points of measured vision, or None without faults."""
    if not faults_at(setup.faults, PointFault) and not faults_at(setup.faults, CalibrationFault):
        return None
    return PointFaultsSystem(setup.faults, setup.calibrated, setup.scenario.vision.work_volume)


def _look(settings: Any) -> ObjectLook:
    """Returns size and colour of an object with the given settings, which measured vision gives its tracks."""
    if isinstance(settings, Ball):
        size = (2.0 * settings.radius,) * 3
    elif isinstance(settings, Hand):
        size = (HAND_LENGTH, HAND_WIDTH, HAND_THICKNESS)
    else:
        size = body_size(settings.body, settings.scale)
    colour = rgb(settings.colour) if settings.colour else train_colour(settings.body)
    red, green, blue = (255.0 * float(value) for value in colour)
    return ObjectLook(size, (red, green, blue))


def check_visible(setup: TrainSetup, parameters: NormalFlowParameters) -> None:
    """Checks that the train moves fast enough in the images to exceed the detector's threshold.

    Args:
        setup: the resolved scenario.
        parameters: parameters of the motion detector.

    Raises DrakeTrackerError when the train is too slow.
    """
    scenario = setup.scenario
    if scenario.track.speed == 0.0:
        return
    needed = parameters.smallest_visible_speed()
    for side, camera in setup.cameras.items():
        fastest = scenario.track.speed * largest_scale(setup, camera)
        if fastest < needed:
            raise DrakeTrackerError(
                f"{scenario.where('vision.method.detector')}: at track.speed {scenario.track.speed:g} m/s the train "
                f"moves at most {fastest:.1f} px/s in the {side} image, but the threshold needs at least {needed:.1f} "
                "px/s; lower the threshold, reduce the cameras' field of view or increase the speed"
            )


def slowest_seen(setup: TrainSetup, parameters: NormalFlowParameters) -> float:
    """Returns the speed below which the train is invisible in one of the images, for all headings [m/s].

    Args:
        setup: the resolved scenario.
        parameters: parameters of the motion detector.
    """
    needed = parameters.smallest_visible_speed()
    return max(needed / largest_scale(setup, camera) for camera in setup.cameras.values())


def largest_scale(setup: TrainSetup, camera: CameraModel) -> float:
    """Returns the scale of an image at the centre of the track, in the direction in which it is largest [px/m].

    Args:
        setup: the resolved scenario.
        camera: the camera.
    """
    centre = np.array([*setup.scenario.track.centre, setup.scenario.table_height + TRAIN_HEIGHT])
    headings = np.linspace(0.0, np.pi, 36)
    step = 0.01
    ends = centre + step * np.column_stack([np.cos(headings), np.sin(headings), np.zeros_like(headings)])
    return np.max(np.linalg.norm(camera.project(ends) - camera.project(centre[None]), axis=1)) / step
