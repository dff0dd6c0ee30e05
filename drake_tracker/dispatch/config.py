"""Settings of the dispatchers and of the arm's cycle. The name of a dispatcher's class is its YAML tag."""

from dataclasses import dataclass
from typing import ClassVar

from drake_tracker.core.setting import setting


@dataclass(frozen=True)
class PickWindow:
    """The piece of the belt on which parts may be picked. A part must be in it when the jaws have closed."""

    y_first: float = setting(-0.40, "where picking begins, along the belt", "m", (-2.0, 2.0))
    y_last: float = setting(0.42, "where picking ends, along the belt", "m", (-2.0, 2.0))
    y_wait: float = setting(
        -0.30, "where the hand waits while there is nothing to pick, along the belt", "m", (-2.0, 2.0)
    )


@dataclass(frozen=True)
class Eligibility:
    """Which parts are offered to a dispatcher. Each setting is described by its ``help``."""

    min_clear: ClassVar[float] = 0.012
    """Least distance to the nearest other part, for the jaws [m]; chosen."""
    max_std: ClassVar[float] = 0.006
    """Largest standard deviation of the position [m]; chosen."""


@dataclass(frozen=True)
class CycleTime:
    """How long the arm takes to pick a part and to put it into a cell.

    The hand approaches from rest to rest at a constant acceleration up to a constant speed, and carries in the same
    way. All other phases have constant durations. Each setting is described by its ``help``. The defaults are fitted to
    runs of the PUMA 560 on development seeds, with ``python benchmarks/conveyor_cycle.py``.
    """

    approach_speed: float = setting(1.1, "largest speed of the hand on the way to a part", "m/s", (0.05, 5.0))
    approach_acceleration: float = setting(5.3, "its acceleration", "m/s^2", (0.1, 50.0))
    descent: float = setting(0.47, "duration of settling above the moving part, and of the descent", "s", (0.0, 10.0))
    close: float = setting(0.24, "time in which the jaws close", "s", (0.0, 5.0))
    lift: float = setting(0.27, "duration of the lift", "s", (0.0, 10.0))
    carry_speed: float = setting(0.9, "largest speed of the hand on the way to a cell", "m/s", (0.05, 5.0))
    carry_acceleration: float = setting(2.6, "its acceleration", "m/s^2", (0.1, 50.0))
    lower: float = setting(0.24, "duration of lowering the part into the cell", "s", (0.0, 10.0))
    release: float = setting(0.12, "time in which the jaws open", "s", (0.0, 5.0))
    rise: float = setting(0.24, "duration of the rise out of the cell", "s", (0.0, 10.0))


@dataclass(frozen=True)
class FirstInFirstOut:
    """Picks the part that was seen first."""


@dataclass(frozen=True)
class NearestDeadline:
    """Picks the part that leaves the window first."""


@dataclass(frozen=True)
class Greedy:
    """Picks the part after which the hand is free again first."""


@dataclass(frozen=True)
class LookAhead:
    """Plans the sequence with the most picks; of several such sequences, the sequence that ends first.

    All sequences are compared for up to ``exact_up_to`` parts. For more parts, a beam search keeps the ``width`` best
    beginnings of each length.
    """

    horizon: float = setting(30.0, "time from now on within which picks are planned", "s", (0.1, 600.0))
    depth: int = setting(4, "largest number of picks that are planned", "", (1, 16))
    exact_up_to: ClassVar[int] = 8
    """Number of parts up to which all sequences are compared; chosen."""
    width: int = setting(64, "number of beginnings that the beam search keeps", "", (1, 10000))
