"""Trouble with the tracking of several objects, from the log of a run: for its summary, and in sentences.

All of it was reported by vision itself. No ground truth is used.
"""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from drake_tracker.core.constants import SIDES
from drake_tracker.core.log import Signal
from drake_tracker.core.messages import REGION_FIELDS, REGION_SLOTS, TRACK_FIELDS, TRACK_SLOTS, Regions, TrackPoints
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.tasks.episode import Log, PhaseSpan
from drake_tracker.tasks.tracks import fresh_tracks
from drake_tracker.tasks.train.episode import sighted
from drake_tracker.vision.camera_motion import Verdict
from drake_tracker.vision.silhouettes.target import REASONS, Reason

LONG_MERGED, LONG_WITHOUT_POINT = 1.0, 0.5
"""Times [s] from which a merged silhouette of the target, and a stretch without a point of it, are told."""
_VERDICTS = tuple(Verdict)
_NUMBER = TRACK_FIELDS.index("number")
_STAMP, _TARGET, _REASON, _OVERFLOW = (
    TrackPoints.get_fields().index(name) for name in ("stamp", "target", "reason", "overflow")
)
_UNUSABLE_WORDS = {
    "light": "the light changed",
    "both": "neither image could be aligned with the known scene, because the light changed, or because both cameras "
    "moved too far, or were blurred or covered",
    "left": "the left image could not be aligned with the known scene, because the camera moved too far, or was "
    "blurred or covered",
    "right": "the right image could not be aligned with the known scene, because the camera moved too far, or was "
    "blurred or covered",
}
"""{key of ``unusable_for``: the same in words}."""


def tracking_findings(log: Log, spans: Sequence[PhaseSpan]) -> dict[str, Any]:
    """Returns the trouble with the tracking of several objects.

    Times are stamps of images. Trouble with the target is counted while the arm uses vision; a lifted target may be
    lost. Measured vision has no images; entries about images are then None or empty.

    - ``most_tracks``: most objects tracked at a time.
    - ``overflow``: most regions and tracks without a slot at a time.
    - ``target_changes``: how often another track became the target. ``first_target_change``: {``time_s``, ``before``,
      ``after``}, with the numbers of the tracks, or None.
    - ``longest_without_point_s``: longest time without a point of the target, from the first point on; or from the
      start if there never was one. ``without_point``: {``start_s``, ``end_s``, ``reasons``} of this stretch, with {name
      of the `Reason`: share}, or None.
    - ``merged_s``, ``longest_merged_s``: time in which the silhouette of the target was divided in one of the images.
    - ``unusable_pairs``: number of pairs of images that could not be used. ``longest_unusable_s``: longest sequence.
      ``unusable_for``: {"light": pairs in which only the brightness had changed, "left" and "right": pairs in which
      only this image could not be aligned with the known scene, and "both": pairs in which neither could}. The last is
      also what happens when the light goes out.
    - ``cameras``: {"left" or "right": {``moved_at_s``, ``moved_s``, ``largest_displacement_px``, ``knocked_at_s``,
      ``displacement_px``, ``stays_displaced``}} of those that moved. The last three are of a camera that stayed at its
      new place for some time; otherwise None, None and False.

    Args:
        log: {name: Signal} of the run.
        spans: phases of the run.
    """
    messages = fresh_tracks(log)
    numbers = messages[:, -TRACK_SLOTS * len(TRACK_FIELDS) :].reshape(len(messages), TRACK_SLOTS, len(TRACK_FIELDS))[
        :, :, _NUMBER
    ]
    regions = {side: _fresh_regions(log.get(f"regions_{side}")) for side in SIDES}
    return {
        "most_tracks": int(np.max(np.count_nonzero(numbers > 0.0, axis=1), initial=0)),
        "overflow": int(np.max(messages[:, _OVERFLOW], initial=0.0)),
        **_target_changes(messages, spans),
        **_without_point(messages, spans),
        **_merged(messages, regions, spans),
        **_unusable(regions),
        "cameras": {side: found for side in SIDES if (found := _camera(regions[side])) is not None},
    }


