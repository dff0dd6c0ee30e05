"""The two runs of the camera loop behind figures 7 and 12 to 14: in one the arm tracks, in the other it grasps."""

from pathlib import Path
from typing import Any

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.log import Signal, load_log
from drake_tracker.core.progress import Progress
from drake_tracker.run.options import RunOptions
from drake_tracker.run.simulation import simulate
from drake_tracker.tasks import load_scenario
from drake_tracker.tasks.train.scenario import TrainScenario
from drake_tracker.tasks.train.setup import resolve

TRACKING = "train"
"""The filter of 1991: the figures show what the paper's own filter makes of the points."""
GRASPING = "train:learned"
"""The grasp of 1991, with the filter that learns the closed path."""
LAPS, SPEED = 3, 0.15
"""Laps and speed [m/s] of the tracking run."""
START_UP = 1.5
"""Simulated time [s] before the laps, in which the train accelerates."""
QUICK_DURATION = 3.0
"""Simulated time [s] of each run of a preview."""


def tracking_scenario(seed: int, quick: bool = False) -> tuple[TrainScenario, float]:
    """Returns (scenario, length of the track [m]) of a run that follows the train for some laps and never grasps.

    Args:
        seed: of the run.
        quick: whether the run is a preview of `QUICK_DURATION`.
    """
    scenario = load_scenario(TRACKING, seed=seed, overrides=[f"track.speed={SPEED}"])
    length = resolve(scenario).track.length
    duration = QUICK_DURATION if quick else LAPS * length / SPEED + START_UP
    return scenario.with_settings({"duration": duration, "grasp.settle_time": 2.0 * duration}), length


def grasping_scenario(seed: int) -> TrainScenario:
    """Returns the scenario of a run that ends when the train is lifted, or after a minute."""
    return load_scenario(GRASPING, seed=seed)


def record(scenario: TrainScenario, out: Path, stop: bool) -> tuple[dict[str, Signal], dict[str, Any]]:
    """Runs a scenario and shows its progress. Returns (log, summary).

    Raises DrakeTrackerError when vision measured no point, and KeyboardInterrupt when the user stopped the run.

    Args:
        scenario: of the run.
        out: run directory to write.
        stop: whether the run ends with its outcome; otherwise it lasts its whole duration.
    """
    progress = Progress(scenario.duration)
    try:
        summary = simulate(scenario, out, RunOptions(record=False, stop_when_over=stop), progress=progress)
    finally:
        progress.close()
    if summary["interrupted"]:
        raise KeyboardInterrupt
    if not (log := load_log(out / "log.npz"))["point"]["valid"].any():
        raise DrakeTrackerError(f"{out}: vision measured no point in this run, so there is nothing to draw")
    return log, summary
