"""Reading files of unknown origin: no pipe or device blocks the reader, and no file is larger than expected."""

import os
import stat
from pathlib import Path
from typing import BinaryIO

from drake_tracker.core.errors import DrakeTrackerError


def open_regular(path: Path | str, most: int | None = None) -> BinaryIO:
    """Returns a regular file, open for reading in binary.

    Args:
        path: of the file. A symbolic link is followed.
        most: largest size of the file [bytes]; None: any.

    Raises DrakeTrackerError, in one line, when it cannot be opened, is a pipe, device or folder, or is too large.
    """
    try:
        file = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    except OSError as error:
        raise DrakeTrackerError(f"{path}: cannot be read: {error.strerror}") from None
    found = os.fstat(file)
    problem = None
    if not stat.S_ISREG(found.st_mode):
        problem = "it is not a regular file"
    elif most is not None and found.st_size > most:
        problem = f"it has {found.st_size} bytes, more than the {most} that are read"
    if problem:
        os.close(file)
        raise DrakeTrackerError(f"{path}: cannot be read: {problem}")
    return os.fdopen(file, "rb")


def read_regular(path: Path | str, most: int) -> bytes:
    """Returns the content of a regular file of at most ``most`` bytes, see `open_regular`."""
    with open_regular(path, most) as file:
        try:
            return file.read(most)
        except OSError as error:
            raise DrakeTrackerError(f"{path}: cannot be read: {error.strerror}") from None
