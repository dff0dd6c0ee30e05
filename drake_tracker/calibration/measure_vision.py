"""Measures the error of a scenario's camera loop, and writes it to the file that `Measured` vision reads."""

import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, DiagramBuilder, EventStatus

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.log import Signal
from drake_tracker.core.progress import Progress
from drake_tracker.core.system_check import require_renderer
from drake_tracker.measured.measured_error import AXES, MeasuredError
from drake_tracker.measured.measured_error_file import save_error
from drake_tracker.measured.measured_error_fit import HEADINGS, Sighting, SpeedFit, combine, fit_speed
from drake_tracker.run.log_recorder import add_loggers, read_log
from drake_tracker.tasks.registry import make_diagram, require_task
from drake_tracker.tasks.train.episode import errors, train_pose
from drake_tracker.tasks.train.scenario import Rendered, TrainScenario
from drake_tracker.tasks.train.setup import resolve
from drake_tracker.tasks.train.task import TASK
from drake_tracker.tasks.train.vision import slowest_seen
from drake_tracker.vision.centroid.config import MotionCentroid, NormalFlow
from drake_tracker.world.config import CamerasConfig
from drake_tracker.world.imaging.cameras import describe_rig, focal_length

SEEDS, LAPS = 2, 2
MOST_SEEDS = 100
"""Seeds from here on are reserved for benchmarks."""
SPEEDS = (0.05, 0.10, 0.15, 0.20, 0.30, 0.45, 0.60)
"""Speeds of the train [m/s]; the error depends on the speed."""
SETTLED = 1.0
"""Time [s] at the start of each run that does not count: the train accelerates."""
_SHOWN = 12
"""Number of headings in the table of the bias."""
_BEND_RADIUS = 0.12
"""Radius of the tightest bends in which the train is grasped [m]."""


def measure(
    scenario: TrainScenario,
    path: str | Path,
    seeds: int = SEEDS,
    laps: int = LAPS,
    speeds: Sequence[float] = SPEEDS,
    progress: bool = True,
) -> MeasuredError:
    """Runs the camera loop of a scenario without a grasp, fits the error of its points, prints it and writes it.

    Where the scenario leaves the direction open, even seeds run forward and odd seeds backward.

    Args:
        scenario: of the train, with `Rendered` vision.
        path: of the file to write.
        seeds: number of runs at each speed, with the seeds from 0 on.
        laps: laps of each run.
        speeds: speeds of the train [m/s].
        progress: whether to print progress to standard error.

    Raises DrakeTrackerError on bad input, before the first run where possible.
    """
    detector = check_request(scenario, path, seeds, laps, speeds)
    require_renderer()
    fits: dict[float, SpeedFit] = {}
    runs = len(speeds) * seeds
    start, pixel = time.monotonic(), pixel_footprint(scenario.cameras)
    for k, speed in enumerate(sorted(speeds)):
        sightings: list[Sighting] = []
        for seed in range(seeds):
            done = k * seeds + seed
            if progress:
                elapsed = f", {time.monotonic() - start:.0f} s so far" if done else ""
                print(f"[{done + 1}/{runs}] {speed:g} m/s, seed {seed}{elapsed}", file=sys.stderr, flush=True)
            sightings += watch(scenario, seed, laps, speed, progress)
        try:
            fits[speed] = fit_speed(sightings, pixel)
        except DrakeTrackerError as caught:
            raise DrakeTrackerError(f"at {speed:g} m/s {caught}") from None
    seen_from = slowest_seen(resolve(scenario), detector.resolve())
    print_fits(fits)
    error = combine(fits, pixel, seen_from)
    notes = {
        "scenario": scenario.name,
        "track": scenario.track.kind,
        "body": scenario.train.body,
        "detector": detector.preset,
        "centroid": detector.centroid,
        "seeds": seeds,
        "laps": laps,
        "points": {f"{speed:g}": fit.points for speed, fit in fits.items()},
        "jitter_std": {f"{speed:g}": np.round(fit.std, 6).tolist() for speed, fit in fits.items()},
    }
    save_error(path, error, rig=describe_rig(scenario.cameras), notes=notes)
    print(f"wrote {path}")
    return error


def check_request(
    scenario: TrainScenario, path: str | Path, seeds: int, laps: int, speeds: Sequence[float]
) -> NormalFlow:
    """Checks the arguments of `measure`, and returns the motion detector of the scenario.

    Raises DrakeTrackerError, in one line, when `measure` cannot run.
    """
    require_task(scenario, "train", "only the error of the train's cameras can be measured")
    if not isinstance(scenario.vision, Rendered):
        raise DrakeTrackerError(f"{scenario.where('vision')} must be !Rendered: the error of cameras is measured")
    method = scenario.vision.method
    if not isinstance(method, MotionCentroid):
        raise DrakeTrackerError(
            f"{scenario.where('vision.method')} must be !MotionCentroid: the error of the motion detector is measured"
        )
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
    return method.detector


