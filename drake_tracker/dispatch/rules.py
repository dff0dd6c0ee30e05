"""Dispatchers that rank the parts by a rule and do not look ahead."""

from collections.abc import Iterable, Sequence

from drake_tracker.dispatch.candidate import Candidate, Cell, FreeHand
from drake_tracker.dispatch.config import Eligibility, FirstInFirstOut, Greedy, NearestDeadline
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
        """Returns the place of a part in the order; of equal ones, the one with the smaller number comes first."""
        raise NotImplementedError


class FirstInFirstOutDispatcher(_Rule):
    """Picks the part that was seen first.

    Args:
        settings: no settings.
        model: the arm's cycle.
        eligibility: which parts are offered.
    """

    def __init__(self, settings: FirstInFirstOut, model: CycleModel, eligibility: Eligibility) -> None:
        super().__init__(settings, model, eligibility)

    def _rank(self, candidate: Candidate, pick: float, cell: Cell, now: float) -> float:
        return candidate.number


class NearestDeadlineDispatcher(_Rule):
    """Picks the part that leaves the window first.

    Args:
        settings: no settings.
        model: the arm's cycle.
        eligibility: which parts are offered.
    """

    def __init__(self, settings: NearestDeadline, model: CycleModel, eligibility: Eligibility) -> None:
        super().__init__(settings, model, eligibility)

    def _rank(self, candidate: Candidate, pick: float, cell: Cell, now: float) -> float:
        return self.model.in_window(candidate, now)[1]


class GreedyDispatcher(_Rule):
    """Picks the part after which the hand is free again first.

    Args:
        settings: no settings.
        model: the arm's cycle.
        eligibility: which parts are offered.
    """

    def __init__(self, settings: Greedy, model: CycleModel, eligibility: Eligibility) -> None:
        super().__init__(settings, model, eligibility)

    def _rank(self, candidate: Candidate, pick: float, cell: Cell, now: float) -> float:
        return self.model.place_time(candidate, pick, cell, now)
