"""One table of all trials, with a row for each trial and a column for each number of a run's summary."""

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from drake_tracker.campaign.grid import plain_value
from drake_tracker.core.errors import load_extra
from drake_tracker.core.files.atomic_file import replacing, write_text

FIRST = ("seed", "success", "failure_reason")
"""Columns after those of the varied settings; the rest follow in the order in which they first occur."""


def columns_of(rows: Sequence[Mapping[str, Any]], keys: Sequence[str]) -> dict[str, list[Any]]:
    """Returns the table as {column: values, None where a row has none}, in the order of ``rows``.

    The columns are the varied settings (as numbers where they are numbers), then `FIRST`, then the rest of the summary.
    Nested values are named with dots (``lag_s.max``), elements of a list by their index (``board_in_world_error.0``).
    """
    flat = []
    for row in rows:
        settings = {key: plain_value(text) for key, text in row["settings"].items()}
        flat.append({**settings, **_flatten({key: value for key, value in row.items() if key != "settings"})})
    names = list(dict.fromkeys([*keys, *FIRST, *(name for row in flat for name in row)]))
    return {name: [row.get(name) for row in flat] for name in names}


def write_csv(columns: Mapping[str, Sequence[Any]], path: Path) -> None:
    """Writes a table as CSV in UTF-8: a header, an empty cell for None, and the words true and false.

    Args:
        columns: {column: values}.
        path: the file, which is replaced. Raises DrakeTrackerError when it cannot be written.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    for row in zip(*columns.values()):
        writer.writerow([str(value).lower() if isinstance(value, bool) else value for value in row])
    write_text(path, text.getvalue())


def require_parquet(what: str = "--parquet", extra: str = "parquet") -> tuple[Any, Any]:
    """Returns the modules (pyarrow, pyarrow.parquet). Raises DrakeTrackerError when pyarrow is not installed.

    Args:
        what: needs them, for the message.
        extra: that installs them.
    """
    return load_extra("pyarrow", extra, what), load_extra("pyarrow.parquet", extra, what)


def write_parquet(columns: Mapping[str, Sequence[Any]], path: Path) -> None:
    """Writes a table as Parquet. A column with values of several types becomes one of texts.

    Args:
        columns: {column: values}.
        path: the file, which is replaced. Raises DrakeTrackerError when it cannot be written.
    """
    pyarrow, parquet = require_parquet()
    table = pyarrow.table({name: pyarrow.array(_of_one_type(values)) for name, values in columns.items()})
    with replacing(path) as beside:
        parquet.write_table(table, beside)


def _of_one_type(values: Sequence[Any]) -> Sequence[Any]:
    types = {type(value) for value in values if value is not None}
    if types == {int, float}:
        return [None if value is None else float(value) for value in values]
    if len(types) > 1:
        return [None if value is None else str(value) for value in values]
    return values


def _flatten(value: Any, name: str = "") -> dict[str, Any]:
    items: Iterable[tuple[Any, Any]]
    if isinstance(value, dict):
        items = value.items()
    elif isinstance(value, list):
        items = enumerate(value)
    else:
        return {name: value}
    flat: dict[str, Any] = {}
    for key, item in items:
        flat |= _flatten(item, f"{name}.{key}" if name else str(key))
    return flat
