"""Makes the vision of the conveyor from a scenario: cameras, windows, and the diagram that outputs parts."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from pydrake.systems.framework import Diagram

from drake_tracker.arm.arm_shape import ArmShape
from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.core.constants import SIDES
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.part_kinds import PART_SHAPES
from drake_tracker.diagrams.arms import arm_of
from drake_tracker.measured.measured_parts_system import MeasuredPartsDiagram, MeasuredPartsSystem
from drake_tracker.tasks.calibrated import calibrated_cameras
from drake_tracker.tasks.conveyor.scenario import ConveyorScenario, Measured, Rendered
from drake_tracker.vision.parts.part_vision_diagram import PartVisionDiagram, belt_window
from drake_tracker.world.conveyor.arrivals import Arrival
from drake_tracker.world.imaging.cameras import ImageWindow, renderable_window
from drake_tracker.world.imaging.image_pipeline import MOST_LATENCY, ImagePipeline, process_count

BEFORE = 0.07
"""Length of the belt before its entry and beyond its end that the cameras look at [m]: a part that arrives is whole."""
HIGHEST = max(shape.height for shape in PART_SHAPES.values())
"""Height of the highest part [m]."""


def image_pipeline(scenario: ConveyorScenario) -> ImagePipeline | None:
    """Returns how the images of a scenario are made beside the simulation, or None if they are not.

    The lag of the vision hides the latency of the images: all of it but one cycle may be used up by them.

    Raises DrakeTrackerError when the environment variable for the number of processes is wrong.
    """
    if isinstance(scenario.vision, Measured):
        return None
    processes = process_count(scenario.cameras.render_processes)
    latency = min(scenario.vision.lag_cycles - 1, MOST_LATENCY)
    return ImagePipeline(latency, processes, scenario.vision.update_cycles) if processes > 0 and latency > 0 else None


def make_vision(
    scenario: ConveyorScenario, arrivals: Sequence[Arrival], pipeline: ImagePipeline | None
) -> tuple[Diagram, dict[str, ImageWindow]]:
    """Returns the vision of a scenario, and {name of the camera: window to render}, empty with measured vision.

    Args:
        scenario: the scenario.
        arrivals: the parts of the run, whose kinds measured vision knows.
        pipeline: how the images are made, or None.

    Raises DrakeTrackerError when the calibration file cannot be used, or the cameras do not see the belt.
    """
    if isinstance(scenario.vision, Measured):
        return measured_vision(scenario, scenario.vision, arrivals), {}
    windows = rendered_windows(scenario)
    latency = 0 if pipeline is None else pipeline.latency
    vision = image_vision(scenario, scenario.vision, windows, image_latency=latency)
    return vision, {f"camera_{side}": windows[side] for side in SIDES}


def measured_vision(
    scenario: ConveyorScenario, settings: Measured, arrivals: Sequence[Arrival]
) -> MeasuredPartsDiagram:
    """Returns the vision of a scenario without cameras, which sees the belt from its entry to its end.

    Args:
        scenario: the scenario.
        settings: of its vision.
        arrivals: the parts of the run.
    """
    belt = scenario.belt
    system = MeasuredPartsSystem(
        settings,
        [arrival.kind for arrival in arrivals],
        belt_height=belt.height,
        view=belt_between(scenario, belt.entry, belt.end),
        seed=scenario.seed,
    )
    return MeasuredPartsDiagram(system, settings.lag_cycles)


def image_vision(
    scenario: ConveyorScenario, settings: Rendered, windows: Mapping[str, ImageWindow], **more: Any
) -> PartVisionDiagram:
    """Returns the vision of a scenario on images, which reports parts from the entry of the belt to its end.

    Args:
        scenario: the scenario.
        settings: of its vision.
        windows: {side: window of the full image that the images show}.
        **more: further arguments of `PartVisionDiagram`.

    Raises DrakeTrackerError when the calibration file cannot be used, or the cameras do not see the belt.
    """
    belt, arm, cameras = scenario.belt, None, calibrated_cameras(scenario)
    check_view(scenario, cameras)
    if settings.parts.mask_arm:
        description = arm_of(scenario)
        arm = (ArmShape(description), len(description.q_start))
    return PartVisionDiagram(
        cameras,
        image_windows=windows,
        belt=seen_belt(scenario),
        belt_height=belt.height,
        reach=(belt.entry, belt.end),
        settings=settings.parts,
        arm=arm,
        lag_cycles=settings.lag_cycles,
        update_cycles=settings.update_cycles,
        **more,
    )


def check_view(scenario: ConveyorScenario, cameras: Mapping[str, CameraModel]) -> None:
    """Raises DrakeTrackerError when a camera does not see the whole belt from its entry to the end of the window.

    Args:
        scenario: the scenario.
        cameras: {side: calibrated camera}.
    """
    first, last = scenario.belt.entry, scenario.window.y_last
    (x0, y0), (x1, y1) = belt_between(scenario, first, last)
    corners = np.array([[x, y, scenario.belt.height] for x in (x0, x1) for y in (y0, y1)])
    for side, camera in cameras.items():
        if not camera.sees(corners).all():
            raise DrakeTrackerError(
                f"{scenario.where('cameras')}: the {side} camera does not see the whole belt from belt.entry, "
                f"y = {first:g} m, to window.y_last, {last:g} m; move the cameras and calibrate them, or use !Measured"
            )


def rendered_windows(scenario: ConveyorScenario) -> dict[str, ImageWindow]:
    """Returns {side: window of the full image that a scenario renders}."""
    config = scenario.cameras
    if not config.render_window:
        return dict.fromkeys(SIDES, (0, 0, config.width, config.height))
    return {
        side: renderable_window(
            belt_window(camera, seen_belt(scenario), scenario.belt.height).bounds, config.width, config.height
        )
        for side, camera in calibrated_cameras(scenario).items()
    }


def seen_belt(scenario: ConveyorScenario) -> np.ndarray:
    """Returns the lowest and the highest corner (x, y) in W of the belt that the cameras look at, shape (2, 2) [m]."""
    return belt_between(scenario, scenario.belt.entry - BEFORE, scenario.belt.end)


def belt_between(scenario: ConveyorScenario, first: float, last: float) -> np.ndarray:
    """Returns the lowest and the highest corner (x, y) in W of a piece of belt, shape (2, 2) [m].

    Args:
        scenario: the scenario.
        first: y at which it begins [m].
        last: y at which it ends [m].
    """
    half = 0.5 * scenario.belt.width
    return np.array([[scenario.belt.middle - half, first], [scenario.belt.middle + half, last]])
