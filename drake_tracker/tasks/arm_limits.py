"""How close the arm came to its limits during a run."""

from dataclasses import dataclass

import numpy as np

from drake_tracker.arm.arm_model import make_arm_model
from drake_tracker.arm.description import ArmDescription
from drake_tracker.arm.plant import actuators_of
from drake_tracker.tasks.episode import Log

SATURATED = 0.999
"""Fraction of a drive's effort limit that counts as saturation."""


@dataclass(frozen=True, eq=False)
class ArmLimits:
    """Limits of n joints.

    Attributes:
        lower: lowest positions [rad], shape (n,).
        upper: highest positions [rad], shape (n,).
        speed: greatest speeds [rad/s], shape (n,).
        effort: greatest efforts of the drives [N m], shape (n,).
    """

    lower: np.ndarray
    upper: np.ndarray
    speed: np.ndarray
    effort: np.ndarray


def limits_of(description: ArmDescription) -> ArmLimits:
    """Returns the limits of the joints of an arm."""
    model = make_arm_model(description)
    effort = np.array([actuator.effort_limit() for actuator in actuators_of(model.plant, model.arm_instance)])
    return ArmLimits(model.position_lower, model.position_upper, model.velocity_limit, effort)


def arm_findings(log: Log, limits: ArmLimits) -> dict[str, float | None]:
    """Returns the entries of the summary about the limits of the arm.

    A saturation lasts for the number of consecutive saturated samples times the sampling period of 1/300 s.

    Args:
        log: {name: Signal} of the run.
        limits: limits of the arm.

    Returns {"joint_limit_margin_rad", "speed_share", "longest_saturation_s"}; None without samples.
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
    """Returns the greatest number of consecutive true values."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]])))
    return max(edges[1::2] - edges[::2], default=0)
