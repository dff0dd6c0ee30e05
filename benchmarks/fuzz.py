"""Gives the program damaged input at random: scenarios, settings, run directories, campaigns, calibrations, packets.

    python benchmarks/fuzz.py [--minutes M] [--seed N] [--json FILE]
    python benchmarks/fuzz.py --case N [--seed N]

Good input is changed at random; case N of a seed is always the same. Most commands are called in a worker process,
some in a process of their own. A case is a defect when it

- prints a traceback, raises anything but an error for the user, or ends with an exit code that is not documented,
- takes longer than 10 s, or 30 s in a process of its own, whose start on a busy machine takes seconds; twice,
- ends its process, or
- writes, renames or removes a file outside of the directory that the command is for. Scenarios name a module that
  writes such a file when it is imported, and links in the directories lead outside.

``--case`` runs one case and shows its traceback. The result counts the cases and has every defect.
"""

import argparse
import contextlib
import json
import multiprocessing
import os
import random
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from pathlib import Path

from result_tables.fuzz_table import table
from shared import common

from drake_tracker.core.files.atomic_file import write_text

RESULTS = common.RESULTS / "fuzz.json"
TESTS = Path(__file__).resolve().parents[1] / "tests"
KINDS = {  # name of a function in fuzz_files or fuzz_packets: how often it is drawn
    "scenario": 30,
    "setting": 10,
    "short_run": 2,
    "view": 12,
    "replay": 4,
    "campaign": 4,
    "dataset": 2,
    "data_file": 8,
    "footage": 5,
    "arm_description": 3,
    "http": 20,
    "read_messages": 20,
    "host_process": 5,
    "arm_receiver": 12,
    "link_guard_servo": 16,
    "real_process": 1,
}
LONGEST = 10.0
"""Wall time after which a case hangs [s]."""
LONGEST_PROCESS = 30.0
"""The same for a case in a process of its own [s]."""
STARTING = 600.0
"""Longest time that a worker takes to start [s]."""


def kind_of(number, seed):
    """Returns (kind, generator) of a case; with --only, all cases are of this kind."""
    generator = random.Random(f"{seed} {number}")
    if "FUZZ_ONLY" in os.environ:
        return os.environ["FUZZ_ONLY"], generator
    return generator.choices(list(KINDS), KINDS.values())[0], generator


def run_case(number, seed, scratch):
    """Runs a case. Returns (what is wrong, or None; whether the input was used and not refused)."""
    from fuzz_parts import files as fuzz_files
    from fuzz_parts import packets as fuzz_packets

    kind, generator = kind_of(number, seed)
    folder = scratch / str(number)
    (folder / "here").mkdir(parents=True)
    (folder / "outside").mkdir()
    (folder / "outside" / "precious").write_text("precious")
    os.mkfifo(folder / "here" / "pipe")
    (folder / "here" / "canary.py").write_text("open('../outside/ran', 'w').close()\n")
    try:
        code = getattr(fuzz_files if hasattr(fuzz_files, kind) else fuzz_packets, kind)(generator, folder)
    except (Exception, SystemExit) as error:
        return f"{type(error).__name__}: {error}\n{traceback.format_exc()[-3000:]}", False
    finally:
        os.chdir(scratch)
        shutil.rmtree(folder)
    return None, code != 2


