"""The arithmetic of latency: when an action that a policy computes takes effect, in simulated time.

observation ──inference time──▶ action ──link delay──▶ arm
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.grasp.motor_schema import ROUNDING

WITH_ACTION, WALL_TIME = "action", "wall"
"""Inference time that is the last element of each action [s], and measured wall time, which is not reproducible."""
InferenceTime = float | str | Callable[[np.random.Generator], float]
"""A constant [s], `WITH_ACTION`, `WALL_TIME`, or a function that draws it from a generator [s]."""


@dataclass
class ActionLine:
    """The actions between the policy and the arm.

    Attributes:
        link_delay: time from the end of the computation until the arm has the action [s].
        pipelined: whether a new computation may begin before the last one has ended.
        current: the command in effect, shape (6,), see `action`.
        thinking_until: time at which the last computation ends [s].
    """

    link_delay: float
    pipelined: bool
    current: np.ndarray
    thinking_until: float = -np.inf
    _coming: list[tuple[float, np.ndarray]] = field(default_factory=list)

    def busy(self, now: float) -> bool:
        """Returns whether the policy still computes at a time [s], so that it takes no new request."""
        return not self.pipelined and now < self.thinking_until - ROUNDING

    def request(self, now: float, inference_time: float, command: np.ndarray) -> None:
        """Adds a command (6,) whose computation begins now and takes ``inference_time`` [s].

        An earlier command that would arrive later is dropped: the arm never goes back to an older one.
        """
        self.thinking_until = now + inference_time
        due = self.thinking_until + self.link_delay
        self._coming = [other for other in self._coming if other[0] < due] + [(due, command)]

    def in_effect(self, now: float) -> np.ndarray:
        """Returns the command in effect at a time [s]."""
        while self._coming and self._coming[0][0] <= now + ROUNDING:
            self.current = self._coming.pop(0)[1]
        return self.current


def check_time(name: str, time: object) -> float:
    """Returns a time [s]. Raises DrakeTrackerError when it is not a number from 0 on."""
    if not (isinstance(time, (int, float, np.number)) and np.isfinite(time) and time >= 0.0):
        raise DrakeTrackerError(f"{name} must be a time in seconds, 0 or more, not {time!r}")
    return float(time)


def lag_cycles(camera_lag: float) -> int:
    """Returns a lag of the cameras [s] in cycles. Raises DrakeTrackerError when it is not a whole number of cycles."""
    cycles = check_time("camera_lag", camera_lag) / VISION_PERIOD
    if abs(cycles - round(cycles)) > 1e-6:
        raise DrakeTrackerError(f"camera_lag = {camera_lag:g} s is {cycles:.3f} cycles of 1/60 s; it must be whole")
    return round(cycles)
