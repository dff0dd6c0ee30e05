"""Draws every figure and writes the numbers behind them: the command `drake-tracker figures`."""

import json
import math
import os
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.files.atomic_file import write_text
from drake_tracker.core.files.regular_file import read_text
from drake_tracker.figures import loop_runs
from drake_tracker.figures.curvature import curvature_limit, draw_curvature
from drake_tracker.figures.densities import (
    arc_length_densities,
    bending_densities,
    draw_arc_length_densities,
    draw_bending_densities,
    draw_moment_ratios,
    moment_ratios,
)
from drake_tracker.figures.grasp_frames import draw_grasp_frames, render_frames, shown_moments
from drake_tracker.figures.horizon import draw_error_against_horizon, error_against_horizon
from drake_tracker.figures.kaiser_response import draw_kaiser_response, kaiser_response
from drake_tracker.figures.measured_arc import (
    draw_filtered_arc,
    draw_measured_density,
    filtered_arc,
    measured_density,
)
from drake_tracker.figures.paper_style import save
from drake_tracker.figures.studio import train_studio
from drake_tracker.figures.trajectory import draw_trajectory, trajectory
from drake_tracker.tasks.results import made_by
from drake_tracker.tasks.train.scenario import TrainScenario
from drake_tracker.tasks.train.setup import resolve

RUNS, QUICK_RUNS = 12, 1
"""Number of synthetic runs for the error over the horizon."""
_DIGITS = 6
OWN = Path(__file__).with_name("bounds.json")
STAGES = ("first_lap", "after_closure", "both")
LARGEST = 4 * 1024 * 1024
"""Greatest size of a file [bytes]."""
_GREATEST = 1e6
"""Greatest time [s] and error [m] of a curve."""
_FORM = "a list of {name, stage, horizon_s, rms_m}"


def make_figures(
    out: Path,
    seed: int = 0,
    quick: bool = False,
    bounds: Sequence[Mapping[str, Any]] | None = None,
    say: Callable[[str], object] = print,
) -> dict[str, Any]:
    """Draws every figure. Returns their numbers, which it also writes to figures.json.

    Args:
        out: an existing directory for the figures, and for the two runs of the camera loop (in ``runs``).
        seed: of the two runs of the camera loop and of the synthetic runs.
        quick: whether to make a preview: a few seconds of the camera loop, no grasp, one synthetic run.
        bounds: curves from `read_bounds`.
        say: called with a line of text for each figure.
    """
    numbers: dict[str, Any] = {
        "seed": seed,
        "quick": quick,
        **made_by(),
    }

    def keep(name: str, found: Any, figure: Figure) -> None:
        save(figure, out / f"{name}.png")
        numbers[name] = found
        say(f"{out / name}.png")

    for name, compute, draw in (
        ("figure_08", arc_length_densities, draw_arc_length_densities),
        ("figure_09", moment_ratios, draw_moment_ratios),
        ("figure_10", bending_densities, draw_bending_densities),
        ("figure_15", curvature_limit, draw_curvature),
        ("kaiser_response", kaiser_response, draw_kaiser_response),
    ):
        found = compute()
        keep(name, found, draw(found))

    runs = QUICK_RUNS if quick else RUNS
    found = error_against_horizon(seed, runs, bounds, lambda run, of: say(f"synthetic run {run + 1} of {of}"))
    keep("error_against_horizon", found, draw_error_against_horizon(found))

    (out / "runs").mkdir()
    scenario, length = loop_runs.tracking_scenario(seed, quick)
    say(f"camera loop, {scenario.name}: {scenario.duration:.1f} s of tracking")
    log, summary = loop_runs.record(scenario, out / "runs" / "tracking", stop=False)
    numbers["tracking_run"] = _run_facts(scenario, summary)
    for name, found, draw in (
        ("figure_07", measured_density(log), draw_measured_density),
        ("figure_12", filtered_arc(log), draw_filtered_arc),
        ("figure_13", trajectory(log, scenario, length), draw_trajectory),
    ):
        keep(name, found, draw(found))

    numbers["grasp_run"] = None
    if not quick:
        scenario = loop_runs.grasping_scenario(seed)
        say(f"camera loop, {scenario.name}: a grasp, {scenario.duration:g} s at most")
        log, summary = loop_runs.record(scenario, out / "runs" / "grasp", stop=True)
        if not summary["success"]:
            say(f"the train was not lifted ({summary['failure_reason']}): figure 14 shows other instants of the run")
        numbers["grasp_run"] = _run_facts(scenario, summary)
    shown = shown_moments(log, scenario)
    with tempfile.TemporaryDirectory() as folder:
        frames = render_frames(train_studio(resolve(scenario), folder), log, [moment.time for moment in shown])
    keep("figure_14", [moment._asdict() for moment in shown], draw_grasp_frames(frames, shown))

    rows = (f"{json.dumps(name)}: {json.dumps(found)}" for name, found in rounded(numbers).items())
    write_text(out / "figures.json", "{\n" + ",\n".join(rows) + "\n}\n")
    return numbers


def _run_facts(scenario: TrainScenario, summary: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the settings and results that describe a run to a reader of figures.json."""
    keys = (
        "success",
        "failure_reason",
        "time_to_grasp_s",
        "simulated_s",
        "vision_valid_fraction",
        "triangulation_rms_m",
        "triangulation_jitter_m",
        "prediction_rms_m",
        "lag_s",
    )
    return {
        "scenario": scenario.name,
        "seed": scenario.seed,
        "speed_m_s": scenario.track.speed,
        "estimator": type(scenario.estimator).__name__,
        **{key: summary[key] for key in keys},
    }


def rounded(value: Any) -> Any:
    """Returns a value fit for JSON: numbers rounded to six significant digits, None for numbers that are not finite."""
    if isinstance(value, dict):
        return {key: rounded(item) for key, item in value.items()}
    if isinstance(value, (list, tuple, np.ndarray)):
        return [rounded(item) for item in value]
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    if isinstance(value, (float, np.floating)):
        return float(f"{value:.{_DIGITS}g}") if math.isfinite(value) else None
    return int(value) if isinstance(value, np.integer) else value


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
