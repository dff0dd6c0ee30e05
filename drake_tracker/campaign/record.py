"""The file of results that grows by one line at each trial: nothing that is in it is ever lost."""

import fcntl
import json
import os
from pathlib import Path

from drake_tracker.core.errors import DrakeTrackerError


class Record:
    """Results on disk, one JSON object a line, each written at once.

    Opening keeps every result that is in the file and cuts off what a killed writer left of its last line. One process
    at a time has it open. Raises DrakeTrackerError when the file cannot be read or written, or another process has it.

    Args:
      path: the file, made when there is none; None keeps results in memory alone.
    """

    def __init__(self, path):
        self.path = None if path is None else Path(path)
        self.rows = []
        self._file = None
        if self.path is None:
            return
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._file = os.open(self.path, os.O_RDWR | os.O_CREAT, 0o666)
            self._lock()
            self._read()
        except OSError as error:
            self.close()
            raise self._trouble(error) from None
        except DrakeTrackerError:
            self.close()
            raise

    def append(self, row):
        """Adds a result, a dict, to the file and to ``rows``. When the disk is full the file stays as it was."""
        if self._file is not None:
            self._write((json.dumps(row, separators=(",", ":")) + "\n").encode())
        self.rows.append(row)

    def close(self):
        """Lets go of the file."""
        if self._file is not None:
            os.close(self._file)
            self._file = None

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def _lock(self):
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise DrakeTrackerError(f"{self.path}: another process is writing to it; wait until it has ended") from None
        except OSError:
            pass  # a file system without locks

    def _read(self):
        data = self.path.read_bytes()
        end = data.rfind(b"\n") + 1
        self.rows = parse_lines(data[:end], self.path)
        try:
            self.rows += parse_lines(data[end:], self.path)
        except DrakeTrackerError:
            os.ftruncate(self._file, end)
        else:
            if end < len(data):
                self._write(b"\n")

    def _write(self, data):
        size = os.lseek(self._file, 0, os.SEEK_END)
        try:
            rest = memoryview(data)
            while rest:
                rest = rest[os.write(self._file, rest) :]
            os.fsync(self._file)
        except OSError as error:
            os.ftruncate(self._file, size)
            raise self._trouble(error) from None

    def _trouble(self, error):
        return DrakeTrackerError(f"{self.path}: {error.strerror}")


def read_lines(path):
    """Returns the results that a file holds, one JSON object a line; none when there is no file.

    Raises DrakeTrackerError when a line is not one.
    """
    path = Path(path)
    return parse_lines(path.read_bytes(), path) if path.exists() else []


def parse_lines(data, path):
    """Returns the results of a file's bytes; ``path`` is for messages."""
    rows = []
    for number, line in enumerate(data.split(b"\n"), 1):
        if not line.strip():
            continue
        try:
            row = json.loads(line)
        except ValueError:  # not UTF-8 is one as well
            row = None
        if not isinstance(row, dict):
            raise DrakeTrackerError(f"{path} line {number}: not a result, a JSON object; mend the line or take it out")
        rows.append(row)
    return rows
