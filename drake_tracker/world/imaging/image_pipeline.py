"""How late the images of simulated cameras appear, and how many processes make them in the meantime."""

import os
from collections.abc import Callable
from dataclasses import dataclass

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.world.config import RENDER_PROCESSES

VARIABLE = "DRAKE_TRACKER_RENDER_PROCESSES"
"""Environment variable that says what "auto" means."""

MOST_LATENCY = 12
"""Cycles for which images are made ahead; more would only delay what is shown of them."""


@dataclass(frozen=True)
class ImagePipeline:
    """How the images of a `PipelinedCamera` are made.

    Attributes:
        latency: cycles from the capture of an image until it appears.
        processes: number of processes.
        wanted: whether the images of a cycle, given by its number, are likely to be read; the others are made only if
            they are read.
    """

    latency: int
    processes: int
    wanted: Callable[[int], bool] = lambda cycle: True


def process_count(setting: str | int) -> int:
    """Returns how many processes make images.

    Args:
        setting: a number of processes, or "auto": one for each processor but the one that simulates, two at most. The
            environment variable `VARIABLE` takes the place of "auto".

    Raises DrakeTrackerError when the environment variable is not one of the settings.
    """
    if setting != "auto":
        return int(setting)
    variable = os.environ.get(VARIABLE, "auto")
    if variable not in RENDER_PROCESSES:
        raise DrakeTrackerError(f"{VARIABLE} is {variable!r}; it must be one of {', '.join(RENDER_PROCESSES)}")
    if variable != "auto":
        return int(variable)
    from drake_tracker.core.processes.worker_pool import processors  # not needed to read a scenario

    return min(processors() - 1, 2)
