"""A server that answers this machine alone: what the pages of a run, live and afterwards, have in common.

It is bound to the loopback, and answers only requests that name it as their host: the page of another site, whose name
was made to lead here, can neither read nor steer a run. A path that comes over the network is looked up as it stands
and never used for anything else.
"""

import sys
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

from drake_tracker.core.errors import DrakeTrackerError

HOST = "127.0.0.1"


class LoopbackServer(ThreadingHTTPServer):
    """Listens at ``url``; `serve_forever` answers.

    Args:
      handler: subclass of `LoopbackHandler`. port: to listen at; 0 takes a free one.

    Raises DrakeTrackerError when the port is taken, or none of this machine's.
    """

    daemon_threads = True
    block_on_close = False

    def __init__(self, handler, port=0):
        try:
            super().__init__((HOST, port), handler)
        except (OSError, OverflowError) as error:
            reason = getattr(error, "strerror", None) or "ports are 0 to 65535"
            raise DrakeTrackerError(
                f"--port {port}: nothing can listen there ({reason}); choose another port, or leave --port out for a "
                "free one"
            ) from None
        port = self.server_address[1]
        self.hosts = {f"{name}:{port}" for name in (HOST, "localhost")}
        self.url = f"http://{HOST}:{port}/"

    def handle_error(self, request, client_address):
        """Says nothing of a browser that turned away in the middle of something."""
        if not isinstance(sys.exception(), (ConnectionError, TimeoutError)):
            super().handle_error(request, client_address)


class LoopbackHandler(BaseHTTPRequestHandler):
    """What both pages' handlers share. ``policy``: what the page's content may load."""

    protocol_version = "HTTP/1.1"
    server_version, sys_version = "drake-tracker", ""
    policy = "default-src 'self'"

    def is_addressed(self):
        """Returns whether the request names this very server; refuses it if not."""
        if self.headers.get("Host") in self.server.hosts:
            return True
        self.refuse(HTTPStatus.FORBIDDEN, "this is not the host that was asked for")
        return False

    def send(self, status, kind, body, more=None):
        """Answers with ``body``, bytes of the media type ``kind``; a request for the head alone gets that."""
        self.head(status, kind, len(body), more, close=status != HTTPStatus.OK)
        if self.command != "HEAD":
            self.wfile.write(body)

    def refuse(self, status, words, more=None):
        """Answers with a line that says why not."""
        self.send(status, "text/plain; charset=utf-8", f"{words}\n".encode(), more)

    def head(self, status, kind, length=None, more=None, close=False):
        """Sends status and headers; ``more``: further ones. ``length`` None: the body ends with the connection."""
        self.send_response(status)
        self.send_header("Content-Type", kind)
        if length is not None:
            self.send_header("Content-Length", str(length))
        if close:  # What may not have been read of a refused request must not be taken for the next one.
            self.send_header("Connection", "close")
            self.close_connection = True
        self.send_header("Cache-Control", "no-store")
        self.send_header("Content-Security-Policy", self.policy)
        self.send_header("X-Content-Type-Options", "nosniff")
        self.send_header("Referrer-Policy", "no-referrer")
        for name, value in (more or {}).items():
            self.send_header(name, value)
        self.end_headers()

    def log_message(self, *words):
        """Requests are not printed."""
