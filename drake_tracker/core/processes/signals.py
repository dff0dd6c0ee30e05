"""Ctrl-C (SIGINT), SIGTERM and SIGHUP: the same request to end, in every command.

`graceful` turns each of the three into `Interrupted`, a KeyboardInterrupt. `on_signal` replaces that for a block, for
example by a flag that ends a run at its next step. `held` postpones the request until the end of a block, for example
while the files of a run are written.

Only the main thread receives signals; in other threads the context managers do nothing.
"""

import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

REQUESTS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
"""The signals that ask a process to end."""
PATIENCE = 15.0
"""Longest time for which a signal waits for the end of an import [s]."""
_AGAIN = 0.05
"""Time after which a signal that arrived during an import is raised again [s]."""
_IMPORTING = "<frozen importlib._bootstrap>"


class Interrupted(KeyboardInterrupt):
    """The user or the system asked the process to end."""


class _Received:
    """The signals that a command received.

    Attributes:
        active: whether `graceful` is in force.
        first: number of the first signal, or None.
        since: when it arrived, on the monotonic clock [s].
    """

    def __init__(self) -> None:
        self.active = False
        self.first: int | None = None
        self.since = 0.0

    def note(self, signum: int) -> None:
        if self.active and self.first is None:
            self.first, self.since = signum, time.monotonic()


_RECEIVED = _Received()


def received() -> int | None:
    """Returns the number of the first signal that arrived within `graceful`, or None.

    Native code may have swallowed the exception that it raised.
    """
    return _RECEIVED.first if _RECEIVED.active else None


def exit_code() -> int:
    """Returns the exit code of an interrupted command: 128 plus the number of the signal, SIGINT if none is known."""
    return 128 + (received() or signal.SIGINT)


@contextmanager
def graceful() -> Iterator[None]:
    """Raises `Interrupted` for each of the three signals. Under ``nohup``, SIGHUP stays ignored.

    A signal that arrives during an import takes effect at its end, since modules in native code turn the exception into
    an ImportError.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    previous = {signum: signal.getsignal(signum) for signum in REQUESTS}
    if previous[signal.SIGHUP] == signal.SIG_IGN:
        del previous[signal.SIGHUP]
    _RECEIVED.active, _RECEIVED.first = True, None
    for signum in previous:
        signal.signal(signum, _raise)
    try:
        yield
    finally:
        for signum, handler in previous.items():
            signal.signal(signum, handler)
        _RECEIVED.active = False


@contextmanager
def on_signal(action: Callable[[int], object]) -> Iterator[None]:
    """Calls an action instead of raising an exception.

    It replaces handlers written in Python, which `graceful` and Python itself install. An ignored signal stays ignored,
    and a signal without a handler still ends the process.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def act(signum: int, frame: FrameType | None) -> None:
        _RECEIVED.note(signum)
        action(signum)

    handlers: dict[int, Any] = {signum: signal.getsignal(signum) for signum in REQUESTS}
    handlers = {signum: old for signum, old in handlers.items() if callable(old)}
    for signum in handlers:
        signal.signal(signum, act)
    try:
        yield
    finally:
        for signum, handler in handlers.items():
            signal.signal(signum, handler)


@contextmanager
def held() -> Iterator[list[int]]:
    """Postpones signals until the end of the block, where the first of them takes effect, unless the block raises.

    Yields the list of the postponed signals. A caller that has dealt with them empties it.
    """
    postponed: list[int] = []
    with on_signal(postponed.append):
        yield postponed
    if postponed:
        signal.raise_signal(postponed[0])


def was_interrupted(error: BaseException) -> bool:
    """Returns whether an error is a KeyboardInterrupt, or was raised while one was being handled."""
    seen = set()
    link: BaseException | None = error
    while link is not None and id(link) not in seen:
        if isinstance(link, KeyboardInterrupt):
            return True
        seen.add(id(link))
        link = link.__cause__ or link.__context__
    return False


def _raise(signum: int, frame: FrameType | None) -> None:
    _RECEIVED.note(signum)
    if _importing(frame) and time.monotonic() - _RECEIVED.since < PATIENCE:
        again = threading.Timer(_AGAIN, signal.pthread_kill, (threading.main_thread().ident, signum))
        again.daemon = True
        again.start()
        return
    raise Interrupted


def _importing(frame: FrameType | None) -> bool:
    while frame is not None:
        if frame.f_code.co_filename == _IMPORTING:
            return True
        frame = frame.f_back
    return False
