"""What the belt's encoder has measured lately."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from drake_tracker.core.frozen_state import FrozenState, read_only
from drake_tracker.estimation.belt import Travel

KEPT = 1.0
"""Time for which readings are kept [s]."""
SLOPE = 0.05
"""Time over which the present speed is measured [s]."""
FASTEST = 2.0
"""Speed [m/s] above which a reading cannot be right."""


@dataclass(frozen=True, eq=False)
class EncoderHistory(FrozenState):
    """Readings of an encoder.

    Attributes:
        readings: rows time [s], distance [m], in order of time, shape (n, 2), read-only.
    """

    readings: np.ndarray = field(default_factory=lambda: read_only(np.zeros((0, 2))))

    def extended(self, reading: Any) -> "EncoderHistory":
        """Returns the history with a new reading. One that cannot be right is not used.

        Args:
            reading: an `EncoderReading`.
        """
        row = np.array([reading.time, reading.distance])
        if not reading.valid or not np.isfinite(row).all():
            return self
        if len(self.readings):
            dt, distance = row - self.readings[-1]
            if dt <= 0.0 or abs(distance) > FASTEST * dt:
                return self
        kept = self.readings[self.readings[:, 0] >= reading.time - KEPT]
        return EncoderHistory(read_only(np.vstack([kept, row])))

    def travel(self, start: float, end: float) -> Travel | None:
        """Returns how far the belt moved between two times, and its speed at the second one; None without readings.

        Args:
            start: time [s].
            end: time, not before ``start`` [s].
        """
        times, distances = self.readings.T
        if len(times) < 2 or start < times[0]:
            return None
        at = np.interp([start, end, end - SLOPE], times, distances)
        return Travel(float(at[1] - at[0]), float((at[1] - at[2]) / min(SLOPE, max(end - times[0], 1e-3))))
