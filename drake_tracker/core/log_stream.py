"""The stream of a log: a file that grows during a run and is readable however the process ended.

The file begins with `MAGIC`. Records follow, each with a header of two little-endian 32-bit numbers, the length of its
content and the CRC-32 of the content. The first record is JSON in UTF-8, {"signals": {name: [names of the fields]}}.
Every further record has what was logged since the one before. For each signal, in the order of the first record, it has
the number of samples n (32 bits), then n times [s], then n rows with a number for each field, all as little-endian
64-bit floating-point numbers.

A record is complete or does not count. Hence all signals that are read end at the same instant.
"""

import json
import os
import struct
import zlib
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO

import numpy as np

MAGIC = b"drake_tracker log stream 1\n"
_HEADER = struct.Struct("<II")
_COUNT, _NUMBER = np.dtype("<u4"), np.dtype("<f8")
_LARGEST_RECORD = 1 << 28
"""Greatest length of a record [bytes]; a longer one is damaged."""

News = Mapping[str, tuple[np.ndarray, np.ndarray]]
"""{name: (times [s], shape (n,), samples, shape (n, k))} of new samples."""
Columns = dict[str, tuple[np.ndarray, np.ndarray, tuple[str, ...]]]
"""{name: (times [s], shape (n,), samples, shape (n, k), names of the fields)}."""


class LogStream:
    """Writes a stream. Every record is handed to the operating system at once, so that a killed process keeps it.

    Raises OSError when the file cannot be written, for example on a full disk. A record is then written completely or
    removed again.

    Args:
        path: file to write.
        fields: {name of a signal: names of its fields}.
    """

    def __init__(self, path: Path, fields: Mapping[str, Sequence[str]]) -> None:
        self.path = path
        self._fields = {name: tuple(names) for name, names in fields.items()}
        flags = os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_APPEND | os.O_NOFOLLOW | os.O_CLOEXEC
        self._file: int | None = os.open(path, flags, 0o666)
        self._size = 0
        self._write(MAGIC + _record(json.dumps({"signals": self._fields}).encode()))

    def append(self, news: News) -> None:
        """Appends new samples.

        Args:
            news: new samples of every signal.
        """
        parts = []
        for name, names in self._fields.items():
            times, data = (np.ascontiguousarray(array, _NUMBER) for array in news[name])
            if data.shape != (len(times), len(names)):
                raise ValueError(f"{name}: {data.shape} samples of {len(names)} fields at {len(times)} times")
            parts += [np.array(len(times), _COUNT).tobytes(), times.tobytes(), data.tobytes()]
        self._write(_record(b"".join(parts)))

    def close(self) -> None:
        """Closes the file. A second call does nothing."""
        if self._file is not None:
            file, self._file = self._file, None
            os.close(file)

    def remove(self) -> None:
        """Closes and removes the file, when the log was saved elsewhere."""
        self.close()
        self.path.unlink(missing_ok=True)

    def _write(self, data: bytes) -> None:
        if self._file is None:
            return
        try:
            rest = memoryview(data)
            while rest:
                rest = rest[os.write(self._file, rest) :]
        except OSError:
            os.ftruncate(self._file, self._size)
            self.close()
            raise
        self._size += len(data)


def read_stream(file: BinaryIO) -> Columns:
    """Returns the signals of a stream, up to its last complete record; none when the first record is not complete.

    Args:
        file: the stream, open for reading.

    Raises ValueError when the file does not begin like a stream.
    """
    start = file.read(len(MAGIC))
    if start != MAGIC[: len(start)]:
        raise ValueError("it is not the stream of a log")
    first = _read_record(file)
    if first is None:
        return {}
    fields = _fields(first)
    rows: dict[str, list[np.ndarray]] = {name: [np.zeros((0, 1 + len(names)))] for name, names in fields.items()}
    with suppress(ValueError):  # what follows a damaged record is not read
        while record := _read_record(file):
            for name, found in _samples(record, fields).items():
                rows[name].append(found)
    columns: Columns = {}
    for name, names in fields.items():
        table = np.concatenate(rows[name])
        columns[name] = (table[:, 0].copy(), table[:, 1:].copy(), names)
    return columns


def _record(content: bytes) -> bytes:
    return _HEADER.pack(len(content), zlib.crc32(content)) + content


def _read_record(file: BinaryIO) -> bytes | None:
    """Returns the content of the next record, or None at the end of the file. Raises ValueError when it is damaged."""
    header = file.read(_HEADER.size)
    if len(header) < _HEADER.size:
        return None
    length, checksum = _HEADER.unpack(header)
    if not 0 < length <= _LARGEST_RECORD:
        raise ValueError("it has a damaged record")
    content = file.read(length)
    if len(content) < length:
        return None
    if zlib.crc32(content) != checksum:
        raise ValueError("it has a damaged record")
    return content


def _fields(record: bytes) -> dict[str, tuple[str, ...]]:
    try:
        fields = json.loads(record)["signals"]
        if all(isinstance(text, str) for names in fields.values() for text in names):
            return {name: tuple(names) for name, names in fields.items()}
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
        pass
    raise ValueError("it does not name its signals")


def _samples(record: bytes, fields: Mapping[str, tuple[str, ...]]) -> dict[str, np.ndarray]:
    """Returns {name: rows of time and sample, shape (n, 1 + k)} of a record. Raises ValueError when it is too short."""
    found, at = {}, 0
    for name, names in fields.items():
        (count,) = np.frombuffer(record, _COUNT, 1, at).tolist()
        at += _COUNT.itemsize
        values = np.frombuffer(record, _NUMBER, count * (1 + len(names)), at)
        at += values.nbytes
        found[name] = np.column_stack([values[:count], values[count:].reshape(count, len(names))])
    return found