def pixel_footprint(cameras: CamerasConfig) -> float:
    """Returns the width [m] that a pixel covers at the point at which the cameras look."""
    return float(cameras.distance / focal_length(cameras.height, cameras.fov_deg))


def watch(scenario: TrainScenario, seed: int, laps: int, speed: float, progress: bool = False) -> list[Sighting]:
    """Runs the loop without a grasp, and returns the sightings of the run.

    Args:
        scenario: of the train.
        seed: of the run.
        laps: number of laps; an open track is travelled once.
        speed: of the train [m/s].
        progress: whether to show progress.
    """
    direction = scenario.track.direction
    if direction == "random":
        direction = "backward" if seed % 2 else "forward"
    scenario = scenario.with_settings({"seed": seed, "track.speed": speed, "track.direction": direction})
    track, start = resolve(scenario).placement
    distance = laps * track.length if track.closed else track.length - start
    duration = float(distance / speed + SETTLED)
    scenario = scenario.with_settings({"duration": duration, "grasp.settle_time": 2.0 * duration})  # no grasp
    hand_eye = make_diagram(scenario)
    builder = DiagramBuilder()
    builder.AddSystem(hand_eye)
    loggers = add_loggers(builder, hand_eye, TASK)
    simulator = Simulator(builder.Build())
    line = Progress(scenario.duration)

    def report(context: Context) -> EventStatus:
        line(context.get_time(), "watching")
        return EventStatus.DidNothing()

    if progress:
        simulator.set_monitor(report)
    try:
        simulator.AdvanceTo(scenario.duration)
    finally:
        line.close()
        hand_eye.world.close()
    return sightings_of(read_log(loggers, simulator.get_context(), TASK), scenario.track.speed)


def sightings_of(log: Mapping[str, Signal], speed: float) -> list[Sighting]:
    """Returns the stretches of a log in which the train was running.

    Args:
        log: with the signals ``point`` and ``truth_train_state``.
        speed: of the train [m/s].
    """
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


def print_fits(fits: Mapping[float, SpeedFit]) -> None:
    """Prints the fits at several speeds: residual and drop-outs against speed, bias against heading.

    Args:
        fits: {speed [m/s]: SpeedFit}.
    """
    print("error minus bias along, across, vertical: standard deviation; autocorrelation 1, 2, 5 cycles later;")
    print("fraction of the variance that repeats at the same place; fraction of cycles without a point")
    for speed, fit in fits.items():
        std = ", ".join(f"{1e3 * x:.2f}" for x in fit.std)
        later = "  ".join(", ".join(f"{x:+.2f}" for x in fit.correlation[lag]) for lag in (1, 2, 5))
        again = ", ".join(f"{x:.2f}" for x in fit.returns)
        print(f"{speed:5.2f} m/s  {std} mm  {later}  {again}  missing {fit.missing[0]:.1%}  {fit.points} points")
    middle = sorted(fits)[len(fits) // 2]
    table = 1e3 * fits[middle].bias[:, :: HEADINGS // _SHOWN]
    print(f"bias at {middle:g} m/s against heading, {', '.join(AXES)} [mm]: straight; bending left, right by 6 1/m")
    for k in range(_SHOWN):
        parts = [table[0, k] + bend * table[1, k] for bend in (0.0, 6.0, -6.0)]
        shown = "   ".join(", ".join(f"{x:+5.1f}" for x in part) for part in parts)
        print(f"{k * 360 // _SHOWN:4d} deg  {shown}")
    print(f"bias over all headings, rms (mean) [mm]: {', '.join(AXES)}; inwards in a bend of {_BEND_RADIUS:g} m")
    for speed, fit in sorted(fits.items()):
        rms, mean = bias_over_headings(fit.bias)
        print(f"{speed:5.2f} m/s  " + "  ".join(f"{1e3 * a:.1f} ({1e3 * b:+.1f})" for a, b in zip(rms, mean)))


def bias_over_headings(bias: np.ndarray, radius: float = _BEND_RADIUS) -> tuple[np.ndarray, np.ndarray]:
    """Returns the (root mean square, mean) of a bias over all headings, each of shape (4,) [m].

    The four numbers are the bias along, across and vertical on a straight path, and across, inwards positive, in bends
    to either side.

    Args:
        bias: of a `SpeedFit`, shape (2, h, 3).
        radius: of the bends [m].
    """
    straight, per_curvature = bias[0], bias[1, :, 1] / radius
    inwards = np.concatenate([straight[:, 1] + per_curvature, per_curvature - straight[:, 1]])
    parts = [*straight.T, inwards]
    return np.array([np.sqrt(np.mean(part**2)) for part in parts]), np.array([np.mean(part) for part in parts])
