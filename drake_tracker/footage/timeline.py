"""One clock for one or two cameras, and the image of each camera at each tick."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.footage.footage import Footage
from drake_tracker.footage.frame_clock import FrameClock, fit_clock
from drake_tracker.footage.frame_sequence import FrameSequence
from drake_tracker.footage.variable_rate import even_out

MOST_RATE_DIFFERENCE = 0.005
"""Largest relative difference between frame rates that count as the same."""
MOST_END_DIFFERENCE = 2
"""Largest difference between the lengths of two videos [ticks]."""
MOST_STAMP_DIFFERENCE = 0.75
"""Largest difference between the stamps of two images of one tick, as a fraction of the period: half a period between
unsynchronised cameras, and jitter."""


@dataclass(frozen=True, eq=False)
class Timeline:
    """The ticks of all cameras.

    Attributes:
        period: from tick to tick [s].
        count: number of ticks; None without an end.
        sequences: `FrameSequence` of each camera.
        notes: one line for each recording whose rate varies.
    """

    period: float
    count: int | None
    sequences: tuple[FrameSequence, ...]
    notes: tuple[str, ...] = ()

    @property
    def duration(self) -> float:
        """Duration of all ticks [s], infinite for live cameras."""
        return float("inf") if self.count is None else self.count * self.period


def align(footage: Sequence[Footage], *, offset: float = 0.0, duration: float | None = None) -> Timeline:
    """Returns the `Timeline` of the footage of one or two cameras.

    Stamps are 0 at the first image of the first camera. Two cameras that share a clock (live cameras, a bag, images
    named by the time since 1970, images with overlapping numbers) keep its times. Otherwise both recordings are assumed
    to begin at the same instant.

    Args:
        footage: of one or two cameras.
        offset: time by which the second recording begins later [s].
        duration: largest duration used [s]; None uses all of it.

    Raises DrakeTrackerError, one line, when only one of two is live, when their frame rates differ, when recordings
    without a shared clock or an offset differ in length, or when they have no time in common.
    """
    if len({each.live for each in footage}) > 1:
        raise DrakeTrackerError(f"{footage[0].name} and {footage[1].name}: one is live and the other is not")
    clocks = [_clock(each) for each in footage]
    for other, clock in zip(footage[1:], clocks[1:]):
        if abs(clock.period / clocks[0].period - 1.0) > MOST_RATE_DIFFERENCE:
            raise DrakeTrackerError(
                f"{footage[0].name} has {1.0 / clocks[0].period:.2f} images per second, {other.name} has "
                f"{1.0 / clock.period:.2f}; both cameras must have the same rate"
            )
    begins = [_begin(each, clock) for each, clock in zip(footage, clocks)]
    footage, clocks, notes = even_out(footage, clocks)
    first, period = footage[0], clocks[0].period
    sequences = [FrameSequence(first, clocks[0], zero=begins[0])]
    ends = [] if first.live else [_last_tick(first, clocks[0])]
    for other, clock, begin in zip(footage[1:], clocks[1:], begins[1:]):
        clock = FrameClock(period, clock.start)
        shared = share_a_clock(first, other)
        lag = offset + (_epoch(other) - _epoch(first) + begin - begins[0] if shared else 0.0)
        shift = round((lag + (clock.start - begin) - (clocks[0].start - begins[0])) / period)
        sequences.append(FrameSequence(other, clock, shift, begin - lag))
        if not other.live:
            ends.append(_last_tick(other, clock) + shift)
            _check_common(first, other, ends, shift, period, shared or offset != 0.0, duration)
    count = None if first.live else min(ends) + 1
    if duration is not None:
        limit = max(1, round(duration / period))
        count = limit if count is None else min(count, limit)
    return Timeline(period, count, tuple(sequences), tuple(notes))


def _clock(footage: Footage) -> FrameClock:
    if footage.rate is not None:  # live, or the recording of a live camera
        return FrameClock(1.0 / footage.rate)
    assert footage.times is not None  # it is not live
    return fit_clock(footage.times, footage.name)


def _begin(footage: Footage, clock: FrameClock) -> float:
    """Returns the time of the first image [s], or of the first tick of a live camera or its recording."""
    return clock.start if footage.times is None or footage.rate is not None else float(footage.times[0])


def _epoch(footage: Footage) -> float:
    return footage.epoch or 0.0


def share_a_clock(first: Footage, other: Footage) -> bool:
    """Returns whether the stamps of two cameras come from one clock."""
    if first.epoch is None or other.epoch is None or first.counted != other.counted:
        return False
    if not first.counted:
        return True
    ends = [_epoch(each) + _last_time(each) for each in (first, other)]
    return max(first.epoch, other.epoch) < min(ends)


def _last_time(footage: Footage) -> float:
    return np.inf if footage.times is None else footage.times[-1]


def _last_tick(footage: Footage, clock: FrameClock) -> int:
    return round((_last_time(footage) - clock.start) / clock.period)


def _check_common(
    first: Footage,
    other: Footage,
    ends: Sequence[int],
    shift: int,
    period: float,
    related: bool,
    duration: float | None,
) -> None:
    """Raises DrakeTrackerError when two recordings do not cover the same time.

    Recordings whose relation is not known, from a clock or an offset that was given, must have the same length.
    """
    if shift > ends[0] or ends[-1] < 0:
        raise DrakeTrackerError(f"{first.name} and {other.name} have no time in common; their clocks differ")
    enough = duration is not None and min(ends[0], ends[-1]) + 1 >= round(duration / period)
    if not related and not enough and abs(ends[0] - ends[-1]) > MOST_END_DIFFERENCE:
        lengths = [(end + 1) * period for end in (ends[0], ends[-1])]
        raise DrakeTrackerError(
            f"{first.name} lasts {lengths[0]:.2f} s and {other.name} ends after {lengths[1]:.2f} s; both must show the "
            "same moment and have the same length; if they do not, set how much of both to use: "
            f"--duration {int(100 * min(lengths)) / 100:g}"
        )
