"""Compares the files that two runs left, array by array, bit for bit, and field by field, for `golden.py`."""

import csv
import json
import math
from typing import NamedTuple

import numpy as np
import yaml

SUFFIXES = (".npz", ".json", ".jsonl", ".csv", ".yaml")
VOLATILE = (
    *("wall_time_s", "wall_s", "processor_time_s", "real_time_factor"),
    *("git_commit", "package_versions", "drake_tracker", "date"),
    *("scenario", "name", "description", "overrides", "settings_sha256"),
)
"""Fields that are not compared. Times depend on the load of the machine. The origin of a result (commit, versions,
date) differs by definition. Name, description, overrides and hash of a scenario change with its texts, not with its
behaviour. Absolute paths need no row: the folders of both sides are replaced in every text."""


class Difference(NamedTuple):
    """A difference.

    Attributes:
        place: file, and what in it.
        now: value in the working tree.
        base: value at the older revision.
        time: simulated time [s]; infinite where there is none.
    """

    place: str
    now: str
    base: str
    time: float = math.inf


def compare_folders(now, base, names, now_paths, base_paths):
    """Returns the differences between the files in two folders, the earliest in simulated time first.

    Args:
        now, base: the folder of the working tree's runs, and of those of the older revision.
        names: a `Names`.
        now_paths, base_paths: paths that the files may contain, and which are no difference.
    """
    found = []
    files = [
        {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.suffix in SUFFIXES}
        for folder in (now, base)
    ]
    for file in sorted(files[0] | files[1]):
        if not all(file in side for side in files):
            found.append(Difference(file, *("there" if file in side else "missing" for side in files), -math.inf))
        elif file.endswith(".npz"):
            found += compare_arrays(file, _arrays(now / file), _arrays(base / file), names)
        else:
            kind = "setting" if file.endswith("scenario.yaml") else "field"
            tables = (read_table(now / file, now_paths), read_table(base / file, base_paths))
            found += compare_tables(file, *tables, names, kind)
    return sorted(found, key=lambda difference: difference.time)


def compare_arrays(file, now, base, names):
    """Returns the first difference of every array {name: array} of an archive."""
    now, base = _renamed(now, names.before), _renamed(base, names.kept)
    found = []
    for name in sorted({*now, *base}):
        if name not in now or name not in base:
            sides = ("there" if name in side else "missing" for side in (now, base))
            found.append(Difference(f"{file}: array {name}", *sides, -math.inf))
        elif difference := compare_array(now[name], base[name], now.get(f"{name}.time"), now.get(f"{name}.names")):
            what, *values = difference
            found.append(Difference(f"{file}: {name}{what}", *values))
    return found


def compare_array(now, base, times=None, columns=None):
    """Returns the first difference of two arrays as (place, value, value, time), or None.

    Args:
        now, base: the arrays.
        times: of the rows [s], or None.
        columns: names of the columns, or None.
    """
    if now.dtype != base.dtype and not now.dtype.kind == base.dtype.kind == "U":
        return " has another type", str(now.dtype), str(base.dtype), -math.inf
    if now.ndim != base.ndim or now.shape[1:] != base.shape[1:]:
        return " has another shape", str(now.shape), str(base.shape), -math.inf
    now, base = np.atleast_1d(now), np.atleast_1d(base)
    rows = min(len(now), len(base))
    places = np.argwhere(unequal(now[:rows], base[:rows]))
    if not len(places) and len(now) == len(base):
        return None
    row = int(places[0][0]) if len(places) else rows
    time = float(times[row]) if times is not None and row < len(times) else math.inf
    where = f", row {row}" + (f" at {time:.6g} s" if math.isfinite(time) else "")
    if not len(places):
        return f"{where}: the shorter one ends", f"{len(now)} rows", f"{len(base)} rows", time
    if columns is not None and len(places[0]) == 2:
        where = f", column {columns[places[0][1]]}" + where
    elif len(places[0]) > 1:
        where += f", place {places[0][1:].tolist()}"
    return where, repr(now[tuple(places[0])].item()), repr(base[tuple(places[0])].item()), time


