"""Figure 13 of Allen et al. 1991: the points that vision found and the trajectory commanded after filtering."""

import numpy as np

from drake_tracker.figures.measured_arc import seen_points
from drake_tracker.figures.paper_style import head, quiet_grid, sheet
from drake_tracker.grasp.schema import Phase
from drake_tracker.tasks.episode import during, errors, phase_spans, train_pose
from drake_tracker.tasks.style import PREDICTED, SEEN


def trajectory(log, scenario, lap_length):
    """Returns the numbers of figure 13 for the last lap: vision points, commanded and true positions [m, W].

    What is commanded is the servo's target at the instant for which it holds; it has been predicted over the lag.
    ``lap_length`` [m].
    """
    target = log["target"]
    tracking = during(phase_spans(log, scenario.time_step), target.times, Phase.TRACK) & (target["valid"] > 0)
    times, commanded = target["time"][tracking], target.view("x", "y")[tracking]
    stamps, points = seen_points(log)
    truth = log["truth_train_state"]
    steps = np.hypot(*np.diff(truth.view("x", "y"), axis=0).T)
    way = np.append(0.0, np.cumsum(steps))
    end = stamps[-1] if len(stamps) else truth.times[-1]
    start = np.interp(np.interp(end, truth.times, way) - lap_length, way, truth.times)

    def rms(at, xy):
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


def draw_trajectory(numbers):
    """Returns figure 13, seen from above with the robot below."""
    with sheet(8.6, 7.0) as figure:
        axes = figure.subplots()
        for key, look, name in (
            ("true_m", dict(color="#e3e6ea", lw=9, solid_joinstyle="round"), "the train"),
            ("points_m", dict(color=SEEN, ls="", marker=".", ms=4.5), "vision points"),
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
            "Figure 13 · Seen and commanded",
            f"The last {numbers['lap_s']:.1f} s. The command, predicted over the lag, "
            f"is off by {along:.1f} mm rms along the track, {across:.1f} mm across.",
        )
    return figure
