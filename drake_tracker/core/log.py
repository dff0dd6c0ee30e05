"""The log of a run, in memory and as an npz file: all vector signals with the names of their fields."""

import tokenize
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from drake_tracker.core.errors import DrakeTrackerError

_DAMAGED = (OSError, ValueError, EOFError, KeyError, zipfile.BadZipFile, zlib.error, tokenize.TokenError)
"""Errors that numpy raises for a damaged file: from reading it, from the archive, and from the header of an array."""


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
    """Writes a log as one npz file.

    Args:
        log: {name: Signal}. The file holds three arrays for each: ``<name>``, ``<name>.time`` and ``<name>.names``.
        path: file to write, ``*.npz``.
    """
    arrays = {}
    for name, signal in log.items():
        arrays[name] = signal.data
        arrays[f"{name}.time"] = signal.times
        arrays[f"{name}.names"] = np.array(signal.names)
    np.savez_compressed(path, **arrays)  # type: ignore[arg-type]


def load_log(path: Path | str) -> dict[str, Signal]:
    """Returns {name: Signal} from a file that `save_log` wrote. Raises DrakeTrackerError when it cannot be read."""
    try:
        with np.load(path) as arrays:
            names = [key for key in arrays.files if "." not in key]
            fields = {name: tuple(arrays[f"{name}.names"].tolist()) for name in names}
            data = {name: [_numbers(arrays[key]) for key in (f"{name}.time", name)] for name in names}
            return {name: Signal(data[name][0], data[name][1], fields[name]) for name in names}
    except _DAMAGED as error:
        raise DrakeTrackerError(f"{path}: this log is damaged or incomplete: {error}") from None


def _numbers(array: np.ndarray) -> np.ndarray:
    if array.dtype.kind not in "fiu":
        raise ValueError(f"it has an array of type {array.dtype}, which are not numbers")
    return array
