"""The kinds of trouble that can keep the arm from lifting the train, and stretches of time in which one is present."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

_ROUNDING = 1e-9
"""Allowance for rounding errors of times [s]."""


class Cause(StrEnum):
    """Trouble that kept the arm from lifting the train, as in the summary of a run. A cause comes before its
    consequences."""

    TRAIN_LOST = "train_lost"
    DERAILED = "derailed"
    TRAIN_DISPLACED = "train_displaced"
    TRAIN_REVERSED = "train_reversed"
    TRAIN_STOPPED = "train_stopped"
    OPERATOR = "operator"
    HOST = "host"
    LINK = "link"
    CAMERA = "camera"
    CALIBRATION = "calibration"
    SECOND_OBJECT = "second_object"
    IMAGE_DISTURBED = "image_disturbed"
    ARM = "arm"
    GRIPPER = "gripper"
    TRACK_END = "track_end"
    MISSED = "missed"
    NOT_LEARNED = "not_learned"


@dataclass(frozen=True)
class Trouble:
    """A stretch of time in which something was not as it should be.

    Attributes:
        cause: what was wrong.
        start: when it began [s].
        end: when it ended [s].
        clause: what happened, as a clause without times: "the train stood still".
    """

    cause: Cause
    start: float
    end: float
    clause: str

    @property
    def sentence(self) -> str:
        """The clause with its times: "the train stood still from 4.0 to 6.0 s"."""
        return f"{self.clause} from {self.start:.1f} to {self.end:.1f} s"


def stretches(
    times: np.ndarray, present: np.ndarray, shortest: float, bridge: float = 0.1
) -> list[tuple[float, float]]:
    """Returns the stretches of time (start, end) [s] in which something is present.

    Args:
        times: times of the samples [s], increasing, shape (n,).
        present: whether it is present, shape (n,), bool.
        shortest: shortest stretch that counts [s].
        bridge: longest interruption that does not end a stretch [s].
    """
    here = times[present]
    if len(here) == 0:
        return []
    breaks = np.nonzero(np.diff(here) > bridge + _ROUNDING)[0]
    starts, ends = here[np.append(0, breaks + 1)], here[np.append(breaks, len(here) - 1)]
    return [(float(a), float(b)) for a, b in zip(starts, ends) if b - a >= shortest - _ROUNDING]


def troubles(
    cause: Cause, clause: str, times: np.ndarray, present: np.ndarray, shortest: float, bridge: float = 0.1
) -> list[Trouble]:
    """Returns a `Trouble` for each of the `stretches` in which something is present."""
    return [Trouble(cause, start, end, clause) for start, end in stretches(times, present, shortest, bridge)]
