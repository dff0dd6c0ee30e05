"""The server of the live view: a few fixed routes on the loopback, from the standard library.

Nothing that comes over the network is ever a path: a route is looked up as it stands, and its page comes from the
package's own data. Only requests that name this server as their host are answered, and only its own page may change
anything: another site in the same browser can neither read nor steer a run.
"""

import json
import socket
import sys
import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files

from drake_tracker.errors import DrakeTrackerError

HOST = "127.0.0.1"
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


class Server(ThreadingHTTPServer):
    """Serves a run's page at ``url`` until it is closed.

    Args:
      state: a `LiveState`. act: called with (action, what came with it) of what the page asks for, returns a dict for
      JSON, raises ValueError on what makes no sense. picture: route of `PICTURES` -> bytes or None. port: to listen
      at; 0 takes a free one.

    Raises DrakeTrackerError when the port is taken.
    """

    daemon_threads = True
    block_on_close = False

    def __init__(self, state, act, picture, port=0):
        try:
            super().__init__((HOST, port), _Handler)
        except (OSError, OverflowError) as error:
            reason = getattr(error, "strerror", None) or "ports are 0 to 65535"
            raise DrakeTrackerError(
                f"--port {port}: the live view cannot listen there ({reason}); choose another port, or leave --port "
                "out for a free one"
            ) from None
        self.state, self.act, self.picture = state, act, picture
        port = self.server_address[1]
        self.hosts = {f"{name}:{port}" for name in (HOST, "localhost")}
        self.url = f"http://{HOST}:{port}/"
        self._thread = threading.Thread(target=self.serve_forever, name="live view", daemon=True)
        self._thread.start()

    def close(self):
        """Ends the server."""
        self.shutdown()
        self.server_close()
        self._thread.join()

    def handle_error(self, request, client_address):
        """Says nothing of a page that was closed."""
        if not isinstance(sys.exception(), (ConnectionError, TimeoutError)):
            super().handle_error(request, client_address)


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    server_version, sys_version = "drake-tracker", ""
    timeout = _IDLE

    def setup(self):
        super().setup()
        self.connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, True)

    def do_GET(self):
        if not self._is_addressed():
            return
        if self.path in FILES:
            name, kind = FILES[self.path]
            self._send(200, kind, (files("drake_tracker.live") / "page" / name).read_bytes())
        elif self.path in PICTURES:
            picture = self.server.picture(self.path)
            if picture is None:
                self._refuse(404, "there is none yet")
            else:
                self._send(200, PICTURES[self.path], picture)
        elif self.path == "/events":
            self._send_events()
        else:
            self._refuse(404, "there is no such page")

    def do_POST(self):
        if not self._is_addressed():
            return
        origin = self.headers.get("Origin", "")
        if origin.removeprefix("http://") not in self.server.hosts:
            self._refuse(403, "only the live view's own page may do that")
            return
        length = self.headers.get("Content-Length", "")
        if not length.isdecimal() or int(length) > LARGEST_REQUEST:
            self._refuse(413, "too much")
            return
        body = self.rfile.read(int(length))
        if self.path != "/control":
            self._refuse(404, "there is no such page")
            return
        try:
            asked = json.loads(body)
            if not isinstance(asked, dict):
                raise ValueError("an object is expected")
            answer = self.server.act(asked.pop("action", None), asked)
        except (ValueError, RecursionError) as error:
            self._refuse(400, str(error))
            return
        self._send(200, "application/json", json.dumps(answer).encode())

    def _is_addressed(self):
        """Whether the request names this very server: a page of another site that had its name lead here does not."""
        if self.headers.get("Host") in self.server.hosts:
            return True
        self._refuse(403, "this is not the host that was asked for")
        return False

    def _send_events(self):
        state = self.server.state
        self._head(200, "text/event-stream", close=True)
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

    def _send(self, status, kind, body):
        self._head(status, kind, len(body), close=status != 200)
        self.wfile.write(body)

    def _refuse(self, status, words):
        self._send(status, "text/plain; charset=utf-8", f"{words}\n".encode())

    def _head(self, status, kind, length=None, close=False):
        self.send_response(status)
        self.send_header("Content-Type", kind)
        if length is not None:
            self.send_header("Content-Length", str(length))
        if close:  # What may not have been read of a refused request must not be taken for the next one.
            self.send_header("Connection", "close")
            self.close_connection = True
        self.send_header("Cache-Control", "no-store")
        self.send_header("Content-Security-Policy", _POLICY)
        self.send_header("X-Content-Type-Options", "nosniff")
        self.send_header("Referrer-Policy", "no-referrer")
        self.end_headers()

    def log_message(self, *words):
        """Requests are not printed."""
