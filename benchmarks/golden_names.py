"""What has another name at an older revision, for `golden.py`, and the translation of such names."""

import itertools
import re
from collections.abc import Callable, Iterable
from typing import NamedTuple


class Rename(NamedTuple):
    """A name that a commit changed.

    Attributes:
        commit: full hash of the commit.
        kind: "scenario"; "setting", a key path of a scenario; "tag" of a kind of part; "effectless", a setting of the
            older revision that had no effect in some scenarios and is not in them today; "signal" of a log; "column" of
            a log, as SIGNAL.COLUMN; or "field", a key path of a JSON file and the head of a column of a CSV table.
        now: the name since the commit, None for what the commit removed.
        before: the name before it, None for what the commit added.
    """

    commit: str
    kind: str
    now: str | None
    before: str | None


KINDS = ("scenario", "setting", "tag", "effectless", "signal", "column", "field")
_DEFAULT_OF_1991 = "8e985441907a25c364a431498f9e14533b6aaecd"
_TOUCH = "44aa2dda45a6e1966fb5a1d8c789e1b6958e8dc6"
_METHODS = "af3e28fa28c4e24c1c573f3fe6b228b92ef5e475"
_INCLINED_PLANE = "1a4ffb230532d10979997b1a9f472dc4ab113d7a"
RENAMES = (
    Rename(_INCLINED_PLANE, "tag", "InclinedPlane", "Slope"),
    Rename(_METHODS, "setting", "vision.method.detector", "vision.detector"),
    Rename(_METHODS, "setting", "vision.method", "vision.tracker"),
    Rename(_METHODS, "tag", "MotionCentroid", "Single"),
    Rename(_METHODS, "tag", "SilhouetteTracker", "Several"),
    Rename(_METHODS, "tag", "OneObject", "Single"),
    Rename(_METHODS, "tag", "SeveralObjects", "Several"),
    *(
        Rename(_METHODS, "effectless", None, name)
        for name in (
            *("vision.detector", "vision.tracker.silhouettes", "vision.tracker.camera_motion"),
            *("vision.tracker.min_pixels", "vision.tracker.max_length", "vision.tracker.largest_std"),
            "vision.tracker.mask_arm",
        )
    ),
    Rename(_TOUCH, "field", "touch_along_m", None),
    Rename(_TOUCH, "field", "touch_across_m", None),
    Rename(_DEFAULT_OF_1991, "scenario", "train", "train:paper"),
    Rename(_DEFAULT_OF_1991, "scenario", "train:learned", "train:blind"),
    Rename(_DEFAULT_OF_1991, "scenario", "train:guided", "train"),
)
"""Every change of a name, the newest commit first. The rows of a commit apply simultaneously."""


class Names:
    """Translates the names of the working tree into those of an older revision.

    The name of a setting, field or signal is also the head of longer names: a row for ``track`` holds for
    ``track.speed`` too.

    Args:
        renames: rows of commits that the older revision does not contain, the newest commit first.
    """

    def __init__(self, renames: Iterable[Rename]) -> None:
        commits = [list(rows) for _, rows in itertools.groupby(renames, lambda row: row.commit)]
        self._steps = [
            {(_family(row.kind), row.now): row.before for row in rows if row.now is not None} for rows in commits
        ]
        self._effectless = tuple(row.before for rows in commits for row in rows if row.kind == "effectless")
        self._removed = {
            (_family(row.kind), self._earlier(row.kind, row.before, number + 1))
            for number, rows in enumerate(commits)
            for row in rows
            if row.now is None and row.kind != "effectless"
        }

    def before(self, kind: str, name: str) -> str | None:
        """Returns a name of the working tree as it was at the older revision, None if there was none."""
        return self._earlier(kind, name, 0)

    def kept(self, kind: str, name: str) -> str | None:
        """Returns a name of the older revision, None if a later commit removed what it names."""
        return None if any((_family(kind), head) in self._removed for head, _ in _heads(name)) else name

    def may_be_missing(self, name: str) -> bool:
        """Returns whether a setting of the older revision had no effect where today's scenarios lack it."""
        return any(head in self._effectless for head, _ in _heads(name))

    def command(self, arguments: Iterable[str]) -> tuple[str, ...] | None:
        """Returns the arguments of a command for the older revision, None if that cannot be expressed there.

        Translates arguments that are names of scenarios, and the keys of ``--set`` and ``--vary``.
        """
        found: list[str | None] = []
        option = ""
        for argument in arguments:
            if option in ("--set", "--vary"):
                key, equals, value = argument.partition("=")
                new = self.before("setting", key)
                value = re.sub(r"!(\w+)", lambda tag: f"!{self.before('tag', tag[1])}", value)
                found.append(None if new is None else new + equals + value)
            else:
                found.append(self.before("scenario", argument))
            option = argument
        return None if None in found else tuple(map(str, found))

    def _earlier(self, kind: str, name: str | None, first: int) -> str | None:
        for step in self._steps[first:]:
            if name is None:
                break
            name = next(
                (
                    _joined(step[_family(kind), head], rest)
                    for head, rest in _heads(name)
                    if (_family(kind), head) in step
                ),
                name,
            )
        return name


def applicable(renames: Iterable[Rename], is_ancestor: Callable[[str], bool]) -> list[Rename]:
    """Returns the rows whose commit the older revision does not contain.

    Args:
        renames: rows.
        is_ancestor: returns whether the older revision contains a commit, given its hash.
    """
    renames = list(renames)
    contained = {commit: is_ancestor(commit) for commit in {row.commit for row in renames}}
    return [row for row in renames if not contained[row.commit]]


def _family(kind: str) -> str:
    return "signal" if kind == "column" else kind  # SIGNAL.COLUMN, so that a new name of the signal holds for it


def _heads(name: str) -> list[tuple[str, str]]:
    """Returns (head, rest) of a name with dots, from the whole name to its first part."""
    parts = name.split(".")
    return [(".".join(parts[:count]), ".".join(parts[count:])) for count in range(len(parts), 0, -1)]


def _joined(head: str | None, rest: str) -> str | None:
    return head if head is None or not rest else f"{head}.{rest}"
