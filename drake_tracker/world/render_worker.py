"""The program of a process that makes images, started by `render_processes.RenderProcesses`.

Its two arguments are inherited file descriptors: a `Connection`, over which it receives a scene and then requests, and
the shared memory for the images. It ends when the connection ends, which also happens when the other process is killed.
"""

import contextlib
import mmap
import os
import pickle
import struct
import sys
from multiprocessing.connection import Connection

import numpy as np

from drake_tracker.world.scene_copy import SceneRenderer

REQUEST = struct.Struct("<iqd")
"""Number of the camera, place of its image in the memory [bytes], time [s]; the poses follow as 64-bit floats."""
DONE = b""
"""Answer when the image is in its place. Any other answer is a text that says what went wrong."""


def serve(connection: Connection, memory: mmap.mmap) -> None:
    """Answers requests until the connection ends.

    Args:
        connection: first receives the pickled (`SceneCopy`, list of `CameraCopy`), then requests.
        memory: receives the images.
    """
    renderer = SceneRenderer(*pickle.loads(connection.recv_bytes()))
    buffer = np.frombuffer(memory, np.uint8)
    while True:
        message = connection.recv_bytes()
        camera, place, time = REQUEST.unpack_from(message)
        poses = np.frombuffer(message, np.float64, offset=REQUEST.size).reshape(-1, 3, 4)
        image = renderer.image(camera, time, poses)
        buffer[place : place + image.size].reshape(image.shape)[:] = image
        connection.send_bytes(DONE)


def main() -> None:
    """Runs the program."""
    connection, memory_file = Connection(int(sys.argv[1])), int(sys.argv[2])
    _let_others_go_first()
    try:
        serve(connection, mmap.mmap(memory_file, 0))
    except (EOFError, ConnectionError):
        pass  # nobody waits for images any more
    except Exception as error:
        text = " ".join(f"{type(error).__name__}: {error}".split())
        with contextlib.suppress(ConnectionError):
            connection.send_bytes(text.encode())
    os._exit(0)  # without taking down the renderer, which takes time


def _let_others_go_first() -> None:
    """Keeps this process from taking the processor of the simulation whenever a request wakes it up."""
    if hasattr(os, "SCHED_BATCH"):
        with contextlib.suppress(OSError):
            os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))


if __name__ == "__main__":
    main()
