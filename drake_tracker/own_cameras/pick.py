"""Lets the user show the object in a page of the browser: ``drake-tracker track --pick``."""

import threading
from collections.abc import Callable, Sequence
from typing import Any

import cv2
import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.processes.loopback_server import BackgroundServer, LoopbackHandler
from drake_tracker.footage.sources import open_footage
from drake_tracker.own_cameras.choice import read_pixel, read_window

FILES = {
    "/": ("pick.html", "text/html; charset=utf-8"),
    "/pick.css": ("pick.css", "text/css; charset=utf-8"),
    "/pick.js": ("pick.js", "text/javascript; charset=utf-8"),
}
"""Routes of the page: file in the folder ``page``, and its media type."""
LARGEST_REQUEST = 65536
"""Greatest size of a request's body [bytes]."""
_INTERVAL = 0.2
"""Time between two looks for Ctrl-C [s]."""


def pick(sources: Sequence[str], fps: float | None, show: Callable[[str], object]) -> tuple[list[str], list[str]]:
    """Returns the user's drawing on the first images as values of ``--roi`` and ``--follow``, or empty lists.

    Args:
        sources: of the cameras.
        fps: images per second, for a source without capture times.
        show: called with the address of the page.

    Raises DrakeTrackerError when a source cannot be read.
    """
    server = PickServer([_first_image(source, fps) for source in sources])
    try:
        show(server.url)
        while not server.picked.wait(_INTERVAL):
            pass
    finally:
        server.close()
    return server.roi, server.follow


def _first_image(source: str, fps: float | None) -> np.ndarray:
    """Returns the first image of a source, RGB."""
    footage = open_footage(source, fps)
    try:
        for _, image in footage.frames():
            return image
    finally:
        footage.close()
    raise DrakeTrackerError(f"{source}: there is no image")


class PickServer(BackgroundServer):
    """Serves the page with the first images in a thread until it is closed.

    Attributes:
        images: as PNG files.
        picked: set once the user has chosen.
        roi: values of ``--roi``, one for each camera, or empty.
        follow: values of ``--follow``, one for each camera, or empty.
    """

    def __init__(self, images: Sequence[np.ndarray]) -> None:
        """Starts the server.

        Args:
            images: first image of each camera, RGB uint8 (h, w, 3).
        """
        super().__init__(_PickHandler, 0, "pick")
        self.sizes = [(image.shape[1], image.shape[0]) for image in images]
        self.images = [cv2.imencode(".png", cv2.cvtColor(image, cv2.COLOR_RGB2BGR))[1].tobytes() for image in images]
        self.picked = threading.Event()
        self.roi: list[str] = []
        self.follow: list[str] = []
        self.start()

    def take(self, request: Any) -> dict[str, Any]:
        """Accepts the user's drawing: {"roi": [text, ...], "follow": [text, ...]}, each for all cameras or empty.

        Returns the empty answer. Raises ValueError or DrakeTrackerError when it is not that.
        """
        lists = [request.get(name) if isinstance(request, dict) else None for name in ("roi", "follow")]
        for texts in lists:
            if not isinstance(texts, list) or not all(isinstance(text, str) for text in texts):
                raise ValueError("roi and follow must be lists of texts")
            if texts and len(texts) != len(self.sizes):
                raise ValueError(f"draw in each of the {len(self.sizes)} images, or in none")
        roi, follow = ([str(text) for text in texts or []] for texts in lists)
        if not roi and not follow:
            raise ValueError("nothing is drawn yet")
        for size, text in zip(self.sizes, roi):
            read_window(text, size)
        for size, text in zip(self.sizes, follow):
            read_pixel(text, size)
        self.roi, self.follow = roi, follow
        self.picked.set()
        return {}


class _PickHandler(LoopbackHandler):
    server: PickServer
    policy = "default-src 'self'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'"
    package = "drake_tracker.own_cameras"
    files = FILES

    def do_GET(self) -> None:
        if not self.is_addressed():
            return
        names = [f"/image{k}.png" for k in range(len(self.server.images))]
        if self.path == "/cameras":
            self.send_json(self.server.sizes)
        elif self.path in names:
            self.send(200, "image/png", self.server.images[names.index(self.path)])
        else:
            self.send_file_of_page()

    def do_POST(self) -> None:
        self.answer_own_request("/pick", LARGEST_REQUEST, "only the page itself may choose", self.server.take)
