"""Shows a Meshcat scene in browsers, and lets nothing back to Meshcat.

Meshcat's own server accepts connections from the pages of any site, and an invalid message ends the program. Meshcat
therefore listens at an address of this machine that cannot be guessed (`hidden_address`). Pages connect to a server of
this module, which checks host and origin and passes messages from Meshcat to the page only.
"""

import re
import secrets
import select
import socket
import time
from base64 import b64encode
from hashlib import sha1
from http import HTTPStatus
from http.client import HTTPConnection
from importlib.resources import files

from drake_tracker.core.processes.loopback_server import BackgroundServer, LoopbackHandler

_FILES = re.compile(r"/|/favicon\.ico|/cas-v1/[0-9a-f]{64}")
"""Routes of Meshcat that are passed on: its page, and the script and the textures that are named by their SHA-256."""
_POLICY = (
    "default-src 'self'; script-src 'self' 'unsafe-inline'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data: blob:; connect-src 'self' data: blob:; base-uri 'none'; form-action 'none'; "
    "frame-ancestors http://127.0.0.1:* http://localhost:*"
)
"""Meshcat's page has its script and its style inside."""
_PAGE_END = b"</body>"
"""Where our own script is added to Meshcat's page."""
_TIMEOUT = 30.0
"""Time [s] after which a connection that does not move is closed."""
_PONG, _PONG_INTERVAL = b"\x8a\x80\0\0\0\0", 30.0
"""An empty pong of a client, RFC 6455 section 5.5.3, and how often [s] it is sent. Meshcat closes a connection that is
silent for 120 s."""
_ACCEPT_SUFFIX = b"258EAFA5-E914-47DA-95CA-C5AB0DC85B11"
"""Of the answer to a key, RFC 6455 section 1.3."""
_KEY = "ZHJha2VfdHJhY2tlcl9rZQ=="
"""Key of our own connections to Meshcat: any 16 bytes."""


def hidden_address() -> str:
    """Returns a random address in 127.0.0.0/8, the 16 million addresses of this machine only.

    Together with a free port there are 2**38 possibilities. A page that tries 1000 possibilities per second needs
    years.
    """
    return f"127.{1 + secrets.randbelow(254)}.{secrets.randbelow(256)}.{1 + secrets.randbelow(254)}"


class SceneServer(BackgroundServer):
    """Serves the page of a Meshcat in a thread until it is closed; open pages stay connected until Meshcat ends.

    Args:
        meshcat: (address, port) of Meshcat's server.

    Attributes:
        meshcat: see above.
        url: address of the page. The name differs from that of the live page, so that a browser draws the scene in a
            separate process and the live page stays responsive.
    """

    def __init__(self, meshcat: tuple[str, int]) -> None:
        super().__init__(_SceneHandler, 0, "scene")
        self.meshcat = meshcat
        self.url = f"http://localhost:{self.server_address[1]}/"
        self.start()


class _SceneHandler(LoopbackHandler):
    server: SceneServer
    policy = _POLICY
    timeout = _TIMEOUT

    def do_GET(self) -> None:
        if not self.is_addressed():
            return
        if self.headers.get("Upgrade", "").lower() == "websocket":
            self._pass_messages()
        elif _FILES.fullmatch(self.path):
            self._pass_file()
        else:
            self.refuse(HTTPStatus.NOT_FOUND, "there is no such page")

    def _pass_file(self) -> None:
        connection = HTTPConnection(*self.server.meshcat, timeout=_TIMEOUT)
        try:
            connection.request("GET", self.path)
            answer = connection.getresponse()
            body = answer.read()
        finally:
            connection.close()
        media_type = answer.getheader("Content-Type", "text/javascript")  # Meshcat names the other types
        if self.path == "/":
            pace = files("drake_tracker.run").joinpath("scene_pace.js").read_bytes()
            body = body.replace(_PAGE_END, b"<script>" + pace + b"</script>" + _PAGE_END, 1)
        self.send(answer.status, media_type, body)

    def _pass_messages(self) -> None:
        """Passes bytes from Meshcat to the page until either side closes; bytes from the page are read and dropped."""
        if self.headers.get("Origin", "").removeprefix("http://") not in self.server.hosts:
            self.refuse(HTTPStatus.FORBIDDEN, "only the scene's own page may connect")
            return
        self.close_connection = True
        self.connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, True)
        key = self.headers.get("Sec-WebSocket-Key", "").encode()
        with socket.create_connection(self.server.meshcat, _TIMEOUT) as meshcat:
            _ask_for_messages(meshcat)
            self.send_response(HTTPStatus.SWITCHING_PROTOCOLS)
            self.send_header("Upgrade", "websocket")
            self.send_header("Connection", "Upgrade")
            self.send_header("Sec-WebSocket-Accept", b64encode(sha1(key + _ACCEPT_SUFFIX).digest()).decode())
            self.end_headers()
            pong_due = 0.0
            while True:
                if time.monotonic() > pong_due:
                    meshcat.sendall(_PONG)
                    pong_due = time.monotonic() + _PONG_INTERVAL
                readable, _, _ = select.select([meshcat, self.connection], [], [], _PONG_INTERVAL)
                if self.connection in readable and not self.connection.recv(1 << 16):
                    return
                if meshcat in readable:
                    messages = meshcat.recv(1 << 16)
                    if not messages:
                        return
                    self.connection.sendall(messages)


def _ask_for_messages(meshcat: socket.socket) -> None:
    """Makes a connection to Meshcat a WebSocket, and reads nothing beyond the head of the answer."""
    host, port = meshcat.getpeername()
    meshcat.sendall(
        f"GET / HTTP/1.1\r\nHost: {host}:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        f"Sec-WebSocket-Key: {_KEY}\r\nSec-WebSocket-Version: 13\r\n\r\n".encode()
    )
    head = b""
    while not head.endswith(b"\r\n\r\n"):
        byte = meshcat.recv(1)
        if not byte:
            raise ConnectionError("Meshcat closed the connection")
        head += byte
