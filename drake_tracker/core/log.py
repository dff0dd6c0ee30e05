"""The log of a run, in memory and as a file: all vector signals with the names of their fields.

A finished run has the file `LOG_FILE`, an npz archive. A run that is under way, or was killed, has `STREAM_FILE`, a
file that grows during the run and is readable however the process ended.

The stream begins with `MAGIC`. Records follow, each with a header of two little-endian 32-bit numbers, the length of
its content and the CRC-32 of the content. The first record is JSON in UTF-8, {"signals": {name: [names of the
fields]}}. Every further record has the samples since the previous record. For each signal, in the order of the first
record, it has the number of samples n (32 bits), then n times [s], then n rows with a number for each field, all as
little-endian 64-bit floating-point numbers. A record is complete or does not count. Hence all signals that are read end
at the same instant.
"""

import json
import os
import struct
import zlib
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.files.atomic_file import replacing
from drake_tracker.core.files.npz_file import load_arrays
from drake_tracker.core.files.regular_file import open_regular

LOG_FILE, STREAM_FILE = "log.npz", "log.part"
"""Names of the files in a run directory."""
LARGEST_LOG = 1 << 31
"""Largest log in memory [bytes], some 100 minutes of a run."""


@dataclass(frozen=True)
class Signal:
    """One logged signal.

    Attributes:
        times: sampling times [s], shape (n,).
        data: samples, shape (n, k).
        names: names of the k fields.
    """

    times: np.ndarray
    data: np.ndarray
    names: tuple[str, ...]

    def __getitem__(self, name: str) -> np.ndarray:
        """Returns one field over time, shape (n,)."""
        return self.data[:, self.names.index(name)]

    def view(self, *names: str) -> np.ndarray:
        """Returns several fields over time, shape (n, len(names))."""
        return self.data[:, [self.names.index(name) for name in names]]


def save_log(log: Mapping[str, Signal], path: Path) -> None:
    """Writes a log as one npz file. Raises DrakeTrackerError when it cannot be written; an old file is then kept.

    Args:
        log: {name: Signal}. The file holds three arrays for each: ``<name>``, ``<name>.time`` and ``<name>.names``.
        path: file to write, ``*.npz``.
    """
    arrays = {}
    for name, signal in log.items():
        arrays[name] = signal.data
        arrays[f"{name}.time"] = signal.times
        arrays[f"{name}.names"] = np.array(signal.names)
    with replacing(path) as beside:
        np.savez_compressed(beside, **arrays)  # type: ignore[arg-type]


def find_log(folder: Path | str) -> Path | None:
    """Returns the path of the log in a run directory, or None: `LOG_FILE`, or else `STREAM_FILE`."""
    places = [Path(folder) / name for name in (LOG_FILE, STREAM_FILE)]
    return next((place for place in places if place.exists()), None)


def load_log(path: Path | str, most: int = LARGEST_LOG) -> dict[str, Signal]:
    """Returns {name: Signal} of a log.

    Args:
        path: run directory, or a file that `save_log` or a `LogStream` wrote. Where there is no `LOG_FILE`, the stream
            is read.
        most: largest size of the log in memory [bytes].

    Raises DrakeTrackerError, in one line, when it cannot be read, is damaged, or is larger.
    """
    path = Path(path)
    folder = path.parent if path.name == LOG_FILE else path
    if folder.is_dir():
        path = find_log(folder) or folder / LOG_FILE
    try:
        file = open_regular(path, most)
    except OSError as error:
        raise DrakeTrackerError(f"{path}: cannot be read: {error.strerror}") from None
    with file:
        try:
            if path.name == STREAM_FILE:
                found = [(name, *columns) for name, columns in read_stream(file).items()]
            else:
                found = list(_signals(load_arrays(file, most)))
            return {name: _checked(name, times, data, names) for name, times, data, names in found}
        except Exception as error:  # numpy, zipfile and zlib raise many kinds of errors for a damaged file
            reason = " ".join(str(error).split()) or type(error).__name__
            raise DrakeTrackerError(f"{path}: this log is damaged or incomplete: {reason}") from None


def _signals(arrays: Mapping[str, np.ndarray]) -> Iterable[tuple[str, np.ndarray, np.ndarray, tuple[str, ...]]]:
    for name in (key for key in arrays if "." not in key):
        yield name, arrays[f"{name}.time"], arrays[name], tuple(arrays[f"{name}.names"].tolist())


def _checked(name: str, times: np.ndarray, data: np.ndarray, names: tuple[str, ...]) -> Signal:
    """Returns a signal. Raises ValueError when its arrays do not fit together."""
    for array in (times, data):
        if array.dtype.kind not in "fiu":
            raise ValueError(f"{name} has an array of type {array.dtype}, which are not numbers")
    if times.ndim != 1 or data.shape != (len(times), len(names)):
        raise ValueError(f"{name} has samples of shape {data.shape} for {times.shape} times and {len(names)} fields")
    if not all(isinstance(field, str) for field in names) or len(set(names)) < len(names):
        raise ValueError(f"{name} has fields without names of their own")
    if not np.isfinite(times).all() or np.any(np.diff(times) < 0.0):
        raise ValueError(f"{name} has times that are not finite or not in order")
    return Signal(times, data, names)


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
        """Appends new samples."""
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
