"""One trial, in a worker."""

import time
from typing import NamedTuple

from drake_tracker.core.errors import MachineError


class Lost(NamedTuple):
    """In the place of a result: the trial did not come to an end, and says nothing of the robot."""

    reason: str


def run_trial(trial):
    """Runs a `plan.Trial`; returns its line of the record: settings, seed and the run's summary; or `Lost`."""
    return run_line(trial.scenario, settings=trial.settings)


def run_line(scenario, **named):
    """Runs a scenario; returns its line, a dict: what is ``named``, seed, wall time [s] and the run's summary; or
    `Lost` when the machine failed.

    A run that ends with an exception counts as one that took nothing, and the exception is its reason.
    """
    from drake_tracker.run.simulation import simulate  # Only now: a campaign is checked without waiting for Drake.

    start = time.monotonic()
    try:
        summary = simulate(scenario)
    except (MachineError, MemoryError, OSError) as error:
        return Lost(f"{type(error).__name__}: {error}")
    except Exception as error:  # one broken trial must not cost the others
        text = " ".join(str(error).split())
        summary = {"scenario": scenario.name, "success": False, "failure_reason": f"{type(error).__name__}: {text}"}
    return {**named, "seed": scenario.seed, "wall_s": round(time.monotonic() - start, 3), **summary}
