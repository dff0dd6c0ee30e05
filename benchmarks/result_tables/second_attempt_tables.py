"""The faults with which `second_attempts.py` provokes a miss, and the table of its results."""

from collections.abc import Callable
from dataclasses import dataclass

from shared.common import share


@dataclass(frozen=True)
class Provocation:
    """A fault during the first descent.

    Attributes:
        what: in words.
        tag: YAML tag with its settings, as a function of the time at which the descent begins [s].
    """

    what: str
    tag: Callable[[float], str]


PROVOCATIONS = {
    "slow-jaws": Provocation(
        "the jaws close at 20 mm/s", lambda start: f"!SlowGripper {{speed: 0.02, at: {start:.3f}, for: 1.2}}"
    ),
    "push": Provocation(
        "a push of 2 N for 0.2 s along the train",
        lambda start: f"!TrainPushed {{force: 2.0, at: {start:.3f}, for: 0.2}}",
    ),
    "stop": Provocation(
        "the train stops for 1.5 s, from 0.2 s before it",
        lambda start: f"!TrainStopped {{at: {start - 0.2:.3f}, for: 1.5}}",
    ),
}


def counts(row):
    """Returns whether a run has a second attempt to count: the first missed and left the train on its track."""
    return bool(row["missed"] and row["on_track"])


def lifted_at_second(row):
    """Returns whether the second attempt lifted the train."""
    return bool(row["success"] and row["attempts"] == 2)


def describe(row):
    """Returns the outcome of a run as a text."""
    said = f"{row['provocation']} seed {row['seed']}: "
    if not row["missed"]:
        return said + row.get("reason", "the first attempt lifted the train all the same")
    if not row["on_track"]:
        return said + "the train left its track"
    return said + (f"lifted at attempt {row['attempts']}" if row["success"] else f"{row['failure_reason']}")


def second_attempts_table(rows):
    """Returns (header, rows) of a table with one row for each provocation, and one for all."""
    lines = [
        [PROVOCATIONS[name].what, *_counts([row for row in rows if row["provocation"] == name])]
        for name in PROVOCATIONS
        if any(row["provocation"] == name for row in rows)
    ]
    lines.append(["all", *_counts(rows)])
    header = ["during the first descent", "runs", "first attempt missed", "train left on its track"]
    return [*header, "lifted at the second attempt", "Wilson 95 %", "lifted later"], lines


def _counts(rows):
    missed = [row for row in rows if row["missed"]]
    again = [row for row in missed if counts(row)]
    second = sum(map(lifted_at_second, again))
    later = sum(bool(row["success"]) for row in again) - second
    return [len(rows), len(missed), len(again), *(share(second, len(again)) if again else ("", "")), later]
