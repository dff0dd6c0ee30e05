"""The messages of a ROS 2 bag, in either format: MCAP, or SQLite files (.db3)."""

import re
import sqlite3
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Protocol

from drake_tracker.core.errors import DrakeTrackerError, load_extra
from drake_tracker.core.files.regular_file import open_regular

LARGEST_MESSAGE = 400_000_000
"""Largest message, record and decompressed chunk [bytes]; an image of 100 million pixels has 300 million."""
_TABLES = {"topics", "messages"}
"""Tables of rosbag2 that are read."""
_READING = (sqlite3.SQLITE_SELECT, sqlite3.SQLITE_READ)


class BagStorage(Protocol):
    """Where the messages of a bag are stored. Its methods raise any exception when a file is damaged."""

    def topics(self) -> dict[str, str]:
        """Returns {topic: type of its messages}."""
        ...

    def messages(self, topic: str) -> Iterator[tuple[int, bytes]]:
        """Yields (time of recording [ns], message) of a topic, in the order of time."""
        ...


class SqliteStorage:
    """Files that rosbag2 wrote with its storage ``sqlite3``; they are opened read-only.

    A file can contain more than data: views and generated columns are computed when they are read, and would fill the
    disk. Only plain tables are read, functions are not allowed, and the messages are fetched one by one.

    Args:
        files: in the order of time.
    """

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
                numbers = [number for (number,) in base.execute("SELECT id FROM topics WHERE name = ?", (topic,))]
                for number in numbers:
                    rows = base.execute(
                        "SELECT timestamp, rowid FROM messages WHERE topic_id = ? ORDER BY timestamp", (number,)
                    )
                    for stamp, row in rows.fetchall():
                        data = base.execute("SELECT data FROM messages WHERE rowid = ?", (row,)).fetchone()
                        if not isinstance(stamp, int) or data is None or not isinstance(data[0], bytes):
                            raise ValueError("a message has no time or no data")
                        yield stamp, data[0]


class _connected:
    """A connection to a SQLite file, read-only, closed at the end."""

    def __init__(self, file: Path) -> None:
        open_regular(file).close()  # a pipe would block SQLite for ever
        # Nothing is written beside the file, unless a recording that was not ended left its log there.
        more = "" if file.with_name(f"{file.name}-wal").exists() else "&immutable=1"
        self._base = sqlite3.connect(f"{file.resolve().as_uri()}?mode=ro{more}", uri=True)

    def __enter__(self) -> sqlite3.Connection:
        base = self._base
        try:
            for setting in ("trusted_schema=OFF", "cell_size_check=ON", "temp_store=MEMORY"):
                base.execute(f"PRAGMA {setting}")
            base.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, LARGEST_MESSAGE)
            base.set_authorizer(lambda action, *_: sqlite3.SQLITE_OK if action in _READING else sqlite3.SQLITE_DENY)
            parts = base.execute("SELECT type, name, sql FROM sqlite_master").fetchall()
            plain = {
                name
                for kind, name, text in parts
                if kind == "table" and not re.search(r"\b(VIRTUAL|GENERATED|AS)\b", str(text), re.IGNORECASE)
            }
            if not plain >= _TABLES:
                raise ValueError("it has no tables topics and messages as rosbag2 writes them")
        except BaseException:
            base.close()
            raise
        return base

    def __exit__(self, *_: object) -> None:
        self._base.close()


class McapStorage:
    """Files in MCAP format. A file whose recording was not ended has no summary, and is read from its beginning.

    Args:
        files: in the order of time.

    Raises DrakeTrackerError when the package ``mcap`` is not installed.
    """

    def __init__(self, files: Sequence[Path]) -> None:
        load_extra("mcap.stream_reader", "rosbag", "a bag in MCAP format")
        self._files = files

    def topics(self) -> dict[str, str]:
        """Returns {topic: type of its messages}, of those that have messages before the file is damaged."""
        found: dict[str, str] = {}
        for file in self._files:
            try:
                found |= self._summarised(file)
            except Exception:  # there is no summary, or it is damaged
                try:
                    for topic, kind, _, _ in self._records(file):
                        found[topic] = kind
                except Exception:
                    if not found:
                        raise
        return found

    def messages(self, topic: str) -> Iterator[tuple[int, bytes]]:
        """Yields (time of recording [ns], message) of a topic, in the order of time."""
        for file in self._files:
            for each, _, stamp, data in self._records(file):
                if each == topic:
                    yield stamp, data

    def _summarised(self, file: Path) -> dict[str, str]:
        """Returns the topics in the summary at the end of a file. Raises any exception when there is none."""
        from mcap.reader import SeekingReader

        with open_regular(file) as stream:
            summary = SeekingReader(stream, record_size_limit=LARGEST_MESSAGE).get_summary()
        if summary is None:
            raise ValueError("there is no summary")
        kinds = {key: schema.name for key, schema in summary.schemas.items()}
        return {each.topic: kinds.get(each.schema_id, "") for each in summary.channels.values()}

    def _records(self, file: Path) -> Iterator[tuple[str, str, int, bytes]]:
        """Yields (topic, type, time of recording [ns], message) of a file; those of a chunk in the order of time."""
        from mcap.records import Channel, Chunk, Message, Schema
        from mcap.stream_reader import StreamReader, breakup_chunk

        kinds: dict[int, str] = {}
        channels: dict[int, Any] = {}
        with open_regular(file) as stream:
            for record in StreamReader(stream, emit_chunks=True, record_size_limit=LARGEST_MESSAGE).records:
                parts = breakup_chunk(_decompressed(record)) if isinstance(record, Chunk) else [record]
                kinds |= {each.id: each.name for each in parts if isinstance(each, Schema)}
                channels |= {each.id: each for each in parts if isinstance(each, Channel)}
                for each in sorted(
                    (each for each in parts if isinstance(each, Message)), key=lambda message: message.log_time
                ):
                    channel = channels[each.channel_id]
                    yield channel.topic, kinds.get(channel.schema_id, ""), each.log_time, each.data


def _decompressed(chunk: Any) -> Any:
    """Returns a chunk without compression. Raises ValueError when it is larger than `LARGEST_MESSAGE`."""
    import lz4.frame
    import zstandard

    if chunk.compression == "zstd":
        data = zstandard.ZstdDecompressor().stream_reader(chunk.data).read(LARGEST_MESSAGE + 1)
    elif chunk.compression == "lz4":
        data = lz4.frame.LZ4FrameDecompressor().decompress(chunk.data, max_length=LARGEST_MESSAGE + 1)
    else:
        return chunk
    if len(data) > LARGEST_MESSAGE:
        raise ValueError("a chunk is larger than any message")
    return replace(chunk, compression="", data=data)


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
