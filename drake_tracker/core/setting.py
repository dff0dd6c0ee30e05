"""One setting: a dataclass field that knows its unit, what is allowed and what it means.

The dataclasses made of settings are frozen. They are both the settings in a YAML file and the parameters with which the
part that they describe is constructed.
"""

import dataclasses
import types
import typing
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

Part = TypeVar("Part")


def setting(
    default: Any,
    help: str,
    unit: str = "",
    range: tuple[float, float] | None = None,
    choices: Sequence[str] | None = None,
    shape: tuple[int | None, ...] | None = None,
) -> Any:
    """Declares a setting as a dataclass field.

    Args:
        default: value, or a class (a nested part, built with its own defaults). A list becomes a tuple; a dict is
            copied for each instance.
        help: one line, what the setting does.
        unit: unit of a number, empty when it has none.
        range: lowest and highest allowed number, both included; of every element when the setting is a tuple.
        choices: the allowed words, when it is one of a few.
        shape: length of a tuple as (n,), or rows and columns of a tuple of tuples as (m, n); None rows: any number.
    """
    metadata = {"help": help, "unit": unit, "range": range, "choices": choices, "shape": shape}
    if isinstance(default, type):
        return dataclasses.field(default_factory=default, metadata=metadata)
    if isinstance(default, dict):
        return dataclasses.field(default_factory=lambda: dict(default), metadata=metadata)
    return dataclasses.field(default=as_tuple(default), metadata=metadata)


def as_tuple(value: Any) -> Any:
    """Returns a list, and every list in it, as a tuple; anything else as it is."""
    return tuple(map(as_tuple, value)) if isinstance(value, (list, tuple)) else value


def settings_of(part: Any) -> tuple[dataclasses.Field[Any], ...]:
    """Returns the fields of a dataclass, or of an instance of one, that are settings."""
    return tuple(field for field in dataclasses.fields(part) if "help" in field.metadata)


def replace_settings(part: Part, changes: Mapping[str, Any]) -> Part:
    """Returns a copy of a dataclass instance with settings changed: {"track.speed": 0.2, "seed": 3}.

    Raises AttributeError when there is no such setting. Whether the values are allowed is not checked.
    """
    nested: dict[str, dict[str, Any]] = {}
    values: dict[str, Any] = {}
    for key, value in changes.items():
        name, _, rest = key.partition(".")
        if not any(field.name == name for field in settings_of(part)):
            raise AttributeError(f"{type(part).__name__} has no setting {name!r}")
        if rest:
            nested.setdefault(name, {})[rest] = value
        else:
            values[name] = as_tuple(value)
    for name, inner in nested.items():
        values[name] = replace_settings(values.get(name, getattr(part, name)), inner)
    return dataclasses.replace(part, **values)  # type: ignore[type-var]


def allowed(metadata: Mapping[str, Any], noun: str) -> str:
    """Returns what a setting allows, in words: "a number from 0 to 1 m/s", "one of oval, circle"."""
    if metadata.get("choices"):
        return "one of " + ", ".join(metadata["choices"])
    text = noun
    if metadata.get("range"):
        low, high = metadata["range"]
        text += f" from {low} to {high}" if isinstance(high, int) else f" from {low:g} to {high:g}"
    return f"{text} {metadata['unit']}" if metadata.get("unit") else text


def kinds_of(annotation: Any) -> tuple[Any, ...]:
    """Returns the members of a Union, or the annotation itself as the only one."""
    if typing.get_origin(annotation) in (typing.Union, types.UnionType):
        return typing.get_args(annotation)
    return (annotation,)
