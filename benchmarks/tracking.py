"""How well the hand follows the train lap after lap, with rendered images in the loop and no grasp.

    python benchmarks/tracking.py [--quick] [--laps N] [--directions forward,backward] [--seed N] [--set KEY=VALUE]

For each direction: whether the train was ever lost; the hand's error and jerk in the last lap beside the second;
errors of the servo's target at the time for which it holds; errors of the triangulated points, their jitter and their
bias over the train's heading; the time from an image's capture until the prediction built on it can be read; and the
arm's limits. Errors are along and across the train's true heading, at the centre of its body.
"""

import argparse
import time

import numpy as np
from common import print_table, save_json
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, EventStatus
from scipy import stats

from drake_tracker import load_scenario, make_diagram
from drake_tracker.arm.description import PUMA560
from drake_tracker.core.log import add_loggers, read_log, tool_signal
from drake_tracker.core.messages import Prediction
from drake_tracker.core.timing import SERVO_PERIOD, VISION_PERIOD, steps_in
from drake_tracker.grasp.schema import Phase
from drake_tracker.tasks.arm_limits import arm_findings, limits_of
from drake_tracker.tasks.episode import errors, tool_pose, train_pose
from drake_tracker.tasks.train.summary import jitter, tidy
from drake_tracker.tasks.train.track_placement import draw_track

HEADING_BINS = 12
START_UP = 1.0
"""Simulated time [s] beyond the laps themselves: the train has to gather speed."""


