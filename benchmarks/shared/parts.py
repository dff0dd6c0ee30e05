"""Benchmarks that consist of parts: cells, seeds, a line per trial, and the results of each part in one JSON file.

Each trial becomes a line of ``runs/NAME/PART.jsonl`` as soon as it ends, and is not repeated on the same commit, nor
while the behaviour that it rests on is today's. All these trials are the results of a part, which replace those of the
same part in the file of results.
"""

import argparse
import json
from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from shared.behaviour_rows import is_current
from shared.common import append_results, print_table, provenance
from shared.stored import read_lines

from drake_tracker.tasks.results import git_commit

QUICK_SEED = 3900
"""Trials of ``--quick`` are on seeds from here on, so that the published ones stay unseen."""


class Part(NamedTuple):
    """One part of a benchmark.

    Attributes:
        job: function of (cell, seed, quick) that returns the line of a trial as a dict, or `Lost`.
        cells: {cell: number of seeds}.
        first_seed: the first of these seeds.
        summary: function of the lines of a cell that returns its results as a dict.
        table: function of the results of all cells that returns (header, rows).
        prepare: function of the chosen cells that returns those that can be measured.
    """

    job: Callable[[Any, int, bool], Any]
    cells: Mapping[Any, int]
    first_seed: int
    summary: Callable[[list], dict]
    table: Callable[[list], tuple]
    prepare: Callable[[Any], Any] = list


class Timed(NamedTuple):
    """A part of which nothing else may run meanwhile, so that it is measured only when it is asked for.

    Attributes:
        work: function of (seed, quick) that returns the results of all cells.
        seed: the seed.
        table: as for `Part`.
    """

    work: Callable[[int, bool], list]
    seed: int
    table: Callable[[list], tuple]


def run_one(job):
    """Runs one trial in a worker; returns its line, or `Lost`."""
    name, work, cell, seed, quick, commit = job
    made = work(cell, seed, quick)
    return {"part": name, "cell": cell, "seed": seed, "commit": commit, **made} if isinstance(made, dict) else made


def describe(row):
    """Returns the progress line of a trial."""
    if "success" in row:
        end = "succeeded" if row["success"] else f"failed: {row.get('failure_reason')}"
    else:
        end = "done"
    return f"{row['cell']} seed {row['seed']}: {end}"


def measure(name, part, path, chosen, seeds, quick, workers, commit):
    """Runs the trials of a part that are missing; returns all its lines of this commit or of today's behaviour, in the
    order of the cells."""
    first = QUICK_SEED if quick else part.first_seed
    cells = {
        cell: count if seeds is None else seeds
        for cell, count in part.cells.items()
        if not chosen or str(cell) in chosen
    }
    path.parent.mkdir(parents=True, exist_ok=True)

    def lines():
        rows = read_lines(path) if path.exists() else []
        rows = [row for row in rows if row.get("commit") == commit or (row.get("behaviour") and is_current(row))]
        known = {(row["cell"], row["seed"]): row for row in rows}
        places = {cell: place for place, cell in enumerate(part.cells)}
        return [known[key] for key in sorted(known, key=lambda key: (places[key[0]], key[1]))]

    done = {(row["cell"], row["seed"]) for row in lines()}
    wanted = [(cell, seed) for cell in part.prepare(cells) for seed in range(first, first + cells[cell])]
    jobs = [(name, part.job, cell, seed, quick, commit) for cell, seed in wanted if (cell, seed) not in done]
    append_results(run_one, jobs, path, workers, describe)
    return lines()


def summed(rows):
    """Returns the sums of the values of several dicts of numbers."""
    return {key: sum(row[key] for row in rows) for key in rows[0]}


def of_cells(rows, summary):
    """Returns a list of the results of all cells, in their order: ``summary`` of the lines of each."""
    cells = dict.fromkeys(row["cell"] for row in rows)
    return [{"cell": cell, **summary([row for row in rows if row["cell"] == cell])} for cell in cells]


def merge(path, result, order):
    """Replaces the results of a part in the JSON file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    before = json.loads(path.read_text(encoding="utf-8")) if path.exists() else []
    parts = {each["part"]: each for each in [*before, result]}
    kept = [parts[name] for name in order if name in parts]
    path.write_text(json.dumps(kept, indent=2) + "\n", encoding="utf-8")


def main(description, parts, folder, results):
    """Runs the command of a benchmark.

    Args:
        description: help of the command.
        parts: {name: `Part` or `Timed`}.
        folder: of the lines of the trials.
        results: default path of the file of results.
    """
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    timed = [name for name, part in parts.items() if isinstance(part, Timed)]
    parser.add_argument("--part", choices=parts, help=f"default: all{''.join(f' but {name}' for name in timed)}")
    parser.add_argument("--cells", help="cells of the part, separated by commas")
    parser.add_argument("--seeds", type=int, help="runs per cell")
    parser.add_argument("--workers", type=int, default=2, choices=(1, 2), help="processes (default 2)")
    parser.add_argument("--quick", action="store_true", help="short runs on other seeds, printed only")
    parser.add_argument("--json", type=Path, default=results, metavar="FILE", help="results (default %(default)s)")
    options = parser.parse_args()
    chosen = options.cells.split(",") if options.cells else []
    known = getattr(parts.get(options.part), "cells", {})
    unknown = [cell for cell in chosen if cell not in map(str, known)]
    if unknown:
        parser.error(f"unknown cell {unknown[0]}; there are {', '.join(map(str, known))}")
    commit = git_commit()
    for name in [options.part] if options.part else [each for each in parts if each not in timed]:
        part = parts[name]
        if isinstance(part, Timed):
            seeds = [QUICK_SEED if options.quick else part.seed]
            cells = part.work(seeds[0], options.quick)
        else:
            path = folder / f"{'quick_' if options.quick else ''}{name}.jsonl"
            rows = measure(name, part, path, chosen, options.seeds, options.quick, options.workers, commit)
            seeds = sorted({row["seed"] for row in rows})
            cells = of_cells(rows, part.summary)
            commits = dict(Counter(row["commit"] for row in rows))
        made_by = {**provenance(seeds, {"part": name}), "commit": commit}
        if not isinstance(part, Timed):
            made_by["commits"] = commits
        result = {"part": name, "made_by": made_by, "cells": cells}
        print_table(*part.table(cells))
        if not options.quick:
            merge(options.json, result, parts)
