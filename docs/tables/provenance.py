"""What each result file says about its origin."""

import json
from collections import Counter
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from shared import stored

from tables.results import Row, ranges, sidecar, table

_PACKAGES = ("python", "drake", "numpy", "scipy", "opencv", "opencv-python-headless", "stonesoup", "filterpy")


class OriginError(ValueError):
    """A result file does not say where it comes from."""


@dataclass(frozen=True)
class Origin:
    """Where the results of a file come from.

    Attributes:
        commits: how many results each commit made, by its full name as recorded.
        seeds: all seeds.
        versions: package versions; each with all that were used.
        note: how the origin was derived where the file does not record it, else empty.
        command: the command that makes the file.
    """

    commits: Counter
    seeds: list[int]
    versions: dict[str, list[str]]
    note: str
    command: str


def origin_of(path: Path) -> Origin:
    """Returns the origin of a result file, from its lines or, where these lack it, from NAME.meta.json.

    Raises OriginError when commit, seeds, versions, behaviour or command are missing.
    """
    made_by = sidecar(path.stem)
    parts = _parts(path)
    commits: Counter = Counter()
    seeds: set[int] = set()
    versions: dict[str, set[str]] = {}
    for number, part in enumerate(parts, 1):
        where = f"{path.name}, result {number}" if len(parts) > 1 else path.name
        commit = part.get("git_commit") or part.get("commit") or made_by.get("commit")
        own_seeds = part.get("seeds") or ([part["seed"]] if "seed" in part else made_by.get("seeds"))
        recorded = part.get("package_versions") or part.get("versions") or _flat_versions(part)
        own_versions = {**made_by.get("versions", {}), **recorded}
        if "behaviour" not in part and "behaviour" not in made_by:
            raise OriginError(f"{where}: no behaviour, and {path.stem}.meta.json has none either")
        for name, value in (("commit", commit), ("seed", own_seeds), ("package versions", own_versions)):
            if not value:
                raise OriginError(f"{where}: no {name}, and {path.stem}.meta.json has none either")
        commits[commit] += 1
        seeds |= set(own_seeds)
        for name, version in own_versions.items():
            versions.setdefault(name, set()).add(version or "not installed")
    if not made_by.get("command") and not any("command" in part for part in parts):
        raise OriginError(f"{path.name}: no command, and {path.stem}.meta.json has none either")
    command = made_by.get("command") or parts[0]["command"]
    shown = {name: sorted(found) for name, found in versions.items()}
    return Origin(commits, sorted(seeds), shown, made_by.get("derived", ""), command)


def result_files() -> str:
    """Returns tables of all result files and of the package versions."""
    rows, notes, used = [], [], {}
    for path in stored.result_files():
        found = origin_of(path)
        mark = ""
        if found.note:
            notes.append(f"{len(notes) + 1}. `{path.name}`: {found.note}")
            mark = f" ({len(notes)})"
        commits = ", ".join(f"`{commit[:7]}`" for commit in found.commits)
        rows.append([f"`{path.name}`{mark}", f"`{found.command}`", ranges(found.seeds), commits])
        for name in _PACKAGES:
            for version in found.versions.get(name, []):
                used.setdefault((name, version), []).append(f"`{path.name}`")
    everywhere = len(rows)
    packages = [
        [name, version, "all" if len(files) == everywhere else ", ".join(files)]
        for (name, version), files in used.items()
    ]
    packages.sort(key=lambda row: _PACKAGES.index(row[0]))
    return "\n\n".join(
        [
            table(["file", "command", "seeds", "commits"], rows),
            "\n".join(notes),
            table(["package", "version", "recorded for"], packages),
        ]
    )


@cache
def _parts(path: Path) -> list[Row]:
    """Returns what may name an origin: the lines of a JSONL file, the makers of a JSON file."""
    if path.suffix == ".jsonl":
        return stored.read_lines(path)
    found = json.loads(stored.read_text(path))
    if isinstance(found, list):
        return [{**part, **part.get("made_by", {})} for part in found]
    made_by = found.get("made_by", {})
    if isinstance(made_by, list):
        first, last = found["seeds"]
        return [{**part, "seeds": list(range(first, last + 1))} for part in made_by]
    return [{**found, **made_by}]


def _flat_versions(part: Row) -> Row:
    return {name: part[name] for name in _PACKAGES if isinstance(part.get(name), str)}
