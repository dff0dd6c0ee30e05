"""Measures the error of a scenario's camera loop and keeps it in a file, from which `Measured` vision is made."""

import sys
import time
from pathlib import Path

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, EventStatus

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.log import add_loggers, read_log
from drake_tracker.core.machine import require_renderer
from drake_tracker.core.progress import Progress
from drake_tracker.tasks.episode import errors, train_pose
from drake_tracker.tasks.train.diagram import flow_parameters, load_cameras, make_diagram, slowest_seen
from drake_tracker.tasks.train.scenario import Rendered
from drake_tracker.tasks.train.track_placement import draw_track
from drake_tracker.vision.measured_error import AXES
from drake_tracker.vision.measured_error_file import save_error
from drake_tracker.vision.measured_error_fit import HEADINGS, Sighting, combine, fit_speed
from drake_tracker.world.cameras import describe_rig, focal_length

SEEDS, LAPS = 2, 2
MOST_SEEDS = 100
"""Seeds from here on belong to benchmarks."""
SPEEDS = (0.05, 0.10, 0.15, 0.20, 0.30, 0.45, 0.60)
"""Of the train [m/s]; the error depends on it."""
SETTLED = 1.0
"""Time [s] at the start of each run that does not count: the train gathers speed."""
_SHOWN = 12
_BEND_RADIUS = 0.12
"""Radius [m] of the tightest bends that are grasped in."""


def measure(scenario, path, seeds=SEEDS, laps=LAPS, speeds=SPEEDS, progress=True):
    """Runs the camera loop of a `TrainScenario` without a grasp, fits the error of its points, prints it, writes it.

    Each speed [m/s] is run with each seed from 0 on for so many laps, seeds in turn forward and backward where the
    scenario leaves the direction open. Returns the `MeasuredError`. Raises DrakeTrackerError on bad input, before the
    first run where that can be known.
    """
    check_request(scenario, path, seeds, laps, speeds)
    require_renderer()
    fits, runs = {}, len(speeds) * seeds
    start, pixel = time.monotonic(), pixel_footprint(scenario.cameras)
    for k, speed in enumerate(sorted(speeds)):
        sightings = []
        for seed in range(seeds):
            done = k * seeds + seed
            if progress:
                spent = f", {time.monotonic() - start:.0f} s so far" if done else ""
                print(f"[{done + 1}/{runs}] {speed:g} m/s, seed {seed}{spent}", file=sys.stderr, flush=True)
            sightings += watch(scenario, seed, laps, speed, progress)
        try:
            fits[speed] = fit_speed(sightings, pixel)
        except DrakeTrackerError as error:
            raise DrakeTrackerError(f"at {speed:g} m/s {error}") from None
    seen_from = slowest_seen(scenario, load_cameras(scenario), flow_parameters(scenario))
    print_fits(fits)
    error = combine(fits, pixel, seen_from)
    notes = {
        "scenario": scenario.name,
        "track": scenario.track.kind,
        "body": scenario.train.body,
        "detector": scenario.vision.detector.preset,
        "centroid": scenario.vision.detector.centroid,
        "seeds": seeds,
        "laps": laps,
        "points": {f"{speed:g}": fit.points for speed, fit in fits.items()},
        "jitter_std": {f"{speed:g}": np.round(fit.std, 6).tolist() for speed, fit in fits.items()},
    }
    save_error(path, error, rig=describe_rig(scenario.cameras), notes=notes)
    print(f"wrote {path}")
    return error


def check_request(scenario, path, seeds, laps, speeds):
    """Raises DrakeTrackerError, in one line, when `measure` cannot do what it is asked."""
    if scenario.task != "train":
        raise DrakeTrackerError(f"{scenario.name}: only the error of the train's cameras is measured")
    if not isinstance(scenario.vision, Rendered):
        raise DrakeTrackerError(f"{scenario.where('vision')} must be !Rendered: only cameras can be measured")
    if not 1 <= seeds <= MOST_SEEDS:
        raise DrakeTrackerError(f"--seeds {seeds}: must be from 1 to {MOST_SEEDS}")
    if not laps >= 1:
        raise DrakeTrackerError(f"--laps {laps}: must be 1 or more")
    if not speeds or not all(0.01 <= speed <= 1.0 for speed in speeds) or len(set(speeds)) < len(speeds):
        shown = ",".join(f"{speed:g}" for speed in speeds)
        raise DrakeTrackerError(f"--speeds {shown}: must be different numbers from 0.01 to 1 m/s")
    path = Path(path)
    if path.is_dir() or not path.absolute().parent.is_dir():
        raise DrakeTrackerError(f"-o {path}: must be a file in a folder that exists")


def pixel_footprint(cameras):
    """Returns the width [m] that a pixel covers at the point the cameras look at."""
    return float(cameras.distance / focal_length(cameras.height, cameras.fov_deg))


