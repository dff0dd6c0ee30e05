"""Draws the picture of a track in another process, which loads Matplotlib while the images are tracked."""

import pickle
from collections.abc import Mapping
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np

from drake_tracker.core.errors import MachineError
from drake_tracker.core.processes.child_process import DONE, ChildProcess, run_child


class PictureProcess:
    """Draws one picture. Where no process can be started, it is drawn by this one."""

    def __init__(self) -> None:
        """Starts the process."""
        self._process: ChildProcess | None = None
        with suppress(MachineError):
            self._process = ChildProcess(
                "drake_tracker.own_cameras.picture_process", name="picture process", instead="the table is complete"
            )

    def draw(self, data: Mapping[str, np.ndarray], path: Path, **options: Any) -> None:
        """Draws the picture.

        Args:
            data: of `draw_track_picture`, as the other arguments.
            path: PNG file to write.
            options: all others.

        Raises DrakeTrackerError when it cannot be written.
        """
        if self._process is not None:
            with suppress(MachineError):
                self._process.send(pickle.dumps((data, path, options)))
                self._process.wait()
                return
        from drake_tracker.own_cameras.picture import draw_track_picture  # slow to load

        draw_track_picture(data, path, **options)

    def close(self) -> None:
        """Ends the process."""
        if self._process is not None:
            self._process.close()


def serve(connection: Connection) -> None:
    """Draws one picture, as the program of the other process.

    Args:
        connection: receives the pickled (data, path, options) of `draw_track_picture`.
    """
    from drake_tracker.own_cameras.picture import draw_track_picture

    data, path, options = pickle.loads(connection.recv_bytes())
    draw_track_picture(data, path, **options)
    connection.send_bytes(DONE)


if __name__ == "__main__":
    run_child(serve)
