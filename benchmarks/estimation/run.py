"""Estimators beside each other, beside bounds, and beside filters of other libraries, in synthetic worlds.

    python benchmarks/estimation/run.py [--quick] [--cells NAMES] [--renew NAME] [--seeds N] [--results FILE]

A cell is a path, a noise, its standard deviation and a speed law, as `stadium-white-1-constant`; `--cells` takes parts
of names, separated by commas. Trials (`own_world`, `moved`, `rice`, `link`) are cells as well. Every run of a cell is a
line of the results as soon as it ends; a run that is there is not run again. After a change of one estimator, `--renew`
runs that one again on the same points, in lines of its own, and leaves the others' results as they are. At the end the
table and the verdicts are printed, and written as JSON beside the results. Published are the seeds from 5000 on;
parameters were frozen before, in `parameters.json`, on seeds 1000 to 1999.

Of each stage ("first": the first lap, from 1 s on; "after": from 1.2 laps on) and each horizon ("present": 0.25 s after
the newest point, "grasp": 0.75 s): root mean square of the horizontal error, its 95th percentile (the mean over runs of
each run's), the heading's error, and the share of errors within the estimator's own `predict_std`. Intervals are
bootstrap 95 % over runs.
"""

import argparse
import functools
import importlib.metadata
import json
import os
import platform
import subprocess
import sys
from pathlib import Path

sys.path.insert(1, str(Path(__file__).resolve().parents[1]))  # what all benchmarks share

from contestants import BASELINES, OURS, SHARP_BASELINES, SINGLE, read_parameters
from measure import run_cell
from shared.common import append_results
from shared.stored import read_lines
from speed import update_times
from tables import cells_of, merged, print_rows, table_rows
from trials import SUBJECTS, TRIALS
from verdicts import print_verdicts, verdicts
from worlds import NOISES, PATHS, SHARP, SPEED_LAWS

HERE = Path(__file__).resolve().parent
RESULTS = HERE.parent / "results" / "estimation.jsonl"
QUICK_RESULTS = HERE.parents[1] / "runs" / "estimation_quick.jsonl"
FIRST_SEED, SEEDS, DURATION = 5000, 20, 40.0
QUICK_FIRST_SEED, QUICK_SEEDS = 1900, 2
"""A look must not wear the published seeds out."""
ROOMS = ("arm", "estimation", "link", "world")
"""Of the package, those whose code takes part."""
SIGMAS_MM = (0.5, 1, 2, 4)
QUICK = (
    "stadium-white-0.5-constant",
    "stadium-white-1-constant",
    "stadium-white-1-varying",
    "stadium-replayed-1-constant",
    "oval-white-1-constant",
    "oval-white-1-stop_and_go",
    "rectangle-white-1-constant",
    *TRIALS,
)


def all_cells():
    """Returns a dict from a cell's name to (path, noise, sigma [mm], law), None for a trial."""
    cells = {}
    for path in PATHS:
        for sigma_mm in SIGMAS_MM if path == "stadium" else (1,):
            for noise in ("white", "replayed") if path in SHARP else NOISES:
                for law in SPEED_LAWS:
                    cells[f"{path}-{noise}-{sigma_mm:g}-{law}"] = (path, noise, sigma_mm, law)
    return cells | dict.fromkeys(TRIALS)


def run_one(made_by, job):
    """Runs one seed of one cell, of all contestants or ``only`` of one, in a worker; returns its line."""
    name, cell, seed, only = job
    parameters = read_parameters()
    if cell is None:
        found = {"trial": TRIALS[name](seed, parameters)}
    else:
        path, noise, sigma_mm, law = cell
        names = OURS + _others(path, noise)
        found = run_cell(path, noise, sigma_mm, law, seed, DURATION, (only,) if only else names, parameters)
    return {"cell": name, "seed": seed, "only": only, **found, **made_by}


def _others(path, noise):
    """Returns the contestants that are run in a cell beside `OURS`."""
    if path in SHARP:
        return (SINGLE, *SHARP_BASELINES)
    return BASELINES if (path, noise) == ("oval", "white") else ()


