"""The role of a dispatcher and its kinds: parts on the belt go in, the part to pick next comes out.

A dispatcher is functional: it has no memory, and the same arguments give the same plan.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

from drake_tracker.core.errors import PartError, raised
from drake_tracker.core.registry import Registry
from drake_tracker.dispatch.config import FirstInFirstOut, Greedy, LookAhead, NearestDeadline

if TYPE_CHECKING:
    from drake_tracker.dispatch.candidate import Candidate, Cell, FreeHand
    from drake_tracker.dispatch.config import Eligibility
    from drake_tracker.dispatch.cycle_time import CycleModel


DISPATCHERS: "Registry[Dispatcher]" = Registry(
    "dispatch",
    {
        LookAhead: "drake_tracker.dispatch.dispatchers:LookAheadDispatcher",
        Greedy: "drake_tracker.dispatch.dispatchers:GreedyDispatcher",
        NearestDeadline: "drake_tracker.dispatch.dispatchers:NearestDeadlineDispatcher",
        FirstInFirstOut: "drake_tracker.dispatch.dispatchers:FirstInFirstOutDispatcher",
    },
)
"""Every dispatcher of the package by its settings; the one place where a dispatcher is registered."""


@dataclass(frozen=True)
class Plan:
    """The parts that the arm is to pick, in this order.

    A dispatcher that does not look ahead plans one pick only.

    Attributes:
        numbers: their numbers; empty when no part can be picked.
        pick_times: when the jaws will have closed on each of them [s].
    """

    numbers: tuple[int, ...] = ()
    pick_times: tuple[float, ...] = ()

    @property
    def number(self) -> int | None:
        """Number of the part to pick next, None when there is none."""
        return self.numbers[0] if self.numbers else None


@runtime_checkable
class Dispatcher(Protocol):
    """Decides which part the arm picks next."""

    def choose(self, hand: "FreeHand", candidates: "Sequence[Candidate]", cells: "Sequence[Cell]", now: float) -> Plan:
        """Returns the plan. Only its first pick is binding.

        Args:
            hand: where and when the hand is free.
            candidates: the parts on the belt, as they are at ``now``, in any order.
            cells: the free cells in the order in which they are filled.
            now: the time [s].
        """
        ...


def make_dispatcher(settings: Any, model: "CycleModel", eligibility: "Eligibility") -> "Dispatcher":
    """Returns a dispatcher.

    Args:
        settings: an instance of the settings of one of the kinds in `DISPATCHERS`.
        model: the arm's cycle.
        eligibility: which parts are offered to it.

    Raises DrakeTrackerError when the settings belong to no kind.
    """
    return DISPATCHERS.make(settings, model=model, eligibility=eligibility)


def choose_plan(
    dispatcher: "Dispatcher", hand: "FreeHand", candidates: "Sequence[Candidate]", cells: "Sequence[Cell]", now: float
) -> Plan:
    """Returns the plan of a dispatcher, see `Dispatcher.choose`.

    Raises PartError when the dispatcher raises an error, or plans a part that is not among the candidates.
    """
    name = f"{type(dispatcher).__name__}.choose"
    try:
        plan = dispatcher.choose(hand, candidates, cells, now)
    except (Exception, SystemExit) as error:
        raise PartError(f"{name} {raised(error)}") from error
    if not isinstance(plan, Plan):
        raise PartError(f"{name} returned a {type(plan).__name__}; it must return a Plan")
    strangers = set(plan.numbers) - {candidate.number for candidate in candidates}
    if strangers or len(plan.pick_times) != len(plan.numbers):
        raise PartError(f"{name} planned {plan.numbers}; these must be candidates, each with a pick time")
    return plan
