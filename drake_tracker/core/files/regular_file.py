"""Reading files of unknown origin: no pipe or device blocks the reader, and no file is larger than expected."""

import errno
import os
import stat
from pathlib import Path
from typing import BinaryIO


def open_regular(path: Path | str | os.PathLike[str], most: int | None = None) -> BinaryIO:
    """Returns a regular file, open for reading in binary.

    Args:
        path: of the file. A symbolic link is followed.
        most: greatest size of the file [bytes]; None: any.

    Raises OSError, with a reason in ``strerror``, when it cannot be opened, is a pipe, a device or a folder, or is
    larger.
    """
    file = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    try:
        found = os.fstat(file)
        if not stat.S_ISREG(found.st_mode):
            raise OSError(errno.EINVAL, "it is not a regular file", str(path))
        if most is not None and found.st_size > most:
            raise OSError(errno.EFBIG, f"it has more than {most // 1024} KiB", str(path))
    except OSError:
        os.close(file)
        raise
    return os.fdopen(file, "rb")


def read_regular(path: Path | str | os.PathLike[str], most: int) -> bytes:
    """Returns the content of a regular file of at most ``most`` bytes, see `open_regular`."""
    with open_regular(path, most) as file:
        return file.read(most)
