"""One table of all trials: a row a trial, a column for each number of a run's summary."""

import csv
import io

from drake_tracker.campaign.directory import replace_whole, write_whole
from drake_tracker.campaign.grid import plain_value
from drake_tracker.core.errors import DrakeTrackerError

FIRST = ("seed", "success", "failure_reason")
"""Columns after those of the varied settings; the rest follow as they come up."""


def columns_of(rows, keys):
    """Returns the table as {column: values, None where a row has none}, its rows ordered as ``rows``.

    First the varied settings, ``keys``, as numbers where they are, then `FIRST`, then the rest of the summary: what is
    nested is named with dots (``lag_s.max``), an element of a list by its number (``board_in_world_error.0``).
    """
    flat = []
    for row in rows:
        settings = {key: plain_value(text) for key, text in row["settings"].items()}
        flat.append({**settings, **_flatten({key: value for key, value in row.items() if key != "settings"})})
    names = list(dict.fromkeys([*keys, *FIRST, *(name for row in flat for name in row)]))
    return {name: [row.get(name) for row in flat] for name in names}


def write_csv(columns, path):
    """Writes a table as CSV: UTF-8, a header, empty for None, true and false."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    for row in zip(*columns.values()):
        writer.writerow([str(value).lower() if isinstance(value, bool) else value for value in row])
    write_whole(path, text.getvalue())


def require_parquet():
    """Returns pyarrow's modules (pyarrow, pyarrow.parquet). Raises DrakeTrackerError when it is not installed."""
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError as error:
        remedy = "pip install 'drake-tracker[parquet]' installs it"
        raise DrakeTrackerError(f"--parquet: pyarrow does not load ({error}); {remedy}") from None
    return pyarrow, pyarrow.parquet


def write_parquet(columns, path):
    """Writes a table as Parquet; a column of values of several kinds becomes one of texts."""
    pyarrow, parquet = require_parquet()
    table = pyarrow.table({name: pyarrow.array(_of_one_kind(values)) for name, values in columns.items()})
    replace_whole(path, lambda beside: parquet.write_table(table, beside))


def _of_one_kind(values):
    kinds = {type(value) for value in values if value is not None}
    if kinds == {int, float}:
        return [None if value is None else float(value) for value in values]
    if len(kinds) > 1:
        return [None if value is None else str(value) for value in values]
    return values


def _flatten(value, name=""):
    if isinstance(value, dict):
        items = value.items()
    elif isinstance(value, list):
        items = enumerate(value)
    else:
        return {name: value}
    flat = {}
    for key, item in items:
        flat |= _flatten(item, f"{name}.{key}" if name else str(key))
    return flat
