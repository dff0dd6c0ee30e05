"""A camera video that another process draws and encodes."""

import pickle
import queue
import threading
from collections.abc import Mapping
from multiprocessing.connection import Connection
from pathlib import Path

from drake_tracker.core.errors import MachineError
from drake_tracker.core.processes.child_process import DONE, ChildProcess, run_child
from drake_tracker.run.video_page import CameraSight, PageState, VideoPage

INSTEAD = "without it: render_processes 0"
"""Advice for the user when the process does not work."""
_MOST_WAITING = 60
"""Frames that may wait for the process; when there are more, the simulation waits, too."""
_PROGRAM = "drake_tracker.run.video_process"
END = b""
"""Message after the last frame; the answer says that the file is complete."""


class VideoProcess:
    """Draws frames and appends them to a video file, as a `DrawnVideo` does, in a separate process.

    The process starts with the first frame. If this process is killed, the file is completed with the frames that were
    passed on until then.

    Args:
        path: MP4 file to write.
        page: draws the frames.
    """

    wanted = True
    """Whether the next frame is wanted, which it always is."""

    def __init__(self, path: Path, page: VideoPage) -> None:
        self._task = pickle.dumps((path, page))
        self._process: ChildProcess | None = None
        self._waiting: queue.Queue[bytes] = queue.Queue(_MOST_WAITING)
        self._errors: list[Exception] = []
        self._open = True

    @property
    def running(self) -> list[int]:
        """The process number of the process; none before the first frame."""
        return [] if self._process is None else [self._process.number]

    def write(self, sights: Mapping[str, CameraSight], state: PageState) -> None:
        """Passes on the content of a frame, see `VideoPage.draw`. After an error, nothing more is written.

        Raises DrakeTrackerError when an earlier frame could not be written; MachineError when the process cannot start,
        has ended, or does not answer.
        """
        if self._open:
            if self._process is None:
                self._start()
            self._waiting.put(pickle.dumps((dict(sights), state)))
            if self._errors:
                self.close()

    def close(self) -> None:
        """Completes the file and ends the process. A second call does nothing. Raises as `write` does."""
        process, self._open = self._process if self._open else None, False
        if process is not None:
            self._waiting.put(END)
            self._thread.join()
            process.close()
            if self._errors:
                raise self._errors[0]

    def _start(self) -> None:
        try:
            self._process = ChildProcess(_PROGRAM, name="video process", instead=INSTEAD)
        except MachineError:
            self._open = False
            raise
        # A pipe is too short for a few frames. A thread waits until the process has read them.
        arguments = (self._process, self._waiting, self._errors)
        self._thread = threading.Thread(target=_send, args=arguments, name="video", daemon=True)
        self._thread.start()
        self._waiting.put(self._task)


def _send(process: ChildProcess, waiting: "queue.Queue[bytes]", errors: list[Exception]) -> None:
    """Sends messages to the process until `END`, and waits until it is done; after an error, drops them.

    Args:
        process: the video process.
        waiting: the messages.
        errors: receives the error.
    """
    message = b"-"
    while message != END:
        message = waiting.get()
        if errors:
            continue
        try:
            process.send(message)
            if message == END:
                process.wait()
        except Exception as error:
            errors.append(error)


def serve(connection: Connection) -> None:
    """Writes a video until the connection ends, as the program of the other process.

    Args:
        connection: first receives the pickled (path, `VideoPage`), then pickled arguments of `VideoPage.draw`.
    """
    from drake_tracker.run.drawn_video import DrawnVideo  # slow to load

    video = DrawnVideo(*pickle.loads(connection.recv_bytes()))
    try:
        while (message := connection.recv_bytes()) != END:
            video.write(*pickle.loads(message))
    finally:
        video.close()
    connection.send_bytes(DONE)


if __name__ == "__main__":
    run_child(serve)
