"""One trial, in a worker."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any, NamedTuple

from drake_tracker.core.errors import MachineError

if TYPE_CHECKING:
    from drake_tracker.campaign.plan import Trial


class Lost(NamedTuple):
    """Stands in place of a result when a trial could not be completed, for a reason that is not the robot's.

    Attributes:
        reason: one line.
    """

    reason: str


def run_trial(trial: Trial) -> dict[str, Any] | Lost:
    """Runs a `plan.Trial`. Returns its line of the record (settings, seed and the run's summary), or `Lost`."""
    return run_line(trial.scenario, settings=trial.settings)


def run_line(scenario: Any, **named: Any) -> dict[str, Any] | Lost:
    """Runs a scenario. Returns its line of a record, or `Lost` when the machine failed.

    A run that ends with an exception counts as a failed run, and the exception is its reason.

    Args:
        scenario: of any task.
        named: further values of the line, which come first.
    """
    from drake_tracker.run.simulation import simulate  # here, because checking a campaign must not wait for Drake

    start = time.monotonic()
    try:
        summary = simulate(scenario)
    except (MachineError, MemoryError, OSError) as error:
        return Lost(f"{type(error).__name__}: {error}")
    except (Exception, SystemExit) as error:  # one broken trial must not cost the others; Drake raises SystemExit
        text = " ".join(str(error).split())
        summary = {"scenario": scenario.name, "success": False, "failure_reason": f"{type(error).__name__}: {text}"}
    return {**named, "seed": scenario.seed, "wall_s": round(time.monotonic() - start, 3), **summary}
