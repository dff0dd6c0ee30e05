"""A scenario file as a tree of values that know where they were written.

The tree is made from the nodes that YAML composes, not from the objects that it constructs, because only the nodes
contain line numbers, tags and repeated keys. `tree_of` and `plain` turn settings back into trees and plain values.
"""

import dataclasses
import re
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, ClassVar

import yaml

from drake_tracker.core.errors import DrakeTrackerWarning
from drake_tracker.core.files.bounded_yaml import BoundedLoader
from drake_tracker.core.setting import key_of, kinds_of, list_kinds, settings_of

_MAPPING = "tag:yaml.org,2002:map"
"""YAML's name of a mapping without a tag."""
RENAMED_TAGS = {"Slope": "InclinedPlane"}
"""{former tag: tag}. Users' files and commands may still use the former tag; its settings must mean the same."""
_EXPONENT = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)[eE][-+]?\d+")


@dataclass
class Value:
    """A value of the tree.

    Attributes:
        data: a dict of Values, a list of Values, or a number, text, bool or None.
        origin: where the value was written, for messages: "train.yaml line 12".
        tag: YAML tag without the exclamation mark, None when there is none.
        in_file: whether it was written in a file. A value from the command line or from Python was not.
        replaced: mapping with another tag that this value replaced, None when there is none.
    """

    data: Any
    origin: str
    tag: str | None = None
    in_file: bool = False
    replaced: "Value | None" = None

    def find(self, key_path: str) -> "Value | None":
        """Returns the value at a key path below this one, None when there is none.

        Args:
            key_path: names with dots between them.
        """
        value: Value | None = self
        for name in key_path.split("."):
            value = value.data.get(name) if value is not None and isinstance(value.data, dict) else None
        return value


def parse(text: str, describe: Callable[[int], str], errors: list[str], in_file: bool = False) -> Value | None:
    """Returns the tree of a YAML text, or None when it is not valid YAML.

    Args:
        text: the YAML text.
        describe: returns the name of a line, counted from 1, for messages.
        errors: list to which problems are appended, one line each.
        in_file: whether the text is that of a file.
    """
    try:
        loader = BoundedLoader(text)  # raises an error on characters that YAML does not allow
        try:
            node = loader.get_single_node()
            if node is None:
                return Value(None, describe(1), in_file=in_file)
            return _convert(loader, node, "", describe, errors, in_file)
        finally:
            loader.dispose()
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line = mark.line + 1 if mark else 1
        errors.append(f"{describe(line)}: not valid YAML: {error.problem or error.context}")
    except (yaml.YAMLError, ValueError) as error:
        errors.append(f"{describe(1)}: not valid YAML: {' '.join(str(error).split())}")
    return None


@lru_cache(maxsize=16)
def parse_file(text: str, label: str) -> tuple[Value | None, tuple[str, ...]]:
    """Returns the tree of the YAML text of a file, or None when it is not valid YAML, and its problems, one line each.

    Reading the settings of one scenario needs its file several times, and parsing takes longer than all the rest. The
    results for the last texts are therefore kept: the caller must not change the tree.

    Args:
        text: the YAML text.
        label: name of the file in messages.
    """
    errors: list[str] = []
    tree = parse(text, lambda line: f"{label} line {line}", errors, in_file=True)
    return tree, tuple(errors)


def _convert(
    loader: yaml.SafeLoader,
    node: yaml.Node,
    path: str,
    describe: Callable[[int], str],
    errors: list[str],
    in_file: bool,
) -> Value:
    origin = describe(node.start_mark.line + 1)
    tag = _present_tag(node.tag[1:], origin, path) if node.tag.startswith("!") else None
    if isinstance(node, yaml.SequenceNode):
        items = [_convert(loader, item, path, describe, errors, in_file) for item in node.value]
        return Value(items, origin, tag, in_file)
    if isinstance(node, yaml.MappingNode):
        if tag is None and node.tag != _MAPPING:
            errors.append(f"{origin}: {path or 'tag'}: !!{node.tag.rpartition(':')[2]} is not a kind; write one !")
        data: dict[str, Value] = {}
        for key_node, value_node in node.value:
            if not isinstance(key_node, yaml.ScalarNode):
                here = describe(key_node.start_mark.line + 1)
                errors.append(f"{here}: {f'{path}: ' if path else ''}a key must be a name, not a list or mapping")
                continue
            key = str(key_node.value)
            key_path = f"{path}.{key}" if path else key
            if key in data:
                here = describe(key_node.start_mark.line + 1)
                errors.append(f"{here}: {key_path} is given twice, first at {data[key].origin}; keep one")
                continue
            value = _convert(loader, value_node, key_path, describe, errors, in_file)
            value.origin = describe(key_node.start_mark.line + 1)
            data[key] = value
        return Value(data, origin, tag, in_file)
    if tag:
        return Value(node.value or {}, origin, tag, in_file)
    if node.tag.rsplit(":", 1)[-1] in ("int", "float", "bool", "null"):
        return Value(loader.construct_object(node), origin, in_file=in_file)
    if node.style is None and _EXPONENT.fullmatch(node.value):
        return Value(float(node.value), origin, in_file=in_file)  # YAML 1.1 reads 1e-3, without a point, as text.
    return Value(node.value, origin, in_file=in_file)


def _present_tag(tag: str, origin: str, path: str) -> str:
    """Returns the present name of a tag. Warns if it is a former one."""
    if tag in RENAMED_TAGS:
        line = f"{origin}: {f'{path}: ' if path else ''}!{tag} is now called !{RENAMED_TAGS[tag]}"
        warnings.warn(line, DrakeTrackerWarning, stacklevel=2)
    return RENAMED_TAGS.get(tag, tag)


def merge(base: Value, over: Value) -> Value:
    """Returns one tree with another on top.

    Mappings are merged key by key. Anything else, also a mapping with another tag, is replaced. The new value
    keeps a replaced mapping, for the settings that all kinds of a role share.

    Args:
        base: the lower tree.
        over: the tree on top of it.
    """
    same_kind = over.tag in (None, base.tag)
    if not (isinstance(base.data, dict) and isinstance(over.data, dict)):
        return over
    if not same_kind:
        return replace(over, replaced=base)
    data = dict(base.data)
    for key, value in over.data.items():
        data[key] = merge(data[key], value) if key in data else value
    return Value(data, over.origin, base.tag, over.in_file, base.replaced)


def nest(key_path: str, value: Value) -> Value:
    """Returns nested mappings that contain one value.

    Args:
        key_path: key path of the value, with dots.
        value: the value.
    """
    for key in reversed(key_path.split(".")):
        value = Value({key: value}, value.origin)
    return value


class _Dumper(yaml.SafeDumper):
    """Writes mappings as blocks, lists of numbers in one line, and the ``_tag`` of a mapping as its YAML tag."""

    def _mapping(self, data: dict[str, Any]) -> yaml.Node:
        tag = data.get("_tag", _MAPPING)
        return self.represent_mapping(tag, {key: value for key, value in data.items() if key != "_tag"})

    def _sequence(self, data: list[Any]) -> yaml.Node:
        nested = any(isinstance(item, (list, dict)) for item in data)
        return self.represent_sequence("tag:yaml.org,2002:seq", data, flow_style=not nested)

    yaml_representers: ClassVar[dict[Any, Any]] = {**yaml.SafeDumper.yaml_representers, dict: _mapping, list: _sequence}


def dump(data: Mapping[str, Any]) -> str:
    """Returns a mapping as YAML text that `parse` and Drake can read."""
    return yaml.dump(data, Dumper=_Dumper, sort_keys=False, default_flow_style=False)


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
