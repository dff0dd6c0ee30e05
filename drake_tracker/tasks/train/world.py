"""The laboratory of a run of the train."""

from collections.abc import Mapping, Sequence

import numpy as np

from drake_tracker.arm.description import Arm
from drake_tracker.tasks.train.scenario import TrainScenario
from drake_tracker.world.cameras import ImageWindow
from drake_tracker.world.tracks import Track
from drake_tracker.world.world_diagram import WorldDiagram


def make_train_world(
    scenario: TrainScenario,
    *,
    description: Arm,
    q_initial: Sequence[float] | np.ndarray,
    track: Track,
    start: float,
    windows: Mapping[str, ImageWindow] | None = None,
) -> WorldDiagram:
    """Returns the `WorldDiagram` of a scenario.

    Args:
        scenario: its settings of the track, the train, the table, the cameras, the light and the jaws.
        description: the arm and its gripper.
        q_initial: joints at the start [rad].
        track: in the direction of travel.
        start: arc length at which the train starts [m].
        windows: {camera name: window} to render; None renders the full images, an empty one adds no cameras.
    """
    return WorldDiagram(
        description=description,
        q_initial=q_initial,
        track=track,
        start=start,
        body=scenario.train.body,
        table_height=scenario.table_height,
        speed=scenario.track.speed,
        speed_law=scenario.track.speed_law,
        variation=scenario.track.variation,
        grip_force=scenario.grasp.grip_force,
        jaw_opening=scenario.grasp.jaw_opening,
        cameras=scenario.cameras,
        lighting=scenario.lighting,
        windows=windows,
        seed=scenario.seed,
        time_step=scenario.time_step,
    )
