"""Settings: dataclass fields with a unit, a range of allowed values and a help text.

Dataclasses of settings are frozen. The settings are the content of a YAML file, and the parameters of the constructor
of the part.
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
    shared: bool = False,
    counterparts: Mapping[str, str] | None = None,
    key: str = "",
) -> Any:
    """Declares a setting as a dataclass field.

    Args:
        default: default value, or a dataclass of settings (a nested part, built with its own defaults). A list becomes
            a tuple; a dict is copied for each instance.
        help: what the setting does, in one line.
        unit: unit of a number, empty for a number without unit.
        range: lowest and highest allowed number, both included. It applies to every element of a tuple.
        choices: the allowed words of a text setting.
        shape: length of a tuple as (n,), or rows and columns of a tuple of tuples as (m, n). None as n in (n,) allows
            any length, and None as m any number of rows.
        shared: whether all kinds of the role have this setting with the same meaning. A value written for one kind is
            kept when a scenario replaces it by another kind.
        counterparts: with ``shared``, {name of a kind in another kind of the role: the corresponding name here}.
        key: name in a scenario, where it is not the name of the field, for example a keyword of Python.
    """
    metadata = {
        "help": help,
        "unit": unit,
        "range": range,
        "choices": choices,
        "shape": shape,
        "shared": shared,
        "counterparts": counterparts or {},
        "key": key,
    }
    if isinstance(default, type):
        return dataclasses.field(default_factory=default, metadata=metadata)
    if isinstance(default, dict):
        return dataclasses.field(default_factory=lambda: dict(default), metadata=metadata)
    return dataclasses.field(default=as_tuple(default), metadata=metadata)


def as_tuple(value: Any) -> Any:
    """Returns a list and all lists in it as tuples, anything else unchanged."""
    return tuple(map(as_tuple, value)) if isinstance(value, (list, tuple)) else value


def settings_of(part: Any) -> tuple[dataclasses.Field[Any], ...]:
    """Returns those fields of a dataclass, or of a dataclass instance, that are settings."""
    return tuple(field for field in dataclasses.fields(part) if "help" in field.metadata)


def constants_of(kind: type) -> dict[str, Any]:
    """Returns {name: value} of the constants of a dataclass of settings: class variables that earlier were settings.

    A file may still contain such a setting, with the value that the constant has.
    """
    found = {}
    for each in reversed(kind.__mro__):
        for name, annotation in vars(each).get("__annotations__", {}).items():
            value = vars(each).get(name, dataclasses.MISSING)
            if (
                name.islower()
                and typing.get_origin(annotation) is typing.ClassVar
                and (dataclasses.is_dataclass(value) or isinstance(value, (bool, int, float, str, tuple, type(None))))
            ):
                found[name] = value
    return found


def key_of(field: dataclasses.Field[Any]) -> str:
    """Returns the name of a setting in a scenario."""
    return field.metadata.get("key") or field.name


def replace_settings(part: Part, changes: Mapping[str, Any]) -> Part:
    """Returns a copy of a dataclass instance with some settings changed. Does not check whether values are allowed.

    Args:
        part: a dataclass instance made of settings.
        changes: {key path: value}, for example {"track.speed": 0.2, "seed": 3}.

    Raises AttributeError when there is no such setting.
    """
    nested: dict[str, dict[str, Any]] = {}
    values: dict[str, Any] = {}
    for key, value in changes.items():
        name, _, rest = key.partition(".")
        fields = {key_of(field): field.name for field in settings_of(part)}
        if name not in fields:
            raise AttributeError(f"{type(part).__name__} has no setting {name!r}")
        name = fields[name]
        if rest:
            nested.setdefault(name, {})[rest] = value
        else:
            values[name] = as_tuple(value)
    for name, inner in nested.items():
        values[name] = replace_settings(values.get(name, getattr(part, name)), inner)
    return dataclasses.replace(part, **values)  # type: ignore[type-var]


def allowed(metadata: Mapping[str, Any], noun: str) -> str:
    """Returns the allowed values of a setting in words: "a number from 0 to 1 m/s", "one of oval, circle".

    Args:
        metadata: metadata of the setting's dataclass field.
        noun: what the value is, for example "a number".
    """
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


def list_kinds(annotation: Any) -> tuple[Any, ...]:
    """Returns the dataclasses of which a setting is a list, for ``tuple[A | B, ...]``; empty for any other setting."""
    arguments = typing.get_args(annotation)
    if typing.get_origin(annotation) is not tuple or len(arguments) != 2 or arguments[1] is not Ellipsis:
        return ()
    return tuple(kind for kind in kinds_of(arguments[0]) if dataclasses.is_dataclass(kind))
