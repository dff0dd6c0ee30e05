"""The directory of a campaign: its plan, and its record of trials, which grows by one line with each trial."""

from __future__ import annotations

import fcntl
import json
import os
import stat
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from drake_tracker.campaign.plan import CampaignPlan, TrialKey, key_of
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.files.atomic_file import write_text
from drake_tracker.core.files.regular_file import read_regular
from drake_tracker.core.processes.signals import held

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
    check_directory(out, wanted)
    record = Record(out / TRIALS)
    try:
        _check_rows(record)
        _drop_repeated(record)
        write_text(out / PLAN, json.dumps(wanted, indent=2) + "\n")
    except DrakeTrackerError:
        record.close()
        raise
    return record


def check_directory(
    out: Path, wanted: Mapping[str, Any], plan: str = PLAN, what: str = "campaign", count: str = "trials"
) -> dict[str, Any]:
    """Returns the plan in the file ``plan`` of a directory, {} if the directory is new or empty.

    Raises DrakeTrackerError, which says ``what`` the directory is for, with one line for each difference from the
    ``wanted`` plan. The plan may have further keys, and the number ``count`` may have grown.
    """
    try:
        occupied = out.exists() and any(out.iterdir())
    except OSError as error:
        raise DrakeTrackerError(f"the {what} directory {out} cannot be read: {error.strerror}") from None
    if not occupied:
        return {}
    found = _read_plan(out, plan, what)
    _compare(wanted, found, out, what, count)
    return found


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


def _read_plan(out: Path, plan: str, what: str) -> dict[str, Any]:
    path = out / plan
    if not path.exists():
        raise DrakeTrackerError(f"the directory {out} is not empty and holds no {what} ({plan}); choose another one")
    try:
        found = json.loads(read_regular(path, _LARGEST_PLAN))
    except (OSError, ValueError, RecursionError):
        found = None
    if not isinstance(found, dict):
        raise DrakeTrackerError(f"{path}: damaged, it describes no {what}; choose another directory")
    return found


def _compare(wanted: Mapping[str, Any], found: Mapping[str, Any], out: Path, what: str, count: str) -> None:
    """Raises DrakeTrackerError, with one line for each difference, when the directory belongs to another plan."""
    errors: list[str] = []
    for key, value in wanted.items():
        there = found.get(key)
        if there == value or (key == count and isinstance(there, int) and there <= value):
            continue
        if key == "settings_sha256":
            if not errors:  # otherwise it follows from them
                errors.append("the settings of its scenario have changed since (a file, or the defaults)")
        elif key == count:
            errors.append(f"it has {there} {count}, not {value}; the number can only grow")
        elif key == "drake_tracker":
            errors.append(f"it was made by drake_tracker {there}, and this is {value}")
        else:
            errors.append(f"its {key.replace('_', ' ')} is {_show(there)}, not {_show(value)}")
    if errors:
        remedy = "choose another directory"
        raise DrakeTrackerError("\n".join(f"{out} holds another {what}: {error}; {remedy}" for error in errors))


def _show(value: Any) -> str:
    text = value if isinstance(value, str) else json.dumps(value)
    return text if len(text) <= 80 else text[:77] + "..."


class Record:
    """Results on disk, one JSON object per line. Each result is written and flushed to the disk at once.

    Opening the file keeps every complete result and drops an incomplete last line, which a killed writer may have left.
    Only one process at a time can have the file open. A symbolic link is refused: in a directory from somebody else it
    may lead to any file. Raises DrakeTrackerError when the file cannot be read or written, or when another process has
    it open.

    Args:
        path: the file, created when it does not exist; None keeps the results in memory only.

    Attributes:
        path: the file, or None.
        rows: the results, in the order of the file.
        notes: a line for each repaired defect of the file.
    """

    def __init__(self, path: str | os.PathLike[str] | None) -> None:
        self.path = None if path is None else Path(path)
        self.rows: list[dict[str, Any]] = []
        self.notes: list[str] = []
        self._file: int | None = None
        if self.path is None:
            return
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            if self.path.is_symlink():
                raise DrakeTrackerError(f"{self.path}: it is a symbolic link, which is not followed; remove it")
            flags = os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
            self._file = os.open(self.path, flags, 0o666)
            if not stat.S_ISREG(os.fstat(self._file).st_mode):
                raise DrakeTrackerError(f"{self.path}: it is not a regular file")
            self._lock(self._file)
            self._read(self._file, self.path)
        except OSError as error:
            self.close()
            raise self._trouble(error) from None
        except DrakeTrackerError:
            self.close()
            raise

    def append(self, row: dict[str, Any]) -> None:
        """Adds a result, fit for JSON, to the file and ``rows``. On a full disk the file keeps its earlier content."""
        with held():  # Ctrl-C does not divide a line
            if self._file is not None:
                self._write(self._file, (json.dumps(row, separators=(",", ":")) + "\n").encode())
            self.rows.append(row)

    def close(self) -> None:
        """Closes the file, so that other processes can open it."""
        if self._file is not None:
            os.close(self._file)
            self._file = None

    def __enter__(self) -> Record:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _lock(self, file: int) -> None:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise DrakeTrackerError(f"{self.path}: another process is writing to it; wait until it has ended") from None
        except OSError:
            pass  # a file system without locks

    def _read(self, file: int, path: Path) -> None:
        data = path.read_bytes()
        end = data.rfind(b"\n") + 1
        self.rows = parse_lines(data[:end], path)
        try:
            self.rows += parse_lines(data[end:], path)
        except DrakeTrackerError:
            os.ftruncate(file, end)
            self.notes.append(f"{path}: the last line is incomplete and was dropped; its trial is run again")
        else:
            if end < len(data):
                self._write(file, b"\n")

    def _write(self, file: int, data: bytes) -> None:
        size = os.lseek(file, 0, os.SEEK_END)
        try:
            rest = memoryview(data)
            while rest:
                rest = rest[os.write(file, rest) :]
            os.fsync(file)
        except OSError as error:
            os.ftruncate(file, size)
            raise self._trouble(error) from None

    def _trouble(self, error: OSError) -> DrakeTrackerError:
        return DrakeTrackerError(f"{self.path}: {error.strerror}")


def read_lines(path: str | os.PathLike[str]) -> list[dict[str, Any]]:
    """Returns the results in a file, one JSON object per line; an empty list when there is no file.

    Raises DrakeTrackerError when a line is not a result.
    """
    path = Path(path)
    return parse_lines(path.read_bytes(), path) if path.exists() else []


def parse_lines(data: bytes, path: Path) -> list[dict[str, Any]]:
    """Returns the results in the content of a file. Raises DrakeTrackerError when a line is not a result.

    Args:
        data: content of the file.
        path: the file, for messages.
    """
    rows = []
    for number, line in enumerate(data.split(b"\n"), 1):
        if not line.strip():
            continue
        try:
            row = json.loads(line)
        except (ValueError, RecursionError):  # also raised when the line is not UTF-8
            row = None
        if not isinstance(row, dict):
            raise DrakeTrackerError(f"{path} line {number}: not a result (a JSON object); repair the line or remove it")
        rows.append(row)
    return rows
