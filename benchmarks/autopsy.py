"""Measures how often the autopsy of a failed run names the stage at fault, with seven known faults injected.

    python benchmarks/autopsy.py                        seven faults and two controls, 20 runs each; resumes
    python benchmarks/autopsy.py --faults link,servo    some of them
    python benchmarks/autopsy.py --faults link --size 0.9 --first-seed 0 --seeds 6 --results /tmp/try.jsonl

A fault is a setting of the scenario where there is one; otherwise this script replaces a part. Each fault is scaled on
seeds 20 to 39 so that about half of the runs fail. What the autopsy knows about healthy runs also comes from seeds
below 100 (``--normal`` prints it). The published seeds are 740 to 759. Each run lasts at most 25 s, time for one or two
attempts. The faults of vision and triangulation need images; the others run on measured vision.
"""

import argparse
import tempfile
import time
from pathlib import Path

from methods.autopsy_faults import FAULTS
from result_tables.autopsy_tables import faults_table, named_wrongly
from shared import common
from shared.common import append_results, print_table
from shared.stored import read_lines

from drake_tracker.campaign.plan import Lost
from drake_tracker.core.errors import MachineError
from drake_tracker.core.log import load_log
from drake_tracker.report.failure_diagnosis.diagnosis import perform
from drake_tracker.report.failure_diagnosis.stages import WORDS
from drake_tracker.run.options import RunOptions
from drake_tracker.run.simulation import simulate
from drake_tracker.tasks import load_scenario
from drake_tracker.tasks.results import tidy

FIRST_SEED, SEEDS, DURATION = 740, 20, 25.0
RESULTS = common.RESULTS / "autopsy.jsonl"
KEPT = ("success", "attempts", "time_to_grasp_s", "failure_reason", "simulated_s", "package_versions", "git_commit")


def run_one(job):
    """Runs one trial in a worker and its autopsy; returns its line, or `Lost`."""
    name, size, seed = job
    fault = FAULTS[name]
    start = time.monotonic()
    scenario = load_scenario("train:learned", seed=seed, duration=DURATION, overrides=fault.overrides(size))
    with tempfile.TemporaryDirectory() as folder, fault.part(size):
        try:
            summary = simulate(scenario, folder, RunOptions(record=False))
        except (MachineError, MemoryError, OSError) as error:
            return Lost(f"{type(error).__name__}: {error}")
        found = perform(scenario, load_log(Path(folder) / "log.npz"))
    return {
        "fault": name,
        "size": size,
        "seed": seed,
        **{key: summary[key] for key in KEPT},
        "named": found["culprit"],
        "autopsy": tidy(found),
        "wall_s": round(time.monotonic() - start, 1),
    }


def outcome(row):
    """Returns the outcome of a run as a text."""
    if row["success"]:
        return f"{row['fault']} {row['size']:g} seed {row['seed']}: lifted at attempt {row['attempts']}"
    attempts = f"{row['attempts']} attempts"
    return f"{row['fault']} {row['size']:g} seed {row['seed']}: failed after {attempts}, named {row['named']}"


def print_results(rows):
    """Prints the table of the faults, and the failed runs in which another stage was named."""
    print_table(*faults_table(rows))
    for row in named_wrongly(rows):
        print(f"named wrongly: {row['fault']} seed {row['seed']}: {row['named']}")


def print_normal(rows):
    """Prints the largest contribution of each stage in these runs [mm]: at the grasp, and while tracking."""
    lines = []
    for word in WORDS.values():
        attempt = max(row["autopsy"]["attempts"][-1]["size_m"][word] for row in rows)
        tracking = max(row["autopsy"]["tracking"]["size_m"][word] for row in rows)
        lines.append((word, f"{1e3 * attempt:.2f}", f"{1e3 * tracking:.2f}"))
    print_table(("stage", "attempt [mm]", f"tracking [mm], {len(rows)} runs"), lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--faults", default="all", help="names separated by commas")
    parser.add_argument("--size", type=float, help="size of the fault, in place of the default")
    parser.add_argument("--seeds", type=int, default=SEEDS, help=f"runs per fault (default {SEEDS})")
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED)
    parser.add_argument("--normal", action="store_true", help="print the largest contribution of each stage")
    parser.add_argument("--workers", type=int, default=1, help="processes (default 1)")
    parser.add_argument("--results", type=Path, default=RESULTS, help="JSONL file to append to")
    options = parser.parse_args()
    names = list(FAULTS) if options.faults == "all" else options.faults.split(",")
    unknown = [name for name in names if name not in FAULTS]
    if unknown:
        parser.error(f"unknown fault {unknown[0]}; there are {', '.join(FAULTS)}")

    sizes = {name: FAULTS[name].size if options.size is None else options.size for name in names}
    done = {(row["fault"], row["size"], row["seed"]) for row in read_lines(options.results)}
    jobs = [
        (name, sizes[name], seed)
        for seed in range(options.first_seed, options.first_seed + options.seeds)
        for name in names
        if (name, sizes[name], seed) not in done
    ]
    append_results(run_one, jobs, options.results, options.workers, outcome)
    rows = [row for row in read_lines(options.results) if sizes.get(row["fault"]) == row["size"]]
    if options.normal:
        print_normal([row for row in rows if row["success"]])
    else:
        print_results(rows)


if __name__ == "__main__":
    main()
