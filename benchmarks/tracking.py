"""Measures how well the hand follows the train lap after lap, with rendered images in the loop and without a grasp.

    python benchmarks/tracking.py [--quick] [--laps N] [--directions forward,backward] [--seed N] [--set KEY=VALUE]

For each direction it prints: whether the train was ever lost; the hand's error and jerk in the second and in the last
lap; the error of the servo's target at the time for which it is meant; the error of the triangulated points, their
jitter and their bias over the train's heading; the time from the capture of an image to the prediction built on it; and
the arm's limits. Errors are along and across the train's true heading, at the centre of its body.
"""

import argparse
import time

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, EventStatus
from result_tables.tracking_tables import HEADING_BINS, bias_table, laps_table, last_against_second
from scipy import stats
from shared.common import print_table, save_json

from drake_tracker import load_scenario, make_diagram
from drake_tracker.arm.description import PUMA560
from drake_tracker.core.messages import Prediction
from drake_tracker.core.timing import SERVO_PERIOD, VISION_PERIOD, steps_in
from drake_tracker.grasp.train.schema import Phase
from drake_tracker.run.log_recorder import add_loggers, read_log, tool_signal
from drake_tracker.tasks.arm_limits import arm_findings, limits_of
from drake_tracker.tasks.episode import tool_pose
from drake_tracker.tasks.results import tidy
from drake_tracker.tasks.train.episode import errors, train_pose
from drake_tracker.tasks.train.setup import resolve
from drake_tracker.tasks.train.summary import jitter
from drake_tracker.tasks.train.task import TASK

START_UP = 1.0
"""Simulated time [s] in addition to the laps: the train has to accelerate."""


class LagMeter:
    """A monitor that records when each new prediction can be read, and its age since the capture of its image.

    Drake calls a monitor once before the updates of each instant that has any, so a change was made at the instant of
    the previous call.
    """

    def __init__(self, hand_eye):
        self._hand_eye = hand_eye
        self._port = hand_eye.GetOutputPort("prediction")
        self._last_instant = 0.0
        self._last_stamp = 0.0
        self.lags = []

    def __call__(self, root):
        packet = Prediction(self._port.Eval(self._hand_eye.GetMyContextFromRoot(root)))
        if packet.valid and packet.stamp != self._last_stamp:
            self._last_stamp = packet.stamp
            self.lags.append(self._last_instant - packet.stamp)
        self._last_instant = root.get_time()
        return EventStatus.DidNothing()


def run(scenario):
    """Runs a scenario to its end; returns (log, lags [s], model of the arm, real-time factor)."""
    hand_eye = make_diagram(scenario)
    builder = DiagramBuilder()
    builder.AddSystem(hand_eye)
    loggers = add_loggers(builder, hand_eye, TASK)
    simulator = Simulator(builder.Build())
    meter = LagMeter(hand_eye)
    simulator.set_monitor(meter)
    start = time.monotonic()
    simulator.AdvanceTo(scenario.duration)
    wall = time.monotonic() - start
    log = read_log(loggers, simulator.get_context(), TASK)
    log["tool"] = tool_signal(log["arm_state"], hand_eye.arm.model)
    return log, np.array(meter.lags), hand_eye.arm.model, scenario.duration / wall


def measure(direction, laps, seed, speed, changes):
    """Returns the results of ``laps`` laps as a dict; lengths in mm."""
    overrides = [f"track.speed={speed}", f"track.direction={direction}", *changes]
    scenario = load_scenario("train", seed=seed, overrides=overrides)
    length = resolve(scenario).track.length
    duration = laps * length / speed + START_UP
    scenario = scenario.with_settings({"duration": duration, "grasp.settle_time": 2 * duration})  # no grasp
    log, lags, model, real_time_factor = run(scenario)

    truth = log["truth_train_state"]
    distance = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(truth.view("x", "y"), axis=0).T))])
    laps_done = distance[-1] / length

    def lap(number):
        return tuple(np.interp([(number - 1) * length, number * length], distance, truth.times))

    last = int(laps_done + 1e-3)
    from_second = [lap_findings(log, model, *lap(number)) for number in range(2, last + 1)]
    second, final = from_second[0], from_second[-1]
    return {
        "direction": direction,
        "seed": seed,
        "laps": laps_done,
        **lost(log),
        "last_lap": last,
        **{f"{name}_lap_2": value for name, value in second.items()},
        **{f"{name}_last_lap": value for name, value in final.items()},
        "hand_rms_mm_change": change([found["hand_rms_mm"] for found in from_second]),
        "hand_jerk_change": change([found["hand_jerk"] for found in from_second]),
        "hand_jerk_laps": [found["hand_jerk"] for found in from_second],
        **target_findings(log),
        **point_findings(log),
        "lag_min_ms": 1e3 * lags.min(),
        "lag_max_ms": 1e3 * lags.max(),
        "predictions": len(lags),
        **arm_findings(log, limits_of(PUMA560)),
        "table_touched": bool(log["truth_verdict"]["table_touched"][-1]),
        "real_time_factor": real_time_factor,
    }


def tracking(log, times):
    """Returns whether the hand was tracking at ``times`` (n,) [s], an array of bool."""
    command = log["command"]
    index = np.clip(np.searchsorted(command.times, times, side="right") - 1, 0, None)
    return command["phase"][index] == Phase.TRACK


