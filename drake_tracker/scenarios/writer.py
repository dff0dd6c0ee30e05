"""Turns dataclasses of settings into trees and plain values, from which they can be read again."""

import dataclasses
from typing import Any

from drake_tracker.core.setting import key_of, kinds_of, list_kinds, settings_of
from drake_tracker.scenarios.tree import Value


def tree_of(part: Any, origin: str) -> Value:
    """Returns the tree of a dataclass instance, from which `read` makes an equal instance.

    Args:
        part: a dataclass instance made of settings, or the value of a setting.
        origin: where the values were written, for messages.
    """
    if dataclasses.is_dataclass(part):
        data = {key_of(field): tree_of(getattr(part, field.name), origin) for field in settings_of(part)}
        return Value(data, origin, type(part).__name__)
    if isinstance(part, dict):
        return Value({name: tree_of(item, origin) for name, item in part.items()}, origin)
    if isinstance(part, (list, tuple)):
        return Value([tree_of(item, origin) for item in part], origin)
    return Value(part, origin)


def plain(part: Any) -> dict[str, Any]:
    """Returns a dataclass instance as dicts, lists and plain values, in the form that Drake's ``yaml_dump`` writes.

    A part in a list, and one that is not of the first kind of its role, has the name of its kind as ``_tag``. A setting
    that is None by default is omitted while it is None.
    """
    result: dict[str, Any] = {}
    for field in settings_of(part):
        value, kinds = getattr(part, field.name), kinds_of(field.type)
        if value is None and field.default is None:
            continue
        if list_kinds(field.type):
            result[key_of(field)] = [_tagged(item) for item in value]
        elif dataclasses.is_dataclass(value):
            result[key_of(field)] = plain(value) if type(value) is kinds[0] else _tagged(value)
        else:
            result[key_of(field)] = _as_list(value)
    return result


def _tagged(part: Any) -> dict[str, Any]:
    return plain(part) | {"_tag": f"!{type(part).__name__}"}


def _as_list(value: Any) -> Any:
    return [_as_list(item) for item in value] if isinstance(value, tuple) else value
