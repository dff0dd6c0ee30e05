"""Builds the train's hand-eye diagram from a scenario."""

from dataclasses import asdict

import numpy as np

from drake_tracker.arm.arm_diagram import ArmDiagram
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.timing import ESTIMATOR_SLOT, SERVO_PERIOD, vision_slot
from drake_tracker.diagrams.estimators import estimator_of
from drake_tracker.diagrams.hand_eye import BETWEEN_ROOMS, HandEyeDiagram
from drake_tracker.estimation.estimator_system import EstimatorSystem
from drake_tracker.grasp.grasp_machine import GraspMachine
from drake_tracker.grasp.grasp_system import GraspSystem
from drake_tracker.link.lossy_link_system import LossyLinkSystem
from drake_tracker.tasks.loader import scenario_file
from drake_tracker.tasks.train.reach import Reach
from drake_tracker.tasks.train.scenario import Measured
from drake_tracker.tasks.train.track_placement import check_track, draw_track
from drake_tracker.vision.calibration import load_calibration
from drake_tracker.vision.detectors import normal_flow_parameters
from drake_tracker.vision.measured_error_file import load_error
from drake_tracker.vision.measured_vision_system import MeasuredVisionDiagram
from drake_tracker.vision.vision_diagram import VisionDiagram
from drake_tracker.vision.window import project_window
from drake_tracker.world.cameras import describe_rig, renderable_window
from drake_tracker.world.plant import TRAIN_HEIGHT
from drake_tracker.world.world_diagram import WorldDiagram

SIDES = ("left", "right")


def make_diagram(scenario):
    """Returns the `HandEyeDiagram` of a scenario.

    Everything random is drawn from ``scenario.seed``. Raises DrakeTrackerError, in one line, when the scenario cannot
    be built: a file is missing, the track is out of reach, or the vision would never see the train.
    """
    return assemble(scenario, *make_vision(scenario), scenario_host(scenario))


def assemble(scenario, vision, windows, host, arrows=BETWEEN_ROOMS):
    """Returns the `HandEyeDiagram` of a scenario with the given ``vision`` and ``host``, or what stands for them.

    ``windows``: {camera name: window to render [px]}, as `WorldDiagram` takes it. ``arrows``: as `HandEyeDiagram` takes
    them. Raises DrakeTrackerError as `make_diagram`.
    """
    reach = Reach(scenario)
    track, start = draw_track(scenario, reach)
    check_track(scenario, track, reach)

    model, q_initial = reach.model, reach.q_initial
    world = WorldDiagram(scenario, reach.description, q_initial, track, start, windows)
    link = scenario_link(scenario)
    grasp = GraspSystem(GraspMachine(scenario.grasp, model, SERVO_PERIOD), scenario.time_step)
    grasp.set_name("grasp")
    arm = ArmDiagram(
        grasp, scenario.servo, model, q_initial, reach.home, scenario.time_step, jaw_opening=scenario.grasp.jaw_opening
    )
    return HandEyeDiagram(world, vision, host, link, arm, arrows)


def make_vision(scenario):
    """Returns a scenario's vision, and {camera name: window to render [px]}, which is empty where it is measured."""
    if isinstance(scenario.vision, Measured):
        return measured_vision(scenario), {}
    return rendered_vision(scenario)


def rendered_vision(scenario, **settings):
    """Returns (VisionDiagram, {camera name: window to render [px]}) of a scenario with ``vision: !Rendered``.

    ``settings``: further ones of the `VisionDiagram`.
    """
    rendered = rendered_windows(scenario)
    return image_vision(scenario, rendered, **settings), {f"camera_{side}": rendered[side] for side in SIDES}


def rendered_windows(scenario):
    """Returns {side: (u0, v0, width, height) [px]}, what of the full frame a scenario renders."""
    config = scenario.cameras
    if not config.render_window:
        return dict.fromkeys(SIDES, (0, 0, config.width, config.height))
    windows = look_windows(scenario, load_cameras(scenario))
    return {side: renderable_window(windows[side].bounds, config.width, config.height) for side in SIDES}


def look_windows(scenario, cameras):
    """Returns {side: Window} in which a scenario's vision looks for motion."""
    vision = scenario.vision
    return {side: project_window(cameras[side], vision.work_volume, vision.outline) for side in SIDES}


