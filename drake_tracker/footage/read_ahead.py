"""Reads ahead in a thread: while one image is being processed, the next ones are decoded."""

import threading
from collections import deque
from collections.abc import Callable, Iterator
from typing import Any


def read_ahead(start: Callable[[], Iterator[Any]], count: int) -> Iterator[Any]:
    """Yields the items of an iterator that a thread reads, at most ``count`` items ahead.

    The thread begins with the first item and ends with the last one, or when this generator is closed or collected. An
    error of the iterator is raised after the items before it.

    Args:
        start: function that returns the iterator; called in the thread.
        count: largest number of items that wait.
    """
    items: deque[Any] = deque()
    changed = threading.Condition()
    stopped = False
    ended: list[BaseException | None] = []

    def produce() -> None:
        error = None
        try:
            for item in start():
                with changed:
                    items.append(item)
                    changed.notify_all()
                    changed.wait_for(lambda: stopped or len(items) < count)
                    if stopped:
                        break
        except BaseException as caught:
            error = caught
        with changed:
            ended.append(error)
            changed.notify_all()

    thread = threading.Thread(target=produce, name="read-ahead", daemon=True)
    thread.start()
    try:
        while True:
            with changed:
                changed.wait_for(lambda: items or ended)
                if not items:
                    break
                item = items.popleft()
                changed.notify_all()
            yield item
        if ended[0] is not None:
            raise ended[0]
    finally:
        with changed:
            stopped = True
            changed.notify_all()
        thread.join()
