"""A run directory, read and checked for a replay."""

import json
from dataclasses import dataclass
from pathlib import Path

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.log import load_log, signals
from drake_tracker.replay.changes import check_changes
from drake_tracker.run.camera_images import IMAGES_FOLDER
from drake_tracker.tasks import load_scenario
from drake_tracker.tasks.train.summary import git_commit, package_versions

STARTS = ("images", "centroids", "points")
"""Where a replay may begin."""
_CENTROIDS = {"train": ("centroid_left", "centroid_right"), "ball": ("centroid",)}


@dataclass(frozen=True, eq=False)
class Recording:
    """A run and what to do with it.

    Attributes:
        folder: of the run. recorded: its scenario. scenario: the same with the changes. log: {name: Signal}.
        start: one of `STARTS`. warnings: lines for the user.
    """

    folder: Path
    recorded: object
    scenario: object
    log: dict
    start: str
    warnings: tuple

    @property
    def sources(self):
        """Names of the logged signals with which the replay begins; with images there is none."""
        return {"images": (), "centroids": _CENTROIDS[self.scenario.task], "points": ("point",)}[self.start]

    @property
    def end(self):
        """Time of the last sample of the cameras' cycle [s]: everything up to it is known."""
        return float(self.log["point"].times[-1])


def open_recording(folder, overrides=(), start=None):
    """Returns the `Recording` of a run directory.

    Args:
        overrides: as for `load_scenario`.
        start: one of `STARTS`; None: centroids, and points of a run that has none.

    Raises DrakeTrackerError, one line for each error, when the directory is not that of a whole run, when its signals
    are not those of this version, or when a change can have no effect.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise DrakeTrackerError(f"there is no run directory {folder}")
    scenario_file = folder / "scenario.yaml"
    if not scenario_file.is_file():
        raise DrakeTrackerError(f"{folder}: there is no scenario.yaml; this is not the directory of a run")
    recorded = load_scenario(str(scenario_file))
    log = _load(folder / "log.npz")
    versions, warnings = _versions(folder)
    start = start or ("centroids" if all(name in log for name in _CENTROIDS[recorded.task]) else "points")
    scenario = load_scenario(str(scenario_file), overrides=overrides)
    recording = Recording(folder, recorded, scenario, log, start, warnings)
    _check_log(recording, versions)
    check_changes(recorded, scenario, start)
    return recording


def _load(path):
    if not path.is_file():
        raise DrakeTrackerError(
            f"{path.parent}: there is no log.npz; a run writes it at its end, and this one was stopped before"
        )
    return load_log(path)


def _versions(folder):
    """Returns {package: version} of the run, and warnings where they are not those of now."""
    try:
        summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
        versions = dict(summary["package_versions"]) | {"commit": summary.get("git_commit")}
    except (OSError, ValueError, KeyError, TypeError):
        return {}, (f"{folder}: no summary.json that can be read; which versions made the run is not known",)
    now = package_versions() | {"commit": git_commit()}
    others = [f"{name} {versions.get(name)} (now {now[name]})" for name in now if versions.get(name) != now[name]]
    if not others:
        return versions, ()
    words = f"{folder} was made with {', '.join(others)}; with nothing changed its signals may still differ a little"
    return versions, (words,)


def _check_log(recording, versions):
    """Raises DrakeTrackerError when signals are missing, empty, or have other fields than this version's."""
    folder, task = recording.folder, recording.scenario.task
    if recording.start == "images" and not (folder / IMAGES_FOLDER).is_dir():
        raise DrakeTrackerError(f"{folder}: there are no images; drake-tracker run --record-images keeps them")
    if recording.start == "centroids" and not all(name in recording.log for name in recording.sources):
        raise DrakeTrackerError(f"{folder}: there are no centroids in its log, measured vision has none; --from points")
    needed = {*recording.sources, "point", "filtered", "prediction", "delivered", "target", "command"}
    needed |= {f"truth_{task}_state", "truth_verdict"}
    known = signals(task)
    for name in sorted(needed):
        signal = recording.log.get(name)
        if signal is None or signal.names != tuple(known[name][1]) or signal.data.shape[1:] != (len(signal.names),):
            what = "is missing" if signal is None else "has other fields than in this version"
            made = versions.get("drake_tracker", "of a version not known")
            raise DrakeTrackerError(
                f"{folder}/log.npz: the signal {name} {what}; the run is of drake_tracker {made}, "
                f"this is {package_versions()['drake_tracker']}, which cannot replay it"
            )
        if len(signal.times) < 2 or len(signal.times) != len(signal.data):
            raise DrakeTrackerError(f"{folder}/log.npz: the signal {name} has too few samples to be replayed")
