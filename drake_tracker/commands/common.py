"""The common part of several commands: exit codes, arguments, run directories."""

import fcntl
import logging
import os
import re
import sys
import time
from argparse import ArgumentParser, _SubParsersAction
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.files.regular_file import printable

Commands = _SubParsersAction
"""The parsers of the commands, as ``ArgumentParser.add_subparsers`` returns them."""

LONGEST_NAME = 100
"""Greatest number of characters that a scenario's name contributes to the name of a directory."""
SUCCESS, NOT_TAKEN, TROUBLE, FAULT, BROKEN_PIPE = 0, 1, 2, 3, 141
"""Exit codes, see `drake_tracker.cli`. `core.processes.signals.exit_code` returns the exit code of an interrupted
command."""


def add_command(
    commands: Commands, name: str, action: Callable[[Any], int], *, help: str, description: str, next_step: str = ""
) -> ArgumentParser:
    """Adds the parser of a command.

    Args:
        commands: parsers of the commands.
        name: name of the command.
        action: called with the options; returns the exit code.
        help: one line for the list of commands.
        description: what the command does and what it leaves, for its own help.
        next_step: the next useful command, with a few words; shown at the end of its help.
    """
    epilog = f"Next: {next_step}" if next_step else None
    command = commands.add_parser(name, help=help, description=description, epilog=epilog)
    command.set_defaults(action=action)
    return command


def add_scenario(command: ArgumentParser) -> None:
    """Adds the argument SCENARIO, ``--set`` and ``--allow-code`` to a parser."""
    command.add_argument(
        "scenario", metavar="SCENARIO[:NAME]", help="scenario from `drake-tracker list`, or FILE.yaml[:NAME]"
    )
    add_overrides(command)
    add_consent(command)


def add_overrides(command: ArgumentParser) -> None:
    """Adds ``--set`` to a parser."""
    command.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY.PATH=VALUE",
        dest="overrides",
        help="change one setting, for example --set track.speed=0.2; may be repeated",
    )


def add_consent(command: ArgumentParser) -> None:
    """Adds ``--allow-code`` to a parser. Its value is True, or None where the user does not give it."""
    command.add_argument(
        "--allow-code",
        action="store_const",
        const=True,
        help="run the code that the scenario file names (!Custom); only for files that you trust",
    )


def announce_code(scenario: Any, parts: Iterable[str] | None = None) -> None:
    """Prints the code of a scenario file that will run, and its place, before it runs.

    Args:
        scenario: a scenario of any task.
        parts: names of the parts that will be made; None for all.

    Raises DrakeTrackerError when the user does not allow it.
    """
    from drake_tracker.scenarios.consent import allowed_code

    for line in allowed_code(scenario, parts):
        warn(line)


def warn(line: str) -> None:
    """Prints a line on standard error, in which control characters from a file are spelled out."""
    print(f"drake-tracker: {printable(line)}", file=sys.stderr)


def add_run(command: ArgumentParser) -> None:
    """Adds the arguments of a run to a parser: seed, duration, directory, recordings."""
    command.add_argument("--seed", type=int, metavar="N", help="seed of the random numbers")
    command.add_argument("--duration", type=float, metavar="S", help="longest simulated time [s]")
    command.add_argument(
        "-o", "--out", type=Path, metavar="DIR", help="run directory, new or empty (default: runs/NAME-TIME)"
    )
    command.add_argument(
        "--no-record", action="store_true", help="write no 3-D recording, no video and no picture made from images"
    )
    command.add_argument("--meshcat", action="store_true", help="show only the 3-D scene in a browser")


def add_browser(command: ArgumentParser) -> None:
    """Adds ``--no-browser`` to a parser."""
    command.add_argument("--no-browser", action="store_true", help="open no browser, print the link only")


def open_browser(url: str) -> None:
    """Opens a page in the browser of the desktop. Without a desktop, no browser may take over the terminal."""
    if any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")):
        import webbrowser

        webbrowser.open(url)


def add_lcm(command: ArgumentParser) -> None:
    """Adds ``--lcm`` to a parser."""
    command.add_argument(
        "--lcm", metavar="URL", help="LCM address, the same for both processes (default: this machine only)"
    )


def quiet_graphics() -> None:
    """Lets OpenCV and Mesa print errors only, so that their messages do not interrupt the output.

    To be called before they are imported.
    """
    os.environ.setdefault("OPENCV_LOG_LEVEL", "ERROR")
    os.environ.setdefault("EGL_LOG_LEVEL", "fatal")  # Mesa warns about devices that it does not use


def one_thread() -> None:
    """Lets numpy and OpenCV compute with one thread: matrices and images are small, and more threads only cost time.

    To be called before they are imported.
    """
    for variable in ("OPENBLAS_NUM_THREADS", "OPENCV_FOR_THREADS_NUM"):
        os.environ.setdefault(variable, "1")


def quiet_drake() -> None:
    """Lets Drake log warnings and errors only, so that its messages do not interrupt the output.

    Drake's logger accepts the level only after Drake was imported, which this does.
    """
    import pydrake.common  # noqa: F401

    logging.getLogger("drake").setLevel(logging.WARNING)


@contextmanager
def run_directory(out: Path | None, name: str, what: str = "run") -> Iterator[Path]:
    """Yields the directory of a run, created if need be. When the block raises, an empty one is removed.

    No other process can use the directory during the block: of two commands with the same ``--out``, the second is
    refused.

    Args:
        out: the directory that the user chose, or None for a new one in runs/.
        name: name of the run, for the name of a new directory.
        what: what the directory is for, in messages.

    Raises:
        DrakeTrackerError: the directory cannot be made, is in use, or has something in it.
    """
    while True:
        folder = out if out is not None else free_name(name)
        try:
            folder.mkdir(parents=True, exist_ok=out is not None)
            break
        except OSError as error:
            if out is not None or not isinstance(error, FileExistsError):
                raise DrakeTrackerError(f"the {what} directory {folder} cannot be made: {error.strerror}") from None
    with locked(folder, f"the {what} directory {folder}"):
        if os.listdir(folder):
            raise DrakeTrackerError(
                f"the {what} directory {folder} is not empty; name a new one, because nothing is ever overwritten"
            )
        try:
            yield folder
        except BaseException:
            with suppress(OSError):  # as a rule, it is not empty
                folder.rmdir()
            raise


@contextmanager
def locked(folder: Path, what: str) -> Iterator[None]:
    """Locks a directory until the end of the block or of the process.

    Raises DrakeTrackerError, which says ``what`` is in use, when another process has locked it.
    """
    lock = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(lock)
        raise DrakeTrackerError(f"{what} is in use: another drake-tracker writes to it; name another one") from None
    except OSError:
        pass  # a file system without locks
    try:
        yield
    finally:
        os.close(lock)


def free_name(name: str) -> Path:
    """Returns the path of a directory in runs/ that does not exist yet, made of a name and the time."""
    name = re.sub(r"[^\w.+-]", "-", name).lstrip(".")[:LONGEST_NAME]
    stem = Path("runs") / f"{name}-{time.strftime('%Y%m%d-%H%M%S')}"
    out, count = stem, 1
    while os.path.lexists(out):
        count += 1
        out = stem.with_name(f"{stem.name}-{count}")
    return out
