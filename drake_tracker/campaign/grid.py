"""The grid of a campaign: which settings are varied, over which values, and the scenario of each combination."""

import itertools
from dataclasses import dataclass
from typing import Any

import yaml

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.scenarios.tree import parse
from drake_tracker.tasks import load_scenario

_OWN = {"seed": "every trial has a seed of its own: use --trials and --first-seed"}
_OPENING, _CLOSING, _QUOTES = "[{(", "]})", "'\""


@dataclass(frozen=True)
class Cell:
    """One combination of the varied settings: {key path: value, as YAML text}, and its checked scenario."""

    settings: dict
    scenario: Any


def split_values(text):
    """Returns the values of "a,b,c": texts split at the commas outside of brackets, braces and quotes."""
    values, depth, quote, start = [], 0, "", 0
    for k, character in enumerate(text):
        if quote:
            quote = "" if character == quote else quote
        elif character in _QUOTES:
            quote = character
        elif character in _OPENING:
            depth += 1
        elif character in _CLOSING:
            depth -= 1
        elif character == "," and depth == 0:
            values.append(text[start:k].strip())
            start = k + 1
    return [*values, text[start:].strip()]


def parse_vary(texts):
    """Returns {key path: [value as YAML text]} of texts "key.path=a,b,c", in their order.

    Raises DrakeTrackerError, one line for each error.
    """
    vary, errors = {}, []
    for text in texts:
        key, equals, values = text.partition("=")
        key = key.strip()
        if not equals or not all(key.split(".")):
            errors.append(f"--vary {text}: write it as key.path=a,b,c, for example --vary track.speed=0.1,0.2")
        elif key in vary:
            errors.append(f"--vary {text}: {key} is varied twice; give all its values in one --vary")
        else:
            vary[key] = split_values(values)
    if errors:
        raise DrakeTrackerError("\n".join(errors))
    return vary


def yaml_text(value):
    """Returns a value of Python (or a text, which is YAML already) as YAML text."""
    if isinstance(value, str):
        return value
    return yaml.safe_dump(value, default_flow_style=True, width=float("inf")).removesuffix("\n...\n").strip()


def plain_value(text):
    """Returns the number or bool that a YAML text is to a scenario; the text itself for anything else."""
    value = parse(text, str, [])
    return value.data if value is not None and isinstance(value.data, (bool, int, float)) else text


def make_cells(spec, overrides, vary, origins=None):
    """Returns the `Cell` of every combination, the last key varying fastest.

    Args:
      spec, overrides: as `load_scenario` takes them. vary: {key path: [value as YAML text]}. origins: {override: what
      the user gave for it}, for messages.

    Raises DrakeTrackerError with every error of every combination, each once.
    """
    origins = dict(origins or {})
    errors = []
    for key, values in vary.items():
        origins |= {f"{key}={value}": f"--vary {key}={value}" for value in values}
        if key in _OWN:
            errors.append(f"--vary {key}: {_OWN[key]}")
        if not all(values):
            errors.append(f"--vary {key}: a value is empty; write it as {key}=a,b,c")
        twice = (value for value in dict.fromkeys(values) if values.count(value) > 1)
        errors += [f"--vary {key}: {value or 'an empty value'} is given twice" for value in twice]
    errors += [f"--set {text}: {_OWN[key]}" for text in overrides for key in _OWN if text.split("=")[0].strip() == key]
    if errors:
        raise DrakeTrackerError("\n".join(errors))
    cells = []
    for values in itertools.product(*vary.values()):
        settings = dict(zip(vary, values))
        try:
            scenario = load_scenario(
                spec, overrides=[*overrides, *(f"{key}={value}" for key, value in settings.items())]
            )
        except DrakeTrackerError as error:
            errors += [_by_its_origin(line, origins) for line in str(error).splitlines()]
        else:
            cells.append(Cell(settings, scenario))
    if errors:
        raise DrakeTrackerError("\n".join(dict.fromkeys(errors)))
    return cells


def _by_its_origin(line, origins):
    """Names in an error what the user gave, where `load_scenario` names the override made of it."""
    for override, origin in origins.items():
        line = line.replace(f"--set {override}:", f"{origin}:")
    return line
