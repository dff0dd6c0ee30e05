"""What the arm of a train's scenario can reach: the pose in which it waits, and whether it can follow a track."""

import numpy as np

from drake_tracker.arm.arm_model import make_arm_model, tool_down
from drake_tracker.arm.differential_ik import joints_for, make_parameters, step_joints
from drake_tracker.diagrams.arms import arm_of
from drake_tracker.tasks.train.scenario import TrainScenario
from drake_tracker.world.plant import TRAIN_HEIGHT
from drake_tracker.world.tracks import Track

CHECKED_PLACES = 40
"""Places along a track that are tried."""
_STEP, _STEPS = 0.1, 20
"""Of the inverse kinematics from one place to the next: its time [s], and how many it may take."""
_NEAR = 1e-3


class Reach:
    """The arm of a scenario over its table.

    description: an `ArmDescription`. model: its `ArmModel`. home: the reference (x, y, z, yaw) over which the hand
    waits. q_initial: the joints [rad] there, the tool down at the height at which it hovers.

    Raises DrakeTrackerError when the arm cannot bring its tool there.
    """

    def __init__(self, scenario: TrainScenario) -> None:
        self._z = scenario.table_height + TRAIN_HEIGHT
        self._heights = (scenario.grasp.hover_height, scenario.grasp.grasp_height)
        self.description = arm_of(scenario)
        self.model = make_arm_model(self.description)
        self.home = home_reference(scenario)
        over_home = tool_down(self.home[:3] + [0.0, 0.0, scenario.grasp.hover_height], self.home[3])
        self.q_initial = joints_for(self.model, self.description.q_start, over_home)

    def missed(self, track: Track) -> tuple[float, float, float] | None:
        """Returns the first place (x, y, height over the train) [m] of a track that the tool does not come to, be it to
        hover or to grasp, or None."""
        parameters = make_parameters(self.model, _STEP)
        q = np.array(self.q_initial)
        for s in np.linspace(0.0, track.length, CHECKED_PLACES, endpoint=False):
            x, y, _ = track.pose(s)
            for height in self._heights:
                X_WT = tool_down((float(x), float(y), self._z + height), np.pi / 2)
                for _ in range(_STEPS):
                    q, _ = step_joints(self.model, parameters, q, X_WT)
                    if np.linalg.norm(self.model.tool_pose(q).translation() - X_WT.translation()) < _NEAR:
                        break
                else:
                    return float(x), float(y), height
        return None


def home_reference(scenario: TrainScenario) -> np.ndarray:
    """Returns the reference (x, y, z, yaw) over which the hand waits: the middle of the work volume, train high.

    Turned so that joint 6 waits near the middle of its range.
    """
    low, high = np.array(scenario.vision.work_volume)
    middle = 0.5 * (low + high)
    return np.array([middle[0], middle[1], scenario.table_height + TRAIN_HEIGHT, np.pi])
