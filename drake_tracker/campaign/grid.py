"""The grid of a campaign: the varied settings, their values, and the scenario of each combination."""

import itertools
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import yaml

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.scenarios.tree import parse
from drake_tracker.tasks import load_scenario
from drake_tracker.tasks.loader import origin_of

MOST_CELLS = 10_000
"""Greatest number of combinations of the varied settings."""
_OWN = {"seed": "every trial has a seed of its own; use --trials and --first-seed"}
_OPENING = (yaml.FlowSequenceStartToken, yaml.FlowMappingStartToken)
_CLOSING = (yaml.FlowSequenceEndToken, yaml.FlowMappingEndToken)
_BARE_TAG = re.compile(r"(!\w+),")
"""A tag without a value; YAML would read the comma, without a space before it, as part of the tag."""


@dataclass(frozen=True)
class GridCell:
    """One combination of the varied settings.

    Attributes:
        settings: {key path: value, as YAML text}.
        scenario: the checked scenario with these settings.
    """

    settings: dict[str, str]
    scenario: Any


def split_values(text: str) -> list[str]:
    """Returns the values of "a,b,c", as YAML texts: the items of the YAML flow sequence [a,b,c].

    Raises yaml.YAMLError when the text is not part of such a sequence.
    """
    sequence = _BARE_TAG.sub(r"\1 ,", f"[{text} ]")
    depth, commas = 0, [0]
    for token in yaml.scan(sequence):
        depth += isinstance(token, _OPENING) - isinstance(token, _CLOSING)
        if depth == 1 and isinstance(token, yaml.FlowEntryToken):
            commas.append(token.start_mark.index)
    return [sequence[a + 1 : b].strip() for a, b in itertools.pairwise([*commas, len(sequence) - 1])]


def parse_vary(texts: Sequence[str]) -> dict[str, list[str]]:
    """Returns {key path: values, as YAML texts} of texts such as "key.path=a,b,c", in their order.

    Raises DrakeTrackerError, with one line for each error.
    """
    vary: dict[str, list[str]] = {}
    errors = []
    for text in texts:
        key, equals, values = text.partition("=")
        key = key.strip()
        if not equals or not all(key.split(".")):
            errors.append(f"--vary {text}: write it as key.path=a,b,c, for example --vary track.speed=0.1,0.2")
        elif key in vary:
            errors.append(f"--vary {text}: {key} is varied twice; give all its values in one --vary")
        else:
            try:
                vary[key] = split_values(values)
            except yaml.YAMLError as error:
                problem = getattr(error, "problem", None) or error
                errors.append(f"--vary {text}: not valid YAML: {problem}")
    if errors:
        raise DrakeTrackerError("\n".join(errors))
    return vary


def yaml_text(value: Any) -> str:
    """Returns a Python value as YAML text; a string is taken as YAML text already."""
    if isinstance(value, str):
        return value
    text: str = yaml.safe_dump(value, default_flow_style=True, width=float("inf"))
    return text.removesuffix("\n...\n").strip()


def plain_value(text: str) -> bool | int | float | str:
    """Returns the number or bool that a YAML text means in a scenario; the text itself when it means anything else."""
    value = parse(text, str, [])
    return value.data if value is not None and isinstance(value.data, (bool, int, float)) else text


def make_cells(
    spec: str,
    overrides: Sequence[str],
    vary: Mapping[str, Sequence[str]],
    origins: Mapping[str, str] | None = None,
    allow_code: bool | None = None,
) -> list[GridCell]:
    """Returns the `GridCell` of every combination; the last key varies fastest.

    Raises DrakeTrackerError with every error of every combination, each once.

    Args:
        spec: as `load_scenario` takes it.
        overrides: as `load_scenario` takes them.
        vary: {key path: values, as YAML texts}.
        origins: {override: what the user wrote for it}, for messages.
        allow_code: as `load_scenario` takes it.
    """
    origins = dict(origins or {})
    errors = []
    for key, values in vary.items():
        origins |= {f"{key}={value}": f"--vary {key}={value}" for value in values}
        if key in _OWN:
            errors.append(f"--vary {key}: {_OWN[key]}")
        if not all(values):
            errors.append(f"--vary {key}: a value is empty; write it as {key}=a,b,c")
        repeated = (value for value in dict.fromkeys(values) if values.count(value) > 1)
        errors += [f"--vary {key}: {value or 'an empty value'} is given twice" for value in repeated]
    errors += [f"--set {text}: {_OWN[key]}" for text in overrides for key in _OWN if text.split("=")[0].strip() == key]
    if errors:
        raise DrakeTrackerError("\n".join(errors))
    count = math.prod(len(values) for values in vary.values())
    if count > MOST_CELLS:
        raise DrakeTrackerError(f"--vary: {count} combinations; at most {MOST_CELLS} are allowed")
    cells = []
    for combination in itertools.product(*vary.values()):
        settings = dict(zip(vary, combination))
        own = [f"{key}={value}" for key, value in settings.items()]
        try:
            scenario = load_scenario(spec, overrides=[*overrides, *own], allow_code=allow_code)
        except DrakeTrackerError as error:
            errors += [_by_its_origin(line, origins) for line in str(error).splitlines()]
        else:
            cells.append(GridCell(settings, scenario))
    if errors:
        raise DrakeTrackerError("\n".join(dict.fromkeys(errors)))
    return cells


def _by_its_origin(line: str, origins: Mapping[str, str]) -> str:
    """Returns an error of `load_scenario` in which the user's own text replaces the override made of it."""
    for override, origin in origins.items():
        line = line.replace(f"{origin_of(override)}:", f"{origin}:")
    return line
