"""The recent readings of the belt's encoder."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from drake_tracker.core.frozen_state import FrozenState, read_only
from drake_tracker.estimation.belt import Travel

KEPT = 1.0
"""Time for which readings are kept [s]."""
SLOPE = 0.05
"""Time over which the present speed is measured [s]."""
FASTEST = 1.2
"""Speed between two readings [m/s] above which the encoder has jumped: three times that of the fastest belt."""
SILENT = 0.1
"""Time without a reading from which on the encoder counts as silent [s]."""
SPAN = 0.4
"""Time over which the travel of the parts is compared with that of the encoder [s]."""
TOLERANCE = 0.008
"""Largest difference between them [m]; the noise of vision is below 2 mm."""
LASTS = 1.0
"""Time for which the encoder is not used after a disagreement [s]."""


@dataclass(frozen=True, eq=False)
class EncoderHistory(FrozenState):
    """Readings of an encoder.

    Attributes:
        readings: rows time [s], distance [m], in order of time, shape (n, 2), read-only.
    """

    readings: np.ndarray = field(default_factory=lambda: read_only(np.zeros((0, 2))))

    def extended(self, reading: Any) -> "EncoderHistory":
        """Returns the history with a new reading. A reading that is not a number, or not newer, is not used.

        After a jump the history begins anew with the reading, because the distance travelled meanwhile is unknown.

        Args:
            reading: an `EncoderReading`.
        """
        row = np.array([reading.time, reading.distance])
        if not reading.valid or not np.isfinite(row).all():
            return self
        if len(self.readings):
            dt, distance = row - self.readings[-1]
            if dt <= 0.0:
                return self
            if abs(distance) > FASTEST * dt:
                return EncoderHistory(read_only(row[None]))
        kept = self.readings[self.readings[:, 0] >= reading.time - KEPT]
        return EncoderHistory(read_only(np.vstack([kept, row])))

    def travel(self, start: float, end: float) -> Travel | None:
        """Returns how far the belt moved between two times, and its speed at the second one.

        None without readings of both times: the encoder is silent, or has jumped since the first.

        Args:
            start: time [s].
            end: time, not before ``start`` [s].
        """
        times, distances = self.readings.T
        if len(times) < 2 or start < times[0] or end > times[-1] + SILENT:
            return None
        at = np.interp([start, end, end - SLOPE], times, distances)
        return Travel(float(at[1] - at[0]), float((at[1] - at[2]) / min(SLOPE, max(end - times[0], 1e-3))))


@dataclass(frozen=True, eq=False)
class EncoderCheck(FrozenState):
    """Whether encoder and vision agree.

    A part may slip, or be moved by the hand. The encoder is wrong only when all parts contradict it.

    Attributes:
        seen: of the last images: stamp [s] and {number of a part: its place along the belt [m]}.
        doubted_until: time up to which the encoder is not used [s].
    """

    seen: tuple[tuple[float, Mapping[int, float]], ...] = ()
    doubted_until: float = float("-inf")

    def after(self, stamp: float, places: Mapping[int, float], encoder: EncoderHistory) -> "EncoderCheck":
        """Returns the check after an image.

        Args:
            stamp: of the image [s].
            places: {number of a part that lies on the belt: its place along the belt [m]}.
            encoder: readings of the encoder up to the present.
        """
        if self.seen and stamp <= self.seen[-1][0]:
            return self
        old = [each for each in self.seen if each[0] <= stamp - SPAN][-1:]
        recent = tuple(each for each in self.seen if each[0] > stamp - SPAN)
        until = self.doubted_until
        if old:
            then, before = old[0]
            travel = encoder.travel(then, stamp)
            moved = [places[number] - before[number] for number in places.keys() & before.keys()]
            if travel is not None and moved and min(abs(each - travel.distance) for each in moved) > TOLERANCE:
                until = stamp + LASTS
        return EncoderCheck((*old, *recent, (stamp, dict(places))), until)
