"""Faults of the encoder of a belt: it jumps, or stands still."""

from collections.abc import Callable
from dataclasses import dataclass

from drake_tracker.faults.fault import EncoderFault


@dataclass(frozen=True)
class EncoderJumpFault(EncoderFault):
    """`EncoderJump`: a constant is added to the distance."""

    def travelled(self, time: float, distance: Callable[[float], float]) -> float:
        return distance(time) + self.settings.distance


@dataclass(frozen=True)
class EncoderStoppedFault(EncoderFault):
    """`EncoderStopped`: the distance stays that at the beginning of the fault."""

    def travelled(self, time: float, distance: Callable[[float], float]) -> float:
        return distance(self.begin)
