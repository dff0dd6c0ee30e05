"""Marks in generated blocks: which rows rest on another behaviour of a scenario than today's."""

import re
from collections.abc import Callable
from functools import cache, wraps

from shared.behaviour_rows import behaviour_records, is_current, other_behaviours, results_of
from shared.stored import result_files

from tables import results
from tables.results import Row, listed

MARK = " †"
_SEPARATOR = re.compile(r"\|(---\|)+$")


def marking(make: Callable[[], str]) -> Callable[[], str]:
    """Returns a function that makes the same block, with a mark at each row that rests on another behaviour."""

    @wraps(make)
    def made() -> str:
        with results.recorded() as used:
            text = make()
        rows = used.rows or [row for name in used.files for row in _results(name)]
        return marked(text, rows)

    return made


def marked(text: str, rows: list[Row]) -> str:
    """Returns a block with marks, and a note that explains them; unchanged if all rows rest on today's behaviour.

    A row of a table whose first cell names packaged scenarios is marked if a result rests on another behaviour of one
    of them. Any other row is marked if a result that has the text of its first cell as a value rests on another
    behaviour; if no result has that text, if any result of the block does.

    Args:
        text: the block.
        rows: the results that it rests on.
    """
    others = sorted({name for row in rows for name in other_behaviours(row)})
    if not others:
        return text
    every = all(map(is_current, rows))
    current: dict[str, bool] = {}
    for row in rows:
        good = is_current(row)
        for value in row.values():
            if isinstance(value, (str, int, float)):
                current[str(value)] = current.get(str(value), True) and good
    lines, in_table = [], False
    for line in text.split("\n"):
        in_table = bool(_SEPARATOR.match(line)) or (in_table and line.startswith("|"))
        if in_table and not _SEPARATOR.match(line):
            first, rest = line[1:].split("|", 1)
            named = set(re.findall(r"`([\w:]+)`", first)) & behaviour_records().keys()
            if not named.isdisjoint(others) if named else not current.get(first.strip(), every):
                line = f"|{first.rstrip()}{MARK} |{rest}"
        lines.append(line)
    what = listed([f"`{name}`" for name in others])
    note = f"*{MARK.strip()} Earlier behaviour of {what}.*"
    return "\n".join([*lines, "", note])


def stale(make: Callable[[], str]) -> tuple[str, set[str]]:
    """Returns what a function returns, and the scenarios whose behaviour has changed since."""
    with results.recorded() as used:
        text = make()
    rows = used.rows or [row for name in used.files for row in _results(name)]
    return text, {name for row in rows for name in other_behaviours(row)}


@cache
def _results(name: str) -> list[Row]:
    """Returns the results of a file NAME.jsonl or NAME.json; none without a file."""
    paths = [path for path in result_files() if path.stem == name]
    return results_of(paths[0]) if paths else []
