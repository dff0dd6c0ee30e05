"""Reads and checks a run directory for a replay."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.log import STREAM_FILE, Signal, find_log, load_log
from drake_tracker.replay.changes import check_changes
from drake_tracker.run.camera_images import IMAGES_FOLDER
from drake_tracker.scenarios.base import BaseScenario
from drake_tracker.tasks.loader import load_scenario
from drake_tracker.tasks.registry import task_of
from drake_tracker.tasks.results import git_commit, load_summary, package_versions
from drake_tracker.tasks.task import Task

STARTS = ("images", "centroids", "points")
"""The recorded signals with which a replay may begin."""


@dataclass(frozen=True, eq=False)
class Recording:
    """A recorded run, and how to replay it.

    Attributes:
        folder: directory of the run.
        recorded: scenario of the run.
        scenario: the same scenario with the changes of the replay.
        log: {name: Signal} of the run.
        start: where the replay begins, one of `STARTS`.
        warnings: lines for the user.
    """

    folder: Path
    recorded: BaseScenario
    scenario: Any
    log: dict[str, Signal]
    start: str
    warnings: tuple[str, ...]

    @property
    def task(self) -> Task:
        """The task of the run."""
        return task_of(self.recorded)

    @property
    def sources(self) -> tuple[str, ...]:
        """Names of the logged signals with which the replay begins, in addition to images if it begins with them."""
        return self.task.replay_sources(self.scenario, self.start)

    @property
    def end(self) -> float:
        """Time of the last sample at the vision period [s], up to which all signals are known."""
        return float(self.log[self.task.replayed[0]].times[-1])


def open_recording(
    folder: Path | str, overrides: Sequence[str] = (), start: str | None = None, allow_code: bool | None = None
) -> Recording:
    """Returns the recording in a run directory.

    Args:
        folder: directory of the run.
        overrides: changed settings, as for `load_scenario`.
        start: where the replay begins, one of `STARTS`. None: centroids, or points for a run without centroids or with
            several objects.
        allow_code: whether code that the scenario of the run names may run, as for `load_scenario`.

    Raises DrakeTrackerError, with one line per error, when the directory does not contain a complete run, when its
    signals are not those of this version, or when a change has no effect.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise DrakeTrackerError(f"there is no run directory {folder}")
    scenario_file = folder / "scenario.yaml"
    if not scenario_file.is_file():
        raise DrakeTrackerError(f"{folder}: there is no scenario.yaml; this is not a run directory")
    recorded = load_scenario(str(scenario_file))
    log = _load(folder)
    versions, warnings = _versions(folder)
    warnings += _partial(folder, log)
    start = start or task_of(recorded).replay_start(recorded, log)
    scenario = load_scenario(str(scenario_file), overrides=overrides, allow_code=allow_code)
    recording = Recording(folder, recorded, scenario, log, start, warnings)
    _check_log(recording, versions)
    check_changes(recorded, scenario, start)
    return recording


def _load(folder: Path) -> dict[str, Signal]:
    if find_log(folder) is None:
        raise DrakeTrackerError(
            f"{folder}: there is no log.npz; a run writes it at its end, but this one was stopped before"
        )
    return load_log(folder)


def _partial(folder: Path, log: Mapping[str, Signal]) -> tuple[str, ...]:
    """Returns a warning when the run was killed, or has not ended."""
    path = find_log(folder)
    if path is None or path.name != STREAM_FILE:
        return ()
    end = max((signal.times[-1] for signal in log.values() if len(signal.times)), default=0.0)
    return (f"{folder}: there is no log.npz; the signals are those of {STREAM_FILE}, up to {end:.1f} s",)


def _versions(folder: Path) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Returns {package: version} of the run, and warnings if they differ from the installed ones."""
    try:
        summary = load_summary(folder / "summary.json")
        versions = dict(summary["package_versions"]) | {"commit": summary.get("git_commit")}
    except (DrakeTrackerError, ValueError, KeyError, TypeError):
        return {}, (f"{folder}: there is no readable summary.json; the versions that made the run are unknown",)
    now = package_versions() | {"commit": git_commit()}
    others = [f"{name} {versions.get(name)} (now {now[name]})" for name in now if versions.get(name) != now[name]]
    if not others:
        return versions, ()
    words = f"{folder} was made with {', '.join(others)}; signals may differ slightly even without changed settings"
    return versions, (words,)


def _check_log(recording: Recording, versions: Mapping[str, Any]) -> None:
    """Raises DrakeTrackerError when signals are missing, empty, or have other fields than this version's, or when
    their times are not those of a run."""
    folder, task = recording.folder, recording.task
    if recording.start == "images" and not (folder / IMAGES_FOLDER).is_dir():
        raise DrakeTrackerError(f"{folder}: there are no images; record them with drake-tracker run --record-images")
    if recording.start == "centroids" and not all(name in recording.log for name in recording.sources):
        raise DrakeTrackerError(f"{folder}: the log has no centroids, since vision is measured; use --from points")
    needed = {*recording.sources, *task.replayed, "command"}
    needed |= {task.truth_signal, "truth_verdict"}
    known = task.signals(len(recording.log["q_commanded"].names) if "q_commanded" in recording.log else 6)
    # The number of fields of a body signal depends on the number of bodies.
    bodies = {
        name: (period, recording.log[name].names)
        for name, (period, _) in task.body_signals.items()
        if name in recording.log
    }
    known = {**bodies, **known}
    for name in sorted(needed):
        signal = recording.log.get(name)
        if signal is None or signal.names != tuple(known[name][1]) or signal.data.shape[1:] != (len(signal.names),):
            what = "is missing" if signal is None else "has fields that differ from this version"
            made = versions.get("drake_tracker", "(unknown version)")
            raise DrakeTrackerError(
                f"{folder}/log.npz: the signal {name} {what}; the run was made with drake_tracker {made}, "
                f"which version {package_versions()['drake_tracker']} cannot replay"
            )
        if len(signal.times) < 2 or len(signal.times) != len(signal.data):
            raise DrakeTrackerError(f"{folder}/log.npz: the signal {name} has too few samples to be replayed")
        if not _is_regular(signal.times, known[name][0]):
            raise DrakeTrackerError(f"{folder}/log.npz: the samples of the signal {name} are not one period apart")


def _is_regular(times: np.ndarray, period: float) -> bool:
    """Returns whether samples begin at the start of a run and are one period [s] apart, as every run logs them."""
    return bool(abs(times[0]) <= period and np.all(np.abs(np.diff(times) - period) <= 0.5 * period))
