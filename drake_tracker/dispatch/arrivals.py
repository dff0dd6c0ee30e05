"""Random arrivals of parts on a belt, for simulations of the queue."""

import math
from dataclasses import dataclass

import numpy as np

from drake_tracker.dispatch.candidate import Candidate

ATTEMPTS = 20
"""Positions across the belt that are tried for a part before it is put further upstream."""


@dataclass(frozen=True)
class PartArrival:
    """A part that comes into view.

    Attributes:
        number: number of the part, from 1 in the order of the arrivals.
        time: time at which it comes into view [s].
        x: position across the belt [m].
        v: speed along +y [m/s].
    """

    number: int
    time: float
    x: float
    v: float

    def candidate(self, y_seen: float, now: float) -> Candidate:
        """Returns the part at a time, located without error, and clear of all others.

        Args:
            y_seen: where the view begins, along the belt [m].
            now: the time [s].
        """
        return Candidate(self.number, 0, self.x, y_seen + self.v * (now - self.time), 0.0, self.v, 0.0, math.inf)


@dataclass(frozen=True)
class SimulatedBelt:
    """The belt of a simulation.

    Attributes:
        speed: speed along +y [m/s].
        x_first: least position of a part's middle across the belt [m].
        x_last: largest position of a part's middle across the belt [m].
        spacing: least distance between the middles of two parts [m].
        y_seen: where the view begins, along the belt [m].
    """

    speed: float = 0.10
    x_first: float = 0.51
    x_last: float = 0.69
    spacing: float = 0.075
    y_seen: float = -0.45


def poisson_arrivals(belt: SimulatedBelt, rate: float, duration: float, seed: int) -> tuple[PartArrival, ...]:
    """Returns parts that arrive independently of each other.

    Args:
        belt: the belt.
        rate: mean number of parts per second.
        duration: time in which parts arrive [s].
        seed: seed of the random numbers.
    """
    rng = np.random.default_rng([seed, 1])
    times, time = [], 0.0
    while (time := time + rng.exponential(1.0 / rate)) < duration:
        times.append(time)
    return _spread(belt, times, duration, rng)


def bunched_arrivals(
    belt: SimulatedBelt, rate: float, bunch: int, duration: float, seed: int
) -> tuple[PartArrival, ...]:
    """Returns parts that arrive in bunches, in each of which they lie as close together as they may.

    The bunches arrive independently of each other.

    Args:
        belt: the belt.
        rate: mean number of parts per second.
        bunch: number of parts in a bunch.
        duration: time in which parts arrive [s].
        seed: seed of the random numbers.
    """
    rng = np.random.default_rng([seed, 2])
    times, time = [], 0.0
    while (time := time + rng.exponential(bunch / rate)) < duration:
        times += [time] * bunch
    return _spread(belt, times, duration, rng)


def even_arrivals(
    belt: SimulatedBelt, rate: float, variation: float, duration: float, seed: int
) -> tuple[PartArrival, ...]:
    """Returns parts that arrive at almost even intervals, as from a feeder.

    Args:
        belt: the belt.
        rate: mean number of parts per second.
        variation: largest deviation of an interval from its mean, as a share of it; from 0 to 1.
        duration: time in which parts arrive [s].
        seed: seed of the random numbers.
    """
    rng = np.random.default_rng([seed, 3])
    times, time = [], rng.uniform(0.0, 1.0 / rate)
    while time < duration:
        times.append(time)
        time += (1.0 + variation * rng.uniform(-1.0, 1.0)) / rate
    return _spread(belt, times, duration, rng)


def _spread(
    belt: SimulatedBelt, times: list[float], duration: float, rng: np.random.Generator
) -> tuple[PartArrival, ...]:
    """Returns parts at random positions across the belt that keep their distance; late parts are omitted.

    A part for which there is no place is put upstream in small steps until there is.
    """
    arrivals: list[PartArrival] = []
    for time in times:
        x = _free_place(belt, arrivals, time, rng)
        while x is None:
            time += 0.1 * belt.spacing / belt.speed
            x = _free_place(belt, arrivals, time, rng)
        arrivals.append(PartArrival(0, time, x, belt.speed))
    ordered = sorted(arrivals, key=lambda arrival: arrival.time)
    return tuple(
        PartArrival(number, arrival.time, arrival.x, arrival.v)
        for number, arrival in enumerate(ordered, start=1)
        if arrival.time < duration
    )


def _free_place(
    belt: SimulatedBelt, arrivals: list[PartArrival], time: float, rng: np.random.Generator
) -> float | None:
    """Returns a position across the belt that is far enough from all parts, or None if none was found."""
    near = [
        (other.x, (time - other.time) * belt.speed)
        for other in arrivals
        if abs(time - other.time) * belt.speed < belt.spacing
    ]
    for x in rng.uniform(belt.x_first, belt.x_last, ATTEMPTS):
        if all(math.hypot(x - other, behind) >= belt.spacing for other, behind in near):
            return float(x)
    return None
