"""Speed of the belt and distance that it has travelled, as functions of time.

The speed is piecewise linear. It rises from rest at time 0; then the belt runs at one speed, or changes between two.
"""

import math
from dataclasses import dataclass

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.world.conveyor.conveyor_config import BELT_MOTIONS, BeltConfig

Piece = tuple[float, float, float]
"""Duration [s], speed at the beginning and speed at the end [m/s] of a piece in which the speed changes linearly."""


@dataclass(frozen=True)
class BeltMotion:
    """How a belt moves.

    Attributes:
        start: the pieces from time 0, which begin at rest.
        cycle: the pieces that follow, again and again.
    """

    start: tuple[Piece, ...]
    cycle: tuple[Piece, ...]

    @property
    def mean_speed(self) -> float:
        """Mean speed over a cycle [m/s]."""
        return _distance(self.cycle) / _duration(self.cycle)

    def speed(self, time: float) -> float:
        """Returns the speed [m/s] at a time [s]; before time 0 the belt rests."""
        piece, elapsed, _ = self._piece_at(max(time, 0.0))
        return _speed_in(piece, elapsed)

    def distance(self, time: float) -> float:
        """Returns the distance [m] travelled from time 0 to a time [s], the exact integral of the speed."""
        piece, elapsed, before = self._piece_at(max(time, 0.0))
        return before + 0.5 * (piece[1] + _speed_in(piece, elapsed)) * elapsed

    def time_at(self, distance: float) -> float:
        """Returns the first time [s] at which the belt has travelled a distance >= 0 [m]."""
        time, remaining = 0.0, distance
        pieces = self.start
        if remaining >= _distance(self.start):
            cycles, remaining = divmod(remaining - _distance(self.start), _distance(self.cycle))
            time = _duration(self.start) + cycles * _duration(self.cycle)
            pieces = self.cycle
        for piece in pieces[:-1]:
            if remaining < _distance((piece,)):
                return time + _time_in(piece, remaining)
            time += piece[0]
            remaining -= _distance((piece,))
        return time + _time_in(pieces[-1], remaining)

    def _piece_at(self, time: float) -> tuple[Piece, float, float]:
        """Returns the piece at a time >= 0, the time since it began [s] and the distance travelled before it [m]."""
        pieces, before = self.start, 0.0
        if time >= _duration(self.start):
            before = _distance(self.start)
            cycles, time = divmod(time - _duration(self.start), _duration(self.cycle))
            before += cycles * _distance(self.cycle)
            pieces = self.cycle
        for piece in pieces[:-1]:
            if time < piece[0]:
                return piece, time, before
            time -= piece[0]
            before += _distance((piece,))
        return pieces[-1], time, before


def make_belt_motion(belt: BeltConfig) -> BeltMotion:
    """Returns the motion that the settings of a belt describe. Raises DrakeTrackerError for an unknown motion."""
    if belt.motion not in BELT_MOTIONS:
        raise DrakeTrackerError(f"belt.motion is {belt.motion!r}; it must be one of {', '.join(BELT_MOTIONS)}")
    start = ((belt.speed / belt.acceleration, 0.0, belt.speed),)
    if belt.motion == "running":
        return BeltMotion(start, ((1.0, belt.speed, belt.speed),))
    second = 0.0 if belt.motion == "stop_and_go" else belt.second_speed
    ramp = abs(belt.speed - second) / belt.acceleration
    cycle = (
        (belt.first_duration, belt.speed, belt.speed),
        (ramp, belt.speed, second),
        (belt.second_duration, second, second),
        (ramp, second, belt.speed),
    )
    return BeltMotion(start, cycle)


def _duration(pieces: tuple[Piece, ...]) -> float:
    return sum(duration for duration, _, _ in pieces)


def _distance(pieces: tuple[Piece, ...]) -> float:
    return sum(0.5 * (first + last) * duration for duration, first, last in pieces)


def _speed_in(piece: Piece, elapsed: float) -> float:
    duration, first, last = piece
    return first if duration == 0.0 else first + (last - first) * elapsed / duration


def _time_in(piece: Piece, distance: float) -> float:
    """Returns the time [s] after the beginning of a piece at which it has covered a distance [m]."""
    duration, first, last = piece
    if distance == 0.0:
        return 0.0
    acceleration = 0.0 if duration == 0.0 else (last - first) / duration
    # The numerically stable root of distance = first t + acceleration t^2 / 2.
    return 2.0 * distance / (first + math.sqrt(max(first * first + 2.0 * acceleration * distance, 0.0)))
