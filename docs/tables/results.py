"""Reads the result files, and writes numbers as texts."""

import json
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache
from typing import Any

from shared.common import RESULTS, interval, markdown_table
from shared.stored import read_lines

Row = dict[str, Any]


@dataclass
class Used:
    """The results that a block rests on.

    Attributes:
        rows: the rows whose origin it states.
        files: names of the files that it reads.
    """

    rows: list[Row] = field(default_factory=list)
    files: list[str] = field(default_factory=list)


_used = Used()


@contextmanager
def recorded() -> Iterator[Used]:
    """A context that gives the results that are read within it."""
    global _used
    before, _used = _used, Used()
    try:
        yield _used
    finally:
        _used = before


def lines(name: str) -> list[Row]:
    """Returns the results of a JSONL file."""
    _used.files.append(name)
    return _lines(name)


def data(name: str) -> Any:
    """Returns the content of a JSON file."""
    _used.files.append(name)
    return _data(name)


@cache
def _lines(name: str) -> list[Row]:
    return read_lines(RESULTS / f"{name}.jsonl")


@cache
def _data(name: str) -> Any:
    return json.loads((RESULTS / f"{name}.json").read_text(encoding="utf-8"))


@cache
def sidecar(name: str) -> Row:
    """Returns what ``NAME.meta.json`` says about the result file NAME; empty without one."""
    path = RESULTS / f"{name}.meta.json"
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}


def uses(*rows: Row) -> None:
    """Says on which results a block rests whose origin it does not state."""
    _used.rows.extend(rows)


def where(rows: Iterable[Row], **fields: Any) -> list[Row]:
    """Returns the rows whose fields have the given values; a value that is a function decides by itself."""

    def fits(row: Row) -> bool:
        return all(want(row[key]) if isinstance(want, Callable) else row[key] == want for key, want in fields.items())

    return [row for row in rows if fits(row)]


def seeds_between(first: int, last: int) -> Callable[[int], bool]:
    """Returns a condition for `where`: a seed from ``first`` to ``last``."""
    return lambda seed: first <= seed <= last


def ranges(seeds: Iterable[int]) -> str:
    """Returns seeds as a text, three or more consecutive numbers as "first to last"."""
    parts: list[list[int]] = []
    for seed in sorted(set(seeds)):
        if parts and seed == parts[-1][-1] + 1:
            parts[-1].append(seed)
        else:
            parts.append([seed])
    texts = [[f"{part[0]} to {part[-1]}"] if len(part) > 2 else list(map(str, part)) for part in parts]
    return listed([text for part in texts for text in part])


def listed(texts: list[str]) -> str:
    """Returns texts joined by commas and "and"."""
    return texts[0] if len(texts) == 1 else ", ".join(texts[:-1]) + " and " + texts[-1]


def commit_of(row: Row) -> str:
    """Returns the short commit that a row names."""
    return (row.get("git_commit") or row["commit"])[:7]


def commits(rows: list[Row]) -> str:
    """Returns the commits of rows as a text, with the number of runs of each when there are several."""
    return _counted(Counter(commit_of(row) for row in rows))


def _counted(counts: Counter[str]) -> str:
    if len(counts) == 1:
        return f"commit `{next(iter(counts))}`"
    return "commits " + listed([f"`{commit}` ({count} runs)" for commit, count in counts.most_common()])


def origin(rows: list[Row], *more: str) -> str:
    """Returns a line in italics below a table: seeds, commits and what else there is to say."""
    uses(*rows)
    seeds = sorted({row["seed"] for row in rows})
    text = f"Seed{'s' if len(seeds) > 1 else ''} {ranges(seeds)}, {commits(rows)}, {len(rows)} runs."
    return f"*{' '.join([text, *more])}*"


def block(*parts: str) -> str:
    """Returns paragraphs and tables, separated by empty lines."""
    return "\n\n".join(parts)


def table(header: list[str], rows: list[list[Any]]) -> str:
    """Returns a Markdown table."""
    return markdown_table(header, rows)


def part(file: str, tables: dict[str, Callable], name: str) -> str:
    """Returns the table of a part of a benchmark that consists of parts, or that it was not measured.

    Args:
        file: name of the file of results.
        tables: {part: function of the results of its cells that returns (header, rows)}.
        name: of the part.
    """
    results = data(file) if (RESULTS / f"{file}.json").exists() else []
    found = next((each for each in results if each["part"] == name), None)
    if found is None:
        return "*Not measured yet.*"
    uses(found)
    made_by = found["made_by"]
    counts = Counter({commit[:7]: runs for commit, runs in made_by.get("commits", {made_by["commit"]: 1}).items()})
    return block(table(*tables[name](found["cells"])), f"*Seeds {ranges(made_by['seeds'])}, {_counted(counts)}.*")


def of(count: int, total: int, noun: str = "") -> str:
    """Returns "COUNT of TOTAL NOUN (Wilson 95 % A-B %)"."""
    return f"{count} of {total}{noun} (Wilson 95 % {interval(count, total)})"
