"""Reading npz archives of unknown origin: no code is run, and no array is larger than the archive is."""

import zipfile
from typing import BinaryIO

import numpy as np

_HEADERS = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}


def load_arrays(file: BinaryIO, most: int | None = None) -> dict[str, np.ndarray]:
    """Returns {name: array} of an npz archive.

    Args:
        file: the archive, open for reading.
        most: largest size of all arrays in memory [bytes]; None: any.

    Raises ValueError when an array contains objects, does not have the size that its header states, or when the arrays
    are larger than allowed, before they are unpacked. A damaged archive also raises errors of many other kinds.
    """
    total = 0
    with zipfile.ZipFile(file) as archive:
        for member in archive.infolist():
            _check_member(archive, member)
            total += member.file_size
    if most is not None and total > most:
        raise ValueError(f"it has {total} bytes, more than the {most} that are read")
    file.seek(0)
    with np.load(file, allow_pickle=False) as arrays:
        return dict(arrays)


def _check_member(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> None:
    with archive.open(member) as file:
        version = np.lib.format.read_magic(file)
        if version not in _HEADERS:
            raise ValueError(f"{member.filename} has the unknown format {version}")
        shape, _, dtype = _HEADERS[version](file)
        if dtype.hasobject or not dtype.itemsize:
            raise ValueError(f"{member.filename} has the type {dtype}, which are not numbers")
        if file.tell() + dtype.itemsize * np.prod(shape, dtype=object) != member.file_size:
            raise ValueError(f"{member.filename} does not have the size that it states")
