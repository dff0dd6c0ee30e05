"""Reads text files that anybody may have written: only regular files, and only up to a size."""

import os
import stat
import unicodedata

from drake_tracker.core.files.regular_file import read_regular

LARGEST = 256 * 1024
"""Greatest size of a text file of settings [bytes]; a scenario with every setting has about 6,000."""


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
