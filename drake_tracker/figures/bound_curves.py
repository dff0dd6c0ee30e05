"""Bounds on the error of any estimator, from a file, to be drawn beside what the estimators reach.

`OWN` holds those of the figure's own world; ``benchmarks/estimation/bound_curves.py`` makes it.
"""

import json
import math
from pathlib import Path

from drake_tracker.core.errors import DrakeTrackerError

OWN = Path(__file__).with_name("bounds.json")
STAGES = ("first_lap", "after_closure", "both")
_FORM = "a list of {name, stage, horizon_s, rms_m}"


def read_bounds(path):
    """Returns the curves of a JSON file, a list of dicts.

    Each has ``name``, the text of the legend; ``stage``, one of `STAGES`: the panel it belongs to; ``horizon_s`` and
    ``rms_m``, two lists of equal length: time ahead [s] and least root mean square error [m].
    Raises DrakeTrackerError, in one line, for anything else.
    """
    try:
        curves = json.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise DrakeTrackerError(f"--bounds {path}: the file cannot be read: {error.strerror}") from None
    except ValueError as error:
        raise DrakeTrackerError(f"--bounds {path}: this is no JSON: {error}") from None
    if not isinstance(curves, list):
        raise DrakeTrackerError(f"--bounds {path}: the file holds {type(curves).__name__}; it must hold {_FORM}")
    for number, curve in enumerate(curves, 1):
        trouble = _trouble(curve)
        if trouble:
            raise DrakeTrackerError(f"--bounds {path}: curve {number}: {trouble}; the file must hold {_FORM}")
    return curves


def _trouble(curve):
    if not isinstance(curve, dict) or not {"name", "stage", "horizon_s", "rms_m"} <= set(curve):
        return "a key is missing"
    if curve["stage"] not in STAGES:
        return f"stage is {curve['stage']!r}, allowed are {', '.join(STAGES)}"
    for key in ("horizon_s", "rms_m"):
        row = curve[key]
        if not isinstance(row, list) or not all(isinstance(x, (int, float)) and math.isfinite(x) for x in row):
            return f"{key} is no list of finite numbers"
    if len(curve["horizon_s"]) != len(curve["rms_m"]) or not curve["rms_m"] or min(curve["rms_m"]) <= 0.0:
        return "horizon_s and rms_m must be of one length, and rms_m above 0"
    return None
