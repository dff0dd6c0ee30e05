"""The autopsy in words: a sentence for each attempt, and one for the run."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from drake_tracker.report.failure_diagnosis.stages import MEANINGS, NORMAL_ATTEMPT, WORDS, Stage
from drake_tracker.tasks.tracks import tell_reasons
from drake_tracker.tasks.train.closing import clearance
from drake_tracker.tasks.train.setup import TrainSetup
from drake_tracker.vision.silhouettes.target import Reason

_BY_WORD = {word: stage for stage, word in WORDS.items()}
_ARTICLES = {WORDS[stage]: "the " for stage in (Stage.FILTER, Stage.LINK, Stage.SERVO)}
_WORTH_MENTIONING = 0.005
"""Contribution [m] from which a stage after the first is mentioned."""
_WORTH_TELLING = 0.1
"""Share of the cycles without a point from which they are mentioned."""


def tell_attempt(setup: TrainSetup, attempt: Mapping[str, Any]) -> str:
    """Returns the sentence on an attempt.

    Args:
        setup: the resolved scenario of the run.
        attempt: dict of `diagnosis.perform`.
    """
    start = f"Attempt {attempt['number']} at {attempt['launch_s']:.1f} s"
    outcome = attempt["outcome"]
    where = f": when the jaws closed, the hand was {_place(attempt['offset'])}" if "offset" in attempt else ""
    if outcome == "lifted":
        return f"{start} lifted the train{where}."
    if outcome == "dropped":
        return f"{start} gripped the train and lost it, at most {_mm(attempt['lifted_m'])} up{where}.{_cause(attempt)}"
    if outcome == "ended":
        return f"{start} was not finished when the run ended."
    tolerance = f" (the tolerance across is {_mm(clearance(setup))})" if where else ""
    return f"{start} missed{where}{tolerance}.{_cause(attempt)}"


def tell_run(
    culprit: Stage | None, found: np.ndarray, broken: Stage | None, attempts: Sequence[Mapping[str, Any]]
) -> str:
    """Returns the sentence on a run in which the train was not lifted.

    Args:
        culprit: the stage that caused it, or None.
        found: excess of each stage, shape (7,) [m].
        broken: the stage that never produced valid output, or None.
        attempts: dicts of `diagnosis.perform`.
    """
    if broken is not None:
        name = _named(WORDS[broken])
        return f"{name[0].upper()}{name[1:]} never produced valid output."
    what = "The train was not lifted" if attempts else "The hand was never sent down"
    if culprit is None:
        return f"{what}, although no stage did worse than in a successful run."
    size = f", {_mm(found[culprit])} more than normal" if found[culprit] > 0.0 else ""
    return f"{what}. The main cause was {_named(WORDS[culprit])}{size}: {MEANINGS[culprit]}."


def tell_unseen(shares: Mapping[Reason, float]) -> str:
    """Returns a space and the sentence on the cycles without a point of the target, "" when they are few.

    Args:
        shares: {reason: share of the cycles in which the arm used vision}, where vision tracked several objects.
    """
    missing = sum(shares.values())
    if missing < _WORTH_TELLING:
        return ""
    return f" While the arm used vision, there was no point in {missing:.0%} of the cycles; {tell_reasons(shares)}."


def _cause(attempt: Mapping[str, Any]) -> str:
    """Returns the main contributions to a failed attempt, as a sentence after a space."""
    if attempt["culprit"] is None:
        return " No stage did worse than in a successful run." if "size_m" in attempt else ""
    first = attempt["culprit"]
    size = attempt["size_m"]
    normal = NORMAL_ATTEMPT[_BY_WORD[first]]
    rest = sorted(
        (word for word in size if word != first and size[word] >= _WORTH_MENTIONING), key=lambda word: -size[word]
    )
    much = f" with {_mm(size[first])}, where up to {_mm(normal)} is normal" if size[first] > normal else ""
    text = f" The main cause was {_named(first)}{much}{_age(attempt, first)}"
    if rest:
        text += "; next came " + " and ".join(f"{_named(word)} with {_mm(size[word])}" for word in rest[:2])
    return text + "."


def _age(attempt: Mapping[str, Any], word: str) -> str:
    """Returns the time that belongs to a stage, in brackets after a space."""
    age = attempt["ages_s"].get(word)
    if age is None:
        return ""
    ms = f"{1e3 * abs(age):.0f} ms"
    return {
        "vision": f" (its newest image was {ms} old)",
        "filter": f" ({ms} {'behind' if age > 0 else 'ahead'})",
        "prediction": f" ({ms} ahead)",
        "link": f" ({ms} behind the host's newest prediction)",
        "servo": f" ({ms} {'behind' if age > 0 else 'ahead'})",
        "grasp timing": f" ({ms} too {'late' if age > 0 else 'early'})",
    }.get(word, "")


def _named(word: str) -> str:
    """Returns the name of a stage with its article, if it takes one."""
    return f"{_ARTICLES.get(word, '')}{word}"


def _place(offset: Sequence[float]) -> str:
    along, across, up, _ = offset
    return (
        f"{_mm(along)} {'ahead of' if along > 0 else 'behind'} the train, "
        f"{_mm(across)} to its {'left' if across > 0 else 'right'} and {_mm(up)} too {'high' if up > 0 else 'low'}"
    )


def _mm(length: float) -> str:
    return f"{1e3 * abs(length):.0f} mm"