def image_vision(scenario, rendered, **settings):
    """Returns the `VisionDiagram` of a scenario for images of the windows ``rendered`` {side: (u0, v0, width, height)}.

    ``settings``: further ones of the `VisionDiagram`. Raises DrakeTrackerError when the train would be too
    slow for it to be seen.
    """
    cameras, flow = load_cameras(scenario), flow_parameters(scenario)
    check_visible(scenario, cameras, flow)
    windows = look_windows(scenario, cameras)
    lag, volume = scenario.vision.lag_cycles, scenario.vision.work_volume
    if lag <= flow.stride:
        raise DrakeTrackerError(
            f"{scenario.where('vision.lag_cycles')} = {lag} must be at least {flow.stride + 1}: the newest image comes "
            f"{flow.stride} after the one that is described, and one cycle is for computing"
        )
    return VisionDiagram(cameras, windows, rendered, flow, lag, volume, **settings)


def measured_vision(scenario):
    """Returns the `MeasuredVisionDiagram` of a scenario with ``vision: !Measured``, which stands in for the cameras.

    Raises DrakeTrackerError when its file cannot be used, or when it would never see the train.
    """
    config = scenario.vision
    error = load_error(scenario_file(config.file), rig=describe_rig(scenario.cameras))
    if 0.0 < scenario.track.speed < error.seen_from:
        raise DrakeTrackerError(
            f"{scenario.where('track.speed')} = {scenario.track.speed:g} m/s: the measured vision sees nothing below "
            f"{error.seen_from:.3f} m/s"
        )
    return MeasuredVisionDiagram(error, config.lag_cycles, config.work_volume, scenario.seed)


def load_cameras(scenario):
    """Returns {"left": CameraModel, "right": CameraModel} from the calibration file that the scenario names."""
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


def flow_parameters(scenario):
    """Returns the `NormalFlowParameters` of a scenario's motion detector."""
    return normal_flow_parameters(scenario.vision.detector)


def check_visible(scenario, cameras, parameters):
    """Raises DrakeTrackerError when the train, at its speed, moves too slowly in an image for the threshold."""
    if scenario.track.speed == 0.0:
        return
    needed = parameters.smallest_visible_speed()
    for side, camera in cameras.items():
        fastest = scenario.track.speed * largest_scale(scenario, camera)
        if fastest < needed:
            raise DrakeTrackerError(
                f"{scenario.where('vision.detector')}: at track.speed {scenario.track.speed:g} m/s the train moves at "
                f"most {fastest:.1f} px/s in the {side} image, and the threshold sees nothing below {needed:.1f} px/s; "
                "lower the threshold, narrow the cameras' field or speed up the train"
            )


def slowest_seen(scenario, cameras, parameters):
    """Returns the speed [m/s] below which the threshold sees nothing in one of the images, whatever the heading."""
    needed = parameters.smallest_visible_speed()
    return max(needed / largest_scale(scenario, camera) for camera in cameras.values())


def largest_scale(scenario, camera):
    """Returns how many px a step of 1 m at the centre of the track takes in an image in the best direction."""
    centre = np.array([*scenario.track.centre, scenario.table_height + TRAIN_HEIGHT])
    headings = np.linspace(0.0, np.pi, 36)
    step = 0.01
    ends = centre + step * np.column_stack([np.cos(headings), np.sin(headings), np.zeros_like(headings)])
    return np.max(np.linalg.norm(camera.project(ends) - camera.project(centre[None]), axis=1)) / step


def scenario_host(scenario):
    """Returns the host of a scenario: its estimator as a System."""
    estimator = estimator_of(scenario.estimator, scenario.where("estimator"))
    host = EstimatorSystem(estimator, offset=vision_slot(ESTIMATOR_SLOT, scenario.time_step))
    host.set_name("host")
    return host


def scenario_link(scenario):
    """Returns the link System that a scenario names by its tag."""
    settings = asdict(scenario.link)  # a perfect link has none: nothing is lost, nothing is late
    link = LossyLinkSystem(**settings, seed=scenario.seed, time_step=scenario.time_step)
    link.set_name("link")
    return link
