"""Reads a part of a scenario, a tag with its settings, from an option of the command line."""

from typing import Any

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.scenarios.reader import read
from drake_tracker.scenarios.tree import parse


def read_option(text: str, schema: Any, name: str) -> Any:
    """Returns the settings of a part from a text such as ``!CoordinatedTurn {speed_noise: 0.01}``.

    Args:
        text: YAML tag and settings; the exclamation mark may be omitted.
        schema: the allowed dataclass, or a Union of them.
        name: name of the option, for messages.

    Raises DrakeTrackerError, with one line per error.
    """
    text = text.strip()
    if not text:
        raise DrakeTrackerError(f"--{name} '': is empty; name a kind, or omit the option")
    errors: list[str] = []
    tree = parse(text if text.startswith("!") else f"!{text}", lambda line: f"--{name} {text}", errors)
    part = None if tree is None or errors else read(tree, schema, name, errors, {})
    if errors:
        raise DrakeTrackerError("\n".join(errors))
    return part
