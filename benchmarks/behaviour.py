"""Behaviour numbers: notices when a packaged scenario behaves differently, and which results rest on it.

    python benchmarks/behaviour.py                        run each entry briefly, and compare it with its record
    python benchmarks/behaviour.py --only train,ball      some entries
    python benchmarks/behaviour.py --update ENTRY REASON  record an entry anew, and raise its number
    python benchmarks/behaviour.py --at COMMIT ENTRY NAME whether a commit's entry NAME behaves as ENTRY does today

Each entry has a number and the record of one run in ``behaviour.json``: its settings, phases, pose at the touch,
outcome, and means of its signals. Every row of the result files names the numbers of the entries that it ran
(`shared/behaviour_rows.py`). Where an entry differs from its record, the command exits with 1 until ``--update`` raises
the number. The tables then mark the rows that rest on the earlier behaviour.

Runs on other processors differ by rounding: up to 3e-11 in a log of `train` (seed 3), and by one moving pixel in one
image, with ``OPENBLAS_CORETYPE=Haswell``, ``LP_NATIVE_VECTOR_WIDTH=128``, and without AVX in NumPy and OpenCV. The
tolerances are far above that. But with AVX-512 in OpenBLAS or in NumPy, `train:hill` takes another course: all runs
use AVX2. Contact is chaotic: signals are compared up to the first launch, or up to the first impact of the ball.
"""

import argparse
import json
import math
import os
import re
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path
from typing import NamedTuple

import numpy as np
from shared.behaviour_rows import RECORDS, behaviour_records

WINDOW = 2.0
"""Time over which signals are averaged [s]."""
AHEAD = 0.75
"""Time from the stamp of a packet to the predicted place that is compared [s]: the horizon of a blind descent."""
MOST_FIELDS = 12
"""First fields of a signal that are compared: all of most messages, the first slot of those with several objects."""
NOT_COMPARED = ("truth", "command", "status", "packet", "limiter", "q_", "arm_", "prediction", "delivered")
"""Beginnings of the names of signals that are not averaged: ground truth, counters, what follows from the others."""
NO_MEAN = ("time", "stamp", "seq", "valid", "yaw", "phase", "gate", "attempts")
"""Fields whose mean says nothing, or that the record has in another form."""
LENGTH, PREDICTED, RELATIVE, LEAST = 2e-5, 2e-4, 0.002, 1e-4
"""Largest difference of the mean of a length [m]; of one predicted place [m], which event times that differ by rounding
changed by 2.5e-5; of any other mean as a share of it, and in its own unit."""
KERNELS = {"OPENBLAS_CORETYPE": "Haswell", "NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR"}
"""Environment of every run: nothing of AVX-512. NumPy passes over names that a processor does not have."""
TIME, OFFSET, PLACE, SHARE = 0.031, 5e-4, 0.002, 0.005
"""Largest difference of the start of a phase [s] (one servo period), of the offset of hand and train at the touch [m],
of the place of the touch [m], and of the share of a verdict of the gate."""
LENGTHS = ("x", "y", "z", "gap", "std", "error", "width")
"""Last words of the names of fields that are lengths [m]."""
IGNORED = ("name", "description", "seed", "duration")
"""Settings that a record does not have."""


class Plan(NamedTuple):
    """The run whose record an entry has.

    Attributes:
        seed: of the run.
        duration: longest simulated time [s]. `train` runs until the train is held, other entries at most until shortly
            after the touch.
        until: time up to which the run is compared [s]: the ball's first impact.
    """

    seed: int
    duration: float
    until: float = math.inf


PLANS = {
    "train": Plan(3, 20.0),
    "train:learned": Plan(3, 11.0),
    "train:guided": Plan(3, 4.0),
    "train:interlaced": Plan(0, 3.0),
    "train:literal": Plan(0, 3.0),
    "train:line": Plan(0, 5.0),
    "train:line_guided": Plan(0, 3.8),
    "train:two": Plan(0, 4.0),
    "train:visitor": Plan(0, 4.0),
    "train:wrist": Plan(0, 3.3),
    "train:space": Plan(1, 12.0),
    "train:hill": Plan(1, 12.0),
    "train:hill_guided": Plan(1, 5.0),
    "ball": Plan(4, 2.6, until=2.5),
    "ball:seven_joint": Plan(4, 2.6, until=2.5),
    "ball:every_image": Plan(4, 2.6, until=2.5),
    "conveyor": Plan(11, 4.0),
    "conveyor:measured": Plan(11, 4.0),
    "conveyor:ur5e": Plan(11, 4.0),
    "conveyor:ur5e_measured": Plan(11, 4.0),
}
"""{packaged entry: the run of its record}."""


