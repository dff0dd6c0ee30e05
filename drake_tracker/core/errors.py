"""The exceptions that users of the package catch."""

import importlib
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any


class DrakeTrackerError(Exception):
    """The input is wrong, or this machine cannot do the job.

    The message says what is wrong, where, and what is allowed or what to do. It is one line, or one line per problem
    where several are found at once. The command line prints it and exits with code 2.
    """


class MachineError(DrakeTrackerError):
    """This machine cannot do the job, whatever the scenario. For example, it cannot render images."""


class PartError(DrakeTrackerError):
    """A custom part raised an error or returned a wrong result. The message names part and method."""


class DrakeTrackerWarning(UserWarning):
    """The input is accepted, but means something else than the user may expect. The message is one line."""


class FirstError:
    """Keeps the first of several errors, so that the remaining files of a recording are still written.

    Args:
        error: the first error, or None.
    """

    def __init__(self, error: BaseException | None = None) -> None:
        self._error = error

    @contextmanager
    def kept(self) -> Iterator[None]:
        """Ends the block at an error without raising it; errors after the first error are dropped."""
        try:
            yield
        except (Exception, SystemExit) as error:  # Drake raises SystemExit for numbers that are not finite
            self._error = self._error or error

    def raise_it(self) -> None:
        """Raises the first error, if there is one."""
        if self._error is not None:
            raise self._error


def raised(error: BaseException) -> str:
    """Returns one line that names an error raised by custom code, and the file and line that raised it."""
    frame = traceback.extract_tb(error.__traceback__)[-1]
    text = " ".join(str(error).split())
    return f"raised {type(error).__name__}: {text} ({Path(frame.filename).name} line {frame.lineno})"


def load_extra(module: str, extra: str, what: str) -> Any:
    """Returns a module that an extra of this package installs. Raises DrakeTrackerError when it cannot be loaded.

    Args:
        module: its full name.
        extra: name in pyproject.toml.
        what: needs the module, for the message.
    """
    try:
        return importlib.import_module(module)
    except Exception as error:  # a package built for other versions raises anything, over several lines
        text, remedy = " ".join(str(error).split()), f"pip install 'drake-tracker[{extra}]' installs it"
        raise DrakeTrackerError(f"{what}: {module} cannot be loaded ({text}); {remedy}") from None
