"""A scenario file as a tree of values that remember where they were written.

The YAML nodes are walked as composed, because only they still know their line, their tag, and a key that was given
twice.
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import yaml

_MAPPING = "tag:yaml.org,2002:map"
"""What YAML itself calls a mapping that bears no tag."""
_EXPONENT = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)[eE][-+]?\d+")


@dataclass
class Value:
    """A value of the tree: ``data`` is a dict of Values, a list of Values, or a plain number, text, bool or None."""

    data: Any
    origin: str
    tag: str | None = None


def parse(text: str, describe: Callable[[int], str], errors: list[str]) -> Value | None:
    """Returns the `Value` of a YAML text, or None when it cannot be read.

    ``describe(line)`` names a line (counted from 1) in messages; problems are appended to ``errors``.
    """
    try:
        loader = yaml.SafeLoader(text)  # refuses characters that YAML does not have
        try:
            node = loader.get_single_node()
            return Value(None, describe(1)) if node is None else _convert(loader, node, "", describe, errors)
        finally:
            loader.dispose()
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line = mark.line + 1 if mark else 1
        errors.append(f"{describe(line)}: not valid YAML: {error.problem or error.context}")
    except (yaml.YAMLError, ValueError) as error:
        errors.append(f"{describe(1)}: not valid YAML: {' '.join(str(error).split())}")
    except RecursionError:
        errors.append(f"{describe(1)}: not valid YAML: nested too deeply")
    return None


def _convert(
    loader: yaml.SafeLoader, node: yaml.Node, path: str, describe: Callable[[int], str], errors: list[str]
) -> Value:
    origin = describe(node.start_mark.line + 1)
    tag = node.tag[1:] if node.tag.startswith("!") else None
    if isinstance(node, yaml.SequenceNode):
        return Value([_convert(loader, item, path, describe, errors) for item in node.value], origin, tag)
    if isinstance(node, yaml.MappingNode):
        if tag is None and node.tag != _MAPPING:
            errors.append(f"{origin}: {path or 'tag'}: !!{node.tag.rpartition(':')[2]} is no tag; one ! makes one")
        data: dict[str, Value] = {}
        for key_node, value_node in node.value:
            key = str(key_node.value)
            key_path = f"{path}.{key}" if path else key
            if key in data:
                here = describe(key_node.start_mark.line + 1)
                errors.append(f"{here}: {key_path} is given twice, first at {data[key].origin}; keep one")
                continue
            value = _convert(loader, value_node, key_path, describe, errors)
            value.origin = describe(key_node.start_mark.line + 1)
            data[key] = value
        return Value(data, origin, tag)
    if tag:
        return Value(node.value or {}, origin, tag)
    if node.tag.rsplit(":", 1)[-1] in ("int", "float", "bool", "null"):
        return Value(loader.construct_object(node), origin)
    if node.style is None and _EXPONENT.fullmatch(node.value):
        return Value(float(node.value), origin)  # YAML 1.1 takes 1e-3, without a point, for text.
    return Value(node.value, origin)


def merge(base: Value, over: Value) -> Value:
    """Returns ``base`` with ``over`` on top: mappings key by key, anything else (another tag too) replaced."""
    same_kind = over.tag in (None, base.tag)
    if not (isinstance(base.data, dict) and isinstance(over.data, dict) and same_kind):
        return over
    data = dict(base.data)
    for key, value in over.data.items():
        data[key] = merge(data[key], value) if key in data else value
    return Value(data, over.origin, base.tag)


def nest(key_path: str, value: Value) -> Value:
    """Returns the `Value` of nested mappings that hold ``value`` at a key path with dots."""
    for key in reversed(key_path.split(".")):
        value = Value({key: value}, value.origin)
    return value


class _Dumper(yaml.SafeDumper):
    """Writes mappings as blocks, lists of numbers on one line, and the ``_tag`` of a mapping as its YAML tag."""

    def _mapping(self, data: dict[str, Any]) -> yaml.Node:
        tag = data.get("_tag", _MAPPING)
        return self.represent_mapping(tag, {key: value for key, value in data.items() if key != "_tag"})

    def _sequence(self, data: list[Any]) -> yaml.Node:
        nested = any(isinstance(item, (list, dict)) for item in data)
        return self.represent_sequence("tag:yaml.org,2002:seq", data, flow_style=not nested)

    yaml_representers: ClassVar[dict[Any, Any]] = {**yaml.SafeDumper.yaml_representers, dict: _mapping, list: _sequence}


def dump(data: Mapping[str, Any]) -> str:
    """Returns a mapping as YAML text that `parse`, and Drake, read back."""
    return yaml.dump(data, Dumper=_Dumper, sort_keys=False, default_flow_style=False)
