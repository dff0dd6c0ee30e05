"""Shows one page and the files beside it to this machine alone.

What may be asked for is a list of names, made before the server starts. A path from the network is looked up in it and
never used for anything else.
"""

import mimetypes
import re
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

from drake_tracker.errors import DrakeTrackerError
from drake_tracker.view.run_files import is_own_file

LOOPBACK = "127.0.0.1"
_CHUNK = 1 << 18
_RANGE = re.compile(r"bytes=(\d*)-(\d*)$")
_POLICY = "default-src 'self' 'unsafe-inline' 'unsafe-eval' data: blob:; frame-ancestors 'self'"
"""Recordings carry their scripts within them; nothing may be fetched from elsewhere."""


def make_server(page, folder, names, port):
    """Returns a server of a page and of files of a folder, bound to loopback; `serve_forever` answers.

    Args:
      page: text of HTML, shown at /. folder: of the files. names: those that may be asked for. port: 0 is any that is
      free.

    Raises DrakeTrackerError when the port is taken, or none of this machine's.
    """
    files = {f"/{name}": Path(folder) / name for name in names}
    handler = type("Handler", (_Handler,), {"page": page.encode("utf-8"), "files": files})
    try:
        return _Server((LOOPBACK, port), handler)
    except (OSError, OverflowError) as error:
        reason = getattr(error, "strerror", None) or "it must lie between 0 and 65535"
        raise DrakeTrackerError(f"port {port}: {reason}; name another one with --port, 0 takes any") from None


class _Server(ThreadingHTTPServer):
    daemon_threads = True

    def handle_error(self, request, client_address):
        """A browser that turns away in the middle of a video is no fault."""


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    page, files = b"", {}

    def do_GET(self):
        self._answer(body=True)

    def do_HEAD(self):
        self._answer(body=False)

    def log_message(self, *_):
        pass

    def _answer(self, body):
        port = self.server.server_address[1]
        if self.headers.get("Host") not in (f"{LOOPBACK}:{port}", f"localhost:{port}"):
            return self._refuse(HTTPStatus.FORBIDDEN)  # another name that leads here: a page of somebody else's
        path = self.path.split("?")[0]
        if path == "/":
            self._head(HTTPStatus.OK, "text/html; charset=utf-8", len(self.page))
            if body:
                self.wfile.write(self.page)
            return None
        file = self.files.get(path)
        if file is None or not is_own_file(file.parent, file.name):
            return self._refuse(HTTPStatus.NOT_FOUND)
        return self._send(file, body)

    def _send(self, file, body):
        kind = mimetypes.guess_type(file.name)[0] or "application/octet-stream"
        with file.open("rb") as stream:
            size = stream.seek(0, 2)
            first, last = self._range(size)
            if first is None:
                self._head(HTTPStatus.OK, kind, size)
                first, last = 0, size - 1
            elif first > last:
                return self._refuse(HTTPStatus.REQUESTED_RANGE_NOT_SATISFIABLE, {"Content-Range": f"bytes */{size}"})
            else:
                span = {"Content-Range": f"bytes {first}-{last}/{size}"}
                self._head(HTTPStatus.PARTIAL_CONTENT, kind, last - first + 1, span)
            stream.seek(first)
            left = last - first + 1 if body else 0
            while left > 0 and (chunk := stream.read(min(left, _CHUNK))):
                self.wfile.write(chunk)
                left -= len(chunk)
        return None

    def _range(self, size):
        """Returns the first and the last byte that are asked for, (None, None) for all, first > last for none."""
        asked = _RANGE.match(self.headers.get("Range", ""))
        if asked is None or asked.groups() == ("", ""):
            return None, None
        first, last = asked.groups()
        if first == "":
            return max(size - int(last), 0), size - 1
        return int(first), min(int(last), size - 1) if last else size - 1

    def _head(self, status, kind, length, more=None):
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(length))
        self.send_header("Accept-Ranges", "bytes")
        self.send_header("Cache-Control", "no-store")
        self.send_header("X-Content-Type-Options", "nosniff")
        self.send_header("Content-Security-Policy", _POLICY)
        for name, value in (more or {}).items():
            self.send_header(name, value)
        self.end_headers()

    def _refuse(self, status, more=None):
        self._head(status, "text/plain; charset=utf-8", 0, more)
