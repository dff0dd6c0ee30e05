"""Keeps every message that comes until somebody has time for it."""

import queue
import threading
from contextlib import contextmanager

from drake_tracker.network.channels import channel_of

_LOOK = 0.002
"""Wall time [s] between two looks at the bus."""


class Mailbox:
    """What came on some channels, in the order in which it came.

    Between two looks at the bus Drake keeps the oldest message of a channel, and drops the others. A host that works on
    one image for longer than a cycle would lose the next; hence `listening`, which leaves the looking to a thread.

    Args:
      lcm: a DrakeLcm, which is nobody else's while `listening`. ports: those whose channels are meant.
    """

    def __init__(self, lcm, ports):
        self._lcm = lcm
        self._came = queue.SimpleQueue()
        self._listening = False
        for port in ports:
            lcm.Subscribe(channel_of(port), lambda data, port=port: self._came.put((port, data)))

    def collect(self, timeout):
        """Returns [(port, message in bytes), ...], all that has come; waits up to ``timeout`` [s] for a first one."""
        messages = []
        if not self._listening:
            self._lcm.HandleSubscriptions(round(1e3 * timeout))
        elif self._came.empty():
            try:
                messages.append(self._came.get(timeout=timeout))
            except queue.Empty:
                return []
        while not self._came.empty():
            messages.append(self._came.get())
        return messages

    @contextmanager
    def listening(self):
        """As long as this lasts a thread looks at the bus, so that nothing is lost while the caller works."""
        over = threading.Event()

        def listen():
            while not over.wait(_LOOK):  # not by waiting at the bus: it would keep Python to itself
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
