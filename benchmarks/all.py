"""Lists all results with their state and cost, and measures what is stale or missing, the most important first.

    python benchmarks/all.py --list         state, cost and command of every result, the most important first
    python benchmarks/all.py --hours 3      runs the commands of results that are stale or miss runs
    python benchmarks/all.py --only faults.jsonl,several.json --hours 1

A result is stale if it rests on another behaviour of a packaged scenario than today's (`behaviour.py`). A benchmark
resumes: it measures only what is missing. The stale lines of a JSONL file are therefore moved to ``runs/stale`` before
its commands. At the end of the time the command is interrupted, and every finished run is kept. The next call goes on
with the runs that are missing. Costs are the times that such runs took, on one core; a result without times counts as
an hour. Results outside of `COMMANDS` are listed only: speeds need a quiet machine, and some commands need files,
installations or hours of their own.
"""

import argparse
import gzip
import json
import runpy
import signal
import subprocess
import sys
import time
from pathlib import Path

from shared import common
from shared.behaviour_rows import is_current, other_behaviours, results_of, sidecar
from shared.common import print_table
from shared.stored import RESULTS, compressed, read_lines, result_files

from drake_tracker.core.files.atomic_file import write_bytes

HERE = Path(__file__).parent
STALE = HERE.parent / "runs" / "stale"
"""Folder of lines that were moved away to be measured again."""
COMMANDS = {
    "train_grasp.jsonl": (
        "train_grasp.py --scenario ladder",
        "train_grasp.py --scenario train:wrist",
        "train_grasp.py --scenario train:two",
        "train_grasp.py --scenario train:visitor",
        "train_grasp.py --estimator alpha_beta_gamma --seeds 5",
        "train_grasp.py --estimator coordinated_turn --seeds 5",
        "train_grasp.py --scenario train:learned --cells cast-shadows-gated",
        "train_grasp.py --cells cast-shadows-gated --seeds 10",
        "train_grasp.py --cells cast-shadows --seeds 2",
    ),
    "ball.jsonl": ("ball.py",),
    "several.json": ("several.py",),
    "eyes_open.json": ("eyes_open.py",),
    "conveyor.json": ("conveyor.py",),
    "hard_paths.jsonl": (
        "hard_paths.py --kind bends,line --seeds 3",
        "hard_paths.py --kind walks,known --seeds 20",
        "hard_paths.py --kind walks,bends --rendered --seeds 1",
        "hard_paths.py --kind hills --seeds 34",
        "hard_paths.py --kind hills --seeds 14 --rendered",
    ),
    "footage.json": ("footage.py",),
    "faults.jsonl": ("faults.py", "faults.py --rendered --seeds 5"),
    "rivals.jsonl": (
        "rivals.py --seeds 20 --lags 6",
        "rivals.py --seeds 20 --lags 15,3 --family dgbench,domino,dom,columbia",
        "rivals.py --seeds 20 --lags 6 --family dgbench,domino,dom,columbia --rendered",
    ),
    "latency_curve.jsonl": ("latency_curve.py", "latency_curve.py --task ball"),
    "launches.jsonl": ("launches.py",),
    "success_law.jsonl": ("success_law.py",),
    "measured_vision.jsonl": ("measured_vision.py",),
    "second_attempts.jsonl": ("second_attempts.py",),
    "autopsy.jsonl": ("autopsy.py",),
    "terminations.jsonl": ("terminations.py",),
    "conveyor_vision.json": ("conveyor_vision.py",),
    "ball_camera.jsonl": ("ball_camera.py --locate 25 --catch 5",),
    **{
        f"{name}.json": (f"{name}.py --json benchmarks/results/{name}.json",)
        for name in ("ball_detectors", "camera_motion", "singh_flow", "paper_figures", "space_filter", "latency")
    },
    "crossing_tracks.json": ("crossing_tracks.py --json benchmarks/results/crossing_tracks.json",),
    "dispatch.json": ("dispatch.py",),
    "tracking_arc_length.json": ("tracking.py --json benchmarks/results/tracking_arc_length.json",),
}
"""{result: the commands that measure it}, the most important first."""
UNKNOWN_COST = 3600.0
"""Cost of a result that does not say how long it took [s]."""


def cost(results, runs):
    """Returns how long a number of runs take on one core [s], if they are like those of the results."""
    makers = [result.get("made_by", result) for result in results]
    known = [maker["wall_s"] for maker in makers if isinstance(maker.get("wall_s"), (int, float))]
    return sum(known) * runs / len(known) if known else UNKNOWN_COST


