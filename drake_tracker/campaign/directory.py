"""The directory of a campaign: what it remembers of its plan, and its record of trials."""

import json
import os
from contextlib import suppress
from pathlib import Path

from drake_tracker.campaign.record import Record
from drake_tracker.core.errors import DrakeTrackerError

PLAN, TRIALS = "campaign.json", "trials.jsonl"
"""Names of the files."""


def open_directory(plan, out):
    """Returns the `Record` of a campaign's trials in the directory ``out``, with the trials that it already holds.

    A new or empty directory begins a campaign; in that of the same campaign it goes on, with more trials if there are
    now to be more. Raises DrakeTrackerError for one that holds something else, and changes nothing in it.

    Args:
      plan: the `Plan`. out: the directory; None keeps nothing on disk.
    """
    if out is None:
        return Record(None)
    out = Path(out)
    wanted = {**plan.identity(), "trials": plan.trials}
    try:
        occupied = out.exists() and any(out.iterdir())
    except OSError as error:
        raise DrakeTrackerError(f"the campaign directory {out} cannot be read: {error.strerror}") from None
    if occupied:
        _compare(wanted, _read_plan(out), out)
    record = Record(out / TRIALS)
    try:
        _check_rows(record)
        write_whole(out / PLAN, json.dumps(wanted, indent=2) + "\n")
    except DrakeTrackerError:
        record.close()
        raise
    return record


def _check_rows(record):
    for number, row in enumerate(record.rows, 1):
        if not (isinstance(row.get("settings"), dict) and isinstance(row.get("seed"), int) and "success" in row):
            raise DrakeTrackerError(f"{record.path}: result {number} is not that of a trial; take its line out")


def discard(out):
    """Takes away the directory of a campaign that recorded nothing, if nothing else is in it."""
    for name in (PLAN, TRIALS):
        (Path(out) / name).unlink(missing_ok=True)
    with suppress(OSError):
        Path(out).rmdir()


def write_whole(path, text):
    """Writes a file so that at any time there is the old one or the new one. Raises DrakeTrackerError if it cannot."""
    replace_whole(path, lambda beside: beside.write_text(text, encoding="utf-8"))


def replace_whole(path, write):
    """Has ``write(path)`` make a file beside ``path``, of the same suffix, and puts it in its place."""
    beside = path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")
    try:
        write(beside)
        os.replace(beside, path)
    except OSError as error:
        raise DrakeTrackerError(f"{path} cannot be written: {error.strerror or error}") from None
    finally:
        beside.unlink(missing_ok=True)


def _read_plan(out):
    path = out / PLAN
    if not path.exists():
        raise DrakeTrackerError(f"the directory {out} is not empty and holds no campaign ({PLAN}); name another one")
    try:
        found = json.loads(path.read_bytes())
    except (OSError, ValueError):
        found = None
    if not isinstance(found, dict):
        raise DrakeTrackerError(f"{path}: damaged, no campaign can be read from it; name another directory")
    return found


def _compare(wanted, found, out):
    """Raises DrakeTrackerError, one line for each difference, when the campaign found is not the one wanted."""
    errors = []
    for key, value in wanted.items():
        there = found.get(key)
        if there == value or (key == "trials" and isinstance(there, int) and there <= value):
            continue
        if key == "settings_sha256":
            if not errors:  # else it follows from them
                errors.append("the settings of its scenario have changed since (a file, or the defaults)")
        elif key == "trials":
            errors.append(f"it has {there} trials, not {value}; only more can be asked for")
        elif key == "drake_tracker":
            errors.append(f"it was made by drake_tracker {there}, and this is {value}")
        else:
            errors.append(f"its {key.replace('_', ' ')} is {_show(there)}, not {_show(value)}")
    if errors:
        name = "name another directory"
        raise DrakeTrackerError("\n".join(f"{out} holds another campaign: {error}; {name}" for error in errors))


def _show(value):
    text = value if isinstance(value, str) else json.dumps(value)
    return text if len(text) <= 80 else text[:77] + "..."
