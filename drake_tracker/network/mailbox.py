"""Keeps every message that arrives until the caller collects it."""

import heapq
import threading
from collections import deque
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from pydrake.lcm import DrakeLcm

from drake_tracker.network.channels import channel_of

MOST_WAITING = 60
"""Greatest number of messages of one channel that wait, one second of them. The newest ones are kept."""
_POLL_PERIOD = 0.002
"""Wall time [s] between two polls of the bus."""


class Mailbox:
    """The messages that arrived on some channels, in order of arrival.

    Between two polls of the bus Drake keeps the oldest message of a channel and drops the others. A host that works on
    one image for longer than a cycle would lose the next one; hence `listening`, which polls the bus in a thread.

    Memory is bounded for any input: at most `MOST_WAITING` messages of a channel wait, and an oversized message is cut
    one byte after the largest allowed size.

    Args:
        lcm: connection to the bus, which nothing else may use while `listening`.
        ports: {name of a port whose channel is received: size of its largest message [bytes]}.

    Attributes:
        skipped: number of messages that were dropped because newer ones arrived before they were collected.
    """

    def __init__(self, lcm: DrakeLcm, ports: Mapping[str, int]) -> None:
        self._lcm = lcm
        self._arrived: dict[str, deque[tuple[int, bytes]]] = {port: deque(maxlen=MOST_WAITING) for port in ports}
        self._count = 0
        self._news = threading.Event()
        self._listening = False
        self.skipped = 0
        for port, largest in ports.items():
            lcm.Subscribe(channel_of(port), lambda data, port=port, largest=largest: self._keep(port, data, largest))

    def collect(self, timeout: float) -> list[tuple[str, bytes]]:
        """Returns all messages that have arrived, as (port, message); waits up to ``timeout`` [s] for the first."""
        if not self._listening:
            self._lcm.HandleSubscriptions(round(1e3 * timeout))
        else:
            self._news.wait(timeout)
            self._news.clear()
        came = []
        for port, waiting in self._arrived.items():
            # A thread may add more meanwhile: take no more than are there now.
            came.append([(*waiting.popleft(), port) for _ in range(len(waiting))])
        return [(port, data) for _, data, port in heapq.merge(*came)]

    def _keep(self, port: str, data: bytes, largest: int) -> None:
        """Keeps a message for `collect`. Called by the bus, in the thread that polls it."""
        waiting = self._arrived[port]
        self.skipped += len(waiting) == waiting.maxlen
        self._count += 1
        waiting.append((self._count, data[: largest + 1]))
        self._news.set()

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
