"""The autopsy in words: a sentence for each attempt, and one for the run."""

from drake_tracker.report.autopsy.normal import NORMAL_ATTEMPT
from drake_tracker.report.autopsy.stages import MEANINGS, WORDS
from drake_tracker.tasks.train.closing import clearance

_BY_WORD = {word: stage for stage, word in WORDS.items()}
_NEXT_FROM = 0.005
"""A stage after the first is mentioned when it contributed this much [m]."""


def tell_attempt(scenario, attempt):
    """Returns the sentence on an attempt, a dict as in `autopsy.perform`."""
    start = f"Attempt {attempt['number']} at {attempt['launch_s']:.1f} s"
    outcome = attempt["outcome"]
    where = f": when the jaws closed the hand was {_place(attempt['offset'])}" if "offset" in attempt else ""
    if outcome == "lifted":
        return f"{start} lifted the train{where}."
    if outcome == "dropped":
        return f"{start} gripped the train and lost it, {_mm(attempt['lifted_m'])} up at most{where}.{_most(attempt)}"
    if outcome == "ended":
        return f"{start} was under way when the run ended."
    room = f" ({_mm(clearance(scenario))} across fit)" if where else ""
    return f"{start} missed{where}{room}.{_most(attempt)}"


def tell_run(culprit, found, broken, attempts):
    """Returns the sentence on a run in which the train was not lifted.

    Args:
      culprit: a `Stage` or None. found: excess (7,) [m]. broken: the `Stage` from which nothing ever came, or None.
      attempts: dicts.
    """
    if broken is not None:
        return f"Nothing of use ever came out of {WORDS[broken]}."
    what = "The train was not lifted" if attempts else "The hand was never sent down"
    if culprit is None:
        return f"{what}, and yet no stage did worse than in a run that goes well."
    size = f", {_mm(found[culprit])} beyond what is normal" if found[culprit] > 0.0 else ""
    return f"{what}. Most came from {WORDS[culprit]}{size}: {MEANINGS[culprit]}."


def _most(attempt):
    """Returns what contributed most to an attempt that failed, as a sentence with a blank before it."""
    if attempt["culprit"] is None:
        return " No stage did worse than in a run that goes well." if "size_m" in attempt else ""
    first = attempt["culprit"]
    size = attempt["size_m"]
    normal = NORMAL_ATTEMPT[_BY_WORD[first]]
    rest = sorted((word for word in size if word != first and size[word] >= _NEXT_FROM), key=lambda word: -size[word])
    much = f", {_mm(size[first])} where up to {_mm(normal)} is normal" if size[first] > normal else ""
    text = f" Most came from {first}{much}{_age(attempt, first)}"
    if rest:
        text += "; then " + ", ".join(f"{word} {_mm(size[word])}" for word in rest[:2])
    return text + "."


def _age(attempt, word):
    """Returns the milliseconds that belong to a stage, as an insertion."""
    age = attempt["ages_s"].get(word)
    if age is None:
        return ""
    ms = f"{1e3 * abs(age):.0f} ms"
    return {
        "vision": f" (what it rests on was {ms} old)",
        "filter": f" ({ms} {'behind' if age > 0 else 'ahead'})",
        "prediction": f" ({ms} ahead)",
        "link": f" ({ms} behind the newest)",
        "servo": f" ({ms} {'behind' if age > 0 else 'ahead'})",
        "grasp timing": f" ({ms} too {'late' if age > 0 else 'early'})",
    }.get(word, "")


def _place(offset):
    along, across, up, _ = offset
    return (
        f"{_mm(along)} {'ahead of' if along > 0 else 'behind'} the train, "
        f"{_mm(across)} to its {'left' if across > 0 else 'right'} and {_mm(up)} too {'high' if up > 0 else 'low'}"
    )


def _mm(length):
    return f"{1e3 * abs(length):.0f} mm"
