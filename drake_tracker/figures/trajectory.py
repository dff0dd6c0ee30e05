"""Figure 13 of Allen et al. 1991: the measured points and the trajectory commanded after filtering."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from drake_tracker.core.log import Signal
from drake_tracker.figures.measured_arc import measured_points
from drake_tracker.figures.paper_style import head, quiet_grid, sheet
from drake_tracker.grasp.train.schema import Phase
from drake_tracker.scenarios.base import BaseScenario
from drake_tracker.tasks.episode import during
from drake_tracker.tasks.style import PREDICTED, SEEN
from drake_tracker.tasks.train.episode import errors, phase_spans, train_pose


def trajectory(log: Mapping[str, Signal], scenario: BaseScenario, lap_length: float) -> dict[str, Any]:
    """Returns the numbers of figure 13 for the last lap: measured, commanded and true positions [m, W].

    The commanded position is the servo's target at the instant for which it is due; it is predicted over the lag.

    Args:
        log: {name: Signal}.
        scenario: of the run.
        lap_length: [m].
    """
    target = log["target"]
    tracking = during(phase_spans(log, scenario.time_step), target.times, Phase.TRACK) & (target["valid"] > 0)
    times, commanded = target["time"][tracking], target.view("x", "y")[tracking]
    stamps, points = measured_points(log)
    truth = log["truth_train_state"]
    steps = np.hypot(*np.diff(truth.view("x", "y"), axis=0).T)
    distance = np.append(0.0, np.cumsum(steps))
    end = stamps[-1] if len(stamps) else truth.times[-1]
    start = np.interp(np.interp(end, truth.times, distance) - lap_length, distance, truth.times)

    def rms(at: np.ndarray, xy: np.ndarray) -> np.ndarray:
        error = errors(log, at, xy)
        return np.sqrt(np.nanmean(error**2, axis=0)) if len(at) else np.full(2, np.nan)

    of_points, of_commands = rms(stamps, points), rms(times, commanded)
    seen, sent, driven = (((row >= start) & (row <= end)) for row in (stamps, times, truth.times))
    return {
        "lap_s": end - max(start, truth.times[0]),
        "points_rms_along_m": of_points[0],
        "points_rms_across_m": of_points[1],
        "commanded_rms_along_m": of_commands[0],
        "commanded_rms_across_m": of_commands[1],
        "points_m": points[seen],
        "commanded_m": commanded[sent],
        "true_m": train_pose(log, truth.times[driven])[:, :2],
    }


def draw_trajectory(numbers: Mapping[str, Any]) -> Figure:
    """Returns figure 13: the track from above, with the robot at the bottom."""
    with sheet(8.6, 7.0) as figure:
        axes = figure.subplots()
        for key, look, name in (
            ("true_m", dict(color="#e3e6ea", lw=9, solid_joinstyle="round"), "the train"),
            ("points_m", dict(color=SEEN, ls="", marker=".", ms=4.5), "measured points"),
            ("commanded_m", dict(color=PREDICTED, lw=1.8), "commanded"),
        ):
            axes.plot(numbers[key][:, 1], numbers[key][:, 0], label=name, **look)
        axes.set_aspect("equal", adjustable="datalim")
        axes.invert_xaxis()
        axes.margins(0.06)
        axes.set(xlabel="$y$  [m], to the robot's left", ylabel="$x$  [m], away from the robot")
        quiet_grid(axes)
        axes.legend(loc="center")
        along, across = 1e3 * numbers["commanded_rms_along_m"], 1e3 * numbers["commanded_rms_across_m"]
        head(
            axes,
            "Figure 13 · Measured points and command",
            f"The last {numbers['lap_s']:.1f} s. The command is predicted over the lag; "
            f"its rms error is {along:.1f} mm along the track and {across:.1f} mm across.",
        )
    return figure
