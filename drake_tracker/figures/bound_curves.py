"""Lower bounds on the error of any estimator, read from a file and drawn beside the errors of the estimators.

`OWN` is the file of the bounds for the simulated drives of the figure; ``benchmarks/estimation/bound_curves.py`` writes
it.
"""

import json
import os
from pathlib import Path
from typing import Any

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.files.text_file import read_text

OWN = Path(__file__).with_name("bounds.json")
STAGES = ("first_lap", "after_closure", "both")
LARGEST = 4 * 1024 * 1024
"""Greatest size of a file [bytes]."""
_GREATEST = 1e6
"""Greatest time [s] and error [m] of a curve."""
_FORM = "a list of {name, stage, horizon_s, rms_m}"


def read_bounds(path: str | os.PathLike[str]) -> list[dict[str, Any]]:
    """Returns the curves in a JSON file, as dicts.

    Each has ``name``, the text of the legend; ``stage``, one of `STAGES`, the panel in which it is drawn; ``horizon_s``
    and ``rms_m``, two lists of the same length: time ahead [s] and lower bound on the root mean square error [m].
    Raises DrakeTrackerError, in one line, for any other content.
    """
    try:
        curves = json.loads(read_text(path, LARGEST))
    except OSError as error:
        raise DrakeTrackerError(f"--bounds {path}: the file cannot be read: {error.strerror}") from None
    except (ValueError, RecursionError) as error:
        raise DrakeTrackerError(f"--bounds {path}: not valid JSON: {error}") from None
    if not isinstance(curves, list):
        raise DrakeTrackerError(f"--bounds {path}: the file holds {type(curves).__name__}; it must hold {_FORM}")
    for number, curve in enumerate(curves, 1):
        trouble = _trouble(curve)
        if trouble:
            raise DrakeTrackerError(f"--bounds {path}: curve {number}: {trouble}; the file must hold {_FORM}")
    return curves


def _trouble(curve: Any) -> str | None:
    if not isinstance(curve, dict) or not {"name", "stage", "horizon_s", "rms_m"} <= set(curve):
        return "a key is missing"
    if curve["stage"] not in STAGES:
        return f"stage is {curve['stage']!r}; allowed are {', '.join(STAGES)}"
    for key in ("horizon_s", "rms_m"):
        row = curve[key]
        if not isinstance(row, list) or not all(isinstance(x, (int, float)) and abs(x) <= _GREATEST for x in row):
            return f"{key} is not a list of numbers up to {_GREATEST:g}"
    if len(curve["horizon_s"]) != len(curve["rms_m"]) or not curve["rms_m"] or min(curve["rms_m"]) <= 0.0:
        return "horizon_s and rms_m must have the same length, and rms_m must be above 0"
    return None
