"""Reads a tree of values into dataclasses of settings and reports all that is wrong, one line per problem."""

import dataclasses
import difflib
import math
import re
import typing
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from typing import Any

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.files.regular_file import printable
from drake_tracker.core.setting import allowed, as_tuple, constants_of, key_of, kinds_of, list_kinds, settings_of
from drake_tracker.scenarios.tree import RENAMED_TAGS, Value, parse, tree_of

_NOUNS = {float: "a number", int: "a whole number", bool: "true or false", str: "text"}
_NAMES = "names, each with a number, true or false, or text"
_MOST_SUGGESTIONS = 20
"""Number of errors after which no similar names are searched for, which takes longer than all the rest."""
_LONGEST_NAME = 60
"""Greatest length of an unknown name for which similar ones are searched for, and which a message shows in full."""


def read(
    value: Value,
    schema: Any,
    key: str,
    errors: list[str],
    origins: dict[str, str],
    metadata: Any = None,
    root: Any = None,
) -> Any:
    """Returns a value of the tree as an instance of a type.

    Args:
        value: value to read.
        schema: type to return: a dataclass of settings, a Union of them, a tuple of any number of these, an Optional of
            one of these, a tuple of numbers or of such tuples, float, int, bool, str, or a dict from names to any of
            the last four.
        key: key path of the value, empty at the top.
        errors: list to which problems are appended, one line each. A value that cannot be read becomes None.
        origins: dict that is filled in: {key path: where the value was written}.
        metadata: metadata of the dataclass field, see `setting`.
        root: schema at the top, searched for the full path of a key that was given in the wrong place.
    """
    metadata = metadata or {}
    root = root or schema
    kinds = list(kinds_of(schema))
    if type(None) in kinds:
        if value.data is None:
            return None
        kinds.remove(type(None))
    if all(dataclasses.is_dataclass(kind) for kind in kinds):
        return _read_part(value, kinds, key, errors, origins, root)
    if parts := list_kinds(kinds[0]):
        return _read_parts(value, parts, key, errors, origins, root)
    if typing.get_origin(kinds[0]) is tuple:
        return _read_list(value, metadata, key, errors)
    if typing.get_origin(kinds[0]) is dict:
        return _read_names(value, kinds[0], key, errors, origins)
    return _read_scalar(value, kinds[0], metadata, key, errors)


def _read_parts(value: Value, kinds: Any, key: str, errors: list[str], origins: dict[str, str], root: Any) -> Any:
    """Returns the parts of a list, each with its tag, as a tuple."""
    if not isinstance(value.data, list) or value.tag:
        errors.append(f"{value.origin}: {key} must be {_parts_noun(kinds)}, not {_show(value)}")
        return ()
    items = []
    for number, item in enumerate(value.data):
        item_key = f"{key}[{number}]"
        if item.tag is None:
            errors.append(f"{item.origin}: {item_key} must begin with one of {_tags(kinds)}, not {_show(item)}")
            continue
        origins[item_key] = item.origin
        items.append(_read_part(item, kinds, item_key, errors, origins, root))
    return tuple(items)


def _read_part(value: Value, kinds: Any, key: str, errors: list[str], origins: dict[str, str], root: Any) -> Any:
    by_name = {kind.__name__: kind for kind in kinds}
    tag = value.tag or kinds[0].__name__
    if tag not in by_name:
        errors.append(f"{value.origin}: {key} must be one of {_tags(kinds)}, not !{tag}{_nearest(tag, by_name, '!')}")
        return kinds[0]()
    kind = by_name[tag]
    data = {} if value.data is None else value.data
    if not isinstance(data, dict):
        noun = f"one of {_tags(kinds)}" if len(kinds) > 1 and isinstance(data, str) else "a mapping of settings"
        near = _nearest(data, by_name, "!") if isinstance(data, str) else ""
        errors.append(f"{value.origin}: {key or 'the scenario'} must be {noun}, not {_show(value)}{near}")
        return kind()
    fields = {key_of(field): field for field in settings_of(kind)}
    constants = constants_of(kind)
    values = {}
    for name, item in (_kept(value, fields) | data).items():
        item_key = f"{key}.{name}" if key else name
        if name not in fields and name in constants:
            _check_constant(item, item_key, constants[name], errors)
            continue
        if name not in fields:
            if len(name) > _LONGEST_NAME:
                errors.append(f"{item.origin}: there is no setting {item_key[: len(item_key) - len(name) + 57]}...")
            else:
                hint = _suggest(name, key, tag, by_name, root) if len(errors) < _MOST_SUGGESTIONS else ""
                errors.append(f"{item.origin}: there is no setting {item_key}{hint}")
            continue
        origins[item_key] = item.origin
        field = fields[name]
        values[field.name] = read(item, field.type, item_key, errors, origins, field.metadata, root)
    return kind(**values)


