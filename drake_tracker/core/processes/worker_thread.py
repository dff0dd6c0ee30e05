"""Work that one thread does in the background, in the order in which it was handed over."""

import threading
from collections import deque
from collections.abc import Callable
from typing import Any


class WorkerThread:
    """Calls a function with one item after the other in a separate thread.

    `put` waits while ``capacity`` items are not yet done, so that memory is bounded. After an error of the function
    nothing more is done, and the error is raised by the next call of `put` or `close`.

    Args:
        work: function of one item.
        capacity: largest number of items that wait.
    """

    def __init__(self, work: Callable[[Any], object], capacity: int) -> None:
        self._work, self._capacity = work, capacity
        self._items: deque[Any] = deque()
        self._changed = threading.Condition()
        self._closed = False
        self._error: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name="background", daemon=True)
        self._thread.start()

    def put(self, item: Any) -> None:
        """Hands over an item. Raises the error of an earlier one."""
        with self._changed:
            self._changed.wait_for(lambda: self._error is not None or len(self._items) < self._capacity)
            self._raise()
            self._items.append(item)
            self._changed.notify_all()

    def close(self) -> None:
        """Waits until everything is done. Raises the error of an item, once. May be called again."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        self._thread.join()
        self._raise()

    def _raise(self) -> None:
        error, self._error = self._error, None
        if error is not None:
            self._closed = True
            raise error

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._items or self._closed)
                if not self._items:
                    return
                item = self._items[0]
            try:
                self._work(item)
            except BaseException as error:
                with self._changed:
                    self._error, self._closed = error, True
                    self._items.clear()
                    self._changed.notify_all()
                return
            with self._changed:
                self._items.popleft()
                self._changed.notify_all()
