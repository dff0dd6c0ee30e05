"""Rows of a CSV file that somebody else has written, with their line numbers."""

import csv
import io
from collections.abc import Iterator

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.files.regular_file import read_text

_LONGEST = 60
"""Greatest length of a row in a message [characters]."""


def read_rows(path: str, what: str, largest: int) -> Iterator[tuple[int, list[str]]]:
    """Yields (line, cells) of each row that is not empty. The cells have no spaces around them.

    Args:
        path: the file.
        what: name of the kind of file, for messages: "track file".
        largest: greatest size of the file [bytes].

    Raises DrakeTrackerError when the file cannot be read or is not CSV.
    """
    try:
        reader = csv.reader(io.StringIO(read_text(path, largest, encoding="utf-8-sig"), newline=""))
        for row in reader:
            cells = [cell.strip() for cell in row]
            if any(cells):
                yield reader.line_num, cells
    except OSError as error:
        raise DrakeTrackerError(f"{what} '{path}' cannot be read: {error.strerror}") from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise DrakeTrackerError(f"{what} {path} is not a text file of comma-separated values") from error


def shown(cells: list[str]) -> str:
    """Returns a row for a message, shortened."""
    text = ",".join(cells)
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 3]}..."
