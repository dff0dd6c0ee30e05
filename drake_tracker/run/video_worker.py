"""The program of a process that draws and encodes a camera video, started by `video_process.VideoProcess`."""

import pickle
from multiprocessing.connection import Connection

from drake_tracker.core.processes.child_process import DONE, run_child
from drake_tracker.run.drawn_video import DrawnVideo

END = b""
"""Message after the last frame; the answer says that the file is complete."""


def serve(connection: Connection) -> None:
    """Writes a video until the connection ends.

    Args:
        connection: first receives the pickled (path, `VideoPage`), then pickled arguments of `VideoPage.draw`.
    """
    video = DrawnVideo(*pickle.loads(connection.recv_bytes()))
    try:
        while (message := connection.recv_bytes()) != END:
            video.write(*pickle.loads(message))
    finally:
        video.close()
    connection.send_bytes(DONE)


if __name__ == "__main__":
    run_child(serve)