def tell_tracking(findings: Mapping[str, Any]) -> list[str]:
    """Returns a sentence for each kind of trouble that occurred.

    Args:
        findings: the return value of `tracking_findings`.
    """
    told = [_tell_camera(side, found) for side, found in findings["cameras"].items()]
    if findings["unusable_pairs"]:
        words = [words for key, words in _UNUSABLE_WORDS.items() if key in findings["unusable_for"]]
        told.append(
            f"{_count(findings['unusable_pairs'], 'pair')} of images could not be used, for at most "
            f"{findings['longest_unusable_s']:.1f} s in a row: {'; '.join(words)}."
        )
    if findings["overflow"]:
        told.append(
            f"Up to {_count(findings['overflow'], 'region')} or tracks found no slot and were left out: there is room "
            f"for {REGION_SLOTS} regions of each image and {TRACK_SLOTS} tracks."
        )
    change = findings["first_target_change"]
    if change is not None:
        often = "once" if findings["target_changes"] == 1 else f"{findings['target_changes']} times, first"
        told.append(
            f"The target changed {often} at {change['time_s']:.1f} s, from object {change['before']} to object "
            f"{change['after']}."
        )
    if (findings["longest_merged_s"] or 0.0) >= LONG_MERGED:
        told.append(
            f"The silhouette of the target was merged with that of another object for {findings['merged_s']:.1f} s, "
            f"{findings['longest_merged_s']:.1f} s of them in a row."
        )
    gap = findings["without_point"]
    if gap is not None and findings["longest_without_point_s"] >= LONG_WITHOUT_POINT:
        reasons = "; ".join(f"{REASONS[Reason[name]]} ({share:.0%})" for name, share in gap["reasons"].items())
        told.append(f"There was no point of the target from {gap['start_s']:.1f} to {gap['end_s']:.1f} s: {reasons}.")
    return told


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"


def _tell_camera(side: str, found: Mapping[str, Any]) -> str:
    if found["knocked_at_s"] is None:
        return (
            f"The {side} camera moved by up to {found['largest_displacement_px']:.0f} px, first at "
            f"{found['moved_at_s']:.1f} s and for {found['moved_s']:.1f} s in all; its images were aligned."
        )
    where = f"The {side} camera was displaced by {found['displacement_px']:.0f} px at {found['knocked_at_s']:.1f} s"
    if found["stays_displaced"]:
        return f"{where} and stayed so: calibrate it again before you trust its points."
    return f"{where} for some time: check its calibration before you trust its points."


def _target_changes(messages: np.ndarray, spans: Sequence[PhaseSpan]) -> dict[str, Any]:
    known = messages[(messages[:, _TARGET] > 0.0) & sighted(spans, messages[:, _STAMP])]
    targets = known[:, _TARGET].astype(int)
    changes = np.nonzero(np.diff(targets))[0] + 1
    first = None
    if len(changes):
        k = changes[0]
        first = {"time_s": float(known[k, _STAMP]), "before": int(targets[k - 1]), "after": int(targets[k])}
    return {"target_changes": len(changes), "first_target_change": first}


def _without_point(messages: np.ndarray, spans: Sequence[PhaseSpan]) -> dict[str, Any]:
    stamps, reasons = messages[:, _STAMP], messages[:, _REASON]
    missing = (reasons != Reason.NONE) & sighted(spans, stamps)
    points = np.nonzero(reasons == Reason.NONE)[0]
    if len(points):
        missing[: points[0]] = False
    longest = _longest(stamps, missing)
    if longest is None:
        return {"longest_without_point_s": 0.0, "without_point": None}
    start, end = longest
    counts = Counter(int(reason) for reason in reasons[(stamps >= start) & (stamps <= end)])
    shares = {Reason(reason).name: count / counts.total() for reason, count in counts.most_common()}
    return {
        "longest_without_point_s": end - start + VISION_PERIOD,
        "without_point": {"start_s": start, "end_s": end, "reasons": shares},
    }


def _merged(messages: np.ndarray, regions: Mapping[str, np.ndarray], spans: Sequence[PhaseSpan]) -> dict[str, Any]:
    if not any(len(each) for each in regions.values()):
        return {"merged_s": None, "longest_merged_s": None}
    merged = np.zeros(len(messages), bool)
    track, shared = (REGION_FIELDS.index(name) for name in ("track", "shared"))
    targets = {round(float(row[_STAMP]), 6): (k, row[_TARGET]) for k, row in enumerate(messages)}
    for rows in regions.values():
        slots = rows[:, -REGION_SLOTS * len(REGION_FIELDS) :].reshape(len(rows), REGION_SLOTS, len(REGION_FIELDS))
        for row, found in zip(rows, slots):
            k, target = targets.get(round(float(row[0]), 6), (-1, 0.0))
            if target > 0.0 and ((found[:, track] == target) & (found[:, shared] > 0.0)).any():
                merged[k] = True
    merged &= sighted(spans, messages[:, _STAMP])
    return {
        "merged_s": float(VISION_PERIOD * np.count_nonzero(merged)),
        "longest_merged_s": _duration(_longest(messages[:, _STAMP], merged)),
    }


