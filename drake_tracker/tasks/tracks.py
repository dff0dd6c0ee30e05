"""The tracks of several objects, for pictures and pages: their states in words, and their histories from a log."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from drake_tracker.core.log import Signal
from drake_tracker.core.messages import TRACK_FIELDS, TRACK_SLOTS, TrackPoints, TrackState, message_rows
from drake_tracker.vision.silhouettes.target import REASONS, Reason

TRACKS = "tracks"
"""Name of the signal with `TrackPoints` vectors, which only a run that tracks several objects has."""
STATE_WORDS = {
    TrackState.MOVING: "moving",
    TrackState.STANDING: "standing",
    TrackState.OCCLUDED: "covered",
    TrackState.NOT_OBSERVED: "not seen",
    TrackState.OUT_OF_VIEW: "outside of an image",
    TrackState.MERGED: "merged with another",
}
"""{state of a track: the same in words}."""
SEEN = (TrackState.MOVING, TrackState.STANDING)
"""States in which an object is seen."""
_NUMBER, _STATE, _X, _VX, _SIZE = (TRACK_FIELDS.index(name) for name in ("number", "state", "x", "vx", "size"))


class TrackRow(NamedTuple):
    """One track of a `TrackPoints` vector.

    Attributes:
        number: identity of the track.
        state: whether the object is seen.
        target: whether it is the target.
        p_WQ: position, shape (3,) [m].
        v_WQ: velocity, shape (3,) [m/s].
        size: largest dimension [m].
    """

    number: int
    state: TrackState
    target: bool
    p_WQ: np.ndarray
    v_WQ: np.ndarray
    size: float

    @property
    def seen(self) -> bool:
        """Whether the object is seen."""
        return self.state in SEEN


def track_rows(message: np.ndarray) -> list[TrackRow]:
    """Returns the tracks of a `TrackPoints` vector; a track whose number or state cannot be is left out."""
    target = TrackPoints(message).target
    rows = []
    for row in message_rows(np.asarray(message), TRACK_FIELDS):
        if np.isfinite(row).all() and row[_NUMBER] >= 1.0 and row[_STATE] in STATE_WORDS:
            number, state = int(row[_NUMBER]), TrackState(int(row[_STATE]))
            rows.append(
                TrackRow(number, state, bool(number == target), row[_X : _X + 3], row[_VX : _VX + 3], float(row[_SIZE]))
            )
    return rows


def reason_words(message: np.ndarray) -> str:
    """Returns why there is no point of the target in a `TrackPoints` vector, "" when there is one or no message yet."""
    header = TrackPoints(message)
    return REASONS.get(header.reason, "") if header.valid else ""


class LoggedTrack(NamedTuple):
    """The history of one track, from a log. There are n samples of it.

    Attributes:
        number: identity of the track.
        times: stamps, shape (n,) [s].
        xyz: positions where the object is seen, and predicted ones otherwise, shape (n, 3) [m].
        states: `TrackState` of each sample, shape (n,).
        size: largest dimension at the end [m].
        target_share: share of the samples in which it is the target.
    """

    number: int
    times: np.ndarray
    xyz: np.ndarray
    states: np.ndarray
    size: float
    target_share: float

    @property
    def seen(self) -> np.ndarray:
        """Whether the object is seen, for each sample, shape (n,)."""
        return np.isin(self.states, SEEN)


def logged_tracks(log: Mapping[str, Signal]) -> list[LoggedTrack]:
    """Returns the tracks of a log in the order of their numbers; an empty list for a log without the signal `TRACKS`.

    Args:
        log: {name: Signal} of a run.
    """
    messages = fresh_tracks(log)
    if not len(messages):
        return []
    slots = messages[:, -TRACK_SLOTS * len(TRACK_FIELDS) :].reshape(len(messages), TRACK_SLOTS, len(TRACK_FIELDS))
    numbers = slots[:, :, _NUMBER]
    stamps, targets = (messages[:, TrackPoints.get_fields().index(name)] for name in ("stamp", "target"))
    tracks = []
    for number in np.unique(numbers[numbers >= 1.0]):
        samples, places = np.nonzero(numbers == number)
        rows = slots[samples, places]
        tracks.append(
            LoggedTrack(
                int(number),
                stamps[samples],
                rows[:, _X : _X + 3],
                rows[:, _STATE].astype(int),
                float(rows[-1, _SIZE]),
                float(np.mean(targets[samples] == number)),
            )
        )
    return tracks


def reason_shares(
    log: Mapping[str, Signal], counts: Callable[[np.ndarray], np.ndarray] | None = None
) -> dict[Reason, float]:
    """Returns {reason why there is no point of the target: share of the cycles}, the most frequent reason first.

    `Reason.NONE`, the share of the cycles with a point, is left out. The dict is empty for a log without the signal
    `TRACKS`.

    Args:
        log: {name: Signal} of a run.
        counts: returns which cycles count, shape (n,), for their stamps [s], shape (n,); None: all count.
    """
    messages = fresh_tracks(log)
    stamps, reasons = (messages[:, TrackPoints.get_fields().index(name)] for name in ("stamp", "reason"))
    if counts is not None:
        reasons = reasons[counts(stamps)]
    numbers = {reason: np.count_nonzero(reasons == reason) for reason in Reason if reason != Reason.NONE}
    found = sorted((reason for reason, number in numbers.items() if number), key=lambda reason: -numbers[reason])
    return {reason: numbers[reason] / len(reasons) for reason in found}


def tell_reasons(shares: Mapping[Reason, float]) -> str:
    """Returns the most frequent reason why there was no point of the target, as a clause; "" without any reason.

    Args:
        shares: the return value of `reason_shares`.
    """
    if not shares:
        return ""
    reason, share = next(iter(shares.items()))
    return f"the most frequent reason: {REASONS[reason]} ({share:.0%})"


def fresh_tracks(log: Mapping[str, Signal]) -> np.ndarray:
    """Returns the `TrackPoints` vectors of a log with a new stamp, shape (n, k); n is 0 without the signal."""
    fields = TrackPoints.get_fields()
    signal = log.get(TRACKS)
    if signal is None or not set(signal.names) <= set(fields):
        return np.zeros((0, len(fields)))
    # Older logs do not have all fields of today's tracks.
    data = np.zeros((len(signal.data), len(fields)))
    data[:, [fields.index(name) for name in signal.names]] = signal.data
    data = data[np.isfinite(data).all(axis=1)]
    data = data[data[:, fields.index("valid")] > 0.0]
    stamps = data[:, fields.index("stamp")]
    return data[np.diff(stamps, prepend=-np.inf) > 0.0]
