"""An HTTP server for this machine only: the common part of all pages of the package.

The server is bound to the loopback address, and answers only requests whose Host header names it. A page of another
site whose name was made to resolve to this machine can therefore neither read nor control a run. Handlers look the path
of a request up in a table and never use it for anything else. A connection that does not move is closed, a body needs a
POST request and a length of its own, and JSON must be finite numbers and whole characters.
"""

import json
import re
import sys
import threading
from collections.abc import Callable, Mapping
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from typing import Any, ClassVar

from drake_tracker.core.errors import DrakeTrackerError

HOST = "127.0.0.1"
_TIMEOUT = 30.0
"""Time after which a connection that does not move is closed [s]."""
_LENGTH = re.compile(r"[0-9]{1,9}", re.ASCII)
"""A length in a header; Python refuses to read numbers of thousands of digits."""
_POLL_INTERVAL = 0.1
"""Longest time after which a server in a thread notices that it is to stop [s]."""


class LoopbackServer(ThreadingHTTPServer):
    """Listens at ``url``; `serve_forever` answers requests.

    Raises DrakeTrackerError when the port is taken or does not exist.

    Args:
        handler: subclass of `LoopbackHandler`.
        port: to listen at; 0 takes a free one.

    Attributes:
        hosts: values of the Host header that name this server.
        url: of this server.
    """

    daemon_threads = True
    block_on_close = False

    def __init__(self, handler: "type[LoopbackHandler]", port: int = 0) -> None:
        try:
            super().__init__((HOST, port), handler)
        except (OSError, OverflowError) as error:
            reason = getattr(error, "strerror", None) or "ports are 0 to 65535"
            raise DrakeTrackerError(
                f"--port {port}: cannot listen there ({reason}); choose another port, or omit --port for a free one"
            ) from None
        port = self.server_address[1]
        self.hosts = {f"{name}:{port}" for name in (HOST, "localhost")}
        self.url = f"http://{HOST}:{port}/"

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Reports an error in a handler, except that a browser closed its connection."""
        if not isinstance(sys.exception(), (ConnectionError, TimeoutError)):
            super().handle_error(request, client_address)


class BackgroundServer(LoopbackServer):
    """A `LoopbackServer` that answers requests in a thread until it is closed: a context manager.

    Args:
        handler: subclass of `LoopbackHandler`.
        port: to listen at; 0 takes a free one.
        name: of the thread.
    """

    def __init__(self, handler: "type[LoopbackHandler]", port: int, name: str) -> None:
        super().__init__(handler, port)
        self._thread = threading.Thread(target=self.serve_forever, args=(_POLL_INTERVAL,), name=name, daemon=True)

    def start(self) -> None:
        """Begins to answer requests."""
        self._thread.start()

    def close(self) -> None:
        """Stops the server. Connections that are open stay so until the other side ends them."""
        self.shutdown()
        self.server_close()
        self._thread.join()

    def __exit__(self, *error: object) -> None:
        self.close()


class LoopbackHandler(BaseHTTPRequestHandler):
    """Base of the request handlers.

    Attributes:
        policy: Content-Security-Policy of every answer, which limits what its content may load.
        package: package whose folder ``page`` has the files of the page.
        files: {route: (name of the file, its media type)}.
    """

    server: LoopbackServer
    timeout = _TIMEOUT
    protocol_version = "HTTP/1.1"
    server_version, sys_version = "drake-tracker", ""
    policy = "default-src 'self'"
    package = ""
    files: ClassVar[Mapping[str, tuple[str, str]]] = {}

    def parse_request(self) -> bool:
        """Reads the head of a request. Refuses a request whose body could be taken for the next request."""
        if not super().parse_request():
            return False
        lengths = self.headers.get_all("Content-Length", [])
        bodiless = self.command != "POST" and lengths not in ([], ["0"])
        if bodiless or len(lengths) > 1 or "Transfer-Encoding" in self.headers:
            self.refuse(HTTPStatus.BAD_REQUEST, "only a POST request has a body, with one Content-Length")
            return False
        return True

    def is_addressed(self) -> bool:
        """Returns whether the Host header of the request names this server; refuses the request if not."""
        if self.headers.get("Host") in self.server.hosts:
            return True
        self.refuse(HTTPStatus.FORBIDDEN, "this is not the host that was asked for")
        return False

    def read_own_request(self, largest: int, refusal: str) -> bytes | None:
        """Returns the body of a POST request that comes from this server's own page; refuses the request if not.

        Args:
            largest: greatest size of the body [bytes].
            refusal: line for a request from another page.
        """
        if not self.is_addressed():
            return None
        if self.headers.get("Origin", "").removeprefix("http://") not in self.server.hosts:
            self.refuse(HTTPStatus.FORBIDDEN, refusal)
            return None
        length = self.headers.get("Content-Length", "")
        if not _LENGTH.fullmatch(length) or int(length) > largest:
            message = f"the request must have a length of at most {largest} bytes"
            self.refuse(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, message)
            return None
        return self.rfile.read(int(length))

    def answer_own_request(self, route: str, largest: int, refusal: str, act: Callable[[Any], Any]) -> None:
        """Answers a POST request of this server's own page: JSON comes in, and JSON goes out.

        Args:
            route: the only route that is answered.
            largest: greatest size of the body [bytes].
            refusal: line for a request from another page.
            act: returns the answer to the value of the body; raises ValueError or DrakeTrackerError for a wrong one.
        """
        body = self.read_own_request(largest, refusal)
        if body is None:
            return
        if self.path != route:
            self.refuse(HTTPStatus.NOT_FOUND, "there is no such page")
            return
        try:
            value = json.loads(body, parse_constant=_refuse_constant)
            json.dumps(value, ensure_ascii=False).encode()  # raises for half of a surrogate pair, which is no character
            answer = act(value)
        except (ValueError, RecursionError, DrakeTrackerError) as error:
            self.refuse(HTTPStatus.BAD_REQUEST, str(error))
            return
        self.send_json(answer)

    def send_json(self, value: Any) -> None:
        """Sends a value as JSON."""
        self.send(HTTPStatus.OK, "application/json", json.dumps(value).encode())

    def send_file_of_page(self) -> None:
        """Sends the file of the page that the route of the request names; refuses the request if there is none."""
        if self.path in self.files:
            name, media_type = self.files[self.path]
            self.send(HTTPStatus.OK, media_type, (files(self.package) / "page" / name).read_bytes())
        else:
            self.refuse(HTTPStatus.NOT_FOUND, "there is no such page")

    def send(self, status: int, media_type: str, body: bytes, more: Mapping[str, str] | None = None) -> None:
        """Sends an answer; its body is omitted when the request is HEAD."""
        self.head(status, media_type, len(body), more, close=status != HTTPStatus.OK)
        if self.command != "HEAD":
            self.wfile.write(body)

    def refuse(self, status: int, reason: str, more: Mapping[str, str] | None = None) -> None:
        """Sends an answer with a line that states why the request is refused."""
        self.send(status, "text/plain; charset=utf-8", f"{reason}\n".encode(errors="replace"), more)

    def head(
        self,
        status: int,
        media_type: str,
        length: int | None = None,
        more: Mapping[str, str] | None = None,
        close: bool = False,
    ) -> None:
        """Sends status and headers.

        Args:
            status: of the answer.
            media_type: of the body.
            length: of the body in bytes; None when the body ends with the connection.
            more: further headers.
            close: whether to close the connection after the answer.
        """
        self.send_response(status)
        self.send_header("Content-Type", media_type)
        if length is not None:
            self.send_header("Content-Length", str(length))
        if close:  # The unread rest of a refused request must not be parsed as the next request.
            self.send_header("Connection", "close")
            self.close_connection = True
        self.send_header("Cache-Control", "no-store")
        self.send_header("Content-Security-Policy", self.policy)
        self.send_header("X-Content-Type-Options", "nosniff")
        self.send_header("Referrer-Policy", "no-referrer")
        self.send_header("Cross-Origin-Resource-Policy", "same-origin")
        self.send_header("Cross-Origin-Opener-Policy", "same-origin")
        for name, value in (more or {}).items():
            self.send_header(name, value)
        self.end_headers()

    def log_message(self, format: str, *arguments: Any) -> None:
        """Prints nothing: requests are not logged."""


def _refuse_constant(name: str) -> float:
    raise ValueError(f"{name} is no number")
