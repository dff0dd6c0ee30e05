"""A part of a scenario given as an option of the command line: a tag and its settings."""

from typing import Any

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.scenarios.reader import read
from drake_tracker.scenarios.tree import parse


def read_option(text: str, schema: Any, name: str) -> Any:
    """Returns the part, an instance of ``schema`` (a Union of dataclasses), that a text such as
    ``!CoordinatedTurn {speed_noise: 0.01}`` stands for; the exclamation mark may be left out.

    ``name`` is that of the option. Raises DrakeTrackerError, one line for each error.
    """
    text = text.strip()
    errors: list[str] = []
    tree = parse(text if text.startswith("!") else f"!{text}", lambda line: f"--{name} {text}", errors)
    part = None if tree is None or errors else read(tree, schema, name, errors, {})
    if errors:
        raise DrakeTrackerError("\n".join(errors))
    return part
