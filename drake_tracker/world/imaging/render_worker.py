"""The program of a process that makes images, started by `render_processes.RenderProcesses`.

It inherits the shared memory for the images.
"""

import mmap
import pickle
import struct
from multiprocessing.connection import Connection

import numpy as np

from drake_tracker.core.processes.child_process import DONE, run_child
from drake_tracker.world.imaging.scene_copy import SceneRenderer

REQUEST = struct.Struct("<iqd")
"""Number of the camera, place of its image in the memory [bytes], time [s]; the poses follow as 64-bit floats."""


def serve(connection: Connection, memory_file: int) -> None:
    """Answers requests until the connection ends.

    Args:
        connection: first receives the pickled (`SceneCopy`, list of `CameraCopy`), then requests.
        memory_file: descriptor of the memory that receives the images.
    """
    memory = mmap.mmap(memory_file, 0)
    renderer = SceneRenderer(*pickle.loads(connection.recv_bytes()))
    buffer = np.frombuffer(memory, np.uint8)
    while True:
        message = connection.recv_bytes()
        camera, place, time = REQUEST.unpack_from(message)
        poses = np.frombuffer(message, np.float64, offset=REQUEST.size).reshape(-1, 3, 4)
        image = renderer.image(camera, time, poses)
        buffer[place : place + image.size].reshape(image.shape)[:] = image
        connection.send_bytes(DONE)


if __name__ == "__main__":
    run_child(serve)
