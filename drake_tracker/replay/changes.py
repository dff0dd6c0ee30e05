"""Which settings of a run may be changed in a replay: those of the parts that are run anew."""

import dataclasses

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.setting import settings_of

_ALWAYS = ("estimator", "link", "servo")
CHANGEABLE = {
    ("train", "points"): _ALWAYS,
    ("train", "centroids"): (*_ALWAYS, "vision.work_volume", "cameras.calibration"),
    ("train", "images"): (
        *_ALWAYS, "vision.detector", "vision.lag_cycles", "vision.work_volume", "vision.outline", "cameras.calibration"
    ),
    ("ball", "points"): _ALWAYS,
    ("ball", "centroids"): (*_ALWAYS, "vision.centroid_height", "vision.tolerance"),
    ("ball", "images"): (*_ALWAYS, "vision"),
}  # fmt: skip
"""Settings, and parts with all that is in them, that have an effect: by task and by where the replay begins."""


def check_changes(recorded, scenario, start):
    """Raises DrakeTrackerError, one line, when ``scenario`` was changed where a replay can show no effect.

    Args:
        recorded: the run's scenario. scenario: the same with the user's overrides. start: where the replay begins.
    """
    changeable = CHANGEABLE[scenario.task, start]
    changed = changed_settings(recorded, scenario)
    refused = [key for key in changed if not any(f"{key}.".startswith(f"{part}.") for part in changeable)]
    if refused:
        raise DrakeTrackerError(
            f"{scenario.where(refused[0])} has no effect in a replay from {start}; what can be changed is "
            f"{', '.join(changeable)}"
        )


def changed_settings(recorded, scenario):
    """Returns {key path: [before, after]} of every setting that differs; None where there is no such setting."""
    before, after = dict(_settings(recorded)), dict(_settings(scenario))
    keys = sorted(key for key in before.keys() | after.keys() if before.get(key) != after.get(key))
    return {key: [before.get(key), after.get(key)] for key in keys}


def _settings(part, prefix=""):
    """Yields (key path, value) of every setting, and of every part the name of its kind."""
    for field in settings_of(part):
        key, value = prefix + field.name, getattr(part, field.name)
        if dataclasses.is_dataclass(value):
            yield key, f"!{type(value).__name__}"
            yield from _settings(value, key + ".")
        else:
            yield key, value
