"""The messages of a ROS 2 bag, in either format: MCAP, or SQLite files (.db3)."""

import re
import sqlite3
import struct
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Protocol

from drake_tracker.core.errors import DrakeTrackerError


class BagStorage(Protocol):
    """Where the messages of a bag are stored."""

    broken: tuple[type[Exception], ...]
    """Exceptions that a damaged bag raises."""

    def topics(self) -> dict[str, str]:
        """Returns {topic: type of its messages}."""
        ...

    def messages(self, topic: str) -> Iterator[tuple[int, bytes]]:
        """Yields (time of recording [ns], message) of a topic, in the order of time."""
        ...


class SqliteStorage:
    """Files that rosbag2 wrote with its storage ``sqlite3``; they are opened read-only.

    Args:
        files: in the order of time.
    """

    broken: tuple[type[Exception], ...] = (sqlite3.Error, ValueError, OSError, TypeError)

    def __init__(self, files: Sequence[Path]) -> None:
        self._files = files

    def topics(self) -> dict[str, str]:
        """Returns {topic: type of its messages}."""
        found: dict[str, str] = {}
        for file in self._files:
            with _connected(file) as base:
                found |= {str(name): str(kind) for name, kind in base.execute("SELECT name, type FROM topics")}
        return found

    def messages(self, topic: str) -> Iterator[tuple[int, bytes]]:
        """Yields (time of recording [ns], message) of a topic, in the order of time."""
        for file in self._files:
            with _connected(file) as base:
                for stamp, data in base.execute(
                    "SELECT m.timestamp, m.data FROM messages m JOIN topics t ON m.topic_id = t.id "
                    "WHERE t.name = ? ORDER BY m.timestamp",
                    (topic,),
                ):
                    if not isinstance(stamp, int) or not isinstance(data, bytes):
                        raise ValueError("a message has no time or no data")
                    yield stamp, data


class _connected:
    """A connection to a SQLite file, read-only, closed at the end."""

    def __init__(self, file: Path) -> None:
        # Nothing is written beside the file, unless a recording that was not ended left its log there.
        more = "" if file.with_name(f"{file.name}-wal").exists() else "&immutable=1"
        self._base = sqlite3.connect(f"{file.resolve().as_uri()}?mode=ro{more}", uri=True)

    def __enter__(self) -> sqlite3.Connection:
        return self._base

    def __exit__(self, *_: object) -> None:
        self._base.close()


class McapStorage:
    """Files in MCAP format.

    Args:
        files: in the order of time.

    Raises DrakeTrackerError when the package ``mcap`` is not installed.
    """

    def __init__(self, files: Sequence[Path]) -> None:
        try:
            from mcap.exceptions import McapError
            from mcap.reader import make_reader
        except ImportError:
            raise DrakeTrackerError(
                "reading an MCAP file needs the package mcap: pip install 'drake-tracker[rosbag]'"
            ) from None
        self._files, self._make_reader = files, make_reader
        self.broken: tuple[type[Exception], ...] = (
            McapError, OSError, ValueError, IndexError, struct.error, EOFError, RuntimeError,
        )  # fmt: skip

    def topics(self) -> dict[str, str]:
        """Returns {topic: type of its messages}."""
        found: dict[str, str] = {}
        for file in self._files:
            with open(file, "rb") as stream:
                summary = self._make_reader(stream).get_summary()
            if summary is not None:
                kinds = {key: schema.name for key, schema in summary.schemas.items()}
                found |= {each.topic: kinds.get(each.schema_id, "") for each in summary.channels.values()}
        return found

    def messages(self, topic: str) -> Iterator[tuple[int, bytes]]:
        """Yields (time of recording [ns], message) of a topic, in the order of time."""
        for file in self._files:
            with open(file, "rb") as stream:
                for _, _, message in self._make_reader(stream).iter_messages(topics=[topic]):
                    yield message.log_time, message.data


SUFFIXES: dict[str, Callable[[Sequence[Path]], BagStorage]] = {".mcap": McapStorage, ".db3": SqliteStorage}
"""{suffix of a bag's files: class that reads them}."""


def find_storage(path: str | Path) -> BagStorage:
    """Returns the storage of a bag.

    Args:
        path: a file, or the folder that rosbag2 writes; the files of a split recording are read one after the other.

    Raises DrakeTrackerError when there is no file of a bag, or there are files of both formats.
    """
    path = Path(path)
    if not path.is_dir():
        return SUFFIXES[path.suffix]([path])
    files = sorted((file for file in path.iterdir() if file.suffix in SUFFIXES), key=_number)
    suffixes = {file.suffix for file in files}
    if len(suffixes) != 1:
        packed = any(file.suffix in (".zstd", ".zst") for file in path.iterdir())
        hint = "; decompress its files with zstd -d first" if packed else ""
        raise DrakeTrackerError(
            f"{path}: this folder contains {len(files)} files .mcap and .db3; name one of them{hint}"
        )
    return SUFFIXES[suffixes.pop()](files)


def is_bag(path: str | Path) -> bool:
    """Returns whether a path names a bag: a file, or a folder with such files or rosbag2's metadata."""
    path = Path(path)
    if path.is_dir():
        return (path / "metadata.yaml").is_file() or any(file.suffix in SUFFIXES for file in path.iterdir())
    return path.suffix in SUFFIXES


def _number(file: Path) -> tuple[int, str]:
    """Returns a key that sorts bag_2.db3 before bag_10.db3."""
    number = re.search(r"([0-9]+)$", file.stem)
    return (int(number[1]) if number else -1, file.name)
