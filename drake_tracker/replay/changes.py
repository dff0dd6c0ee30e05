"""Which settings of a run may be changed in a replay: those of the parts that are run anew."""

import dataclasses
from collections.abc import Iterator
from typing import Any

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.setting import settings_of
from drake_tracker.tasks.registry import task_of


def check_changes(recorded: Any, scenario: Any, start: str) -> None:
    """Raises DrakeTrackerError, one line, when a setting was changed that has no effect in a replay.

    Args:
        recorded: the run's scenario.
        scenario: the same with the user's overrides.
        start: where the replay begins.
    """
    changeable = task_of(recorded).changeable[start]
    changed = changed_settings(recorded, scenario)
    refused = [key for key in changed if not any(f"{key}.".startswith(f"{part}.") for part in changeable)]
    if refused:
        raise DrakeTrackerError(
            f"{scenario.where(refused[0])} has no effect in a replay from {start}; what can be changed is "
            f"{', '.join(changeable)}"
        )


def changed_settings(recorded: Any, scenario: Any) -> dict[str, list[Any]]:
    """Returns {key path: [before, after]} of every setting that differs; None where there is no such setting."""
    before, after = dict(_settings(recorded)), dict(_settings(scenario))
    keys = sorted(key for key in before.keys() | after.keys() if before.get(key) != after.get(key))
    return {key: [before.get(key), after.get(key)] for key in keys}


def _settings(part: Any, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yields (key path, value) of every setting, and of every part the name of its kind."""
    for field in settings_of(part):
        key, value = prefix + field.name, getattr(part, field.name)
        if dataclasses.is_dataclass(value):
            yield key, f"!{type(value).__name__}"
            yield from _settings(value, key + ".")
        else:
            yield key, value
