"""A run of the conveyor without physics: the belt, the arm's cycle and a dispatcher, event by event."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from drake_tracker.dispatch.arrivals import PartArrival
from drake_tracker.dispatch.candidate import Cell, FreeHand
from drake_tracker.dispatch.cycle_time import CycleModel, motion_time
from drake_tracker.dispatch.dispatcher import Dispatcher


@dataclass(frozen=True)
class Pick:
    """A part that was picked.

    Attributes:
        number: number of the part.
        start: time from which the arm worked on it [s].
        time: time at which the jaws had closed [s].
        end: time at which it was in its cell and the hand free again [s].
        y: where it was picked, along the belt [m].
    """

    number: int
    start: float
    time: float
    end: float
    y: float


@dataclass(frozen=True)
class QueueRun:
    """The events of a run.

    Attributes:
        picks: the picks up to the end of the run, in their order.
        missed: numbers of the parts that left the window.
        duration: duration of the run [s].
    """

    picks: tuple[Pick, ...]
    missed: tuple[int, ...]
    duration: float

    @property
    def picks_per_minute(self) -> float:
        """Number of picks per minute of the run."""
        return 60.0 * len(self.picks) / self.duration


def simulate_queue(
    dispatcher: Dispatcher,
    model: CycleModel,
    arrivals: Sequence[PartArrival],
    hand: FreeHand,
    cells: Sequence[Cell],
    y_seen: float,
    duration: float,
    wait: tuple[float, float] | None = None,
) -> QueueRun:
    """Runs a dispatcher on a queue of parts.

    The dispatcher is asked whenever the hand is free, and knows the parts that are in view by then. Its choice is
    final. When no part can be picked, the hand goes to where it waits, and the dispatcher is asked again as the next
    part comes into view. Full trays are replaced at once.

    Args:
        dispatcher: the dispatcher.
        model: the arm's cycle, which comes true exactly.
        arrivals: all parts of the run, in the order of their times.
        hand: where and when the hand is free first.
        cells: the cells of the trays, in the order in which they are filled.
        y_seen: where the view begins, along the belt [m].
        duration: duration of the run [s].
        wait: where the hand waits while no part can be picked, as x and y [m]; None: where it is.

    Raises ValueError when the dispatcher chooses a part that cannot be picked.
    """
    picks: list[Pick] = []
    taken: set[int] = set()
    now = hand.free_at
    while now <= duration:
        filled = len(picks) % len(cells)
        free = (*cells[filled:], *cells[:filled])
        candidates = {
            arrival.number: arrival.candidate(y_seen, now)
            for arrival in arrivals
            if arrival.time <= now and arrival.number not in taken
        }
        number = dispatcher.choose(hand, tuple(candidates.values()), free, now).number
        if number is None:
            later = [arrival.time for arrival in arrivals if arrival.time > now]
            if not later:
                break
            hand, now = _waiting(hand, wait, model), min(later)
            continue
        part = candidates[number]
        done = model.after(hand, part, free[0], now)
        if done is None:
            raise ValueError(f"time {now:.3f} s: part {number} cannot be picked")
        time, after = done
        if time > duration:
            break
        picks.append(Pick(number, now, time, after.free_at, part.y + part.v * (time - now)))
        taken.add(number)
        hand, now = after, after.free_at
    missed = tuple(
        arrival.number
        for arrival in arrivals
        if arrival.number not in taken and model.in_window(arrival.candidate(y_seen, duration), duration)[1] < duration
    )
    return QueueRun(tuple(picks), missed, duration)


def _waiting(hand: FreeHand, wait: tuple[float, float] | None, model: CycleModel) -> FreeHand:
    """Returns the hand after its motion to where it waits."""
    if wait is None or wait == (hand.x, hand.y):
        return hand
    cycle = model.cycle
    distance = math.hypot(wait[0] - hand.x, wait[1] - hand.y)
    motion = motion_time(distance, cycle.approach_speed, cycle.approach_acceleration)
    return FreeHand(*wait, hand.free_at + motion)
