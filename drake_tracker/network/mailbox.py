"""Keeps every message that arrives until the caller collects it."""

import queue
import threading
from collections.abc import Iterable, Iterator
from contextlib import contextmanager

from pydrake.lcm import DrakeLcm

from drake_tracker.network.channels import channel_of

_POLL_PERIOD = 0.002
"""Wall time [s] between two polls of the bus."""


class Mailbox:
    """The messages that arrived on some channels, in order of arrival.

    Between two polls of the bus Drake keeps the oldest message of a channel and drops the others. A host that works on
    one image for longer than a cycle would lose the next one; hence `listening`, which polls the bus in a thread.

    Args:
        lcm: connection to the bus, which nothing else may use while `listening`.
        ports: names of the ports whose channels are received.
    """

    def __init__(self, lcm: DrakeLcm, ports: Iterable[str]) -> None:
        self._lcm = lcm
        self._arrived: queue.SimpleQueue[tuple[str, bytes]] = queue.SimpleQueue()
        self._listening = False
        for port in ports:
            lcm.Subscribe(channel_of(port), lambda data, port=port: self._arrived.put((port, data)))

    def collect(self, timeout: float) -> list[tuple[str, bytes]]:
        """Returns all messages that have arrived, as (port, message); waits up to ``timeout`` [s] for the first."""
        messages = []
        if not self._listening:
            self._lcm.HandleSubscriptions(round(1e3 * timeout))
        elif self._arrived.empty():
            try:
                messages.append(self._arrived.get(timeout=timeout))
            except queue.Empty:
                return []
        while not self._arrived.empty():
            messages.append(self._arrived.get())
        return messages

    @contextmanager
    def listening(self) -> Iterator[None]:
        """A context in which a thread polls the bus, so that no message is lost while the caller works."""
        over = threading.Event()

        def listen() -> None:
            while not over.wait(_POLL_PERIOD):  # waiting at the bus would hold Python's global lock
                self._lcm.HandleSubscriptions(0)

        thread = threading.Thread(target=listen, name="mailbox", daemon=True)
        self._listening = True
        thread.start()
        try:
            yield
        finally:
            over.set()
            thread.join()
            self._listening = False
