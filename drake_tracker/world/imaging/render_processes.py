"""Processes that make the images of simulated cameras ahead of their use."""

import mmap
import os
import pickle
import struct
import tempfile
import weakref
from collections import deque
from collections.abc import Sequence
from multiprocessing.connection import Connection

import numpy as np

from drake_tracker.core.errors import MachineError
from drake_tracker.core.processes.child_process import DONE, ChildProcess, run_child
from drake_tracker.world.imaging.scene_copy import CameraCopy, SceneCopy, SceneRenderer

INSTEAD = "without them: render_processes 0"
"""Advice for the user when the processes do not work."""

MOST_RUNNING = 4
"""Number of `RenderProcesses` of one program that run at the same time. When another `RenderProcesses` starts, the
oldest one ends its processes: Drake does not always release a diagram that is no longer used."""
_PROGRAM = "drake_tracker.world.imaging.render_processes"
REQUEST = struct.Struct("<iqd")
"""Number of the camera, place of its image in the memory [bytes], time [s]; the poses follow as 64-bit floats."""

Request = tuple[int, float, bytes]
"""(number of the camera, time [s], poses as bytes): everything that determines an image."""


class RenderProcesses:
    """Makes images in other processes, with the same result as `SceneRenderer` in this one.

    An image that is asked for early is ready, or being made, when it is read. The processes start with the first
    request. They end with `close`, with this object, or when this process ends in any way; beyond `MOST_RUNNING` they
    end until they are needed again. The shared memory has no name, so that nothing of it is left behind.

    Args:
        scene: what can be seen.
        cameras: the cameras.
        processes: number of processes, 1 or more.
        depth: number of images of each camera that can be asked for before the first of them is read.
    """

    def __init__(self, scene: SceneCopy, cameras: Sequence[CameraCopy], *, processes: int, depth: int) -> None:
        self._cameras = tuple(cameras)
        self._task = pickle.dumps((scene, self._cameras))
        self._count = processes
        self._slots = -(-depth * len(cameras) // processes) + 1
        self._workers: list[_Worker] = []
        self._asked: dict[Request, _Worker] = {}
        self._turn = 0

    @property
    def running(self) -> list[int]:
        """The process numbers of the processes, none before the first request."""
        return [worker.process.number for worker in self._workers]

    def ask(self, request: Request) -> None:
        """Has an image made, unless it has been asked for. Raises MachineError when a process has ended."""
        if request in self._asked:
            return
        if not self._workers:
            self.start()
        worker = self._workers[self._turn % self._count]
        self._turn += 1
        dropped = worker.ask(request)
        self._asked[request] = worker
        if dropped is not None:
            del self._asked[dropped]

    def image(self, request: Request) -> np.ndarray:
        """Returns an image, RGBA, uint8, which later requests overwrite. Waits until it is made.

        Raises MachineError when a process has ended, or does not answer.
        """
        self.ask(request)
        return self._asked[request].image(request, self._cameras[request[0]].shape)

    def start(self) -> None:
        """Starts the processes, if they do not run. Raises MachineError when that is impossible."""
        if self._workers:
            return
        largest = max(int(np.prod(camera.shape)) for camera in self._cameras)
        workers: list[_Worker] = []
        try:
            for _ in range(self._count):
                workers.append(_Worker(self._task, self._slots, largest))
        except MachineError:
            for worker in workers:
                worker.process.close()
            raise
        self._workers = workers
        _running.append(weakref.ref(self))
        others = [each for reference in _running if (each := reference()) is not None]
        for oldest in others[:-MOST_RUNNING]:
            oldest.close()

    def close(self) -> None:
        """Ends the processes. They start again with the next request."""
        for worker in self._workers:
            worker.process.close()
        self._workers, self._asked = [], {}
        _running[:] = [reference for reference in _running if reference() not in (self, None)]


_running: list["weakref.ref[RenderProcesses]"] = []
"""Those whose processes run, in the order in which they started."""


class _Worker:
    """One process, and the places for its images.

    Args:
        task: the pickled scene and cameras.
        slots: number of places.
        size: of a place [bytes].

    Raises MachineError when the process cannot start.
    """

    def __init__(self, task: bytes, slots: int, size: int) -> None:
        self._slots, self._size = slots, size
        self._places: dict[Request, int] = {}  # in the order of the requests
        self._pending: deque[Request] = deque()
        try:
            self._memory, memory_file = _shared_memory(slots * size)
        except OSError as error:
            raise MachineError(f"no memory for rendered images: {error.strerror or error}; {INSTEAD}") from None
        try:
            self.process = ChildProcess(_PROGRAM, name="render process", instead=INSTEAD, files=(memory_file,))
        finally:
            os.close(memory_file)
        self.process.send(task)

    def ask(self, request: Request) -> Request | None:
        """Sends a request; returns the oldest one, whose image is lost, if all places were taken."""
        if len(self._pending) == self._slots:  # nobody reads the images: do not let the answers pile up
            self._wait()
        dropped = None
        if len(self._places) == self._slots:
            dropped = next(iter(self._places))
            place = self._places.pop(dropped)
        else:
            place = len(self._places)
        self._places[request] = place
        self._pending.append(request)
        camera, time, poses = request
        self.process.send(REQUEST.pack(camera, place * self._size, time) + poses)
        return dropped

    def image(self, request: Request, shape: tuple[int, int, int]) -> np.ndarray:
        """Returns the image of a request."""
        while request in self._pending:
            self._wait()
        offset = self._places[request] * self._size
        return np.frombuffer(self._memory, np.uint8, int(np.prod(shape)), offset).reshape(shape)

    def _wait(self) -> None:
        self.process.wait()
        self._pending.popleft()


def _shared_memory(size: int) -> tuple[mmap.mmap, int]:
    """Returns memory and the descriptor of its file, which has no name. Its pages exist: writing them cannot fail."""
    if hasattr(os, "memfd_create"):
        descriptor = os.memfd_create("images")
    else:
        with tempfile.TemporaryFile() as file:
            descriptor = os.dup(file.fileno())
    try:
        if hasattr(os, "posix_fallocate"):
            os.posix_fallocate(descriptor, 0, size)
        else:
            os.ftruncate(descriptor, size)
        return mmap.mmap(descriptor, size), descriptor
    except OSError:
        os.close(descriptor)
        raise


def serve(connection: Connection, memory_file: int) -> None:
    """Answers requests until the connection ends, as the program of another process, which inherits the shared memory.

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
