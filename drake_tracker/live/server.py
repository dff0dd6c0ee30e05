"""The HTTP server of the live view: a few fixed routes on 127.0.0.1.

The page is part of the package's own data. Requests that control the run are accepted from this page only.
"""

import json
import socket
import time
from collections.abc import Callable
from typing import Any

from drake_tracker.core.processes.loopback_server import BackgroundServer, LoopbackHandler
from drake_tracker.live.pace import EVENTS_INTERVAL
from drake_tracker.live.state import LiveState

FILES = {
    "/": ("index.html", "text/html; charset=utf-8"),
    "/live.css": ("live.css", "text/css; charset=utf-8"),
    "/live.js": ("live.js", "text/javascript; charset=utf-8"),
    "/overview.js": ("overview.js", "text/javascript; charset=utf-8"),
    "/strips.js": ("strips.js", "text/javascript; charset=utf-8"),
    "/windows.js": ("windows.js", "text/javascript; charset=utf-8"),
}
"""Routes of the page: file in the folder ``page``, and its media type."""
PICTURES = {"/frame.jpg": "image/jpeg", "/board.png": "image/png"}
"""Routes of the pictures, with their media types."""
LARGEST_REQUEST = 4096
"""Greatest size of a request's body [bytes]."""
HEARTBEAT = 1.0
"""Longest time [s] between two events; a closed page is noticed when an event cannot be sent."""
_IDLE_TIMEOUT = 30.0
"""Time [s] after which an idle connection is closed."""
_POLICY = (
    "default-src 'self'; img-src 'self' data:; style-src 'self'; frame-src http://localhost:*; frame-ancestors 'none'; "
    "base-uri 'none'; form-action 'none'"
)


class Server(BackgroundServer):
    """Serves the page of a run in a thread until it is closed.

    Attributes:
        url: address of the page.
        state: see the constructor.
        act: see the constructor.
        picture: see the constructor.
    """

    def __init__(
        self,
        state: LiveState,
        act: Callable[[Any, dict[str, Any]], dict[str, Any]],
        picture: Callable[[str], bytes | None],
        port: int = 0,
    ) -> None:
        """Starts the server.

        Args:
            state: what the page shows.
            act: called with (action, other values) of each request of the page; returns a dict for JSON, and raises
                ValueError for an invalid request.
            picture: returns the bytes of a route of `PICTURES`, or None while there are none.
            port: port to listen at; 0 takes a free one. Raises DrakeTrackerError when the port is taken.
        """
        super().__init__(_LiveHandler, port, "live view")
        self.state, self.act, self.picture = state, act, picture
        self.start()


class _LiveHandler(LoopbackHandler):
    server: Server
    policy = _POLICY
    timeout = _IDLE_TIMEOUT
    package = "drake_tracker.live"
    files = FILES

    def setup(self) -> None:
        super().setup()
        self.connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, True)

    def do_GET(self) -> None:
        if not self.is_addressed():
            return
        if self.path in PICTURES:
            picture = self.server.picture(self.path)
            if picture is None:
                self.refuse(404, "there is no picture yet")
            else:
                self.send(200, PICTURES[self.path], picture)
        elif self.path == "/events":
            self._send_events()
        else:
            self.send_file_of_page()

    def do_POST(self) -> None:
        refusal = "only the live view's own page may control the run"
        self.answer_own_request("/control", LARGEST_REQUEST, refusal, self._act)

    def _act(self, request: Any) -> dict[str, Any]:
        if not isinstance(request, dict):
            raise ValueError("a JSON object is expected")
        return self.server.act(request.pop("action", None), request)

    def _send_events(self) -> None:
        state = self.server.state
        self.head(200, "text/event-stream", close=True)
        state.watch(True)
        try:
            seen, more = None, True
            while more:
                news, seen, more = state.news(seen, HEARTBEAT)
                line = f"data: {json.dumps(news)}\n\n" if news else ":\n\n"
                self.wfile.write(line.encode())
                self.wfile.flush()
                if more:
                    time.sleep(EVENTS_INTERVAL)
        finally:
            state.watch(False)
