"""Checks the values of a summary, which may be damaged or made up, before a page shows them."""

import math
from collections.abc import Callable, Mapping
from typing import Any

from drake_tracker.report.summary_table import SHARED_ROWS
from drake_tracker.tasks.task import Task

LARGEST = 1e12
"""Largest number that a page shows."""
LONGEST = 10_000
"""Largest number of characters of a text."""


def sound_summary(summary: Mapping[str, Any], task: Task) -> tuple[dict[str, Any], list[str]]:
    """Returns (the summary without wrong values, names of the wrong values).

    Values that the page does not show are not checked.

    Args:
        summary: of a run.
        task: of the run.
    """
    numbers = dict.fromkeys((key for key, *_ in (*task.summary_rows, *SHARED_ROWS)), is_number)
    kinds = {**numbers, **_KINDS}
    wrong = [key for key, is_right in kinds.items() if summary.get(key) is not None and not is_right(summary[key])]
    return {key: value for key, value in summary.items() if key not in wrong}, wrong


def is_number(value: Any) -> bool:
    """Returns whether a value is a number, finite and of a size that can be shown."""
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) <= LARGEST


def _are_counts(value: Any) -> bool:
    return isinstance(value, dict) and all(is_number(each) for each in value.values())


def _is_text(value: Any) -> bool:
    return isinstance(value, str) and 0 < len(value) <= LONGEST


def _is_lag(value: Any) -> bool:
    return isinstance(value, dict) and all(each is None or is_number(each) for each in value.values())


def _are_versions(value: Any) -> bool:
    return isinstance(value, dict) and all(each is None or _is_text(each) for each in (*value, *value.values()))


def _has_sentences(value: Any) -> bool:
    if not isinstance(value, dict):
        return False
    sentences = value.get("sentences", [])
    return isinstance(sentences, list) and all(_is_text(each) for each in sentences)


_KINDS: dict[str, Callable[[Any], bool]] = {
    "scenario": _is_text,
    "seed": lambda value: _is_text(value) or (is_number(value) and math.floor(value) == value),
    "success": lambda value: isinstance(value, bool),
    "failure_reason": _is_text,
    "lag_s": _is_lag,
    "packets_rejected_for": _are_counts,
    "tracking": _has_sentences,
    "lost_parts": _has_sentences,
    "package_versions": _are_versions,
}
"""{key: returns whether a value is of the right kind}."""
