"""Files that are complete or absent: they are written under another name beside their place, and then renamed."""

import os
import secrets
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from drake_tracker.core.errors import DrakeTrackerError


@contextmanager
def replacing(path: Path | str) -> Iterator[Path]:
    """Yields the path of a new file, which replaces the file ``path`` at the end of the block.

    However the process ends, ``path`` is at any time either the old file or the complete new one. A symbolic link is
    replaced and never followed. When the block raises, the new file is removed and the old one is left unchanged.

    Args:
        path: file to write. The yielded path is in the same folder and has the same suffix.

    Raises DrakeTrackerError, one line that names the file, when it cannot be written, for example on a full disk, or
    when ``path`` is a folder, a device or a pipe.
    """
    path = Path(path)
    beside = path.with_name(f".{path.stem[:100]}.{secrets.token_hex(4)}{path.suffix}")
    try:
        with suppress(FileNotFoundError):
            if not stat.S_ISREG(mode := path.lstat().st_mode) and not stat.S_ISLNK(mode):
                raise DrakeTrackerError(f"{path}: cannot be written: it is not a regular file")
        yield beside
        _flush(beside)
        os.replace(beside, path)
    except OSError as error:
        raise unwritable(path, error) from None
    finally:
        with suppress(OSError):
            beside.unlink(missing_ok=True)


def write_text(path: Path | str, text: str) -> None:
    """Writes a text file in UTF-8, see `replacing`.

    Half a surrogate pair, which a damaged JSON file may contain, is no character and is written as an escape.
    """
    with replacing(path) as beside:
        beside.write_text(text, encoding="utf-8", errors="backslashreplace")


def write_bytes(path: Path | str, data: bytes | memoryview) -> None:
    """Writes a binary file, see `replacing`."""
    with replacing(path) as beside:
        beside.write_bytes(data)


def unwritable(path: Path | str, error: OSError) -> DrakeTrackerError:
    """Returns the error for a file that cannot be written, in one line."""
    return DrakeTrackerError(f"{path}: cannot be written: {error.strerror or error}")


def _flush(path: Path) -> None:
    """Waits until a file is on the disk, so that a loss of power after the renaming does not leave it empty."""
    file = os.open(path, os.O_RDONLY)
    try:
        os.fsync(file)
    finally:
        os.close(file)
