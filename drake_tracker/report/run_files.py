"""Reads a run directory, which may be complete, half-written, damaged, or of another version.

Nothing in a run directory is executed, no pipe blocks the reader, and no file outside of the directory is read or
served.
"""

import math
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.log import LOG_FILE, STREAM_FILE, Signal, load_log
from drake_tracker.report.summary_table import SHARED_ROWS
from drake_tracker.scenarios.base import BaseScenario
from drake_tracker.tasks import load_scenario
from drake_tracker.tasks.registry import TASKS, task_named, task_of
from drake_tracker.tasks.results import load_summary, package_versions
from drake_tracker.tasks.task import Task

SIGNS = ("summary.json", LOG_FILE, STREAM_FILE, "scenario.yaml")
"""A directory with none of these files is not a run directory."""
LONGEST_RUN = 1e6
"""Largest time in a log [s]; a scenario lasts at most a tenth of it."""
_LONGEST_REASON = 300
_Content = TypeVar("_Content")
LARGEST = 1e12
"""Largest number that a page shows."""
LONGEST = 10_000
"""Largest number of characters of a text."""


@dataclass
class RunFiles:
    """A run directory.

    Attributes:
        folder: the directory.
        task: of the run.
        scenario: of the task; None when it could not be read.
        summary: the summary, None when it could not be read.
        log: {name: Signal}, None when it could not be read.
        names: names of the files of the run that exist.
        notes: a sentence for each thing that is wrong.
    """

    folder: Path
    task: Task
    scenario: Any = None
    summary: dict[str, Any] | None = None
    log: dict[str, Signal] | None = None
    names: tuple[str, ...] = ()
    notes: list[str] = field(default_factory=list)


def read_run(folder: str | os.PathLike[str]) -> RunFiles:
    """Returns the `RunFiles` of a run directory.

    Raises DrakeTrackerError when there is no such directory, or when it is not a run directory.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise DrakeTrackerError(f"{folder}: there is no such run directory")
    if not any((folder / name).is_file() for name in SIGNS):
        raise DrakeTrackerError(f"{folder} is not a run directory: it contains none of {', '.join(SIGNS)}")
    notes: list[str] = []
    summary = _read(folder, "summary.json", load_summary, notes)
    streamed = not is_own_file(folder, LOG_FILE)
    log = _read(folder, STREAM_FILE if streamed else LOG_FILE, _load_log, notes)
    scenario = _read(folder, "scenario.yaml", lambda path: load_scenario(str(path.absolute()), allow_code=False), notes)
    task = _task(scenario, log, summary)
    if summary is not None:
        summary, wrong = sound_summary(summary, task)
        if wrong:
            notes.append(f"summary.json has wrong values, which are not shown: {', '.join(wrong)}.")
    if streamed and log is not None:
        end = max((signal.times[-1] for signal in log.values() if len(signal.times)), default=0.0)
        notes.append(f"The signals are those of {STREAM_FILE}, up to {end:.1f} s.")
    run = RunFiles(folder, task, scenario, summary, log, notes=notes)
    files = (*task.files, STREAM_FILE) if streamed else task.files
    run.names = tuple(name for name in files if is_own_file(folder, name))
    _note(run)
    return run


def is_own_file(folder: str | os.PathLike[str], name: str) -> bool:
    """Returns whether a directory contains a file of this name itself, and not through a link to another directory."""
    path = Path(folder) / name
    return path.is_file() and path.resolve().parent == Path(folder).resolve()


def _read(folder: Path, name: str, reader: Callable[[Path], _Content], notes: list[str]) -> _Content | None:
    """Returns the result of a reader for a file, or None when the file is missing or cannot be read."""
    if not is_own_file(folder, name):
        return None
    try:
        return reader(folder / name)
    except Exception as error:  # whatever a file contains, the others are shown
        notes.append(f"{name} cannot be read: {first_line(error)}.")
        return None


def _load_log(path: Path) -> dict[str, Signal]:
    log = load_log(path)
    for name, signal in log.items():
        if len(signal.times) and not -LONGEST_RUN < signal.times[0] <= signal.times[-1] < LONGEST_RUN:
            raise DrakeTrackerError(f"the times of {name} are not those of a run")
    return log


def first_line(error: Exception) -> str:
    """Returns the first line of an error's message, or its type when it has none."""
    return (str(error).splitlines() or [type(error).__name__])[0][:_LONGEST_REASON]


def _task(scenario: BaseScenario | None, log: dict[str, Signal] | None, summary: dict[str, Any] | None) -> Task:
    """Returns the task of a run; the first task when the files do not tell."""
    if scenario is not None:
        return task_of(scenario)
    tasks = [task_named(name) for name in TASKS]
    if log is not None:
        found = [task for task in tasks if task.truth_signal in log]
    else:
        found = [task for task in tasks if str((summary or {}).get("scenario", "")).startswith(task.name)]
    return (found or tasks)[0]


def _note(run: RunFiles) -> None:
    if run.summary is None:
        run.notes.insert(0, "There is no summary: the run is still going on, or was stopped before it could write one.")
    versions = (run.summary or {}).get("package_versions") or {}
    made, here = versions.get("drake_tracker"), package_versions()["drake_tracker"]
    if made and here and made != here:
        run.notes.insert(0, f"This run was made by version {made}, this page by version {here}.")
    files = run.task.files if run.scenario is None else run.task.files_of(run.scenario)
    missing = [name for name in files if not (run.folder / name).exists() and name != "summary.json"]
    if missing:
        run.notes.append(f"Not in the directory: {', '.join(missing)}.")


def sound_summary(summary: Mapping[str, Any], task: Task) -> tuple[dict[str, Any], list[str]]:
    """Returns (the summary without wrong values, names of the wrong values).

    Values that the page does not show are not checked.

    Args:
        summary: of a run.
        task: of the run.
    """
    numbers = dict.fromkeys((key for key, *_ in (*task.summary_rows, *SHARED_ROWS)), is_number)
    kinds = {**numbers, **_KINDS}
    wrong = [key for key, is_right in kinds.items() if summary.get(key) is not None and not is_right(summary[key])]
    return {key: value for key, value in summary.items() if key not in wrong}, wrong


def is_number(value: Any) -> bool:
    """Returns whether a value is a number, finite and of a size that can be shown."""
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) <= LARGEST


def _is_text(value: Any) -> bool:
    return isinstance(value, str) and 0 < len(value) <= LONGEST


def _are_versions(value: Any) -> bool:
    return isinstance(value, dict) and all(each is None or _is_text(each) for each in (*value, *value.values()))


def _has_sentences(value: Any) -> bool:
    if not isinstance(value, dict):
        return False
    sentences = value.get("sentences", [])
    return isinstance(sentences, list) and all(_is_text(each) for each in sentences)


_KINDS: dict[str, Callable[[Any], bool]] = {
    "scenario": _is_text,
    "seed": lambda value: _is_text(value) or (is_number(value) and math.floor(value) == value),
    "success": lambda value: isinstance(value, bool),
    "failure_reason": _is_text,
    "lag_s": lambda value: isinstance(value, dict) and all(each is None or is_number(each) for each in value.values()),
    "packets_rejected_for": lambda value: isinstance(value, dict) and all(map(is_number, value.values())),
    "tracking": _has_sentences,
    "lost_parts": _has_sentences,
    "package_versions": _are_versions,
}
"""{key: returns whether a value is of the right kind}."""
