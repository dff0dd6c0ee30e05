"""Settings that may be changed in a replay: the settings of the parts that run again."""

import dataclasses
from collections.abc import Iterator
from typing import Any

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.setting import settings_of
from drake_tracker.scenarios.base import BaseScenario
from drake_tracker.tasks.registry import task_of


def check_changes(recorded: BaseScenario, scenario: BaseScenario, start: str) -> None:
    """Raises DrakeTrackerError when a setting was changed that has no effect in the replay.

    Args:
        recorded: scenario of the run.
        scenario: the same scenario with the changes of the replay.
        start: where the replay begins: "images", "centroids" or "points".
    """
    changeable = task_of(recorded).changeable_settings(recorded, scenario, start)
    changed = changed_settings(recorded, scenario)
    refused = [key for key in changed if not any(f"{key}.".startswith(f"{part}.") for part in changeable)]
    if refused:
        raise DrakeTrackerError(
            f"{scenario.where(refused[0])} has no effect in a replay from {start}; these settings have: "
            f"{', '.join(changeable)}"
        )


def changed_settings(recorded: BaseScenario, scenario: BaseScenario) -> dict[str, list[Any]]:
    """Returns {key path: [before, after]} of all settings that differ; None stands for a setting that does not exist.

    Args:
        recorded: scenario of the run.
        scenario: scenario of the replay.
    """
    before, after = dict(_settings(recorded)), dict(_settings(scenario))
    keys = sorted(key for key in before.keys() | after.keys() if before.get(key) != after.get(key))
    return {key: [before.get(key), after.get(key)] for key in keys}


def _settings(part: Any, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yields (key path, value) for each setting, and (key path, tag of its kind) for each part."""
    for field in settings_of(part):
        key, value = prefix + field.name, getattr(part, field.name)
        if dataclasses.is_dataclass(value):
            yield key, f"!{type(value).__name__}"
            yield from _settings(value, key + ".")
        else:
            yield key, value
