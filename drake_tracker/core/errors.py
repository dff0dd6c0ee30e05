"""The exceptions that users of the package catch."""

import traceback
from pathlib import Path


class DrakeTrackerError(Exception):
    """The input is wrong, or this machine cannot do the job.

    The message says what is wrong, where, and what is allowed or what to do. It is one line, or one line per problem
    where several are found at once. The command line prints it and exits with code 2.
    """


class MachineError(DrakeTrackerError):
    """This machine cannot do the job, whatever the scenario. For example, it cannot render images."""


def raised(error: BaseException) -> str:
    """Returns one line that names an error raised by custom code, and the file and line that raised it."""
    frame = traceback.extract_tb(error.__traceback__)[-1]
    text = " ".join(str(error).split())
    return f"raised {type(error).__name__}: {text} ({Path(frame.filename).name} line {frame.lineno})"
