"""Whether the arm kept within its limits during a run."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from drake_tracker.arm.arm_model import make_arm_model
from drake_tracker.arm.description import ArmDescription
from drake_tracker.arm.plant import actuators_of
from drake_tracker.tasks.episode import Log

SATURATED = 0.999
"""Share of a drive's effort limit that counts as saturation."""


@dataclass(frozen=True, eq=False)
class ArmLimits:
    """Limits of n joints, arrays of shape (n,): positions [rad], speeds [rad/s], efforts of the drives [N m]."""

    lower: np.ndarray
    upper: np.ndarray
    speed: np.ndarray
    effort: np.ndarray


def limits_of(description: ArmDescription) -> ArmLimits:
    """Returns the `ArmLimits` of an `ArmDescription`."""
    model = make_arm_model(description)
    effort = np.array([actuator.effort_limit() for actuator in actuators_of(model.plant, model.arm_instance)])
    return ArmLimits(model.position_lower, model.position_upper, model.velocity_limit, effort)


def arm_findings(log: Log, limits: ArmLimits) -> dict[str, Any]:
    """Returns how near the arm came to its limits: the summary's entries on it, by name.

    The log holds a sample each 1/300 s; a saturation lasts as many of them as follow one another.
    """
    n = len(limits.speed)
    q, v = np.split(log["arm_state"].data, [n], axis=1)
    if len(q) == 0:
        return {"joint_limit_margin_rad": None, "speed_share": None, "longest_saturation_s": None}
    effort = log["arm_effort"]
    saturated = np.abs(effort.data) >= SATURATED * limits.effort
    step = np.median(np.diff(effort.times)) if len(effort.times) > 1 else 0.0
    return {
        "joint_limit_margin_rad": min(np.min(q - limits.lower), np.min(limits.upper - q)),
        "speed_share": np.max(np.abs(v) / limits.speed),
        "longest_saturation_s": step * max(_longest_run(drive) for drive in saturated.T),
    }


def _longest_run(flags: np.ndarray) -> int:
    """Returns how many true values follow one another at most."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]])))
    return max(edges[1::2] - edges[::2], default=0)