def unequal(now, base):
    """Returns where two arrays of one shape differ in a bit; NaN equals NaN, and 0.0 differs from -0.0."""
    if now.dtype.kind != "f":
        return now != base
    bits = np.dtype(f"u{now.dtype.itemsize}")
    differs = np.ascontiguousarray(now).view(bits) != np.ascontiguousarray(base).view(bits)
    return differs & ~(np.isnan(now) & np.isnan(base))


def _renamed(arrays, name_of):
    """Returns {name: array} with translated names of signals and columns, without those that have no such name."""
    found = {}
    for name, array in arrays.items():
        signal, dot, part = name.partition(".")
        new = name_of("signal", signal)
        if new is None:
            continue
        columns = arrays.get(f"{signal}.names")
        if columns is not None and part in ("", "names"):
            said = [name_of("column", f"{signal}.{column}") for column in columns.tolist()]
            kept = [number for number, column in enumerate(said) if column is not None]
            if part == "":
                array = array[:, kept]
            else:
                array = np.array([said[number].partition(".")[2] for number in kept], dtype=np.str_)
        found[new + dot + part] = array
    return found


def _arrays(path):
    with np.load(path, allow_pickle=False) as archive:
        return dict(archive)


def compare_tables(file, now, base, names, kind):
    """Returns the first difference of every field of two tables, which are lists of rows {key path: value}.

    Args:
        file: for the place of a difference.
        now, base: the tables.
        names: a `Names`.
        kind: what the key paths are: "field" or "setting".
    """
    if len(now) != len(base):
        return [Difference(file, f"{len(now)} rows", f"{len(base)} rows", -math.inf)]
    found = {}
    for number, (one, other) in enumerate(zip(now, base)):
        one = {
            names.before(kind, path): names.before("tag", value) if path.endswith("!") else value
            for path, value in one.items()
            if not is_volatile(path)
        }
        other = {names.kept(kind, path): value for path, value in other.items() if not is_volatile(path)}
        other = {path: value for path, value in other.items() if path in one or not names.may_be_missing(path)}
        for path in sorted({*one, *other} - {None, *found}):
            values = [repr(row[path]) if path in row else "missing" for row in (one, other)]
            if values[0] != values[1]:
                where = f"row {number + 1}, " if len(now) > 1 else ""
                found[path] = Difference(f"{file}: {where}{path}", *values, _stamp(one))
    return list(found.values())


def is_volatile(path):
    """Returns whether a key path has a part that `VOLATILE` names."""
    return any(part in VOLATILE for part in path.split("."))


def _stamp(row):
    """Returns the time of a row of a track [s], infinite where it has none."""
    try:
        return float(row["stamp"])
    except (KeyError, TypeError, ValueError):
        return math.inf


def read_table(path, paths=()):
    """Returns the rows [{key path: value}] of a JSON, JSONL, CSV or YAML file; one row for JSON and YAML.

    Args:
        path: the file.
        paths: what to take out of its text, the longest first.
    """
    text = path.read_text(encoding="utf-8")
    for number, part in enumerate(paths):
        text = text.replace(str(part), f"<{number}>")
    if path.suffix == ".csv":
        return list(csv.DictReader(text.splitlines()))
    if path.suffix == ".jsonl":
        return [dict(leaves(json.loads(line))) for line in text.splitlines()]
    if path.suffix == ".json":
        return [dict(leaves(json.loads(text)))]
    document = yaml.load(text, _Loader)
    return [dict(leaves(document["scenario"] if path.name == "scenario.yaml" else document))]


def leaves(value, path=""):
    """Yields (key path, value) of everything in a document that is no mapping and no list, or an empty one."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, item in items:
        yield from leaves(item, f"{path}.{key}" if path else str(key))
    if not isinstance(value, (dict, list)) or not value:
        yield path, value


class _Loader(yaml.SafeLoader):
    """Reads the tags of kinds (``!ClosedPath``) as a setting more."""


def _tagged(loader, tag, node):
    settings = loader.construct_mapping(node, deep=True) if isinstance(node, yaml.MappingNode) else {}
    return {"!": tag, **settings}


_Loader.add_multi_constructor("!", _tagged)
