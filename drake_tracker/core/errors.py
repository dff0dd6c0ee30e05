"""The one exception that users of the package need to catch."""

import traceback
from pathlib import Path


class DrakeTrackerError(Exception):
    """Bad input, or a machine that cannot do the job.

    The message is one line that says what is wrong, where, and what is allowed or what to do. The command line prints
    it and exits with code 2.
    """


class MachineError(DrakeTrackerError):
    """This machine cannot do the job, whatever the scenario; for example, it has no renderer."""


def raised(error: BaseException) -> str:
    """Returns one line that says which error custom code raised, and in which line of it."""
    frame = traceback.extract_tb(error.__traceback__)[-1]
    text = " ".join(str(error).split())
    return f"raised {type(error).__name__}: {text} ({Path(frame.filename).name} line {frame.lineno})"
