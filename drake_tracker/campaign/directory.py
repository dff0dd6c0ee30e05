"""The directory of a campaign: its plan and its record of trials."""

import json
import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from drake_tracker.campaign.plan import CampaignPlan, TrialKey, key_of
from drake_tracker.campaign.record import Record
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.files.atomic_file import write_text
from drake_tracker.core.files.regular_file import read_regular

PLAN, TRIALS = "campaign.json", "trials.jsonl"
"""Names of the files."""
_LARGEST_PLAN = 1 << 26
"""Largest size of a plan [bytes]."""


def open_directory(plan: CampaignPlan, out: str | os.PathLike[str] | None) -> Record:
    """Returns the `Record` of a campaign's trials, with the trials that its directory already holds.

    A new or empty directory starts a campaign. The directory of the same campaign continues it, possibly with more
    trials. Raises DrakeTrackerError for a directory with any other content, and changes nothing in it.

    Args:
        plan: of the campaign.
        out: the directory; None keeps nothing on disk.
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
        _drop_repeated(record)
        write_text(out / PLAN, json.dumps(wanted, indent=2) + "\n")
    except DrakeTrackerError:
        record.close()
        raise
    return record


def _check_rows(record: Record) -> None:
    for number, row in enumerate(record.rows, 1):
        settings = row.get("settings")
        is_trial = isinstance(settings, dict) and all(isinstance(value, str) for value in settings.values())
        if not (is_trial and type(row.get("seed")) is int and isinstance(row.get("success"), bool)):
            raise DrakeTrackerError(f"{record.path}: result {number} is not the result of a trial; remove its line")


def _drop_repeated(record: Record) -> None:
    """Keeps the first result of each trial, so that none counts twice."""
    first: dict[TrialKey, dict[str, Any]] = {}
    for row in record.rows:
        first.setdefault(key_of(row["settings"], row["seed"]), row)
    repeated = len(record.rows) - len(first)
    if repeated:
        record.rows[:] = first.values()
        record.notes.append(
            f"{record.path}: results of a trial that is there already: {repeated}; its first one counts"
        )


def discard(out: str | os.PathLike[str]) -> None:
    """Removes the directory of a campaign that recorded nothing, unless it holds anything else."""
    for name in (PLAN, TRIALS):
        (Path(out) / name).unlink(missing_ok=True)
    with suppress(OSError):
        Path(out).rmdir()


def _read_plan(out: Path) -> dict[str, Any]:
    path = out / PLAN
    if not path.exists():
        raise DrakeTrackerError(f"the directory {out} is not empty and holds no campaign ({PLAN}); choose another one")
    try:
        found = json.loads(read_regular(path, _LARGEST_PLAN))
    except (OSError, ValueError, RecursionError):
        found = None
    if not isinstance(found, dict):
        raise DrakeTrackerError(f"{path}: damaged, it describes no campaign; choose another directory")
    return found


def _compare(wanted: Mapping[str, Any], found: Mapping[str, Any], out: Path) -> None:
    """Raises DrakeTrackerError, with one line for each difference, when the campaign found is not the one wanted."""
    errors: list[str] = []
    for key, value in wanted.items():
        there = found.get(key)
        if there == value or (key == "trials" and isinstance(there, int) and there <= value):
            continue
        if key == "settings_sha256":
            if not errors:  # otherwise it follows from them
                errors.append("the settings of its scenario have changed since (a file, or the defaults)")
        elif key == "trials":
            errors.append(f"it has {there} trials, not {value}; the number can only grow")
        elif key == "drake_tracker":
            errors.append(f"it was made by drake_tracker {there}, and this is {value}")
        else:
            errors.append(f"its {key.replace('_', ' ')} is {_show(there)}, not {_show(value)}")
    if errors:
        remedy = "choose another directory"
        raise DrakeTrackerError("\n".join(f"{out} holds another campaign: {error}; {remedy}" for error in errors))


def _show(value: Any) -> str:
    text = value if isinstance(value, str) else json.dumps(value)
    return text if len(text) <= 80 else text[:77] + "..."