def _check_constant(value: Value, key: str, constant: Any, errors: list[str]) -> None:
    """Appends a problem when a former setting does not have the value at which it is fixed today."""
    if dataclasses.is_dataclass(constant) and isinstance(value.data, dict):
        known = constants_of(type(constant))
        for name, item in value.data.items():
            if name in known:
                _check_constant(item, f"{key}.{name}", known[name], errors)
            else:
                errors.append(f"{item.origin}: there is no setting {key}.{name}")
    elif value.tag or as_tuple(_plain(value)) != constant:
        errors.append(f"{value.origin}: {key} is no longer a setting; it is fixed at {_plain_text(constant)}")


def _plain_text(constant: Any) -> str:
    if isinstance(constant, tuple):
        return f"[{', '.join(map(_plain_text, constant))}]"
    return "empty" if constant is None else f"{constant:g}" if isinstance(constant, float) else str(constant)


def _kept(value: Value, fields: Mapping[str, Any]) -> dict[str, Value]:
    """Returns the shared settings of the kinds that a part replaced, which hold for the part as well."""
    replaced = value.replaced
    if replaced is None or not isinstance(replaced.data, dict):
        return {}
    written = _kept(replaced, fields) | replaced.data
    kept = {name: item for name, item in written.items() if name in fields and fields[name].metadata["shared"]}
    for name, item in list(kept.items()):
        counterparts = fields[name].metadata["counterparts"]
        if item.tag in counterparts:
            kept[name] = Value({}, item.origin, counterparts[item.tag], item.in_file, item)
        elif counterparts and item.tag is None:  # of the first kind there, and hence of the first kind here
            del kept[name]
    return kept


def _read_list(value: Value, metadata: Any, key: str, errors: list[str]) -> Any:
    shape = metadata["shape"]
    plain = _plain(value)
    rows = plain if len(shape) == 2 else [plain]
    fits = (
        isinstance(rows, list)
        and (len(shape) == 1 or shape[0] in (None, len(rows)))
        and all(isinstance(row, list) and shape[-1] in (None, len(row)) for row in rows)
    )
    if not (fits and all(_number_fits(number, metadata) for row in rows for number in row)):
        errors.append(f"{value.origin}: {key} must be {allowed(metadata, _list_noun(shape))}, not {_show(value)}")
        return None
    rows = as_tuple([[float(number) for number in row] for row in rows])
    return rows if len(shape) == 2 else rows[0]


def _read_names(value: Value, schema: Any, key: str, errors: list[str], origins: dict[str, str]) -> dict[str, Any]:
    """Returns the dict of a mapping whose names the user chose."""
    data = {} if value.data is None else value.data
    if not isinstance(data, dict) or value.tag:
        errors.append(f"{value.origin}: {key} must be {_NAMES}, not {_show(value)}")
        return {}
    _, kinds = typing.get_args(schema)
    for name, item in data.items():
        origins[f"{key}.{name}"] = item.origin
        if item.tag or not isinstance(item.data, kinds_of(kinds)):
            errors.append(f"{item.origin}: {key}.{name} must be a number, true or false, or text, not {_show(item)}")
    return {name: item.data for name, item in data.items()}


