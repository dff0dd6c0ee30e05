"""The two runs of the camera loop that figures 7 and 12 to 14 are made of: one tracks, one grasps."""

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.log import load_log
from drake_tracker.core.progress import Progress
from drake_tracker.run.simulation import simulate
from drake_tracker.tasks import load_scenario
from drake_tracker.tasks.train.track_placement import draw_track

TRACKING = "train:paper"
"""The filter of 1991: the figures show what the paper's own filter makes of the points."""
GRASPING = "train"
LAPS, SPEED = 3, 0.15
"""Of the tracking run; speed in [m/s]."""
START_UP = 1.5
"""Simulated time [s] beyond the laps themselves: the train has to gather speed."""
QUICK_DURATION = 3.0
"""Simulated time [s] of each run of a preview."""


def tracking_scenario(seed, quick=False):
    """Returns (scenario, length of the track [m]) of a run that follows the train for some laps and never grasps."""
    scenario = load_scenario(TRACKING, seed=seed, overrides=[f"track.speed={SPEED}"])
    length = draw_track(scenario)[0].length
    duration = QUICK_DURATION if quick else LAPS * length / SPEED + START_UP
    return scenario.with_settings({"duration": duration, "grasp.settle_time": 2.0 * duration}), length


def grasping_scenario(seed):
    """Returns the scenario of a run that ends with a train lifted, or after a minute without."""
    return load_scenario(GRASPING, seed=seed)


def record(scenario, out, stop):
    """Runs a scenario, leaves its run directory at ``out``, shows progress, and returns (log, summary).

    ``stop`` False runs for the whole duration whatever happens.
    """
    progress = Progress(scenario.duration)
    try:
        summary = simulate(scenario, out=out, record=False, progress=progress, stop=stop)
    finally:
        progress.close()
    if summary["interrupted"]:
        raise KeyboardInterrupt
    if not (log := load_log(out / "log.npz"))["point"]["valid"].any():
        raise DrakeTrackerError(f"{out}: nothing was seen in this run, there is nothing to draw")
    return log, summary