def circumstances():
    """Returns the commit and the versions that a line of the results names."""

    def git(*words):
        return subprocess.run(["git", *words], cwd=HERE, capture_output=True, text=True).stdout.strip()

    rooms = (f"../../drake_tracker/{room}" for room in ROOMS)
    changed = git("status", "--porcelain", "--untracked-files=no", ".", *rooms)
    commit = (git("rev-parse", "--short=12", "HEAD") or "unknown") + ("+changes" if changed else "")
    versions = {name: importlib.metadata.version(name) for name in ("numpy", "scipy", "stonesoup", "filterpy")}
    return {"commit": commit, "python": platform.python_version(), **versions}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="a few cells and seeds, for a look, kept in runs/ only")
    parser.add_argument("--cells", default="", help="parts of names separated by commas (default: all)")
    renewed = (*OURS, SINGLE, *SHARP_BASELINES)
    parser.add_argument(
        "--renew", metavar="NAME", choices=renewed, help="run this one again where another commit ran it"
    )
    parser.add_argument("--seeds", type=int, help=f"runs a cell (default {SEEDS}, {QUICK_SEEDS} with --quick)")
    parser.add_argument("--first-seed", type=int, help=f"default {FIRST_SEED}, {QUICK_FIRST_SEED} with --quick")
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    parser.add_argument("--results", type=Path, help=f"default {RESULTS.relative_to(HERE.parents[1])}")
    parser.add_argument(
        "--keep-times",
        action="store_true",
        help="do not measure the time of an update (on a busy machine), but keep what the JSON file has",
    )
    options = parser.parse_args()
    path = options.results or (QUICK_RESULTS if options.quick else RESULTS)
    if options.quick:
        path.unlink(missing_ok=True)
    cells = {name: cell for name, cell in all_cells().items() if not options.quick or name in QUICK}
    wanted = [part for part in options.cells.split(",") if part]
    cells = {name: cell for name, cell in cells.items() if not wanted or any(part in name for part in wanted)}
    if not cells:
        parser.error(f"no cell has {options.cells} in its name; there are {', '.join(all_cells())}")

    made_by, only = circumstances(), options.renew
    if only:
        cells = {name: cell for name, cell in cells.items() if cell is not None or SUBJECTS[name] == only}
    lines = [line for line in read_lines(path) if line.get("only") == only]
    done = {(line["cell"], line["seed"]) for line in lines if not only or line["commit"] == made_by["commit"]}
    first, count = (QUICK_FIRST_SEED, QUICK_SEEDS) if options.quick else (FIRST_SEED, SEEDS)
    first = options.first_seed if options.first_seed is not None else first
    seeds = range(first, first + (options.seeds or count))
    jobs = [(name, cells[name], seed, only) for seed in seeds for name in cells if (name, seed) not in done]
    append_results(
        functools.partial(run_one, made_by),
        jobs,
        path,
        options.workers,
        lambda line: f"{line['cell']} seed {line['seed']}",
    )

    lines = merged([line for line in read_lines(path) if line["cell"] in cells])
    lines.sort(key=lambda line: (list(cells).index(line["cell"]), line["seed"]))
    rows, saved = table_rows(cells_of(lines)), path.with_suffix(".json")
    if options.keep_times:
        times = json.loads(saved.read_text(encoding="utf-8"))["update_us"] if saved.exists() else {}
    else:
        times = update_times(read_parameters())
    judged = verdicts(lines, times)
    print_rows(rows)
    print_verdicts(judged)
    makers = {json.dumps(maker, sort_keys=True) for line in lines for maker in line["made_by"]}
    found = {
        "made_by": [json.loads(maker) for maker in sorted(makers)],
        "seeds": [seeds[0], seeds[-1]],
        "update_us": times,
        "verdicts": judged,
        "table": rows,
    }
    found = json.loads(json.dumps(found), parse_constant=lambda _: None)  # what is not a number is null
    saved.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
