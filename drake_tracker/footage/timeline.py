"""One clock for one camera or two, and the images of each in its ticks."""

from dataclasses import dataclass

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.footage.frame_clock import FrameClock, fit_clock
from drake_tracker.footage.frame_sequence import FrameSequence

MOST_RATE_DIFFERENCE = 0.005
"""Share by which the frame rates of two cameras may differ and still be the same."""
MOST_END_DIFFERENCE = 2
"""Ticks by which one of two videos may be longer."""
MOST_STAMP_DIFFERENCE = 0.75
"""Part of a tick by which the stamps of two images of one tick may differ: half of one between cameras that nothing
synchronises, and jitter."""


@dataclass(frozen=True, eq=False)
class Timeline:
    """The ticks of all cameras: their period [s], how many there are (None: until somebody stops), and the
    `FrameSequence` of each camera.
    """

    period: float
    count: int | None
    sequences: tuple

    @property
    def duration(self):
        """Time that the ticks take [s], infinite for live cameras."""
        return float("inf") if self.count is None else self.count * self.period


def align(footage, *, offset=0.0, duration=None):
    """Returns the `Timeline` of one or two `Footage`.

    Stamps are 0 at the first image of the first camera. Two cameras whose times are of one clock (live cameras, a bag,
    images named by the time since 1970, images counted through the same numbers) keep them. Else both recordings are
    taken to begin at the same instant, or the second ``offset`` [s] later.

    Args:
        duration: no more than this is used [s].

    Raises DrakeTrackerError, one line, when one of two is live and the other is not, when their frame rates or, of
    recordings with clocks of their own, their lengths differ, or when they have no time in common.
    """
    first, others = footage[0], footage[1:]
    if len({each.live for each in footage}) > 1:
        raise DrakeTrackerError(f"{footage[0].name} and {footage[1].name}: one is live and the other is not")
    clocks = [FrameClock(1.0 / each.rate) if each.live else fit_clock(each.times, each.name) for each in footage]
    period, start = clocks[0].period, clocks[0].start
    sequences = [FrameSequence(first, clocks[0])]
    ends = [_last_tick(first, clocks[0])]
    for other, clock in zip(others, clocks[1:]):
        if abs(clock.period / period - 1.0) > MOST_RATE_DIFFERENCE:
            raise DrakeTrackerError(
                f"{first.name} has {1.0 / period:.2f} images a second, {other.name} has {1.0 / clock.period:.2f}; "
                "both cameras must have the same rate"
            )
        clock = FrameClock(period, clock.start)
        shared = _share_a_clock(first, other)
        lag = offset + (other.epoch - first.epoch + clock.start - start if shared else 0.0)
        shift = round(lag / period)
        sequences.append(FrameSequence(other, clock, shift, clock.start - lag))
        if not other.live:
            ends.append(_last_tick(other, clock) + shift)
            _check_common(first, other, ends, shift, period, shared, duration)
    count = None if first.live else min(ends) + 1
    if duration is not None:
        limit = max(1, round(duration / period))
        count = limit if count is None else min(count, limit)
    return Timeline(period, count, tuple(sequences))


def _share_a_clock(first, other):
    if first.epoch is None or other.epoch is None or first.counted != other.counted:
        return False
    if not first.counted:
        return True
    ends = [each.epoch + each.times[-1] for each in (first, other)]
    return max(first.epoch, other.epoch) < min(ends)


def _last_tick(footage, clock):
    return None if footage.live else round((footage.times[-1] - clock.start) / clock.period)


def _check_common(first, other, ends, shift, period, shared, duration):
    """Raises DrakeTrackerError when two recordings do not cover one time."""
    if shift > ends[0] or ends[-1] < 0:
        raise DrakeTrackerError(f"{first.name} and {other.name} have no time in common; their clocks differ")
    enough = duration is not None and min(ends[0], ends[-1]) + 1 >= round(duration / period)
    if not shared and not enough and abs(ends[0] - ends[-1]) > MOST_END_DIFFERENCE:
        lengths = [(end + 1) * period for end in (ends[0], ends[-1])]
        raise DrakeTrackerError(
            f"{first.name} lasts {lengths[0]:.2f} s and {other.name} ends after {lengths[1]:.2f} s; both must be of "
            f"one moment and one length, or say how much of both to use: --duration {int(100 * min(lengths)) / 100:g}"
        )
