"""Fits the time of a cycle that the dispatcher expects (`cycle.*`) to what the arm did in runs of the conveyor.

    python benchmarks/conveyor_cycle.py                 four development seeds at two speeds, parts always waiting
    python benchmarks/conveyor_cycle.py --set "arm=!UR5e {}"
    python benchmarks/conveyor_cycle.py --runs RUN ...  run directories that are there already

Constant phases get the mean of their durations in the log. The speeds and accelerations of the hand are fitted to the
durations of its motions: to a part, as the first time at which a hand within these limits can be where the part is,
and to a cell, from rest to rest. What an approach takes beyond is counted with the descent. Prints the settings, and
the error of the cycle that is left.
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares
from shared import common

from drake_tracker import load_scenario, simulate
from drake_tracker.core.log import load_log
from drake_tracker.core.messages import BELT_FIELDS, packet_target
from drake_tracker.core.timing import SERVO_PERIOD
from drake_tracker.dispatch.cycle_time import meeting_time, motion_time
from drake_tracker.grasp.conveyor.pick_schema import PickPhase
from drake_tracker.run.options import RunOptions

SEEDS = (0, 1, 2, 3)
SPEEDS = (0.10, 0.20)
PICKED = (
    PickPhase.TRACK, PickPhase.INTERCEPT, PickPhase.CLOSE, PickPhase.LIFT, PickPhase.CARRY, PickPhase.LOWER,
    PickPhase.RELEASE, PickPhase.RAISE,
)  # fmt: skip
"""The phases of a cycle in which nothing fails."""


def cycles_of(log):
    """Returns one dict per cycle in which nothing failed: durations of the phases, and the motions."""
    command, status, belt = log["command"], log["status"], log["belt"]
    numbers = command["phase"].astype(int)
    starts = np.flatnonzero(np.diff(numbers, prepend=-1))
    phases = [PickPhase(number) for number in numbers[starts]]
    times = np.append(command.times[starts], command.times[-1])
    rows = belt.data[:, 4:].reshape(len(belt.times), -1, len(BELT_FIELDS))
    found = []
    for k in range(len(phases) - len(PICKED)):
        if tuple(phases[k : k + len(PICKED)]) != PICKED:
            continue
        lasted = dict(zip(PICKED, np.diff(times[k : k + len(PICKED) + 1])))
        at = np.searchsorted(status.times, times[k], side="right") - 1
        seen = rows[np.searchsorted(belt.times, times[k], side="right") - 1]
        target = log["target"]
        number = packet_target(target["seq"][np.searchsorted(target.times, times[k + 1], side="right") - 1])
        part = seen[seen[:, 0] == number]
        if not len(part):
            continue
        carried = np.searchsorted(status.times, times[k + 4], side="right") - 1
        cell = np.searchsorted(status.times, times[k + 5], side="right") - 1
        found.append(
            {
                "lasted": lasted,
                "waited": phases[k - 1] == PickPhase.WAIT and times[k] - times[k - 1] > 2.0 * SERVO_PERIOD,
                "across": part[0, 2] - status["x"][at],
                "along": part[0, 3] - status["y"][at],
                "v": part[0, 6],
                "y": part[0, 3],
                "idle": times[k] - times[k - 1] if phases[k - 1] == PickPhase.WAIT else 0.0,
                "carry": np.hypot(status["x"][cell] - status["x"][carried], status["y"][cell] - status["y"][carried]),
            }
        )
    return found


def fit(cycles):
    """Returns {setting of ``cycle``: value}, and the errors of the time of a whole cycle [s]."""
    mean = {phase: float(np.mean([cycle["lasted"][phase] for cycle in cycles])) for phase in PICKED}
    carries = np.array([(cycle["carry"], cycle["lasted"][PickPhase.CARRY]) for cycle in cycles])
    approaches = [(cycle["across"], cycle["along"], cycle["v"], cycle["lasted"][PickPhase.TRACK]) for cycle in cycles]

    def carry_errors(p):
        return [motion_time(d, p[0], p[1]) - t for d, t in carries]

    def approach_errors(p):
        return [meeting_time(x, y, v, p[0], p[1]) + p[2] - t for x, y, v, t in approaches]

    limits = ([0.2, 0.5], [5.0, 50.0])
    carry = least_squares(carry_errors, [0.6, 2.5], bounds=limits, loss="soft_l1", f_scale=0.03)
    approach = least_squares(
        approach_errors, [0.6, 2.5, 0.05], bounds=([0.5, 0.5, 0.0], [5.0, 50.0, 0.5]), loss="soft_l1", f_scale=0.03
    )
    cycle = {
        "approach_speed": approach.x[0],
        "approach_acceleration": approach.x[1],
        "descent": mean[PickPhase.INTERCEPT] + approach.x[2],
        "close": mean[PickPhase.CLOSE],
        "lift": mean[PickPhase.LIFT],
        "carry_speed": carry.x[0],
        "carry_acceleration": carry.x[1],
        "lower": mean[PickPhase.LOWER],
        "release": mean[PickPhase.RELEASE],
        "rise": mean[PickPhase.RAISE] + SERVO_PERIOD,  # a tick of WAIT until the next order is taken
    }
    return cycle, np.array(approach_errors(approach.x)), np.array(carry_errors(carry.x))


def logs_of(options):
    """Returns the logs of the runs that the options name, or makes them."""
    if options.runs:
        return [load_log(Path(run) / "log.npz") for run in options.runs]
    logs = []
    for speed in SPEEDS:
        for seed in SEEDS:
            overrides = ["vision=!Measured {}", f"belt.speed={speed}", "arrivals.rate=30", *options.set]
            with tempfile.TemporaryDirectory() as folder:
                scenario = load_scenario("conveyor:measured", seed=seed, overrides=overrides)
                simulate(scenario, out=f"{folder}/run", options=RunOptions(record=False))
                logs.append(load_log(f"{folder}/run/log.npz"))
    return logs


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", nargs="+", default=[], metavar="RUN", help="run directories with a log.npz")
    parser.add_argument("--set", action="append", default=[], metavar="KEY.PATH=VALUE", help="a setting of the runs")
    options = parser.parse_args()
    cycles = [cycle for log in logs_of(options) for cycle in cycles_of(log)]
    settings, approach, carry = fit(cycles)
    common.print_table(["cycle.*", "fitted"], [[name, f"{value:.3f}"] for name, value in settings.items()])
    print(
        f"{len(cycles)} cycles; rms error of the approach {np.std(approach):.3f} s, of the carry {np.std(carry):.3f} s"
    )


if __name__ == "__main__":
    main()
