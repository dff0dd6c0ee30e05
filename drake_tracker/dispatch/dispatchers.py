"""The kinds of dispatcher: some rank the parts by a rule and do not look ahead, one plans the next picks.

The n-th pick goes into the n-th free cell. The place of the hand after a set of picks therefore depends on their number
only. Of all orders in which the same set can be picked, only the order that ends first matters. This is the dynamic
programme of Held and Karp (1962) over sets, here with time windows.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from drake_tracker.dispatch.candidate import Candidate, Cell, FreeHand
from drake_tracker.dispatch.config import Eligibility, LookAhead
from drake_tracker.dispatch.cycle_time import CycleModel
from drake_tracker.dispatch.dispatcher import Plan


def eligible(candidates: Iterable[Candidate], eligibility: Eligibility) -> list[Candidate]:
    """Returns the parts that the jaws can grasp, in the order of their numbers."""
    found = [
        candidate
        for candidate in candidates
        if candidate.clear >= eligibility.min_clear and candidate.std <= eligibility.max_std
    ]
    return sorted(found, key=lambda candidate: candidate.number)


class _Rule:
    """A dispatcher that picks the first of the parts in an order.

    Args:
        settings: settings of the kind.
        model: the arm's cycle.
        eligibility: which parts are offered.
    """

    def __init__(self, settings: object, model: CycleModel, eligibility: Eligibility) -> None:
        self.settings = settings
        self.model = model
        self.eligibility = eligibility

    def choose(self, hand: FreeHand, candidates: Sequence[Candidate], cells: Sequence[Cell], now: float) -> Plan:
        """Returns the plan; see `drake_tracker.dispatch.dispatcher.Dispatcher`."""
        if not cells:
            return Plan()
        best, first = (float("inf"), 0), Plan()
        for candidate in eligible(candidates, self.eligibility):
            pick = self.model.pick_time(hand, candidate, now)
            if pick is not None:
                rank = (self._rank(candidate, pick, cells[0], now), candidate.number)
                if rank < best:
                    best, first = rank, Plan((candidate.number,), (pick,))
        return first

    def _rank(self, candidate: Candidate, pick: float, cell: Cell, now: float) -> float:
        """Returns the place of a part in the order; of equal parts, the part with the smaller number comes first."""
        raise NotImplementedError


class FirstInFirstOutDispatcher(_Rule):
    """Picks the part that was seen first."""

    def _rank(self, candidate: Candidate, pick: float, cell: Cell, now: float) -> float:
        return candidate.number


class NearestDeadlineDispatcher(_Rule):
    """Picks the part that leaves the window first."""

    def _rank(self, candidate: Candidate, pick: float, cell: Cell, now: float) -> float:
        return self.model.in_window(candidate, now)[1]


class GreedyDispatcher(_Rule):
    """Picks the part after which the hand is free again first."""

    def _rank(self, candidate: Candidate, pick: float, cell: Cell, now: float) -> float:
        return self.model.place_time(candidate, pick, cell, now)


@dataclass(frozen=True)
class _Sequence:
    """The beginning of a plan.

    Attributes:
        hand: the hand after the last pick.
        numbers: numbers of the parts in the order of the picks.
        pick_times: times of the picks [s].
    """

    hand: FreeHand
    numbers: tuple[int, ...] = ()
    pick_times: tuple[float, ...] = ()

    @property
    def order(self) -> tuple[float, tuple[int, ...]]:
        """Criterion between two sequences of the same length: the earlier end."""
        return self.hand.free_at, self.numbers


class LookAheadDispatcher:
    """Plans the sequence with the most picks; of several such sequences, the sequence that ends first.

    Args:
        settings: depth of the plan, and when the search is exact.
        model: the arm's cycle.
        eligibility: which parts are offered.
    """

    def __init__(self, settings: LookAhead, model: CycleModel, eligibility: Eligibility) -> None:
        self.settings = settings
        self.model = model
        self.eligibility = eligibility

    def choose(self, hand: FreeHand, candidates: Sequence[Candidate], cells: Sequence[Cell], now: float) -> Plan:
        """Returns the plan; see `drake_tracker.dispatch.dispatcher.Dispatcher`."""
        parts = self._within_reach(hand, candidates, now)
        width = None if len(parts) <= self.settings.exact_up_to else self.settings.width
        layer = {0: _Sequence(hand)}
        best = layer[0]
        for cell in cells[: self.settings.depth]:
            layer = self._next_layer(layer, parts, cell, now)
            if not layer:
                break
            best = min(layer.values(), key=lambda sequence: sequence.order)
            if width is not None and len(layer) > width:
                kept = sorted(layer.items(), key=lambda item: item[1].order)[:width]
                layer = dict(kept)
        return Plan(best.numbers, best.pick_times)

    def _within_reach(self, hand: FreeHand, candidates: Sequence[Candidate], now: float) -> list[Candidate]:
        """Returns the parts that could be picked next, within the horizon.

        The others could not be picked after another part either, unless the hand carried much faster than it
        approaches.
        """
        reach = []
        for candidate in eligible(candidates, self.eligibility):
            pick = self.model.pick_time(hand, candidate, now)
            if pick is not None and pick <= now + self.settings.horizon:
                reach.append(candidate)
        return reach

    def _next_layer(
        self, layer: dict[int, _Sequence], parts: Sequence[Candidate], cell: Cell, now: float
    ) -> dict[int, _Sequence]:
        """Returns {set of parts as bits: its best sequence} for all sets with one more pick."""
        longer: dict[int, _Sequence] = {}
        for chosen, sequence in layer.items():
            for i, part in enumerate(parts):
                if chosen >> i & 1:
                    continue
                done = self.model.after(sequence.hand, part, cell, now)
                if done is None or done[0] > now + self.settings.horizon:
                    continue
                pick, hand = done
                found = _Sequence(hand, (*sequence.numbers, part.number), (*sequence.pick_times, pick))
                known = longer.get(chosen | 1 << i)
                if known is None or found.order < known.order:
                    longer[chosen | 1 << i] = found
        return longer
