"""The registry of the dispatchers."""

from typing import TYPE_CHECKING, Any

from drake_tracker.core.registry import Registry
from drake_tracker.dispatch.config import FirstInFirstOut, Greedy, LookAhead, NearestDeadline

if TYPE_CHECKING:
    from drake_tracker.dispatch.config import Eligibility
    from drake_tracker.dispatch.cycle_time import CycleModel
    from drake_tracker.dispatch.dispatcher import Dispatcher

DISPATCHERS: "Registry[Dispatcher]" = Registry(
    "dispatch",
    {
        LookAhead: "drake_tracker.dispatch.look_ahead:LookAheadDispatcher",
        Greedy: "drake_tracker.dispatch.rules:GreedyDispatcher",
        NearestDeadline: "drake_tracker.dispatch.rules:NearestDeadlineDispatcher",
        FirstInFirstOut: "drake_tracker.dispatch.rules:FirstInFirstOutDispatcher",
    },
)
"""Every dispatcher of the package by its settings; the one place where a dispatcher is registered."""


def make_dispatcher(settings: Any, model: "CycleModel", eligibility: "Eligibility") -> "Dispatcher":
    """Returns a dispatcher.

    Args:
        settings: an instance of the settings of one of the kinds in `DISPATCHERS`.
        model: the arm's cycle.
        eligibility: which parts are offered to it.

    Raises DrakeTrackerError when the settings belong to no kind.
    """
    return DISPATCHERS.make(settings, model=model, eligibility=eligibility)