def measure(entry: str) -> dict:
    """Runs an entry in this process; returns its record."""
    from drake_tracker import load_scenario, simulate
    from drake_tracker.run.options import RunOptions
    from drake_tracker.scenarios.reader import describe_settings

    plan = PLANS[entry]
    scenario = load_scenario(entry, seed=plan.seed, duration=plan.duration)
    with tempfile.TemporaryDirectory() as folder:
        summary = simulate(scenario, f"{folder}/run", RunOptions(record=False))
        record = record_of(entry, f"{folder}/run", summary)
    settings = {key: value for key, value, *_ in describe_settings(scenario) if key not in IGNORED}
    return {"settings": settings, **record}


def record_of(entry: str, run: str, summary: dict) -> dict:
    """Returns what the run directory ``run`` of an entry says about its behaviour, without its settings."""
    from drake_tracker import load_log, load_scenario, task_of
    from drake_tracker.tasks.episode import phase_spans, tool_pose

    log, scenario, until = load_log(f"{run}/log.npz"), load_scenario(entry), PLANS[entry].until
    spans = [span for span in phase_spans(log, task_of(scenario).phases, scenario.time_step) if span.start < until]
    launch = next((span.start for span in spans if span.phase.name == "INTERCEPT"), math.inf)
    end = min(until, launch)
    record = {"phases": [[span.phase.name, round(span.start, 4)] for span in spans], "means": _means(log, end)}
    times = np.arange(1.0, min(end, log["tool"].times[-1]), 1.0)
    record["path"] = [[float(t), *map(_rounded, row[:3])] for t, row in zip(times, tool_pose(log, times))]
    gates = Counter(int(gate) for gate in log["diagnosis"]["gate"][log["diagnosis"].times < end]) if _gated(log) else {}
    record["gate"] = {str(gate): _rounded(count / sum(gates.values())) for gate, count in sorted(gates.items())}
    if until == math.inf:
        record["outcome"] = {key: summary[key] for key in ("success", "attempts", "placed") if key in summary}
    if summary.get("touch_along_m") is not None:
        verdict = log["truth_verdict"]
        touched = (verdict["left_contact"] > 0) | (verdict["right_contact"] > 0)
        record["touch"] = {
            "offset": [_rounded(summary[key]) for key in ("touch_along_m", "touch_across_m")],
            "place": [_rounded(value) for value in tool_pose(log, verdict.times[touched][:1]).ravel()[:3]],
        }
    return record


def _gated(log) -> bool:
    return "diagnosis" in log and "gate" in log["diagnosis"].names


def _means(log, end: float) -> dict[str, list[float]]:
    """Returns {signal.field: its mean in each `WINDOW` up to a time [s]}, of valid rows only."""
    found: dict[str, list[float]] = {}
    edges = [*np.arange(0.0, min(end, log["tool"].times[-1]), WINDOW), end]
    for name, signal in log.items():
        if name.startswith(NOT_COMPARED):
            continue
        valid = signal["valid"] > 0 if "valid" in signal.names else np.ones(len(signal.times), bool)
        fields = [field for field in signal.names[:MOST_FIELDS] if field.split("_")[0] not in NO_MEAN]
        for start, stop in zip(edges, edges[1:]):
            rows = valid & (signal.times >= start) & (signal.times < stop)
            if rows.any():
                found.setdefault(f"{name}.rows", []).append(int(rows.sum()))
                for field in fields:
                    found.setdefault(f"{name}.{field}", []).append(_rounded(np.nanmean(signal[field][rows])))
    for axis, values in zip(("x", "y", "std"), zip(*_ahead(log, end))):
        found[f"ahead.{axis}"] = [_rounded(value) for value in values]
    return found