def _unusable(regions: Mapping[str, np.ndarray]) -> dict[str, Any]:
    left, right = (regions[side] for side in SIDES)
    count = min(len(left), len(right))
    if not count:
        return {"unusable_pairs": None, "longest_unusable_s": None, "unusable_for": {}}
    lost = _field(left, "usable")[:count] == 0.0
    blamed = Counter(_blamed(left[k], right[k]) for k in np.nonzero(lost)[0])
    return {
        "unusable_pairs": int(np.count_nonzero(lost)),
        "longest_unusable_s": _duration(_longest(_field(left, "stamp")[:count], lost)),
        "unusable_for": dict(blamed),
    }


def _camera(rows: np.ndarray) -> dict[str, Any] | None:
    """Returns the motion of one camera, None for a camera at rest."""
    verdicts = [_verdict(row) for row in rows]
    stamps, sizes = _field(rows, "stamp"), _field(rows, "displacement")
    moved = np.array([verdict in (Verdict.COMPENSATED, Verdict.DISPLACED) for verdict in verdicts], bool)
    if not moved.any():
        return None
    displaced = [k for k, verdict in enumerate(verdicts) if verdict is Verdict.DISPLACED]
    onset = None
    if displaced:
        still = [k for k in range(displaced[0]) if verdicts[k] is Verdict.STILL]
        onset = float(stamps[still[-1] + 1 if still else 0])
    known = [verdict for verdict in verdicts if verdict is not Verdict.UNUSABLE]
    return {
        "moved_at_s": float(stamps[moved][0]),
        "moved_s": float(VISION_PERIOD * np.count_nonzero(moved)),
        "largest_displacement_px": float(sizes[moved].max()),
        "knocked_at_s": onset,
        "displacement_px": float(sizes[displaced[-1]]) if displaced else None,
        "stays_displaced": known[-1] is Verdict.DISPLACED,
    }


def _blamed(left: np.ndarray, right: np.ndarray) -> str:
    """Returns the key of ``unusable_for`` for a pair of images that could not be used."""
    sides = [side for side, row in zip(SIDES, (left, right)) if _verdict(row) is Verdict.UNUSABLE]
    if not sides:
        return "light"
    return sides[0] if len(sides) == 1 else "both"


def _verdict(row: np.ndarray) -> Verdict:
    return _VERDICTS[int(Regions(row).camera)]


def _field(rows: np.ndarray, name: str) -> np.ndarray:
    return rows[:, Regions.get_fields().index(name)]


def _fresh_regions(signal: Signal | None) -> np.ndarray:
    """Returns the `Regions` vectors with a new stamp, shape (n, k); n is 0 without such a signal."""
    fields = Regions.get_fields()
    if signal is None or signal.names != tuple(fields):
        return np.zeros((0, len(fields)))
    data = signal.data[np.isfinite(signal.data).all(axis=1)]
    stamps, cameras = _field(data, "stamp"), _field(data, "camera")
    return data[(np.diff(stamps, prepend=0.0) > 0.0) & np.isin(cameras, range(len(_VERDICTS)))]


def _longest(stamps: np.ndarray, present: np.ndarray) -> tuple[float, float] | None:
    """Returns the first and the last stamp [s] of the longest sequence of images in which something is present.

    Args:
        stamps: of the images [s], increasing, shape (n,).
        present: whether it is present, shape (n,), bool.
    """
    return max(_sequences(stamps, present), key=lambda ends: ends[1] - ends[0], default=None)


def _sequences(stamps: np.ndarray, present: np.ndarray) -> Iterator[tuple[float, float]]:
    edges = np.nonzero(np.diff(np.concatenate([[False], present, [False]]).astype(int)))[0]
    for start, end in edges.reshape(-1, 2):
        yield float(stamps[start]), float(stamps[end - 1])


def _duration(ends: tuple[float, float] | None) -> float:
    return 0.0 if ends is None else ends[1] - ends[0] + VISION_PERIOD