def _read_scalar(value: Value, kind: Any, metadata: Any, key: str, errors: list[str]) -> Any:
    data, choices = value.data, metadata.get("choices")
    if value.tag:
        good = False
    elif kind is float:
        good = _number_fits(data, metadata)
    elif kind is int:
        good = isinstance(data, int) and _number_fits(data, metadata)
    else:
        if choices and isinstance(data, int) and str(data) in choices:  # a number among words
            data = str(data)
        good = isinstance(data, kind) and (not choices or data in choices)
    if good and kind is str and printable(data) != data:
        errors.append(f"{value.origin}: {key} must be text without control characters, not {_show(value)}")
        return None
    if not good:
        hint = _nearest(str(data), choices) if choices else ""
        errors.append(f"{value.origin}: {key} must be {allowed(metadata, _NOUNS[kind])}, not {_show(value)}{hint}")
        return None
    return kind(data)


def _tags(kinds: Iterable[type]) -> str:
    return ", ".join("!" + kind.__name__ for kind in kinds)


def _parts_noun(kinds: Iterable[type]) -> str:
    return f"a list of {_tags(kinds)}"


def summary_of(kind: type) -> str:
    """Returns the first line of the docstring of a dataclass of settings."""
    return (kind.__doc__ or "").strip().partition("\n")[0]


def _list_noun(shape: Any) -> str:
    if len(shape) == 1:
        return "a list of numbers" if shape[0] is None else f"a list of {shape[0]} numbers"
    return f"a list of {shape[0]} lists of {shape[1]} numbers"


def _number_fits(data: Any, metadata: Any) -> bool:
    if isinstance(data, bool) or not isinstance(data, (int, float)):
        return False
    low, high = metadata.get("range") or (-math.inf, math.inf)
    return low <= data <= high and abs(data) != math.inf


def _plain(value: Value) -> Any:
    if isinstance(value.data, list):
        return [_plain(item) for item in value.data]
    if isinstance(value.data, dict):
        return {key: _plain(item) for key, item in value.data.items()}
    return value.data


def _show(value: Value) -> str:
    data = _plain(value)
    if isinstance(data, dict):
        text = "a mapping"
    elif data is None:
        text = "empty"
    else:
        text = str(data).lower() if isinstance(data, bool) else repr(data)
    text = text if len(text) <= 60 else text[:57] + "..."
    return f"!{value.tag} {text}" if value.tag else text


def _nearest(word: str, names: Iterable[str], prefix: str = "") -> str:
    close = difflib.get_close_matches(word, list(names), n=1, cutoff=0.5)
    return f"; did you mean {prefix}{close[0]}?" if close else ""


def _suggest(name: str, key: str, tag: str, kinds: Any, root: Any) -> str:
    """Returns the place where an unknown setting may belong: another kind of the role, or the setting with the most
    similar name, in the same part if a name there is similar.
    """
    prefix = f"{key}." if key else ""
    names = [key_of(field) for field in settings_of(kinds[tag])]
    for kind, part in kinds.items():
        if name in map(key_of, settings_of(part)):
            return f" in !{tag}; it belongs to {key}: !{kind}"
    own = [prefix + each for each in names]
    elsewhere = (
        setting_keys(root) if dataclasses.is_dataclass(root) else ()
    )  # a Union for an option of the command line
    for paths in (own, list(elsewhere)):
        scores = [difflib.SequenceMatcher(None, name, path.rpartition(".")[2]).ratio() for path in paths]
        if max(scores, default=0.0) >= 0.6:
            return f"; did you mean {paths[scores.index(max(scores))]}?"
    return f"; {key or 'a scenario'} has {', '.join(names) or 'no settings'}"


def setting_keys(schema: Any, prefix: str = "") -> Iterator[str]:
    """Returns the key paths of all settings of a dataclass, including those of every kind of a role.

    Args:
        schema: a dataclass of settings.
        prefix: start of every key path.
    """
    return (word[:-1] for word in setting_words(schema, prefix) if word.endswith("="))


def setting_words(schema: Any, prefix: str = "") -> Iterator[str]:
    """Yields the possible beginnings of an argument of ``--set``: ``key=`` for a setting, ``key=Kind`` for a part.

    Args:
        schema: a dataclass of settings.
        prefix: start of every key path.
    """
    for field in settings_of(schema):
        kinds = kinds_of(field.type)
        parts = [kind for kind in kinds if isinstance(kind, type) and dataclasses.is_dataclass(kind)]
        if len(parts) > 1:
            yield from (f"{prefix}{key_of(field)}={kind.__name__}" for kind in parts)
        elif not parts:
            yield f"{prefix}{key_of(field)}="
        for part in parts:
            yield from setting_words(part, f"{prefix}{key_of(field)}.")