def _ahead(log, end: float) -> list[np.ndarray]:
    """Returns (x, y, standard deviation) of the place `AHEAD` of its stamp that packets predict, twice a second."""
    from drake_tracker.core.messages import evaluate_prediction
    from drake_tracker.tasks.episode import can_be_evaluated

    signal = log["delivered"]
    usable = can_be_evaluated(signal)
    rows = []
    for time in np.arange(0.5, min(end, signal.times[-1]), 0.5):
        row = np.searchsorted(signal.times, time)
        if usable[row]:
            packet = signal.data[row]
            rows.append(evaluate_prediction(packet, packet[0] + AHEAD)[[0, 1, 4]])
    return rows


def _rounded(value: float) -> float | None:
    return float(f"{value:.6g}") if math.isfinite(value) else None


def differences(kept: dict, now: dict) -> list[str]:
    """Returns in which respects a run differs from the record of its entry, one line each, by the tolerances."""
    found = []
    for key in kept.get("settings", {}).keys() & now.get("settings", {}).keys():
        if kept["settings"][key] != now["settings"][key]:
            found.append(f"{key} was {kept['settings'][key]}, is {now['settings'][key]}")
    names = [[name for name, _ in record["phases"]] for record in (kept, now)]
    if names[0] != names[1]:
        found.append(f"phases were {' '.join(names[0])}, are {' '.join(names[1])}")
    for (name, before), (_, after) in zip(kept["phases"], now["phases"]):
        found += _unlike(f"start of {name} [s]", before, after, TIME)
    for key in kept["means"].keys() & now["means"].keys():
        before, after = kept["means"][key], now["means"][key]
        if len(before) != len(after):
            found.append(f"mean of {key}: {len(before)} windows were valid, {len(after)} are")
        length = re.sub(r"\d*$", "", key).rpartition(".")[2].rpartition("_")[2] in LENGTHS
        for number, (a, b) in enumerate(zip(before, after)):
            allowed = LENGTH if length else max(LEAST, RELATIVE * abs(a or 0.0))
            allowed = PREDICTED if key.startswith("ahead.") else allowed
            found += _unlike(f"mean {number} of {key}", a, b, allowed)
    for (time, *before), (_, *after) in zip(kept["path"], now["path"]):
        found += _unlike(f"tool at {time:g} s [m]", before, after, PLACE)
    for key in sorted(kept["gate"].keys() | now["gate"].keys()):
        found += _unlike(f"share of verdict {key}", kept["gate"].get(key, 0.0), now["gate"].get(key, 0.0), SHARE)
    if kept.get("outcome") != now.get("outcome"):
        found.append(f"outcome was {kept.get('outcome')}, is {now.get('outcome')}")
    if "touch" in kept and "touch" in now:
        for what, allowed in (("offset", OFFSET), ("place", PLACE + TIME * 0.2)):  # m; at most 0.2 m/s
            found += _unlike(f"{what} at the touch [m]", kept["touch"][what], now["touch"][what], allowed)
    return sorted(found)


def _unlike(what: str, before, after, allowed: float) -> list[str]:
    a, b = (np.atleast_1d(np.array(value, dtype=float)) for value in (before, after))
    same = np.isnan(a) == np.isnan(b)
    if (same & (np.isnan(a) | (np.abs(a - b) <= allowed))).all():
        return []
    return [f"{what} was {before}, is {after} (allowed: {allowed:.2g})"]


def run_entry(entry: str) -> dict:
    """Returns the record of an entry in a worker, or ``{"error": ...}``: one broken entry does not hide the others."""
    try:
        return {"entry": entry, **measure(entry)}
    except (Exception, SystemExit) as error:
        return {"entry": entry, "error": f"{type(error).__name__}: {' '.join(str(error).split())}"}


def run_entries(entries: list[str], workers: int) -> dict[str, dict]:
    """Returns {entry: its record today}; tells about each as soon as it is there."""
    from drake_tracker.campaign.plan import Lost
    from drake_tracker.campaign.pool import pool

    found = {}
    os.environ.setdefault("DRAKE_TRACKER_RENDER_PROCESSES", "0")
    for entry, record in pool(workers)(run_entry, entries):
        found[entry] = {"error": record.reason} if isinstance(record, Lost) else record
        print(f"behaviour: {entry} was run ({len(found)} of {len(entries)})", file=sys.stderr, flush=True)
    return found


