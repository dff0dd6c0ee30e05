"""Faults for tests: every kind with its defaults, and what makes a fault of settings."""

import numpy as np

from drake_tracker.arm.description import PUMA560
from drake_tracker.faults.kinds import FAULTS, make_faults
from drake_tracker.tasks.train.scenario import WORK_VOLUME, TrainScenario
from drake_tracker.world.imaging.cameras import camera_poses, true_camera_models

KINDS = list(FAULTS.makers)
X_WCS = {
    name.removeprefix("camera_"): X_WC.GetAsMatrix4() for name, X_WC in camera_poses(TrainScenario().cameras).items()
}
CAMERAS = {name.removeprefix("camera_"): model for name, model in true_camera_models(TrainScenario().cameras).items()}


def all_at_once(task="train"):
    """Returns the override that lists every fault of a task."""
    return "faults=[" + ", ".join(f"!{kind.__name__} {{}}" for kind in KINDS if task in kind.tasks) + "]"


def make(settings, seed=3):
    """Returns the fault of its settings."""
    known = {"lag": 0.25, "table_height": 0.45, "work_volume": WORK_VOLUME, "X_WCs": X_WCS, "time_step": 1 / 300}
    arm = {"servo_inertia": PUMA560.servo_inertia, "finger_stiffness": 5000.0}
    (fault,) = make_faults([settings], seed=seed, **known, **arm)
    return fault


def free_body(position=(0.56, 0.2, 0.485), yaw=0.0, velocity=(0.0, 0.0, 0.0)):
    """Returns the 13 numbers of a free body."""
    return np.array([np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2), *position, 0.0, 0.0, 0.0, *velocity])
