"""Which cameras the points of the target came from, and why the camera on the hand had none, from the log of a run."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from drake_tracker.grasp.train.schema import Phase
from drake_tracker.tasks.episode import Log, PhaseSpan, during
from drake_tracker.vision.hand.wrist_measurement import WristReason

SOURCES = ("none", "fixed", "wrist", "both")
"""Words for `WristPoint.source`, in its order."""


def wrist_findings(log: Log, spans: Sequence[PhaseSpan]) -> dict[str, Any]:
    """Returns what the summary of a run says about the camera on the hand. No ground truth is used.

    Times are stamps of images, while vision had a target or looked for one.

    - ``hover``, ``descent``: {word of `SOURCES`: share of the points}, while the hand follows the object at hover
      height, and from the launch until the jaws hold. None without an image.
    - ``reasons``: {name of the `WristReason`: share} over both.

    Args:
        log: {name: Signal} of the run.
        spans: phases of the run.
    """
    signal = log["wrist"]
    stamps = signal["stamp"]
    fresh = np.diff(stamps, prepend=0.0) > 0.0
    rows, stamps = signal.view("reason", "source")[fresh].astype(int), stamps[fresh]
    hover = during(spans, stamps, Phase.TRACK)
    descent = during(spans, stamps, Phase.INTERCEPT, Phase.CLOSE)
    return {
        "hover": _shares(rows[hover, 1], SOURCES),
        "descent": _shares(rows[descent, 1], SOURCES),
        "reasons": _shares(rows[hover | descent, 0], tuple(reason.name for reason in WristReason)),
    }


def _shares(numbers: np.ndarray, words: Sequence[str]) -> dict[str, float] | None:
    """Returns {word: share} of those numbers that occur, which are indices into the words; None without numbers."""
    if len(numbers) == 0:
        return None
    return {word: float(np.mean(numbers == k)) for k, word in enumerate(words) if (numbers == k).any()}
