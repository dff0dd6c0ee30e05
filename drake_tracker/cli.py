"""The command ``drake-tracker``.

Exit codes:

- 0: success (for a campaign: it ran, whatever its rates).
- 1: the run ended and the object was not grasped.
- 2: bad input or a broken machine, reported in clear lines without a traceback.
- 3: a fault of the program, with its traceback.
- 129, 130, 143: interrupted by SIGHUP, Ctrl-C or SIGTERM; everything recorded so far is kept.
- 141: the program that reads the output, such as ``head``, ended first.
"""

import argparse
import errno
import io
import locale
import os
import shutil
import sys
import textwrap
import traceback
import warnings
from collections.abc import Callable, Sequence
from typing import Any, NoReturn, TextIO

import drake_tracker
from drake_tracker.commands import (
    arm,
    board,
    calibrate,
    campaign,
    completion,
    dataset,
    doctor,
    figures,
    host,
    lag,
    list_scenarios,
    measure,
    photograph,
    predict,
    predict_success,
    replay,
    run,
    track,
    view,
)
from drake_tracker.commands.common import BROKEN_PIPE, FAULT, TROUBLE, quiet_graphics, warn
from drake_tracker.core.errors import DrakeTrackerError, DrakeTrackerWarning
from drake_tracker.core.processes import signals
from drake_tracker.core.progress import show_progress

COMMANDS = (
    run,
    view,
    replay,
    list_scenarios,
    doctor,
    board,
    photograph,
    calibrate,
    lag,
    track,
    predict,
    predict_success,
    measure,
    campaign,
    dataset,
    figures,
    host,
    arm,
)
"""Modules of the commands, in the order of ``--help``; `completion` follows."""
_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.EIO)
"""Errors of a disk, which are not faults of the program."""
_WIDEST = 110
"""Greatest width of a help text, however wide the terminal is."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs a command and returns its exit code. SIGTERM and SIGHUP act like Ctrl-C.

    Args:
        arguments: arguments of the command line; None takes those of the process.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # a damaged file may contain what is no character
            stream.reconfigure(errors="backslashreplace")
    with signals.graceful(), warnings.catch_warnings():
        warnings.simplefilter("always", DrakeTrackerWarning)
        warnings.showwarning = _shows_each_once()
        try:
            return _run(arguments)
        except KeyboardInterrupt:
            return _interrupted()


def _run(arguments: Sequence[str] | None) -> int:
    for argument in sys.argv[1:] if arguments is None else arguments:
        if any("\ud800" <= character <= "\udfff" for character in argument):  # how Python keeps other bytes
            warn(f"{argument}: this name is not UTF-8, and could not be written into results; rename the file")
            return TROUBLE
    options = make_parser().parse_args(arguments)
    show_progress(not options.quiet)
    quiet_graphics()
    try:
        return options.action(options)
    except DrakeTrackerError as error:
        if signals.was_interrupted(error):
            return _interrupted()
        for line in str(error).split("\n"):
            warn(line)
        return TROUBLE
    except BrokenPipeError:  # the program that reads the output, such as head, ended first
        sys.stdout = _nothing()
        return BROKEN_PIPE
    except ImportError as error:
        if signals.received() is not None:
            return _interrupted()
        remedy = "`make setup` installs what is missing, `drake-tracker doctor` says more"
        if locale.getpreferredencoding(False).lower().replace("-", "") != "utf8":
            remedy = "Drake needs UTF-8 names: set PYTHONUTF8=1, or a locale such as C.UTF-8"
        print(f"drake-tracker: a package cannot be imported ({str(error).splitlines()[0]}); {remedy}", file=sys.stderr)
        return TROUBLE
    except (Exception, SystemExit) as error:  # a custom part that calls sys.exit(0) must not look like a success
        if signals.was_interrupted(error):
            return _interrupted()
        if isinstance(error, OSError) and error.errno == errno.EIO and signals.received() is not None:
            sys.stdout = sys.stderr = _nothing()  # the terminal was closed, and the result could not be printed
            return signals.exit_code()
        if isinstance(error, OSError) and error.errno in _FULL:
            print(f"drake-tracker: {error.filename or 'a file'}: cannot be written: {error.strerror}", file=sys.stderr)
            return TROUBLE
        traceback.print_exc()
        return FAULT


def _shows_each_once() -> Callable[..., None]:
    """Returns the function that prints warnings: those of the package as one line, each once, others as Python does."""
    shown = set()  # several commands read the scenario more than once

    def show(message: Warning | str, category: type[Warning], filename: str, lineno: int, *details: Any) -> None:
        if not issubclass(category, DrakeTrackerWarning):
            sys.stderr.write(warnings.formatwarning(message, category, filename, lineno))
        elif str(message) not in shown:
            shown.add(str(message))
            warn(str(message))

    return show


def _nothing() -> TextIO:
    return open(os.devnull, "w")  # Python flushes it at exit


def _interrupted() -> int:
    print("drake-tracker: interrupted", file=sys.stderr)
    return signals.exit_code()


class _HelpFormatter(argparse.HelpFormatter):
    """Keeps the line breaks of descriptions, breaks no line at a hyphen, and aligns the list of commands."""

    def __init__(self, prog: str) -> None:
        super().__init__(prog, max_help_position=26, width=min(shutil.get_terminal_size().columns, _WIDEST) - 2)

    def add_argument(self, action: argparse.Action) -> None:
        super().add_argument(action)
        if isinstance(action, argparse._SubParsersAction):  # argparse forgets that their names are indented once more
            longest = max(len(name) for name in action.choices)
            self._action_max_length = max(self._action_max_length, longest + 2 * self._indent_increment)

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        return "\n".join(indent + line for part in text.splitlines() for line in self._split_lines(part, width))

    def _split_lines(self, text: str, width: int) -> list[str]:
        return textwrap.wrap(text, width, break_on_hyphens=False)


class _Parser(argparse.ArgumentParser):
    def __init__(self, **options: Any) -> None:
        super().__init__(**{"formatter_class": _HelpFormatter, **options})

    def error(self, message: str) -> NoReturn:
        self.exit(TROUBLE, f"{self.prog}: {message}; see {self.prog} --help\n")


def make_parser() -> argparse.ArgumentParser:
    """Returns the parser of ``drake-tracker`` with all its commands."""
    parser = _Parser(
        prog="drake-tracker",
        description="Simulates hand-eye systems that track and grasp a moving object.",
        epilog="Next: drake-tracker run train --live shows a run in a browser; drake-tracker COMMAND --help explains a "
        "command.",
    )
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    for command in COMMANDS:
        command.register(commands)
    completion.register(commands, parser)
    parser.add_argument("--version", action="version", version=f"drake-tracker {drake_tracker.__version__}")
    parser.add_argument("--quiet", action="store_true", help="show no progress, only results and warnings")
    for each in commands.choices.values():
        each.add_argument("--quiet", action="store_true", default=argparse.SUPPRESS, help="show no progress")
    return parser