def missing(path):
    """Returns how many runs the commands of a JSONL file have not made yet."""
    count, arguments = 0, sys.argv
    common.COUNTING = True
    try:
        for command in COMMANDS.get(path.name, ()) if path.suffix == ".jsonl" else ():
            sys.argv = command.split()
            try:
                runpy.run_path(str(HERE / sys.argv[0]), run_name="__main__")
            except common.Counted as counted:
                count += counted.args[0]
    finally:
        common.COUNTING, sys.argv = False, arguments
    return count


def commands_of(path, results):
    """Returns the commands that measure the results of a file, as a text."""
    if path.name in COMMANDS:
        return "; ".join(f"python benchmarks/{command}" for command in COMMANDS[path.name])
    made_by = results[-1].get("made_by", results[-1])
    return sidecar(path).get("command") or made_by.get("command", "see benchmarks/README.md")


def overview():
    """Returns (path, results, stale results, number of missing runs) of every file, the most important first."""
    order = {name: place for place, name in enumerate(COMMANDS)}
    paths = sorted(result_files(), key=lambda path: (order.get(path.name, len(order)), path.name))
    found = []
    for path in paths:
        results = results_of(path)
        found.append((path, results, [result for result in results if not is_current(result)], missing(path)))
    return found


def list_all():
    """Prints all results; returns 1 if one is stale or misses runs."""
    rows, found = [], overview()
    for path, results, stale, absent in found:
        scenarios = sorted({name for result in stale for name in other_behaviours(result)})
        state = [f"{len(stale)} of {len(results)} stale: {', '.join(scenarios)}"] * bool(stale)
        state += [f"{absent} runs missing"] * bool(absent)
        minutes = max(1, round(cost(results, len(stale) + absent or len(results)) / 60))
        rows.append([path.name, "; ".join(state) or "current", f"{minutes} min", commands_of(path, results)])
    print_table(["result", "state", "cost on one core", "commands"], rows)
    return int(any(stale or absent for _, _, stale, absent in found))


def move_stale(path, away):
    """Moves the lines of a JSONL file that rest on another behaviour than today's to a file of the same name.

    Args:
        path: the result file.
        away: folder of the other file, to which the lines are appended first, so that none is lost.
    """
    made_by = sidecar(path).get("behaviour", {})
    rows = read_lines(path)
    stale = [row for row in rows if not is_current({"behaviour": made_by, **row})]
    if not stale:
        return
    away.mkdir(parents=True, exist_ok=True)
    with (away / path.name).open("a", encoding="utf-8") as file:
        file.writelines(json.dumps(row) + "\n" for row in stale)
    text = "".join(json.dumps(row, separators=(",", ":")) + "\n" for row in rows if row not in stale)
    write_bytes(compressed(path), gzip.compress(text.encode(), mtime=0))
    path.unlink(missing_ok=True)


def run(command, seconds):
    """Runs the command of a benchmark for a time at most [s]; returns its exit code, None if the time was over."""
    print(f"python benchmarks/{command}", file=sys.stderr, flush=True)
    name, *arguments = command.split()
    process = subprocess.Popen([sys.executable, HERE / name, *arguments], cwd=HERE.parent)
    try:
        return process.wait(seconds)
    except subprocess.TimeoutExpired:
        process.send_signal(signal.SIGINT)
        process.wait()
        return None
    except KeyboardInterrupt:  # the benchmark has the signal, too, and keeps what it has
        process.wait()
        sys.exit(130)


def measure(only, hours):
    """Measures what is stale or missing until the time is over; returns 1 if something is left."""
    end = time.monotonic() + 3600.0 * hours
    for path, _, stale, absent in overview():
        if path.name not in COMMANDS or (path.name not in only if only else not (stale or absent)):
            continue
        if path.suffix == ".jsonl":
            move_stale(path, STALE)
        for command in COMMANDS[path.name]:
            code = run(command, max(end - time.monotonic(), 0.0))
            if code is None:
                print(f"the time is over; {path.name} is not finished, the same command goes on", file=sys.stderr)
                return 1
            if code:
                print(f"{path.name}: python benchmarks/{command} ended with exit code {code}", file=sys.stderr)
    return list_all()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--list", action="store_true", help="run nothing")
    parser.add_argument("--hours", type=float, default=3.0, help="time to measure (default 3)")
    parser.add_argument("--only", default="", help="names of result files, separated by commas")
    options = parser.parse_args()
    only = [name for name in options.only.split(",") if name]
    for name in only:
        if not (RESULTS / name).exists() and not compressed(RESULTS / name).exists():
            parser.error(f"there is no result {name!r} in {RESULTS.name}")
    sys.exit(list_all() if options.list else measure(only, options.hours))


if __name__ == "__main__":
    main()
