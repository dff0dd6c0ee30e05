"""Reads a run directory as it is: whole, half-written, or of another version."""

import json
from dataclasses import dataclass, field
from pathlib import Path

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.log import load_log
from drake_tracker.tasks import load_scenario
from drake_tracker.tasks.train.summary import package_versions

EXPECTED = {
    "train": (
        *("summary.json", "log.npz", "scenario.yaml", "recording.html", "cameras.mp4", "tracking.png"),
        "motion.png",
    ),
    "ball": (
        *("summary.json", "log.npz", "scenario.yaml", "recording.html", "cameras.mp4", "ball_path.png", "board.png"),
        "motion.png",
    ),
}
"""What the run of a task leaves."""
SIGNS = ("summary.json", "log.npz", "scenario.yaml")
"""A directory with none of these is no run."""
_UNREADABLE = (OSError, ValueError, KeyError)


@dataclass
class RunFiles:
    """A run directory: ``folder``, ``task``, what could be read of it (else None), the names of the files of a run that
    are there, and ``notes``, a sentence for each thing that is not as it should be.
    """

    folder: Path
    task: str = "train"
    scenario: object = None
    summary: dict | None = None
    log: dict | None = None
    names: tuple = ()
    notes: list = field(default_factory=list)


def read_run(folder):
    """Returns the `RunFiles` of a run directory.

    Raises DrakeTrackerError when there is no such directory, or nothing of a run in it.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise DrakeTrackerError(f"{folder}: there is no such run directory")
    if not any((folder / name).is_file() for name in SIGNS):
        raise DrakeTrackerError(f"{folder} is no run directory: it has none of {', '.join(SIGNS)}")
    run = RunFiles(folder)
    run.summary = _read(run, "summary.json", lambda path: _mapping(json.loads(path.read_text(encoding="utf-8"))))
    run.log = _read(run, "log.npz", load_log)
    run.scenario = _read(run, "scenario.yaml", lambda path: load_scenario(str(path.absolute())))
    run.task = _task(run)
    everything = dict.fromkeys(name for names in EXPECTED.values() for name in names)
    run.names = tuple(name for name in everything if is_own_file(folder, name))
    _note(run)
    return run


def is_own_file(folder, name):
    """Whether a run directory has a file of this name that lies in it, and not elsewhere by way of a link."""
    path = Path(folder) / name
    return path.is_file() and path.resolve().parent == Path(folder).resolve()


def _read(run, name, reader):
    if not is_own_file(run.folder, name):
        return None
    try:
        return reader(run.folder / name)
    except (DrakeTrackerError, *_UNREADABLE) as error:
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        run.notes.append(f"{name} cannot be read: {reason}.")
        return None


def _mapping(value):
    if not isinstance(value, dict):
        raise ValueError("it is not a mapping")
    return value


def _task(run):
    if run.scenario is not None:
        return run.scenario.task
    if run.log is not None:
        return "ball" if "truth_ball_state" in run.log else "train"
    return "ball" if str((run.summary or {}).get("scenario", "")).startswith("ball") else "train"


def _note(run):
    if run.summary is None:
        run.notes.insert(0, "There is no summary: the run goes on still, or was ended before it could write one.")
    versions = (run.summary or {}).get("package_versions") or {}
    made, here = versions.get("drake_tracker"), package_versions()["drake_tracker"]
    if made and here and made != here:
        run.notes.insert(0, f"This run was made by version {made}; the page is of version {here}.")
    measured = run.scenario is not None and type(getattr(run.scenario, "vision", None)).__name__ == "Measured"
    missing = [name for name in EXPECTED[run.task] if not (run.folder / name).exists() and name != "summary.json"]
    if measured:  # without cameras there is neither
        missing = [name for name in missing if name not in ("cameras.mp4", "motion.png")]
    if missing:
        run.notes.append(f"Not in the directory: {', '.join(missing)}.")
