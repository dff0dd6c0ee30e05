"""Proves that the behaviour of the working tree is bit-identical to that of an earlier revision.

    python benchmarks/golden.py --base main                    every case, some 20 minutes on one core
    python benchmarks/golden.py --base v1 --only train,measure these cases
    python benchmarks/golden.py --list                         the cases, and their commands

Each case is a short sequence of commands with fixed seeds. It runs once with the files of the working tree, which are
copied at the start, so that you may go on editing, and once with those of the revision: a git worktree in a temporary
folder, with an environment of its own if it pins other packages. Both must have the same exit codes and leave the same
signals, summaries, tables, settings and calibrations, bit for bit, except for `golden_parts.files.VOLATILE`. Names that
have changed since the revision are translated with `golden_parts.names.RENAMES`. A case is new if the revision does not
have what it runs.

The exit code is 0 if all cases are equal or new, 1 if one differs or fails, and 2 for bad input.
"""

import argparse
import itertools
import shlex
import shutil
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import closing
from pathlib import Path

from golden_parts.cases import make_cases, needs_inputs, write_inputs
from golden_parts.files import Difference, compare_folders
from golden_parts.names import RENAMES, Names, applicable
from golden_parts.sides import (
    ROOT,
    Children,
    Side,
    check_side,
    checked_out,
    copy_working_tree,
    git,
    interpreter,
    is_ancestor,
    tell,
)

import drake_tracker
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.processes.signals import exit_code, graceful
from drake_tracker.core.progress import time_left

JUDGED = (0, 1)
"""Exit codes of a command that did its job: with and without success."""
MOST_SHOWN = 3
"""Number of differences of a case that are printed."""
EQUAL, DIFFERS, FAILED, NEW = "equal", "DIFFERS", "failed", "new"
"""Results of a case."""


def run_case(case, sides, names, scratch, children):
    """Runs a case on both sides; returns (result, lines that explain it)."""
    folder = scratch / case.name.replace(":", "-")
    commands = (case.commands, [names.command(command) for command in case.commands])
    if None in commands[1]:
        return NEW, [f"it cannot be expressed at {sides[1].name}"]
    codes, complaints = ([], []), []
    for side, own, ended in zip(sides, commands, codes):
        (folder / side.checkout.name).mkdir(parents=True)
        for command in own:
            code, _, errors = children.run(side, ("-m", "drake_tracker", *command), folder / side.checkout.name)
            ended.append(code)
            if code not in JUDGED:
                said = (errors.strip().splitlines() or ["no message"])[-1]
                complaints.append(f"{side.name}: {command[0]} ended with exit code {code}: {said}")
                break
    found = []
    if not complaints:
        if codes[0] != codes[1]:
            found.append(Difference("exit codes of the commands", *map(str, codes)))
        places = [(folder / side.checkout.name, side.checkout) for side in sides]
        found += compare_folders(places[0][0], places[1][0], names, *places)
    shutil.rmtree(folder)
    lines = [f"{each.place}: {each.now} now, {each.base} at {sides[1].name}" for each in found]
    if len(lines) > MOST_SHOWN:
        lines[MOST_SHOWN:] = [f"and {len(lines) - MOST_SHOWN} more"]
    return (FAILED, complaints) if complaints else (DIFFERS, lines) if lines else (EQUAL, [])


def compare(base, cases, workers):
    """Compares the working tree with a revision; returns the exit code."""
    names = Names(applicable(RENAMES, lambda commit: is_ancestor(commit, base)))
    with tempfile.TemporaryDirectory(prefix="golden-") as name:
        scratch = Path(name).resolve()
        inputs = scratch / "inputs"
        chosen = [case for case in make_cases(inputs) if case.name in cases]
        tell("Copying the working tree")
        copy_working_tree(scratch / "now")
        with checked_out(base, scratch / "base"):
            sides = (
                Side("now", scratch / "now", sys.executable),
                Side(base, scratch / "base", interpreter(scratch / "base", scratch / "environment")),
            )
            if any(needs_inputs(case, inputs) for case in chosen):
                tell("Making clips and photographs")
                write_inputs(inputs)
            children = Children()
            for side in sides:
                check_side(side, scratch, children)
            counts = dict.fromkeys((EQUAL, DIFFERS, FAILED, NEW), 0)
            with closing(run_all(chosen, sides, names, scratch / "runs", children, workers)) as results:
                for case, result, lines in results:
                    counts[result] += 1
                    print("\n".join([f"{result:<8} {case.name}", *(f"         {line}" for line in lines)]), flush=True)
    total = ", ".join(f"{count} {result}" for result, count in counts.items())
    print(f"{len(chosen)} cases, compared with {base}: {total}")
    return 1 if counts[DIFFERS] or counts[FAILED] else 0


def run_all(cases, sides, names, scratch, children, workers):
    """Yields (case, result, lines) as the cases end, and prints the progress."""
    start, numbers = time.monotonic(), itertools.count(1)

    def work(case):
        number = next(numbers)
        ended = number - workers
        left = f", {time_left(time.monotonic() - start, ended, len(cases) - ended)} left" if ended > 0 else ""
        tell(f"[{number} of {len(cases)}{left}] {case.name}")
        return run_case(case, sides, names, scratch, children)

    with ThreadPoolExecutor(workers) as executor:
        try:
            futures = {executor.submit(work, case): case for case in cases}
            for future in as_completed(futures):
                yield futures[future], *future.result()
        except BaseException:
            executor.shutdown(wait=False, cancel_futures=True)
            children.end()
            raise


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--base", metavar="REV", help="the earlier revision, any name of a commit that git knows")
    parser.add_argument("--only", metavar="NAME[,NAME]", help="cases to run (default: all)")
    parser.add_argument("--list", action="store_true", help="print the cases and their commands, and run nothing")
    parser.add_argument("--workers", type=int, default=1, metavar="N", help="cases at a time (default: 1)")
    options = parser.parse_args()
    try:
        with graceful():
            return execute(options)
    except DrakeTrackerError as error:
        print(f"golden: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("golden: interrupted", file=sys.stderr)
        return exit_code()


def execute(options):
    """Does what the options say; returns the exit code. Raises DrakeTrackerError for bad input."""
    if not Path(drake_tracker.__file__).is_relative_to(ROOT):
        raise DrakeTrackerError(f"{drake_tracker.__file__} is another package: run it with PYTHONPATH={ROOT}")
    cases = {case.name: case for case in make_cases(Path("INPUTS"))}
    if options.list:
        for case in cases.values():
            print("\n".join([case.name, *(f"    drake-tracker {shlex.join(command)}" for command in case.commands)]))
        return 0
    if options.base is None:
        raise DrakeTrackerError("--base is missing: the revision to compare with")
    if git("rev-parse", "--verify", "--quiet", f"{options.base}^{{commit}}", check=False).returncode:
        raise DrakeTrackerError(f"--base {options.base}: git knows no such revision")
    if options.workers < 1:
        raise DrakeTrackerError(f"--workers {options.workers}: must be at least 1")
    chosen = list(cases) if options.only is None else options.only.split(",")
    for name in chosen:
        if name not in cases:
            raise DrakeTrackerError(f"--only {name}: there is no such case; allowed are {', '.join(cases)}")
    return compare(options.base, chosen, options.workers)


if __name__ == "__main__":
    sys.exit(main())
