"""The server of the live view: a few fixed routes on the loopback.

The page comes from the package's own data, and only it may change anything.
"""

import json
import socket
import threading
import time
from importlib.resources import files

from drake_tracker.core.loopback_server import LoopbackHandler, LoopbackServer

FILES = {
    "/": ("index.html", "text/html; charset=utf-8"),
    "/live.css": ("live.css", "text/css; charset=utf-8"),
    "/live.js": ("live.js", "text/javascript; charset=utf-8"),
    "/strips.js": ("strips.js", "text/javascript; charset=utf-8"),
    "/windows.js": ("windows.js", "text/javascript; charset=utf-8"),
}
"""Routes of the page, each with its file in the folder ``page`` and its type."""
PICTURES = {"/frame.jpg": "image/jpeg", "/board.png": "image/png"}
LARGEST_REQUEST = 4096
"""Bytes of what a page may send."""
EVENTS_INTERVAL = 1 / 20
"""Least time [s] between two events."""
HEARTBEAT = 1.0
"""Longest time [s] between two events: without it, nobody would notice that a page was closed."""
_IDLE = 30.0
"""Time [s] after which a connection that says nothing is closed."""
_POLICY = (
    "default-src 'self'; img-src 'self' data:; style-src 'self'; frame-src http://localhost:*; frame-ancestors 'none'; "
    "base-uri 'none'; form-action 'none'"
)


class Server(LoopbackServer):
    """Serves a run's page at ``url`` until it is closed.

    Args:
      state: a `LiveState`. act: called with (action, what came with it) of what the page asks for, returns a dict for
      JSON, raises ValueError on what makes no sense. picture: route of `PICTURES` -> bytes or None. port: to listen
      at; 0 takes a free one.

    Raises DrakeTrackerError when the port is taken.
    """

    def __init__(self, state, act, picture, port=0):
        super().__init__(_Handler, port)
        self.state, self.act, self.picture = state, act, picture
        self._thread = threading.Thread(target=self.serve_forever, name="live view", daemon=True)
        self._thread.start()

    def close(self):
        """Ends the server."""
        self.shutdown()
        self.server_close()
        self._thread.join()


class _Handler(LoopbackHandler):
    policy = _POLICY
    timeout = _IDLE

    def setup(self):
        super().setup()
        self.connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, True)

    def do_GET(self):
        if not self.is_addressed():
            return
        if self.path in FILES:
            name, kind = FILES[self.path]
            self.send(200, kind, (files("drake_tracker.live") / "page" / name).read_bytes())
        elif self.path in PICTURES:
            picture = self.server.picture(self.path)
            if picture is None:
                self.refuse(404, "there is none yet")
            else:
                self.send(200, PICTURES[self.path], picture)
        elif self.path == "/events":
            self._send_events()
        else:
            self.refuse(404, "there is no such page")

    def do_POST(self):
        if not self.is_addressed():
            return
        origin = self.headers.get("Origin", "")
        if origin.removeprefix("http://") not in self.server.hosts:
            self.refuse(403, "only the live view's own page may do that")
            return
        length = self.headers.get("Content-Length", "")
        if not length.isdecimal() or int(length) > LARGEST_REQUEST:
            self.refuse(413, "too much")
            return
        body = self.rfile.read(int(length))
        if self.path != "/control":
            self.refuse(404, "there is no such page")
            return
        try:
            asked = json.loads(body)
            if not isinstance(asked, dict):
                raise ValueError("an object is expected")
            answer = self.server.act(asked.pop("action", None), asked)
        except (ValueError, RecursionError) as error:
            self.refuse(400, str(error))
            return
        self.send(200, "application/json", json.dumps(answer).encode())

    def _send_events(self):
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
