"""The one error a user of the package ever needs to catch."""

import traceback
from pathlib import Path


class DrakeTrackerError(Exception):
    """Bad input or a broken machine.

    The message is one clear line: what is wrong, where, and what is allowed or what to do. The command line prints
    it and exits with code 2.
    """


class MachineError(DrakeTrackerError):
    """The machine cannot do what it is asked for, whatever the scenario: there is no renderer, say."""


def raised(error):
    """Returns in words which error the user's own code raised, and in which line of it, for a message of one line."""
    frame = traceback.extract_tb(error.__traceback__)[-1]
    text = " ".join(str(error).split())
    return f"raised {type(error).__name__}: {text} ({Path(frame.filename).name} line {frame.lineno})"
