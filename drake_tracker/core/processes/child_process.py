"""Programs of this package that run in separate processes, and the connections to them.

A program is a module that calls `run_child` with a function. The function receives one end of the connection, and
answers `DONE` to every request for an answer. It ends when the connection ends, which also happens when the process
that started it is killed.
"""

import contextlib
import os
import socket
import struct
import subprocess
import sys
import weakref
from collections.abc import Callable, Sequence
from multiprocessing import Pipe
from multiprocessing.connection import Connection

from drake_tracker.core.errors import DrakeTrackerError, MachineError

PATIENCE = 60.0
"""Time [s] after which a process that does not answer counts as broken."""
CLOSING_TIME = 2.0
"""Time [s] in which a process must end by itself."""
DONE = b""
"""Answer of a program that has completed a request."""
_REFUSED, _FAILED = b"R", b"F"
"""First byte of an answer with an error: a `DrakeTrackerError`, and any other error."""


class ChildProcess:
    """A program in a separate process, and the connection to it.

    The process ends with `close`, with this object, or when this process ends in any way.

    Args:
        module: name of the program's module.
        name: of the process in messages, such as "render process".
        instead: what the user can do when the process does not work.
        files: file descriptors that the program inherits, and gets as arguments.

    Raises MachineError when the process cannot start.
    """

    def __init__(self, module: str, *, name: str, instead: str, files: Sequence[int] = ()) -> None:
        self._name, self._instead = name, instead
        self._connection, theirs = Pipe()
        try:
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-m", module, str(theirs.fileno()), *map(str, files)],
                stdin=subprocess.DEVNULL,
                pass_fds=(theirs.fileno(), *files),
                env=_environment(),
                process_group=0,  # so that Ctrl-C does not reach it
            )
        except OSError as error:
            self._connection.close()
            raise MachineError(f"a {name} cannot start: {error.strerror or error}; {instead}") from None
        finally:
            theirs.close()
        _limit_sending(self._connection)
        self._finalizer = weakref.finalize(self, _end, self._connection, self._process)

    @property
    def number(self) -> int:
        """The process number."""
        return self._process.pid

    def send(self, message: bytes) -> None:
        """Sends a message. Raises as `wait` does when the process has ended, or does not read it within `PATIENCE`."""
        try:
            self._connection.send_bytes(message)
        except OSError:
            while True:  # the process may have said what went wrong
                self.wait()

    def wait(self) -> None:
        """Waits until the process has completed the request.

        Raises DrakeTrackerError with the refusal of the program; MachineError when it failed, ended, or did not answer
        within `PATIENCE`.
        """
        try:
            if not self._connection.poll(PATIENCE):
                raise MachineError(f"a {self._name} did not answer within {PATIENCE:g} s; {self._instead}")
            answer = self._connection.recv_bytes()
        except (EOFError, OSError):
            raise MachineError(f"a {self._name} {self._how_it_ended()}; {self._instead}") from None
        kind, text = answer[:1], answer[1:].decode()
        if kind == _REFUSED:
            raise DrakeTrackerError(text)
        if kind == _FAILED:
            raise MachineError(f"a {self._name} failed: {text}; {self._instead}")

    def close(self) -> None:
        """Ends the process."""
        self._finalizer()

    def _how_it_ended(self) -> str:
        try:
            code = self._process.wait(CLOSING_TIME)
        except subprocess.TimeoutExpired:
            code = 0
        return f"was ended by signal {-code}" if code < 0 else f"ended with exit code {code}"


def run_child(serve: Callable[..., None]) -> None:
    """Runs a program that a `ChildProcess` started, and ends it.

    Args:
        serve: called with the `Connection` and the inherited file descriptors. The function returns, or raises
            EOFError, when the connection ends. Any other error is sent to the other process.
    """
    if hasattr(os, "SCHED_BATCH"):  # not to interrupt the other process with whatever it asks for
        with contextlib.suppress(OSError):
            os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))
    connection, *files = Connection(int(sys.argv[1])), *map(int, sys.argv[2:])
    try:
        serve(connection, *files)
    except (EOFError, ConnectionError):
        pass  # the other process has ended
    except Exception as error:
        refused = isinstance(error, DrakeTrackerError) and not isinstance(error, MachineError)
        text = str(error) if refused else f"{type(error).__name__}: {error}"
        with contextlib.suppress(ConnectionError):
            connection.send_bytes((_REFUSED if refused else _FAILED) + " ".join(text.split()).encode())
    os._exit(0)  # without taking down its libraries, which takes time


def _environment() -> dict[str, str]:
    """Returns the environment of a process, which imports the same modules as this process and computes with one
    thread."""
    search = os.pathsep.join(path or os.getcwd() for path in sys.path)
    return {"LP_NUM_THREADS": "1", **os.environ, "PYTHONPATH": search}


def _limit_sending(connection: Connection) -> None:
    """Lets sending fail after `PATIENCE`: a process that was stopped would otherwise stop this one, too."""
    with socket.socket(fileno=os.dup(connection.fileno())) as end:
        whole, part = divmod(PATIENCE, 1.0)
        end.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, struct.pack("ll", int(whole), int(1e6 * part)))


def _end(connection: Connection, process: "subprocess.Popen[bytes]") -> None:
    connection.close()
    try:
        process.wait(CLOSING_TIME)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
