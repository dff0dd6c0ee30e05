"""The role of a link between the host that predicts and the controller of the arm, and its kinds."""

from typing import Any, Protocol, TypeVar

import numpy as np

from drake_tracker.core.registry import Registry
from drake_tracker.link.config import Lossy, Perfect

State = TypeVar("State")
LINKS: "Registry[Link[Any]]" = Registry(
    "link",
    {
        Perfect: "drake_tracker.link.lossy_link:perfect_link",
        Lossy: "drake_tracker.link.lossy_link:LossyLink",
    },
)
"""Every link of the package by its settings; the one place where a link is registered. `Registry.make` returns its
arithmetic (`Link`), `drake_tracker.link.link_system.make_link` its System."""


class Link(Protocol[State]):
    """The arithmetic of a link, which delivers some of the offered packets of predicted path, and later.

    A link is functional: its methods return a new state and never change the link or the old state, since the state is
    kept in a Context, which Drake copies. A state is a frozen dataclass derived from
    `drake_tracker.core.frozen_state.FrozenState`. `drake_tracker.link.link_system.LinkSystem` makes a System of a link.
    """

    def initial_state(self) -> State:
        """Returns the state before the first packet."""
        ...

    def post(self, state: State, packet: np.ndarray, now: float) -> State:
        """Returns the state after a packet was offered to the link.

        Args:
            state: the state before.
            packet: a vector of a message, usually a `Prediction`; all zeros, and the same packet again, are allowed and
                must be ignored. Any other numbers are allowed, too, NaN included: the receiver judges them.
            now: time [s] on the arm's clock.
        """
        ...

    def delivered(self, state: State, now: float) -> np.ndarray | None:
        """Returns the packet with the newest stamp that has arrived, None before the first arrival.

        Args:
            state: the state after the last `post`.
            now: time [s] on the arm's clock.
        """
        ...