@cache
def kind_names(schema: Any) -> frozenset[str]:
    """Returns the names of all kinds of parts that the settings of a dataclass may have."""
    names: set[str] = set()
    for field in settings_of(schema):
        for kind in (*kinds_of(field.type), *list_kinds(field.type)):
            if dataclasses.is_dataclass(kind) and isinstance(kind, type):
                names |= {kind.__name__, *kind_names(kind)}
    return frozenset(names)


def tag_kinds(text: str, schema: Any) -> str:
    """Returns the value of an override with an exclamation mark before each kind that has none.

    An interactive shell takes ``!Lossy`` for a word of its history, even in double quotes.

    Args:
        text: the value, as YAML: ``Lossy {drop: 0.3}``.
        schema: the dataclass of the scenario, whose kinds are recognised outside of quotes.
    """

    def tagged(match: re.Match[str]) -> str:
        before, name, settings = match.groups()
        if settings:
            return f"{before}!{name}"
        return f"{before}!{name} {{}}" if RENAMED_TAGS.get(name, name) in kind_names(schema) else match.group()

    pieces = re.split(r"""("(?:[^"\\]|\\.)*"|'(?:[^']|'')*')""", text)
    return "".join(
        piece if number % 2 else re.sub(r"((?:^|[\[{,:])\s*)([A-Z]\w*)(?=\s*(?:$|[\]},]|(\s\{)))", tagged, piece)
        for number, piece in enumerate(pieces)
    )


def setting_unit(schema: Any, key: str) -> str:
    """Returns the unit of a setting, "" when it has none.

    Args:
        schema: a dataclass of settings.
        key: key path of the setting; it may belong to any kind of a role.
    """
    return next(filter(None, (field.metadata["unit"] for field in fields_at(schema, key))), "")


def fields_at(schema: Any, key: str) -> Iterator[dataclasses.Field[Any]]:
    """Yields the fields at the key path of a setting, one for each kind of a role that has such a setting."""
    name, _, rest = key.partition(".")
    for field in settings_of(schema):
        if key_of(field) == name and not rest:
            yield field
        elif key_of(field) == name:
            for kind in kinds_of(field.type):
                if dataclasses.is_dataclass(kind):
                    yield from fields_at(kind, rest)


def describe_settings(part: Any, prefix: str = "") -> list[tuple[str, str, str, str]]:
    """Returns a row (key path, value, allowed values, meaning) for each setting of a dataclass instance."""
    rows = []
    for field in settings_of(part):
        value, key = getattr(part, field.name), prefix + key_of(field)
        kinds = kinds_of(field.type)
        if parts := list_kinds(field.type):
            tags = f"[{_tags(type(item) for item in value)}]"
            rows.append((key, tags, _parts_noun(parts), field.metadata["help"]))
            for number, item in enumerate(value):
                item_key = f"{key}[{number}]"
                rows.append((item_key, f"!{type(item).__name__}", "its kind", summary_of(type(item))))
                rows += describe_settings(item, item_key + ".")
        elif dataclasses.is_dataclass(value):
            if len(kinds) > 1:
                rows.append((key, f"!{type(value).__name__}", f"one of {_tags(kinds)}", field.metadata["help"]))
            rows += describe_settings(value, key + ".")
        else:
            shape = field.metadata["shape"]
            if isinstance(value, dict):
                noun = _NAMES
            elif dataclasses.is_dataclass(kinds[0]):  # a part that may be null
                noun = "null, or a mapping of settings"
            else:
                noun = _list_noun(shape) if shape else next(_NOUNS[kind] for kind in kinds if kind in _NOUNS)
            shown = value if isinstance(value, str) else _show(tree_of(value, ""))
            rows.append((key, shown, allowed(field.metadata, noun), field.metadata["help"]))
    return rows


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
