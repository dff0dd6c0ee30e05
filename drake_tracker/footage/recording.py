"""Records the images of a live camera without loss, with their times, so that a session can be replayed.

A recording is a video ``NAME.mkv`` and a table ``NAME.csv``. The table begins with a line of JSON after ``#``, with
``source``, ``rate`` (images per second that the camera announced) and ``epoch`` (time of the first image [s since
1970]). Then follows the time of each image, counted from the first [s]. Replayed images have the very times of the live
session, which the video can keep to a millisecond only.
"""

import json
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, TextIO

import cv2
import numpy as np

from drake_tracker.core.constants import SIDES
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.files.atomic_file import unwritable
from drake_tracker.core.files.regular_file import is_file, read_text
from drake_tracker.core.processes.worker_thread import WorkerThread
from drake_tracker.footage.encoded_video import LosslessVideo
from drake_tracker.footage.footage import Footage
from drake_tracker.footage.video import open_video

FOLDER = "recording"
"""Name of the folder with the recordings in the directory of a track."""
_WAITING = 16
"""Images that may wait for being written."""
_FASTEST = 500
"""Greatest rate of the video: Matroska has times in milliseconds, which must still tell its images apart."""
_LARGEST = 64 * 1024 * 1024
"""Greatest size of a table of times [bytes]: several days."""


class FootageRecorder:
    """Writes the images of a live camera while they are read.

    Attributes:
        footage: the same images; those read after `begin` are written.
    """

    def __init__(self, footage: Footage) -> None:
        """Prepares a recording; nothing is written yet.

        Args:
            footage: of a live camera. Raises DrakeTrackerError for any other.
        """
        if not footage.live:
            raise DrakeTrackerError(f"--record: {footage.name} is not a live camera")
        self._source = footage
        self.footage = replace(footage, frames=self._frames)
        self._video: LosslessVideo | None = None
        self._table: TextIO | None = None
        self._writer: WorkerThread | None = None

    def begin(self, path: Path) -> None:
        """Creates the files.

        Args:
            path: of both, without suffix. Raises DrakeTrackerError when they cannot be written.
        """
        rate = self._source.rate or 1.0
        try:
            path.parent.mkdir(exist_ok=True)
            self._table = open(path.with_suffix(".csv"), "w", encoding="utf-8")  # noqa: SIM115 - closed by `close`
            facts = {"source": self._source.name, "rate": rate, "epoch": self._source.epoch}
            self._table.write(f"# {json.dumps(facts)}\ntime\n")
            self._table.flush()
        except OSError as error:
            raise unwritable(path, error) from None
        size = self._source.size
        self._video = LosslessVideo(path.with_suffix(".mkv"), _pace(rate), size, colour=True, compressed=True)
        self._writer = WorkerThread(self._write, _WAITING)

    def close(self) -> None:
        """Completes the files. May be called again. Raises DrakeTrackerError when an image could not be written."""
        writer, self._writer = self._writer, None
        try:
            if writer is not None:
                writer.close()
        finally:
            if self._video is not None:
                self._video.close()
            if self._table is not None:
                self._table.close()

    def _frames(self) -> Iterator[tuple[float, np.ndarray]]:
        for time, image in self._source.frames():
            if self._writer is not None:
                self._writer.put((time, image))
            yield time, image

    def _write(self, item: tuple[float, np.ndarray]) -> None:
        time, image = item
        assert self._video is not None and self._table is not None  # both exist before the thread
        self._video.write(cv2.cvtColor(image, cv2.COLOR_RGB2RGBA))
        try:
            self._table.write(f"{time!r}\n")
            self._table.flush()
        except OSError as error:
            raise unwritable(self._table.name, error) from None


def _pace(rate: float) -> int:
    """Returns the images per second of the video, by which the number of an image follows from its time in it."""
    return min(max(1, round(rate)), _FASTEST)


def find_recordings(source: str) -> list[str] | None:
    """Returns the sources in the folder of a recording, or in the directory of its track; None for any other source."""
    for folder in (Path(source), Path(source) / FOLDER):
        videos = [str(folder / f"camera_{side}.mkv") for side in SIDES]
        found = [video for video in videos if is_recording(video)]
        if found:
            return found
    return None


def is_recording(path: str | Path) -> bool:
    """Returns whether a video has a table of times beside it."""
    return str(path).endswith(".mkv") and is_file(path) and is_file(Path(path).with_suffix(".csv"))


def open_recording(path: str | Path) -> Footage:
    """Returns the `Footage` of a recording, with the times and the rate of the live session.

    Args:
        path: of the video.

    Raises DrakeTrackerError, one line, when the video or the table cannot be read.
    """
    facts, times = _read_table(Path(path).with_suffix(".csv"))
    video = open_video(path)
    assert video.times is not None  # it is a file
    count = min(len(times), len(video.times))  # the end of one of them is missing when the process was killed
    pace = _pace(facts["rate"])

    def frames() -> Iterator[tuple[float, np.ndarray]]:
        for shown, image in video.frames():
            number = round(shown * pace)
            if 0 <= number < count:
                yield times[number], image

    return replace(
        video, frames=frames, times=np.array(times[:count]), epoch=facts["epoch"], rate=facts["rate"], name=str(path)
    )


def _read_table(path: Path) -> tuple[dict[str, Any], Sequence[float]]:
    """Returns (facts, times [s]) of the table of a recording."""
    try:
        first, *lines = read_text(path, _LARGEST).split("\n")
        facts = json.loads(first.removeprefix("# "))
        epoch, rate = float(facts["epoch"]), float(facts["rate"])
        times = [float(line) for line in lines[1:-1]]  # the last line may be incomplete
    except (OSError, ValueError, KeyError, TypeError, OverflowError, RecursionError) as error:
        reason = getattr(error, "strerror", None) or "it is no table of times of a recording"
        raise DrakeTrackerError(f"{path}: cannot be read: {reason}") from None
    if not (np.isfinite([epoch, rate, *times]).all() and 0.0 < rate <= 1e5 and (np.diff(times) > 0.0).all() and times):
        raise DrakeTrackerError(f"{path}: the times of a recording must increase, and its rate be above 0")
    return {"epoch": epoch, "rate": rate}, times
