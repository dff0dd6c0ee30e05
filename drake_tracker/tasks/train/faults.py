"""Makes the faults of a scenario of the train."""

from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.diagrams.arms import arm_of
from drake_tracker.faults.fault import Fault
from drake_tracker.faults.kinds import make_faults
from drake_tracker.tasks.train.scenario import TrainScenario
from drake_tracker.world.imaging.cameras import camera_poses


def train_faults(scenario: TrainScenario) -> tuple[Fault, ...]:
    """Returns what goes wrong in a scenario.

    Raises DrakeTrackerError when a fault cannot happen in it.
    """
    if not scenario.faults:
        return ()
    description = arm_of(scenario)
    poses = camera_poses(scenario.cameras)
    return make_faults(
        scenario.faults,
        seed=scenario.seed,
        lag=scenario.vision.lag_cycles * VISION_PERIOD,
        table_height=scenario.table_height,
        work_volume=scenario.vision.work_volume,
        X_WCs={name.removeprefix("camera_"): X_WC.GetAsMatrix4() for name, X_WC in poses.items()},
        servo_inertia=description.servo_inertia,
        finger_stiffness=description.finger_stiffness,
        time_step=scenario.time_step,
    )
