"""The log of a run, in memory and as a file: all vector signals with the names of their fields.

A finished run has the file `LOG_FILE`, an npz archive. A run that is under way, or was killed, has `STREAM_FILE`, which
`core/log_stream.py` describes.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.files.atomic_file import replacing
from drake_tracker.core.files.npz_file import load_arrays
from drake_tracker.core.files.regular_file import open_regular
from drake_tracker.core.log_stream import read_stream

LOG_FILE, STREAM_FILE = "log.npz", "log.part"
"""Names of the files in a run directory."""


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


def load_log(path: Path | str, most: int | None = None) -> dict[str, Signal]:
    """Returns {name: Signal} of a log.

    Args:
        path: run directory, or a file that `save_log` or a `LogStream` wrote. Where there is no `LOG_FILE`, the stream
            is read.
        most: largest size of the log in memory [bytes]; None: any.

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