def start_worker(scratch):
    """Prepares this process for cases."""
    sys.path.append(str(TESTS))
    sys.dont_write_bytecode = True
    os.environ |= {"LP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "OPENCV_FOR_THREADS_NUM": "1"}
    os.environ["PYTHONPATH"] = os.pathsep.join([str(TESTS.parent), os.environ.get("PYTHONPATH", "")])
    scratch.mkdir()
    os.chdir(scratch)
    sys.path.insert(0, "")
    from fuzz_parts import files as fuzz_files
    from fuzz_parts import packets as fuzz_packets

    fuzz_files.prepare(scratch)
    fuzz_packets.prepare()


def serve(connection, seed, scratch):
    """Runs the cases whose numbers arrive; sends what `run_case` returns."""
    os.setsid()
    start_worker(scratch)
    connection.send("ready")
    while True:
        connection.send(run_case(connection.recv(), seed, scratch))


class Worker:
    """A process that runs cases; a new one takes the place of one that hangs or dies."""

    def __init__(self, seed, scratch):
        self._seed, self._scratch, self._count = seed, scratch, 0
        self._process = None

    def run(self, number):
        """Runs a case, see `run_case`."""
        self.start()
        self._connection.send(number)
        try:
            limit = LONGEST_PROCESS if kind_of(number, self._seed)[0] == "real_process" else LONGEST
            if self._connection.poll(limit):
                return self._connection.recv()
            self.close()
            return f"hang: longer than {limit:g} s", False
        except (EOFError, ConnectionError):
            self._process.join()
            code = self._process.exitcode
            self.close()
            return f"crash: the process ended with exit code {code}", False

    def start(self):
        """Starts the process, unless it is running, and waits until it is ready."""
        if self._process is not None:
            return
        self._count += 1
        context = multiprocessing.get_context("spawn")
        self._connection, theirs = context.Pipe()
        arguments = (theirs, self._seed, self._scratch / f"worker{self._count}")
        self._process = context.Process(target=serve, args=arguments)
        self._process.start()
        theirs.close()
        if not self._connection.poll(STARTING):
            sys.exit("fuzz: the worker does not start")
        self._connection.recv()

    def close(self):
        """Ends the process."""
        if self._process is not None:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self._process.pid, signal.SIGKILL)
            self._process.join()
            self._process = None


def run_cases(minutes, seed, scratch, first):
    """Runs cases for some minutes, or until Ctrl-C. Returns the result."""
    worker, start, said = Worker(seed, scratch), time.monotonic(), 0.0
    counts, accepted, longest, defects = Counter(), Counter(), dict.fromkeys(KINDS, 0.0), []
    number, repeated = first, 0
    try:
        while (elapsed := time.monotonic() - start) < 60.0 * minutes:
            worker.start()
            kind, begin = kind_of(number, seed)[0], time.monotonic()
            trouble, used = worker.run(number)
            if trouble is not None and trouble.startswith("hang"):
                repeated += 1
                print(f"case {number}, {kind}: {trouble}; once more", file=sys.stderr, flush=True)
                worker.start()
                begin = time.monotonic()
                trouble, used = worker.run(number)  # a busy machine is no hang
            counts[kind] += 1
            accepted[kind] += used
            longest[kind] = max(longest[kind], time.monotonic() - begin)
            if trouble is not None:
                defects.append({"case": number, "kind": kind, "what": trouble})
                print(f"case {number}, {kind}: {trouble}", file=sys.stderr, flush=True)
            if elapsed > said + 30.0:
                said = elapsed
                print(f"{elapsed:.0f} s: {counts.total()} cases, {len(defects)} defects", file=sys.stderr, flush=True)
            number += 1
    except KeyboardInterrupt:
        minutes = round((time.monotonic() - start) / 60.0, 1)
    finally:
        worker.close()
    return {
        "minutes": minutes,
        "first_case": first,
        "cases": counts.total(),
        "by_kind": {kind: counts[kind] for kind in KINDS},
        "accepted": {kind: accepted[kind] for kind in KINDS},
        "longest_s": {kind: round(value, 2) for kind, value in longest.items()},
        "repeated": repeated,
        "defects": defects,
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=20.0, help="how long (default 20)")
    parser.add_argument("--seed", type=int, default=0, help="of the cases (default 0)")
    parser.add_argument("--first", type=int, default=0, help="number of the first case (default 0)")
    parser.add_argument("--case", type=int, metavar="N", help="run this case only, without a time limit")
    parser.add_argument("--json", type=Path, default=RESULTS, help="file for the result")
    parser.add_argument("--only", metavar="KIND", choices=KINDS, help="run cases of this kind only")
    options = parser.parse_args()
    if options.only:
        os.environ["FUZZ_ONLY"] = options.only
    with tempfile.TemporaryDirectory(prefix="fuzz-") as scratch:
        scratch = Path(scratch).resolve()
        if options.case is not None:
            start_worker(scratch / "worker")
            print(kind_of(options.case, options.seed)[0])
            trouble, _ = run_case(options.case, options.seed, scratch / "worker")
            os.chdir(TESTS)
            print(trouble or "no defect")
            return
        result = run_cases(options.minutes, options.seed, scratch, options.first)
    common.print_table(*table(result))
    made_by = common.provenance([options.seed])
    options.json.parent.mkdir(parents=True, exist_ok=True)
    write_text(options.json, json.dumps({"made_by": made_by, **result}, indent=2) + "\n")


if __name__ == "__main__":
    main()
