"""The role of a link between the host that predicts and the controller of the arm, and its kinds."""

import pickle
from typing import Any, Protocol, TypeVar

import numpy as np

from drake_tracker.core.errors import DrakeTrackerError, raised
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


def check_link(link: Any) -> None:
    """Raises DrakeTrackerError, one line, when a link of `Prediction` packets cannot be used.

    Packets are offered 60 times a second for 2 s. A link may lose and delay them, but must deliver only packets that
    were offered, must not change an earlier state, and must do the same again after another run in between.

    Args:
        link: what is checked.
    """
    from drake_tracker.core.messages import Prediction, message_size  # loads Drake

    name = type(link).__name__
    missing = [method for method in vars(Link) if not method.startswith("_") and not hasattr(link, method)]
    if missing:
        raise DrakeTrackerError(f"{name} has no {', '.join(missing)}; see Link")
    size = message_size(Prediction)
    packets = [np.concatenate([[0.1 + k / 60.0], np.full(size - 1, k + 1.0)]) for k in range(120)]
    try:
        first = link.initial_state()
        before = pickle.dumps(first)
        delivered = _deliver(link, packets)
        if pickle.dumps(first) != before:
            raise DrakeTrackerError(f"{name} changed a state that it had returned; it must return a new one")
        for packet in delivered:
            if packet is not None and not any(np.array_equal(packet, offered) for offered in packets):
                raise DrakeTrackerError(f"{name}.delivered returned what was not offered: {str(packet)[:60]}")
        _deliver(link, [2.0 * packet for packet in packets])
        again = _deliver(link, packets)
    except DrakeTrackerError:
        raise
    except (Exception, SystemExit) as error:
        raise DrakeTrackerError(f"{name} {raised(error)}") from error
    if [None if one is None else one.tolist() for one in delivered] != [
        None if one is None else one.tolist() for one in again
    ]:
        raise DrakeTrackerError(f"{name} delivered other packets in the same run; all memory must be in the state")


def _deliver(link: Any, packets: list[np.ndarray]) -> list[np.ndarray | None]:
    """Returns what a link delivers after each of the packets."""
    state, delivered = link.initial_state(), []
    for k, packet in enumerate(packets):
        now = 0.35 + k / 60.0
        state = link.post(state, packet, now)
        delivered.append(link.delivered(state, now))
    return delivered
