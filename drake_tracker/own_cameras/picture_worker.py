"""The program of a process that draws the picture of a track, started by `picture_process.PictureProcess`."""

import pickle
from multiprocessing.connection import Connection

from drake_tracker.core.processes.child_process import DONE, run_child
from drake_tracker.own_cameras.picture import draw_track_picture


def serve(connection: Connection) -> None:
    """Draws one picture.

    Args:
        connection: receives the pickled (data, path, options) of `draw_track_picture`.
    """
    data, path, options = pickle.loads(connection.recv_bytes())
    draw_track_picture(data, path, **options)
    connection.send_bytes(DONE)


if __name__ == "__main__":
    run_child(serve)