class LagMeter:
    """A monitor that notes when each new prediction can be read, and its age since its image's capture.

    Drake calls a monitor once before the updates of every instant that has any; what it finds changed was changed at
    the instant of the call before.
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
    """Runs a scenario to its end; returns (log, lags [s], the arm's model, real-time factor)."""
    hand_eye = make_diagram(scenario)
    builder = DiagramBuilder()
    builder.AddSystem(hand_eye)
    loggers = add_loggers(builder, hand_eye)
    simulator = Simulator(builder.Build())
    meter = LagMeter(hand_eye)
    simulator.set_monitor(meter)
    start = time.monotonic()
    simulator.AdvanceTo(scenario.duration)
    wall = time.monotonic() - start
    log = read_log(loggers, simulator.get_context())
    log["tool"] = tool_signal(log["arm_state"], hand_eye.arm.model)
    return log, np.array(meter.lags), hand_eye.arm.model, scenario.duration / wall


def measure(direction, laps, seed, speed, changes):
    """Returns the results of ``laps`` laps as a dict; lengths in mm."""
    overrides = [f"track.speed={speed}", f"track.direction={direction}", *changes]
    scenario = load_scenario("train", seed=seed, overrides=overrides)
    length = draw_track(scenario)[0].length
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
    """Whether the hand was tracking at ``times`` (n,) [s], bool: from the first such command on, unless it was lost."""
    command = log["command"]
    index = np.clip(np.searchsorted(command.times, times, side="right") - 1, 0, None)
    return command["phase"][index] == Phase.TRACK


def lost(log):
    """How often the hand stopped tracking after it had begun, and for how long the servo had nothing fresh to go by."""
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
    """The hand's horizontal error [mm] and jerk [m/s^3], rms, between two times [s].

    The jerk is the third difference of the hand's place from one servo period to the next.
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
    """How much a quantity grew from the first of its laps to the last, by a straight line through all of them.

    Returns the change, half the width of its 95 % interval, and the scatter of single laps about the line (standard
    deviation), each as a share of the mean: one noisy lap beside another says little about wear. None below 4 laps.
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
    """Errors [mm] of the servo's target at the time for which it holds, while tracking."""
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
    """Errors [mm] of the triangulated points at their stamps: rms, jitter by axis, and mean over the heading."""
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


def percent(found):
    """Writes what `change` found."""
    return "" if found is None else f"{found[0]:+.1%} +- {found[1]:.1%} (one lap: {found[2]:.1%})"


def print_results(results):
    rows = [
        ("laps", "laps", ".1f"),
        ("hand tracks from [s]", "tracking_from_s", ".2f"),
        ("times lost", "times_lost", "d"),
        ("share of time without fresh packets", "stale_share", ".1%"),
        ("hand's error in lap 2, rms [mm]", "hand_rms_mm_lap_2", ".2f"),
        ("hand's error in the last lap, rms [mm]", "hand_rms_mm_last_lap", ".2f"),
        ("hand's jerk in lap 2, rms [m/s^3]", "hand_jerk_lap_2", ".2f"),
        ("hand's jerk in the last lap, rms [m/s^3]", "hand_jerk_last_lap", ".2f"),
        ("change of the error from lap 2 to the last, by a line through all", "hand_rms_mm_change", percent),
        ("change of the jerk likewise", "hand_jerk_change", percent),
        ("present position (servo's target), rms [mm]", "target_rms_mm", ".2f"),
        ("the same, 95 % [mm]", "target_p95_mm", ".2f"),
        ("the same, along, rms [mm]", "target_rms_along_mm", ".2f"),
        ("the same, across, rms [mm]", "target_rms_across_mm", ".2f"),
        ("cycles with a valid point", "valid_share", ".1%"),
        ("triangulated point, rms [mm]", "point_rms_mm", ".2f"),
        ("its jitter, horizontal [mm]", "point_jitter_mm", ".2f"),
        ("its jitter along [mm]", "point_jitter_along_mm", ".2f"),
        ("its jitter across [mm]", "point_jitter_across_mm", ".2f"),
        ("its jitter vertical [mm]", "point_jitter_vertical_mm", ".2f"),
        ("its mean error along [mm]", "point_mean_along_mm", "+.2f"),
        ("its mean error across [mm]", "point_mean_across_mm", "+.2f"),
        ("its mean error vertical [mm]", "point_mean_vertical_mm", "+.2f"),
        ("capture to prediction, least [ms]", "lag_min_ms", ".4f"),
        ("capture to prediction, greatest [ms]", "lag_max_ms", ".4f"),
        ("predictions timed", "predictions", "d"),
        ("least distance to a joint limit [rad]", "joint_limit_margin_rad", ".3f"),
        ("greatest share of a rated joint speed", "speed_share", ".1%"),
        ("longest saturation of a drive [s]", "longest_saturation_s", ".4f"),
        ("table touched", "table_touched", ""),
        ("real-time factor", "real_time_factor", ".2f"),
    ]
    print_table(
        ["", *(result["direction"] for result in results)],
        [
            [label, *(spec(result[key]) if callable(spec) else format(result[key], spec) for result in results)]
            for label, key, spec in rows
        ],
    )
    for result in results:
        error = result["hand_rms_mm_last_lap"] / result["hand_rms_mm_lap_2"] - 1
        jerk = result["hand_jerk_last_lap"] / result["hand_jerk_lap_2"] - 1
        print(f"{result['direction']}: lap {result['last_lap']} against lap 2: error {error:+.1%}, jerk {jerk:+.1%}")
    print()
    width = 360 // HEADING_BINS
    print_table(
        ["heading [deg]", *(f"{result['direction']}: along, across, vertical [mm]" for result in results)],
        [
            [
                f"{k * width}-{(k + 1) * width}",
                *(", ".join(f"{x:+.1f}" for x in result["point_bias_by_heading_mm"][k]) for result in results),
            ]
            for k in range(HEADING_BINS)
        ],
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--laps", type=int, default=20, help="laps in each direction, at least 2")
    parser.add_argument("--quick", action="store_true", help="3 laps instead")
    parser.add_argument("--directions", default="forward,backward", help="names separated by a comma")
    parser.add_argument("--seed", type=int, default=200)
    parser.add_argument("--speed", type=float, default=0.15, help="of the train [m/s]")
    parser.add_argument("--set", action="append", default=[], dest="changes", metavar="KEY=VALUE", help="as in a run")
    parser.add_argument("--json", metavar="FILE")
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
    save_json(tidy(results), options.json)


if __name__ == "__main__":
    main()