def watch(scenario, seed, laps, speed, progress=False):
    """Runs the loop without a grasp; returns the list of `Sighting` of the run."""
    direction = scenario.track.direction
    if direction == "random":
        direction = "backward" if seed % 2 else "forward"
    scenario = scenario.with_settings({"seed": seed, "track.speed": speed, "track.direction": direction})
    track, start = draw_track(scenario)
    way = laps * track.length if track.closed else track.length - start
    duration = float(way / speed + SETTLED)
    scenario = scenario.with_settings({"duration": duration, "grasp.settle_time": 2.0 * duration})  # no grasp
    hand_eye = make_diagram(scenario)
    builder = DiagramBuilder()
    builder.AddSystem(hand_eye)
    loggers = add_loggers(builder, hand_eye)
    simulator = Simulator(builder.Build())
    line = Progress(scenario.duration)
    if progress:
        simulator.set_monitor(lambda context: line(context.get_time(), "watching") or EventStatus.DidNothing())
    try:
        simulator.AdvanceTo(scenario.duration)
    finally:
        line.close()
    return sightings_of(read_log(loggers, simulator.get_context()), scenario.track.speed)


def sightings_of(log, speed):
    """Returns the stretches of a log over which the train ran, as a list of `Sighting`."""
    point, truth = log["point"], log["truth_train_state"]
    fresh = np.concatenate([[True], np.diff(point["stamp"]) > 0.0]) & (point["stamp"] > SETTLED)
    stamps = point["stamp"][fresh]
    pose = train_pose(log, stamps)
    state = {name: np.interp(stamps, truth.times, truth[name]) for name in ("vx", "vy", "wz")}
    horizontal = errors(log, stamps, point.view("x", "y")[fresh])
    error = np.column_stack([horizontal, point["z"][fresh] - pose[:, 2]])
    error[point["valid"][fresh] == 0] = np.nan
    running = np.hypot(state["vx"], state["vy"]) > 0.5 * speed
    cuts = np.nonzero(np.diff(running.astype(int)))[0] + 1
    return [
        Sighting(pose[k, :2], pose[k, 3], np.hypot(state["vx"][k], state["vy"][k]), state["wz"][k], error[k])
        for k in np.split(np.arange(len(stamps)), cuts)
        if len(k) and running[k[0]]
    ]


def print_fits(fits):
    """Prints {speed: SpeedFit} as tables: jitter, correlation and drop-outs over the speed, bias over the heading."""
    print("what the bias leaves, along, across, vertical: std; its correlation 1, 2, 5 cycles later; share that comes")
    print("back at the same place; and cycles without a point")
    for speed, fit in fits.items():
        std = ", ".join(f"{1e3 * x:.2f}" for x in fit.std)
        later = "  ".join(", ".join(f"{x:+.2f}" for x in fit.correlation[lag]) for lag in (1, 2, 5))
        again = ", ".join(f"{x:.2f}" for x in fit.returns)
        print(f"{speed:5.2f} m/s  {std} mm  {later}  {again}  missing {fit.missing[0]:.1%}  {fit.points} points")
    middle = sorted(fits)[len(fits) // 2]
    table = 1e3 * fits[middle].bias[:, :: HEADINGS // _SHOWN]
    print(f"bias at {middle:g} m/s over the heading, {', '.join(AXES)} [mm]: straight on; bending left, right at 6 1/m")
    for k in range(_SHOWN):
        parts = [table[0, k] + bend * table[1, k] for bend in (0.0, 6.0, -6.0)]
        shown = "   ".join(", ".join(f"{x:+5.1f}" for x in part) for part in parts)
        print(f"{k * 360 // _SHOWN:4d} deg  {shown}")
    print(f"bias over all headings, rms (mean) [mm]: {', '.join(AXES)}; inwards in a bend of {_BEND_RADIUS:g} m")
    for speed, fit in sorted(fits.items()):
        rms, mean = bias_over_headings(fit.bias)
        print(f"{speed:5.2f} m/s  " + "  ".join(f"{1e3 * a:.1f} ({1e3 * b:+.1f})" for a, b in zip(rms, mean)))


def bias_over_headings(bias, radius=_BEND_RADIUS):
    """Returns (rms, mean), each (4,) [m], of a `SpeedFit`'s bias over all headings: along, across and vertical on a
    straight path, and across it, inwards positive, in bends of ``radius`` [m] to either side.
    """
    straight, per_curvature = bias[0], bias[1, :, 1] / radius
    inwards = np.concatenate([straight[:, 1] + per_curvature, per_curvature - straight[:, 1]])
    parts = [*straight.T, inwards]
    return np.array([np.sqrt(np.mean(part**2)) for part in parts]), np.array([np.mean(part) for part in parts])
