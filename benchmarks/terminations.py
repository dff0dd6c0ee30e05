"""Ends commands at random times, and checks that everything they left behind can be read.

    python benchmarks/terminations.py [--count N] [--seed N] [--results FILE]

Each of the commands is first run to its end. Then it is ended again and again: by Ctrl-C (SIGINT), SIGTERM, SIGHUP and
SIGKILL at a time that is drawn uniformly from 0 to 1.1 times the time that it takes, and by a full disk. A full disk is
a limit on the size of a file, drawn uniformly from 0 to the size of the largest file. Signals other than SIGKILL are
sent twice, half a second apart. Afterwards ``load_log``, the page of ``view`` and the readers of all other files read
what is there. One line for each termination is appended to ``results/terminations.jsonl``; those that are there are not
repeated.

A termination is a failure when the command did not end within 60 s, printed a traceback, ended with an exit code that
is not documented, left a temporary file (unless it was killed), or left a file that cannot be read.
"""

import argparse
import csv
import json
import os
import random
import resource
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import av
import cv2
from shared import common, stored
from shared.behaviour_rows import behaviour_of

from drake_tracker.campaign.directory import Record, read_lines
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.log import LOG_FILE, STREAM_FILE, load_log
from drake_tracker.report.page import page_of
from drake_tracker.report.run_files import SIGNS, read_run
from drake_tracker.tasks import load_scenario
from drake_tracker.tasks.results import git_commit, load_summary, package_versions

RESULTS = common.RESULTS / "terminations.jsonl"
MEASURED = "vision=!Measured {}"
RECORDED = "recorded"
"""Directory of the run that is replayed."""
COMMANDS = {
    "run": ["run", "train", "--set", MEASURED, "--duration", "6", "--out", "out"],
    "run, no recording": ["run", "train", "--set", MEASURED, "--duration", "12", "--no-record", "--out", "out"],
    "run, cameras": ["run", "train", "--duration", "4", "--record-images", "--out", "out"],
    "campaign": [
        *("campaign", "train", "--trials", "3", "--vary", "track.speed=0.1,0.2", "--vision", "measured"),
        *("--set", "duration=1.5", "--workers", "1", "--out", "out"),
    ],
    "replay": ["replay", RECORDED, "--set", "estimator=!CoordinatedTurn {}", "--out", "out"],
}
SIGNALS = {"INT": 130, "TERM": 143, "HUP": 129, "KILL": -9}
"""{signal: exit code}."""
FULL = "full disk"
ENDINGS = [*SIGNALS, FULL]
LONGEST, AGAIN = 60.0, 0.5
"""Wall time after which a command hangs, and between two signals [s]."""
LATEST = 1.1
"""Latest time of a signal, in units of the time that the command takes."""


def start(name, folder, limit=None):
    """Starts a command in a folder, with a limit on the size of files [bytes]. Returns the process."""

    def prepare():
        for request in (signal.SIGINT, signal.SIGHUP):
            signal.signal(request, signal.SIG_DFL)
        if limit is not None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

    program = [sys.executable, "-m", "drake_tracker", *COMMANDS[name]]
    with (folder / "stderr").open("wb") as errors:
        return subprocess.Popen(
            program, cwd=folder, stdout=subprocess.DEVNULL, stderr=errors, preexec_fn=prepare, start_new_session=True
        )


def run_to_end(name, folder):
    """Runs a command to its end. Returns (time that it took [s], size of its largest file [bytes])."""
    begin = time.monotonic()
    process = start(name, folder)
    if process.wait() not in (0, 1):
        sys.exit(f"{name}: exit code {process.returncode}\n{(folder / 'stderr').read_text()}")
    sizes = [path.stat().st_size for path in (folder / "out").rglob("*") if path.is_file()]
    return time.monotonic() - begin, max(sizes)


def terminate(job, reference, folder):
    """Runs a command and ends it. Returns the line of the result."""
    number, seed, name, ending = job
    generator = random.Random(f"{seed} {number}")
    duration, size = reference
    limit = generator.randrange(size) if ending == FULL else None
    after = generator.uniform(0.0, LATEST * duration) if limit is None else None
    process = start(name, folder, limit)
    problems = []
    try:
        for pause in () if after is None else (after,) if ending == "KILL" else (after, AGAIN):
            try:
                process.wait(pause)
            except subprocess.TimeoutExpired:
                process.send_signal(signal.Signals[f"SIG{ending}"])
        process.wait(LONGEST if after is not None else LONGEST + duration)
    except subprocess.TimeoutExpired:
        problems.append("it hung")
        process.kill()
        process.wait()
    errors = (folder / "stderr").read_text(errors="replace")
    code, out = process.returncode, folder / "out"
    documented = {0, 1, 2 if ending == FULL else SIGNALS[ending]}
    if ending not in ("KILL", FULL):
        documented.add(-signal.Signals[f"SIG{ending}"])  # before the first line of the program, or after the last one
    if code not in documented:
        problems.append(f"exit code {code}")
    if "Traceback" in errors and code >= 0:
        problems.append("a traceback")
    kept, unreadable = read_all(out, killed=ending == "KILL")
    return {
        "number": number,
        "seed": seed,
        "command": name,
        "ending": ending,
        "after_s": after,
        "limit_bytes": limit,
        "exit_code": code,
        "last_line": (errors.splitlines() or [""])[-1][-200:],
        **kept,
        "problems": problems + unreadable,
    }


