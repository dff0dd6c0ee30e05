"""The number of picks of an arm that knows all arrivals from the start.

This is a scheduling problem: one machine, jobs with release times and deadlines (a part enters and leaves the window),
setup times that depend on the state of the machine, and the largest number of jobs. A dynamic programme solves it. Its
layer k has one state for each way to pick k parts: when the hand is free, and which of the parts that can still be
picked it has picked already. The n-th part goes into the n-th cell, so that all states of a layer have the hand in the
same place. A state is dropped if another state is free no later and has not picked any further remaining part.

When a layer has too many states, the search is no longer exact, and two searches enclose the optimum, as in Bergman,
Cire, van Hoeve and Hooker, Decision Diagrams for Optimization (2016). The restricted search drops states; its result
can be carried out. The relaxed search merges states into better states; its result can only have too many picks.
"""

import math
from bisect import bisect_left
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from drake_tracker.dispatch.arrivals import PartArrival
from drake_tracker.dispatch.candidate import Cell, FreeHand
from drake_tracker.dispatch.cycle_time import CycleModel


@dataclass(frozen=True)
class Bound:
    """The largest number of picks in a run lies between ``len(numbers)`` and ``upper``.

    Attributes:
        numbers: parts of the best schedule found, in the order of the picks. The arm can carry it out.
        pick_times: when the jaws have closed on each of them [s].
        upper: number of picks that no schedule exceeds. Equal to the length of ``numbers`` when the search was exact.
    """

    numbers: tuple[int, ...]
    pick_times: tuple[float, ...]
    upper: int


@dataclass(frozen=True)
class _State:
    """A way to pick some parts.

    Attributes:
        hand: the hand after the last pick.
        taken: the picked parts among those that can still be picked, as bits.
        number: number of the last part, 0 before the first pick.
        pick: time of the last pick [s].
        before: the state before that pick.
    """

    hand: FreeHand
    taken: int
    number: int = 0
    pick: float = -math.inf
    before: "_State | None" = None


Reduction = Callable[[list[_State], int], list[_State]]
"""Returns at most a given number of states in place of a longer list, which is sorted by `FreeHand.free_at`."""


def offline_optimum(
    model: CycleModel,
    arrivals: Sequence[PartArrival],
    hand: FreeHand,
    cells: Sequence[Cell],
    y_seen: float,
    duration: float,
    width: int = 400,
) -> Bound:
    """Returns bounds on the number of picks up to the end of a run, from above and from below.

    No dispatcher in `drake_tracker.dispatch.queue_simulation.simulate_queue` with the same arguments exceeds ``upper``.

    Args:
        model: the arm's cycle.
        arrivals: all parts of the run.
        hand: where and when the hand is free first.
        cells: the cells of the trays, in the order in which they are filled; full trays are replaced at once.
        y_seen: where the view begins, along the belt [m].
        duration: duration of the run [s].
        width: number of states of a layer up to which the search is exact.
    """
    search = _Search(model, arrivals, cells, y_seen, duration)
    count, last, exact = search.run(hand, width, _restricted)
    upper = count if exact else search.run(hand, width, _relaxed)[0]
    numbers, pick_times = [], []
    state: _State | None = last
    while state is not None and state.before is not None:
        numbers.append(state.number)
        pick_times.append(state.pick)
        state = state.before
    return Bound(tuple(reversed(numbers)), tuple(reversed(pick_times)), upper)


def _restricted(states: list[_State], width: int) -> list[_State]:
    """Keeps the states in which the hand is free first."""
    return states[:width]


def _relaxed(states: list[_State], width: int) -> list[_State]:
    """Merges neighbouring states: the merged state is free as early as the first state, and its picked parts are the
    parts that all states have picked."""
    merged = []
    for i in range(width):
        group = states[i * len(states) // width : (i + 1) * len(states) // width]
        taken = group[0].taken
        for state in group[1:]:
            taken &= state.taken
        merged.append(_State(group[0].hand, taken, group[0].number, group[0].pick, group[0].before))
    return merged


class _Search:
    """The dynamic programme of one run; its arguments are those of `offline_optimum`."""

    def __init__(
        self, model: CycleModel, arrivals: Sequence[PartArrival], cells: Sequence[Cell], y_seen: float, duration: float
    ) -> None:
        parts = [arrival.candidate(y_seen, 0.0) for arrival in arrivals]
        parts.sort(key=lambda part: (model.in_window(part, 0.0)[0], part.number))
        self._parts = parts
        self._windows = [model.in_window(part, 0.0) for part in parts]
        self._model, self._cells, self._duration = model, cells, duration
        self._follow = model.cycle.descent + model.cycle.close
        leaving = sorted((leaves, 1 << i) for i, (_, leaves) in enumerate(self._windows))
        self._leaves = [leaves for leaves, _ in leaving]
        self._remaining = [0]
        for _, bit in reversed(leaving):
            self._remaining.insert(0, self._remaining[0] | bit)

    def run(self, hand: FreeHand, width: int, reduce: Reduction) -> tuple[int, _State, bool]:
        """Returns the largest number of picks, a state with as many, and whether no layer had to be reduced."""
        layer, count, exact = [_State(hand, 0)], 0, True
        while following := self._next_layer(layer, self._cells[count % len(self._cells)]):
            if len(following) > width:
                following, exact = reduce(following, width), False
            layer, count = following, count + 1
        return count, layer[0], exact

    def _next_layer(self, layer: list[_State], cell: Cell) -> list[_State]:
        """Returns the states with one more pick that no other one dominates, sorted by `FreeHand.free_at`."""
        longer = [following for state in layer for following in self._successors(state, cell)]
        longer.sort(key=lambda state: (state.hand.free_at, state.taken))
        kept: list[_State] = []
        takers: dict[int, int] = {}  # {part, as a bit: the states in ``kept`` that have taken it, as bits}
        for state in longer:
            others = self._still_there(state.hand.free_at) & ~state.taken
            not_better = 0  # the states in ``kept`` that have taken a part that this one can still pick
            for part, states in takers.items():
                if part & others:
                    not_better |= states
            own = 1 << len(kept)
            if not_better == own - 1:
                kept.append(state)
                taken = state.taken
                while taken:
                    part = taken & -taken
                    takers[part] = takers.get(part, 0) | own
                    taken ^= part
        return kept

    def _successors(self, state: _State, cell: Cell) -> list[_State]:
        """Returns the states after one more pick.

        Parts that come so late that another one can be picked before, and has left the window by then, are left out:
        the state after that one dominates.
        """
        found = []
        there = self._still_there(state.hand.free_at)
        latest = self._duration
        for i, (part, (enters, leaves)) in enumerate(zip(self._parts, self._windows)):
            if enters > latest:
                break
            if state.taken >> i & 1 or not there >> i & 1:
                continue
            done = self._model.after(state.hand, part, cell, 0.0)
            if done is None or done[0] > self._duration:
                continue
            pick, hand = done
            latest = min(latest, max(leaves, hand.free_at))
            taken = (state.taken | 1 << i) & self._still_there(hand.free_at)
            found.append(_State(hand, taken, part.number, pick, state))
        return found

    def _still_there(self, free_at: float) -> int:
        """Returns the parts, as bits, that have not left when a hand that is free at a time [s] could pick them."""
        return self._remaining[bisect_left(self._leaves, free_at + self._follow)]
