"""Checks, for the scenarios of all tasks, of settings that are allowed one by one but make no sense together.

Each function returns a list of (key path, what is required), as `BaseScenario.problems` does.
"""

from collections.abc import Sequence

from drake_tracker.core.timing import PATH_DURATION
from drake_tracker.link.config import Lossy
from drake_tracker.scenarios.base import BaseScenario
from drake_tracker.world.imaging.image_pipeline import MOST_LATENCY

BYTES_PER_PIXEL = 44
"""Memory of a rendered pixel: buffers of the renderer, and the images made of them [bytes]. Rendering 2048 x 2048 px
with 4 x 4 rendered pixels each raises the peak memory of a process by 2.8 GiB."""
BYTES_AHEAD = 4 * (MOST_LATENCY + 2)
"""Memory of an image pixel in the images that are made ahead of their use [bytes]."""
MOST_IMAGE_MEMORY = 4 * 1024**3
"""Greatest memory of the images of a run [bytes]."""

Problems = list[tuple[str, str]]
"""(key path, what is required) of each problem."""


def link_problems(scenario: BaseScenario, link: object) -> Problems:
    """Returns a problem when packets arrive after the path that they predict has ended.

    Args:
        scenario: the scenario.
        link: settings of its link.
    """
    late = link.delay + link.jitter if isinstance(link, Lossy) else 0.0
    if scenario.lag + late < PATH_DURATION:
        return []
    key = set_by_user(scenario, ["link.delay", "link.jitter", scenario.LAG_KEY])
    return [
        (
            key,
            f"lets packets arrive too late: a packet predicts {PATH_DURATION:g} s from its image on, of which vision "
            f"takes {scenario.lag:.3g} s and the link up to {late:.3g} s (delay and jitter)",
        )
    ]


def image_problems(prefix: str, width: int, height: int, cameras: int = 1, supersampling: int = 1) -> Problems:
    """Returns a problem when the images of a run need more than `MOST_IMAGE_MEMORY`.

    Args:
        prefix: key path of the settings of the cameras.
        width: of an image [px].
        height: of an image [px].
        cameras: number of cameras.
        supersampling: rendered pixels per image pixel, along u and along v.
    """
    needed = cameras * width * height * (supersampling**2 * BYTES_PER_PIXEL + BYTES_AHEAD)
    if needed <= MOST_IMAGE_MEMORY:
        return []
    rendered = f"{cameras * width * height * supersampling**2 / 1e6:.0f} million rendered pixels"
    what = f"{width} x {height} px" + (
        f" with {supersampling} x {supersampling} rendered pixels each" if supersampling > 1 else ""
    )
    key = f"{prefix}.supersampling" if supersampling > 1 else f"{prefix}.width"
    return [(key, f"must be smaller: {what} need {needed / 1024**3:.1f} GiB of memory ({rendered}); at most "
             f"{MOST_IMAGE_MEMORY / 1024**3:g} GiB are allowed")]  # fmt: skip


def set_by_user(scenario: BaseScenario, keys: Sequence[str]) -> str:
    """Returns the first of several keys that a file or an override sets, to blame for a problem; else the last one."""
    return next((key for key in keys if key in scenario.origins), keys[-1])