def read_all(out, killed):
    """Reads every file in a directory. Returns (facts, list of what cannot be read)."""
    problems = []
    facts = {"files": sorted(path.relative_to(out).as_posix() for path in out.rglob("*") if path.is_file())}
    for name in facts["files"]:
        if Path(name).name.startswith("."):
            if not killed:
                problems.append(f"{name}: a temporary file")
            continue
        try:
            READERS.get(Path(name).suffix, Path.read_bytes)(out / name)
        except Exception as error:  # this is what is looked for
            problems.append(f"{name}: {type(error).__name__}: {error}")
    if any((out / name).is_file() for name in (LOG_FILE, STREAM_FILE)):
        ends = [signal.times[-1] for signal in load_log(out).values() if len(signal.times)]
        facts["log_end_s"] = float(max(ends, default=0.0))
    if any((out / name).is_file() for name in SIGNS):
        try:
            page_of(read_run(out))
        except Exception as error:
            problems.append(f"view: {type(error).__name__}: {error}")
    return facts, problems


def read_video(path):
    """Decodes a video; raises an error when that is not possible. A file in which nothing is yet is readable."""
    if path.stat().st_size:
        with av.open(str(path)) as video:
            if video.streams.video:
                for _ in video.decode(video=0):
                    pass


def read_picture(path):
    """Decodes a picture; raises an error when that is not possible."""
    if cv2.imread(str(path)) is None:
        raise ValueError("it is not a picture")


def read_record(path):
    """Opens the record of a campaign, as its next call does."""
    Record(path).close()
    keys = [(json.dumps(row["settings"]), row["seed"]) for row in read_lines(path)]
    if len(set(keys)) < len(keys):
        raise ValueError("a trial is there twice")


def read_table(path):
    """Reads a table; raises an error when it has no row."""
    with path.open(newline="") as file:
        if not list(csv.DictReader(file)):
            raise ValueError("it is empty")


READERS = {
    ".npz": load_log,
    ".part": load_log,
    ".json": load_summary,
    ".yaml": lambda path: load_scenario(str(path.absolute())),
    ".jsonl": read_record,
    ".csv": read_table,
    ".mp4": read_video,
    ".mkv": read_video,
    ".png": read_picture,
}
"""{suffix: reader of a file, which raises an error for an incomplete one}."""


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=20, help="number of terminations (default 20)")
    parser.add_argument("--seed", type=int, default=0, help="of the times (default 0)")
    parser.add_argument("--results", type=Path, default=RESULTS, help="JSONL file to append to")
    options = parser.parse_args()
    names = list(COMMANDS)
    jobs = [
        (number, options.seed, names[number % len(names)], ENDINGS[(number + number // len(names)) % len(ENDINGS)])
        for number in range(options.count)
    ]
    done = {(row["number"], row["seed"]) for row in stored.read_lines(options.results)}
    missing = [job for job in jobs if job[:2] not in done]
    common.about_to_run(missing)
    options.results.parent.mkdir(parents=True, exist_ok=True)
    os.environ |= {"LP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    with stored.record(options.results) as opened, tempfile.TemporaryDirectory() as scratch:
        references = {}
        for name in dict.fromkeys(("run", *(job[2] for job in missing))):
            folder = Path(scratch, name)
            folder.mkdir()
            if references:
                (folder / RECORDED).symlink_to(Path(scratch, "run", "out"))
            references[name] = run_to_end(name, folder)
            print(f"{name}: {references[name][0]:.1f} s, largest file {references[name][1]} bytes", file=sys.stderr)
        for job in missing:
            folder = Path(scratch, str(job[0]))
            folder.mkdir()
            (folder / RECORDED).symlink_to(Path(scratch, "run", "out"))
            result = terminate(job, references[job[2]], folder)
            origin = {"package_versions": package_versions(), "git_commit": git_commit()}
            opened.append({**result, **origin, **behaviour_of(RESULTS.stem, result)})
            said = "; ".join(result["problems"]) or "read"
            print(f"{job[0]}: {job[2]}, {job[3]}: exit code {result['exit_code']}, {said}", file=sys.stderr, flush=True)
        rows = [row for row in opened.rows if (row["number"], row["seed"]) in {job[:2] for job in jobs}]
    common.print_table(*table(rows))


def table(rows):
    """Returns (header, rows) of a table with one row for each ending."""
    lines = []
    for ending in (*ENDINGS, "all"):
        own = [row for row in rows if ending in (row["ending"], "all")]
        good = sum(not row["problems"] for row in own)
        lines.append([ending, len(own), sum(bool(row["files"]) for row in own), *common.share(good, len(own))])
    return ["ending", "terminations", "left files", "everything readable", "Wilson 95 %"], lines


if __name__ == "__main__":
    try:
        main()
    except DrakeTrackerError as error:
        sys.exit(f"terminations: {error}")