def save(records: dict) -> None:
    """Writes the records, one line for each part of an entry."""
    blocks = []
    for entry, record in records.items():
        parts = ",\n".join(f'  "{key}": {json.dumps(value)}' for key, value in record.items())
        blocks.append(f'"{entry}": {{\n{parts}\n}}')
    RECORDS.write_text("{\n" + ",\n".join(blocks) + "\n}\n", encoding="utf-8")


def check(entries: list[str], workers: int) -> int:
    """Compares entries with their records; returns the exit code."""
    records, status = behaviour_records(), 0
    for entry, now in sorted(run_entries(entries, workers).items(), key=lambda item: entries.index(item[0])):
        if "error" in now:
            found = [now["error"]]
        elif entry not in records:
            found = ["there is no record"]
        else:
            found = differences(records[entry], now)
        number = records.get(entry, {}).get("number", 0)
        print(f"{entry}: behaviour {number}" + (f" DIFFERS in {len(found)} respects" if found else ""))
        print(*(f"    {line}" for line in found[:8]), sep="\n", end="\n" if found else "")
        status |= bool(found)
    if status:
        print(
            'behaviour: if this is intended, python benchmarks/behaviour.py --update ENTRY "reason", and measure again'
        )
    return status


def update(entry: str, reason: str) -> int:
    """Records an entry anew and raises its number; returns the exit code."""
    now = run_entry(entry)
    if "error" in now:
        print(f"behaviour: {entry}: {now['error']}", file=sys.stderr)
        return 1
    del now["entry"]
    records = behaviour_records()
    before = records.get(entry, {"number": 0, "reasons": []})
    number = before["number"] + 1
    records[entry] = {"number": number, "reasons": [*before["reasons"], f"{number}: {reason}"], **now}
    save({name: records[name] for name in PLANS if name in records})
    print(f"{entry}: behaviour {number}")
    return 0


def compare_at(commit: str, entry: str, name: str) -> int:
    """Compares the entry ``name`` of an earlier commit with today's record of ``entry``; returns the exit code."""
    plan = PLANS[entry]
    with tempfile.TemporaryDirectory() as folder:
        checkout, run = f"{folder}/checkout", f"{folder}/run"
        subprocess.run(["git", "-C", RECORDS.parent, "worktree", "add", "-q", "-f", checkout, commit], check=True)
        try:
            command = [sys.executable, "-m", "drake_tracker", "run", name, "--no-record", "--out", run]
            command += ["--seed", str(plan.seed), "--duration", str(plan.duration)]
            environment = {**os.environ, "PYTHONPATH": checkout, "DRAKE_TRACKER_RENDER_PROCESSES": "0"}
            subprocess.run(command, cwd=folder, env=environment, capture_output=True, check=False)
            summary = json.loads(Path(run, "summary.json").read_text(encoding="utf-8"))
            found = differences(behaviour_records()[entry], record_of(entry, run, summary))
        finally:
            subprocess.run(["git", "-C", RECORDS.parent, "worktree", "remove", "--force", checkout], check=True)
    print(
        f"{commit[:7]}: {name} "
        + (f"differs from {entry}: {'; '.join(found[:3])}" if found else f"is {entry} of today")
    )
    return bool(found)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", help="names separated by commas (default: all)")
    parser.add_argument("--workers", type=int, default=os.cpu_count(), help="processes (default: one per core)")
    action = parser.add_mutually_exclusive_group()
    action.add_argument("--update", nargs=2, metavar=("ENTRY", "REASON"), help="record an entry anew")
    action.add_argument("--at", nargs=3, metavar=("COMMIT", "ENTRY", "NAME"), help="compare an earlier commit")
    options = parser.parse_args()
    if not KERNELS.keys() <= os.environ.keys():  # OpenBLAS has read its environment already
        os.execve(sys.executable, [sys.executable, *sys.argv], {**os.environ, **KERNELS})
    asked = [options.update[0]] if options.update else [options.at[1]] if options.at else []
    entries = options.only.split(",") if options.only else list(PLANS)
    for name in (*asked, *entries):
        if name not in PLANS:
            parser.error(f"there is no entry {name!r}; there are {', '.join(PLANS)}")
    if options.update:
        return update(*options.update)
    return compare_at(*options.at) if options.at else check(entries, options.workers)


if __name__ == "__main__":
    sys.exit(main())
