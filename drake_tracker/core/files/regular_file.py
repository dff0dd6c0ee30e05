"""Reading files of unknown origin: no pipe or device blocks the reader, and no file is larger than expected."""

import errno
import os
import stat
import unicodedata
from pathlib import Path
from typing import BinaryIO

LARGEST = 256 * 1024
"""Greatest size of a text file of settings [bytes]; a scenario with every setting has about 6,000."""


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


def read_text(path: str | os.PathLike[str], largest: int = LARGEST, encoding: str = "utf-8") -> str:
    """Returns the content of a text file.

    Args:
        path: the file.
        largest: its greatest size [bytes].
        encoding: of the text.

    Raises OSError, with a reason in ``strerror``, when the file does not exist, cannot be read, is larger, or is not a
    regular file (a pipe or a device could block for ever). Raises UnicodeDecodeError when it is not text.
    """
    return read_regular(path, largest).decode(encoding)


def is_file(path: str | os.PathLike[str]) -> bool:
    """Returns whether there is a regular file at a path, also for a path that no file could have."""
    try:
        return stat.S_ISREG(os.stat(path).st_mode)
    except (OSError, ValueError):  # for example a name that is too long, or with a null character
        return False


def printable(text: str) -> str:
    """Returns a text in which control characters, with which a file could rewrite a terminal, are spelled out."""
    return "".join(ascii(c)[1:-1] if unicodedata.category(c) in ("Cc", "Cs") else c for c in text)
