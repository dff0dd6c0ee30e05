"""Compares the encoder with what vision sees of the parts."""

from collections.abc import Mapping
from dataclasses import dataclass

from drake_tracker.core.frozen_state import FrozenState
from drake_tracker.dispatch.encoder_history import EncoderHistory

SPAN = 0.4
"""Time over which the travel of the parts is compared with that of the encoder [s]."""
TOLERANCE = 0.008
"""Largest difference between them [m]; the noise of vision is below 2 mm."""
LASTS = 1.0
"""Time for which the encoder is not used after a disagreement [s]."""


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
