"""The file of results, which grows by one line with each trial and never loses a result."""

from __future__ import annotations

import fcntl
import json
import os
import stat
from pathlib import Path
from typing import Any

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.processes.signals import held


class Record:
    """Results on disk, one JSON object per line. Each result is written and flushed to the disk at once.

    Opening the file keeps every complete result and drops an incomplete last line, which a killed writer may have left.
    Only one process at a time can have the file open. A symbolic link is refused: in a directory from somebody else it
    may lead to any file. Raises DrakeTrackerError when the file cannot be read or written, or when another process has
    it open.

    Args:
        path: the file, created when it does not exist; None keeps the results in memory only.

    Attributes:
        path: the file, or None.
        rows: the results, in the order of the file.
        notes: a line for what was wrong in the file and could be put right.
    """

    def __init__(self, path: str | os.PathLike[str] | None) -> None:
        self.path = None if path is None else Path(path)
        self.rows: list[dict[str, Any]] = []
        self.notes: list[str] = []
        self._file: int | None = None
        if self.path is None:
            return
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            if self.path.is_symlink():
                raise DrakeTrackerError(f"{self.path}: it is a symbolic link, which is not followed; remove it")
            flags = os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
            self._file = os.open(self.path, flags, 0o666)
            if not stat.S_ISREG(os.fstat(self._file).st_mode):
                raise DrakeTrackerError(f"{self.path}: it is not a regular file")
            self._lock(self._file)
            self._read(self._file, self.path)
        except OSError as error:
            self.close()
            raise self._trouble(error) from None
        except DrakeTrackerError:
            self.close()
            raise

    def append(self, row: dict[str, Any]) -> None:
        """Adds a result to the file and to ``rows``. When the disk is full, the file keeps its earlier content.

        Args:
            row: fit for JSON.
        """
        with held():  # Ctrl-C does not divide a line
            if self._file is not None:
                self._write(self._file, (json.dumps(row, separators=(",", ":")) + "\n").encode())
            self.rows.append(row)

    def close(self) -> None:
        """Closes the file, so that other processes can open it."""
        if self._file is not None:
            os.close(self._file)
            self._file = None

    def __enter__(self) -> Record:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _lock(self, file: int) -> None:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise DrakeTrackerError(f"{self.path}: another process is writing to it; wait until it has ended") from None
        except OSError:
            pass  # a file system without locks

    def _read(self, file: int, path: Path) -> None:
        data = path.read_bytes()
        end = data.rfind(b"\n") + 1
        self.rows = parse_lines(data[:end], path)
        try:
            self.rows += parse_lines(data[end:], path)
        except DrakeTrackerError:
            os.ftruncate(file, end)
            self.notes.append(f"{path}: the last line is incomplete and was dropped; its trial is run again")
        else:
            if end < len(data):
                self._write(file, b"\n")

    def _write(self, file: int, data: bytes) -> None:
        size = os.lseek(file, 0, os.SEEK_END)
        try:
            rest = memoryview(data)
            while rest:
                rest = rest[os.write(file, rest) :]
            os.fsync(file)
        except OSError as error:
            os.ftruncate(file, size)
            raise self._trouble(error) from None

    def _trouble(self, error: OSError) -> DrakeTrackerError:
        return DrakeTrackerError(f"{self.path}: {error.strerror}")


def read_lines(path: str | os.PathLike[str]) -> list[dict[str, Any]]:
    """Returns the results in a file, one JSON object per line; an empty list when there is no file.

    Raises DrakeTrackerError when a line is not a result.
    """
    path = Path(path)
    return parse_lines(path.read_bytes(), path) if path.exists() else []


def parse_lines(data: bytes, path: Path) -> list[dict[str, Any]]:
    """Returns the results in the content of a file. Raises DrakeTrackerError when a line is not a result.

    Args:
        data: content of the file.
        path: the file, for messages.
    """
    rows = []
    for number, line in enumerate(data.split(b"\n"), 1):
        if not line.strip():
            continue
        try:
            row = json.loads(line)
        except (ValueError, RecursionError):  # also raised when the line is not UTF-8
            row = None
        if not isinstance(row, dict):
            raise DrakeTrackerError(f"{path} line {number}: not a result (a JSON object); repair the line or remove it")
        rows.append(row)
    return rows
