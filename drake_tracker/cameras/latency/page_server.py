"""Serves the page with the running code to a browser on this machine."""

import time
from collections.abc import Callable

from drake_tracker.cameras.latency import screen_code
from drake_tracker.core.processes.loopback_server import BackgroundServer, LoopbackHandler

FILES = {
    "/": ("index.html", "text/html; charset=utf-8"),
    "/code.css": ("code.css", "text/css; charset=utf-8"),
    "/code.js": ("code.js", "text/javascript; charset=utf-8"),
}
"""Routes of the page: file in the folder ``page``, and its media type."""


class CodeServer(BackgroundServer):
    """Serves the page in a thread until it is closed: a context manager.

    Args:
        port: port to listen at; 0 takes a free one. Raises DrakeTrackerError when the port is taken.
        clock: returns the time that the code shows [s].
    """

    def __init__(self, port: int = 0, clock: Callable[[], float] = time.time) -> None:
        super().__init__(_CodeHandler, port, "running code")
        self.clock = clock
        self.start()


class _CodeHandler(LoopbackHandler):
    server: CodeServer
    policy = "default-src 'self'; img-src data:; frame-ancestors 'none'; base-uri 'none'; form-action 'none'"
    package = "drake_tracker.cameras.latency"
    files = FILES

    def do_GET(self) -> None:
        if not self.is_addressed():
            return
        if self.path == "/time":
            self.send(200, "text/plain", f"{1e3 * self.server.clock():.3f}".encode())
        elif self.path == "/layout.json":
            self.send_json(_layout())
        else:
            self.send_file_of_page()


def _layout() -> dict[str, object]:
    """Returns the parameters of the code for the page, see `screen_code`."""
    markers = range(len(screen_code.MARKERS))
    return {
        "size": screen_code.SIZE,
        "side": screen_code.SIDE,
        "markers": screen_code.MARKERS,
        "marker_cells": [screen_code.marker_cells(number).astype(int).ravel().tolist() for number in markers],
        "fields": screen_code.FIELDS,
        "order": screen_code.ORDER,
        "empty_field": screen_code.field_cells(0).astype(int).ravel().tolist(),
        "range": screen_code.RANGE,
        "time_bits": screen_code.TIME_BITS,
        "check_bits": screen_code.CHECK_BITS,
        "polynomial": screen_code.POLYNOMIAL,
        "first": screen_code.FIRST,
    }
