"""What has another name at an older revision, for `golden.py`, and the translation of such names."""

import itertools
import re
from collections.abc import Callable, Iterable
from typing import NamedTuple


class Rename(NamedTuple):
    """A name that a commit changed.

    Attributes:
        commit: full hash of the commit.
        kind: "scenario"; "setting", a key path of a scenario; "tag" of a kind of part; "gone", a setting of the older
            revision that scenarios may lack today, because it had no effect or is a constant; "signal" of a log;
            "column" of a log, as SIGNAL.COLUMN; or "field", a key path of a JSON file and the head of a column of a CSV
            table.
        now: the name since the commit, None for what the commit removed.
        before: the name before it, None for what the commit added.
    """

    commit: str
    kind: str
    now: str | None
    before: str | None


KINDS = ("scenario", "setting", "tag", "gone", "signal", "column", "field")
_DEFAULT_OF_1991 = "8e985441907a25c364a431498f9e14533b6aaecd"
_TOUCH = "44aa2dda45a6e1966fb5a1d8c789e1b6958e8dc6"
_CONSTANTS = "bc2a569e9bd377596d7633f5850d0af6ee1c175c"
_METHODS = "af3e28fa28c4e24c1c573f3fe6b228b92ef5e475"
_INCLINED_PLANE = "1a4ffb230532d10979997b1a9f472dc4ab113d7a"
_FIXED = {
    "arrivals": "mix",
    "belt": "first_duration second_duration second_speed",
    "board": "placement_range",
    "catch": (
        "follow_tolerance hand_acceleration hand_speed home_duration manual_speed raise_duration "
        "raised_height rest_time rim_height settle_tolerance shortest_motion stop_duration trust_time "
    ),
    "dispatch": "exact_up_to",
    "estimator": (
        "drift encoder_std forget_after hit_speed process_noise sharp_bend_length sharp_bend_noise "
        "speed_noise turn_drift vertical_tracking_index "
    ),
    "grasp": (
        "abort_probability along_tolerance close_timeout grasp_height grip_force jaw_speed lateral_tolerance "
        "lift_duration manual_speed memory_radius retreat_duration silence std_tolerance stop_duration "
        "straight_length straight_tolerance "
    ),
    "guard": "clock_tolerance max_speed table_tolerance",
    "hand_eye": "keep largest_rate outlier time_constant",
    "operator": "placing_std",
    "pick": (
        "abort_probability carry_height close_timeout grasp_height grip_force hand_acceleration hand_speed "
        "hand_turn_speed jaw_speed lift_duration lower_duration manual_speed place_height place_timeout "
        "place_tolerance place_turn_tolerance_deg raise_duration release_duration release_gap "
        "retreat_duration shortest_motion stop_duration "
    ),
    "servo": "descent_tracking_index stale_after",
    "tray": "first_cell pitch wall_height",
    "vision": "bias_std centroid_height noise_std turn_bias_std_deg turn_noise_std_deg",
    "vision.detector": "denominator_floor difference_gate smoothing_sigma threshold_window_s",
    "changes.estimator": "sharp_bend_length sharp_bend_noise speed_noise",
    "detector": "denominator_floor difference_gate smoothing_sigma threshold_window_s",
    "vision.parts": (
        "body_share largest_misfit learning_rate lost_after noise_factor shadow_darkest shadow_lightest shadow_spread "
    ),
}
"""{part of a scenario: its settings that are constants today}"""
RENAMES = (
    *(Rename(_CONSTANTS, "gone", None, f"{part}.{name}") for part, names in _FIXED.items() for name in names.split()),
    Rename(_CONSTANTS, "gone", None, "eligibility"),
    Rename(_INCLINED_PLANE, "tag", "InclinedPlane", "Slope"),
    Rename(_METHODS, "setting", "vision.method.detector", "vision.detector"),
    Rename(_METHODS, "setting", "vision.method", "vision.tracker"),
    Rename(_METHODS, "tag", "MotionCentroid", "Single"),
    Rename(_METHODS, "tag", "SilhouetteTracker", "Several"),
    Rename(_METHODS, "tag", "OneObject", "Single"),
    Rename(_METHODS, "tag", "SeveralObjects", "Several"),
    *(Rename(_METHODS, "gone", None, name) for name in ("vision.detector", "vision.tracker")),
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
        self._gone = tuple(row.before for rows in commits for row in rows if row.kind == "gone")
        self._removed = {
            (_family(row.kind), self._earlier(row.kind, row.before, number + 1))
            for number, rows in enumerate(commits)
            for row in rows
            if row.now is None and row.kind != "gone"
        }

    def before(self, kind: str, name: str) -> str | None:
        """Returns a name of the working tree as it was at the older revision, None if there was none."""
        return self._earlier(kind, name, 0)

    def kept(self, kind: str, name: str) -> str | None:
        """Returns a name of the older revision, None if a later commit removed what it names."""
        return None if any((_family(kind), head) in self._removed for head, _ in _heads(name)) else name

    def may_be_missing(self, name: str) -> bool:
        """Returns whether a setting of the older revision had no effect where today's scenarios lack it."""
        return any(head in self._gone for head, _ in _heads(name))

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
