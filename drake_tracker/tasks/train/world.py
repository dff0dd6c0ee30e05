"""Makes the laboratory of the train from a scenario."""

from collections.abc import Mapping, Sequence

import numpy as np

from drake_tracker.arm.description import Arm
from drake_tracker.faults.fault import Fault
from drake_tracker.tasks.train.objects import train_objects
from drake_tracker.tasks.train.scenario import TrainScenario
from drake_tracker.tasks.train.vision_parts import tracks_several
from drake_tracker.world.imaging.cameras import ImageWindow
from drake_tracker.world.imaging.image_pipeline import ImagePipeline
from drake_tracker.world.train.tracks import Track
from drake_tracker.world.train.world_diagram import WorldDiagram


def make_train_world(
    scenario: TrainScenario,
    *,
    description: Arm,
    q_initial: Sequence[float] | np.ndarray,
    track: Track,
    start: float,
    windows: Mapping[str, ImageWindow] | None = None,
    pipeline: ImagePipeline | None = None,
    faults: Sequence[Fault] = (),
) -> WorldDiagram:
    """Returns the laboratory of a scenario.

    Args:
        scenario: the scenario.
        description: the arm and its gripper.
        q_initial: joints at the start [rad], shape (n,).
        track: track in the direction of travel.
        start: arc length at which the train starts [m].
        windows: {name of the camera: window to render}. None renders the full images; an empty dict adds no cameras.
        pipeline: how the images are made beside the simulation; None: they are rendered when they are read.
        faults: what goes wrong.
    """
    return WorldDiagram(
        description=description,
        q_initial=q_initial,
        track=track,
        start=start,
        body=scenario.train.body,
        scale=scenario.train.scale,
        colour=scenario.train.colour,
        start_delay=scenario.train.start_delay,
        table_height=scenario.table_height,
        table_colour=scenario.table_colour,
        speed=scenario.track.speed,
        speed_law=scenario.track.speed_law,
        variation=scenario.track.variation,
        event=scenario.track.event,
        grip_force=scenario.grasp.grip_force,
        jaw_opening=scenario.grasp.jaw_opening,
        cameras=scenario.cameras,
        lighting=scenario.lighting,
        windows=windows,
        pipeline=pipeline,
        objects=train_objects(scenario, track, start),
        judge_all=tracks_several(scenario),
        faults=faults,
        seed=scenario.seed,
        time_step=scenario.time_step,
    )