def lost(log):
    """Returns when tracking began, how often it stopped, and the share of time without a fresh packet."""
    phase = log["command"]["phase"]
    begun = int(np.argmax(phase == Phase.TRACK))
    target = log["target"]
    without = (target["valid"] == 0) | (target["stale"] > 0)
    return {
        "tracking_from_s": float(log["command"].times[begun]) if np.any(phase == Phase.TRACK) else None,
        "times_lost": int(np.count_nonzero(np.diff((phase[begun:] == Phase.TRACK).astype(int)) < 0)),
        "stale_share": float(np.mean(without[target.times > log["command"].times[begun]])),
    }


def lap_findings(log, model, start, end):
    """Returns the hand's horizontal error [mm] and jerk [m/s^3], rms, between two times [s].

    The jerk is the third difference of the hand's position over servo periods.
    """
    times = log["tool"].times
    times = times[(times >= start) & (times <= end)]
    away = np.hypot(*(tool_pose(log, times)[:, :2] - train_pose(log, times)[:, :2]).T)
    state = log["arm_state"]
    inside = (state.times >= start) & (state.times <= end)
    joints = state.data[inside, : model.num_joints][:: steps_in(SERVO_PERIOD)]
    tool = np.array([model.tool_pose(q).translation() for q in joints])
    jerk = np.linalg.norm(np.diff(tool, n=3, axis=0), axis=1) / SERVO_PERIOD**3
    return {"hand_rms_mm": 1e3 * rms(away), "hand_jerk": rms(jerk)}


def change(laps):
    """Returns how much a quantity grew from its first lap to its last, by a straight line fitted to all of them.

    The result is the change, half the width of its 95 % interval, and the standard deviation of single laps about the
    line, each as a fraction of the mean; None with fewer than 4 laps.
    """
    if len(laps) < 4:
        return None
    number = np.arange(len(laps))
    line = stats.linregress(number, laps)
    share = (len(laps) - 1) / np.mean(laps)
    half = stats.t.ppf(0.975, len(laps) - 2) * line.stderr
    scatter = np.std(laps - (line.intercept + line.slope * number), ddof=2)
    return [line.slope * share, half * share, scatter / np.mean(laps)]


def target_findings(log):
    """Returns the errors [mm] of the servo's target at the time for which it is meant, while tracking."""
    target = log["target"]
    good = (target["valid"] > 0) & tracking(log, target.times)
    error = errors(log, target["time"], target.view("x", "y"))[good]
    error = 1e3 * error[np.isfinite(error).all(axis=1)]
    size = np.hypot(*error.T)
    return {
        "target_rms_mm": rms(size),
        "target_p95_mm": float(np.percentile(size, 95)),
        "target_rms_along_mm": rms(error[:, 0]),
        "target_rms_across_mm": rms(error[:, 1]),
    }


def point_findings(log):
    """Returns the errors [mm] of the triangulated points at their stamps: rms, jitter by axis, mean by heading."""
    point = log["point"]
    seen = point["stamp"] > 0.0
    valid = seen & (point["valid"] > 0)
    stamps = point["stamp"][valid]
    truth = train_pose(log, stamps)
    error = 1e3 * np.column_stack([errors(log, stamps, point.view("x", "y")[valid]), point["z"][valid] - truth[:, 2]])
    sector = (np.mod(truth[:, 3], 2 * np.pi) / (2 * np.pi) * HEADING_BINS).astype(int) % HEADING_BINS
    bias = [error[sector == k].mean(axis=0) if np.any(sector == k) else np.full(3, np.nan) for k in range(HEADING_BINS)]
    axes = ("along", "across", "vertical")
    return {
        "valid_share": np.count_nonzero(valid) / np.count_nonzero(seen),
        "point_rms_mm": rms(np.hypot(error[:, 0], error[:, 1])),
        "point_jitter_mm": jitter(stamps, error[:, :2]),
        **{f"point_jitter_{axis}_mm": jitter(stamps, error[:, [k]]) for k, axis in enumerate(axes)},
        **{f"point_mean_{axis}_mm": float(error[:, k].mean()) for k, axis in enumerate(axes)},
        "point_bias_by_heading_mm": np.array(bias).tolist(),
    }


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


def print_results(results):
    print_table(*laps_table(results))
    for result in results:
        error, jerk = last_against_second(result)
        print(f"{result['direction']}: lap {result['last_lap']} against lap 2: error {error:+.1%}, jerk {jerk:+.1%}")
    print()
    print_table(*bias_table(results))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--laps", type=int, default=20, help="laps in each direction, at least 2")
    parser.add_argument("--quick", action="store_true", help="3 laps")
    parser.add_argument("--directions", default="forward,backward", help="names separated by a comma")
    parser.add_argument("--seed", type=int, default=200, help="default 200")
    parser.add_argument("--speed", type=float, default=0.15, help="of the train [m/s], default 0.15")
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        dest="changes",
        metavar="KEY=VALUE",
        help="setting of the scenario, as in drake-tracker run",
    )
    parser.add_argument("--json", metavar="FILE", help="also write the results to FILE")
    options = parser.parse_args()
    laps = 3 if options.quick else options.laps
    if laps < 2:
        parser.error("--laps must be at least 2")
    print(f"default oval at {options.speed:g} m/s, seed {options.seed}, images every {1e3 * VISION_PERIOD:.2f} ms\n")
    results = [
        measure(direction, laps, options.seed, options.speed, options.changes)
        for direction in options.directions.split(",")
    ]
    print_results(results)
    save_json(tidy(results), options.json, [options.seed])


if __name__ == "__main__":
    main()
