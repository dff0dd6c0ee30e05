"""Measures how often the second attempt lifts the train after a provoked miss.

    python benchmarks/second_attempts.py                      every provocation, 20 seeds; resumes
    python benchmarks/second_attempts.py --seeds 2 --results /tmp/try.jsonl

With measured vision. Each job runs a scenario twice: first undisturbed, to learn when its first descent begins, and
then with a fault during that descent. The controller knows nothing of either. A second attempt counts if the first one
missed and left the train on its track: the judge sees it derailed neither then nor within 3 s. The published seeds are
950 to 969; nothing was chosen on them. Each run becomes a line of ``results/second_attempts.jsonl`` as soon as it ends.
"""

import argparse
import os
import tempfile
from pathlib import Path

from result_tables.second_attempt_tables import PROVOCATIONS, describe, second_attempts_table
from shared import common
from shared.common import append_results, print_table
from shared.stored import read_lines

from drake_tracker.campaign.plan import Lost
from drake_tracker.core.errors import MachineError
from drake_tracker.core.log import load_log
from drake_tracker.grasp.train.schema import Phase
from drake_tracker.run.options import RunOptions
from drake_tracker.run.simulation import simulate
from drake_tracker.tasks import load_scenario
from drake_tracker.tasks.episode import phase_spans

FIRST_SEED, SEEDS = 950, 20
RESULTS = common.RESULTS / "second_attempts.jsonl"
DURATION = 40.0
"""Longest duration of a run [s]."""
AFTERWARDS = 3.0
"""Time after the first attempt in which a train that is still on its track must not derail [s]."""
KEPT = ("success", "attempts", "failure_reason", "cause", "simulated_s", "package_versions", "git_commit")
MEASURED = "vision=!Measured {}"


def record(seed, *overrides):
    """Runs the train on a seed; returns its summary and its log."""
    with tempfile.TemporaryDirectory() as folder:
        scenario = load_scenario("train:learned", seed=seed, duration=DURATION, overrides=[MEASURED, *overrides])
        summary = simulate(scenario, folder, RunOptions(record=False))
        return summary, load_log(Path(folder) / "log.npz")


def first_attempt(log):
    """Returns the times [s] at which the first descent began and its attempt ended; None: there was none."""
    spans = phase_spans(log, Phase)
    started = next((k for k, span in enumerate(spans) if span.phase == Phase.INTERCEPT), None)
    if started is None:
        return None
    ended = next((span.start for span in spans[started:] if span.phase == Phase.RETREAT), spans[-1].end)
    return spans[started].start, ended


def run_one(job):
    """Provokes a miss in a worker; returns its line, or `Lost`."""
    name, seed = job
    try:
        times = first_attempt(record(seed)[1])
        if times is None:
            return {"provocation": name, "seed": seed, "missed": False, "reason": "no attempt was made"}
        summary, log = record(seed, f"faults=[{PROVOCATIONS[name].tag(times[0])}]")
    except (MachineError, MemoryError, OSError) as error:
        return Lost(f"{type(error).__name__}: {error}")
    _, ended = first_attempt(log)
    verdict = log["truth_verdict"]
    soon = (verdict.times >= times[0]) & (verdict.times <= ended + AFTERWARDS)
    missed = not (summary["success"] and summary["attempts"] == 1)
    on_track = not verdict["derailed"][soon].any()
    kept = {key: summary[key] for key in KEPT}
    return {"provocation": name, "seed": seed, "missed": missed, "on_track": bool(on_track), **kept}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--provocations", default=",".join(PROVOCATIONS), help="names separated by commas")
    parser.add_argument("--seeds", type=int, default=SEEDS, help=f"runs per provocation (default {SEEDS})")
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED)
    parser.add_argument("--workers", type=int, default=os.cpu_count(), help="processes (default: one per core)")
    parser.add_argument("--results", type=Path, default=RESULTS, help="JSONL file to append to")
    options = parser.parse_args()
    names = options.provocations.split(",")
    unknown = [name for name in names if name not in PROVOCATIONS]
    if unknown:
        parser.error(f"unknown provocation {unknown[0]}; there are {', '.join(PROVOCATIONS)}")
    seeds = range(options.first_seed, options.first_seed + options.seeds)
    done = {(row["provocation"], row["seed"]) for row in read_lines(options.results)}
    jobs = [(name, seed) for seed in seeds for name in names if (name, seed) not in done]
    append_results(run_one, jobs, options.results, options.workers, describe)
    rows = [row for row in read_lines(options.results) if row["provocation"] in names and row["seed"] in seeds]
    print_table(*second_attempts_table(rows))


if __name__ == "__main__":
    main()
