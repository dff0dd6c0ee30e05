"""Serves one page, and the files beside it, to this machine only.

The names of the files that may be requested are fixed before the server starts. The path of a request is looked up
among them and never used for anything else.
"""

import mimetypes
import os
import re
from collections.abc import Iterable, Mapping
from http import HTTPStatus
from pathlib import Path

from drake_tracker.core.files.regular_file import open_regular
from drake_tracker.core.processes.loopback_server import LoopbackHandler, LoopbackServer
from drake_tracker.report.run_files import is_own_file

_CHUNK = 1 << 18
_RANGE = re.compile(r"bytes=(\d{0,18})-(\d{0,18})$", re.ASCII)
_RANGES = {"Accept-Ranges": "bytes"}


def make_server(page: str, folder: str | os.PathLike[str], names: Iterable[str], port: int) -> LoopbackServer:
    """Returns a server of a page and of files, bound to loopback; `serve_forever` answers requests.

    Raises DrakeTrackerError when the port is taken or does not exist.

    Args:
        page: text of HTML, served at /.
        folder: of the files.
        names: of the files that may be requested.
        port: to listen at; 0 takes a free one.
    """
    paths = {f"/{name}": Path(folder) / name for name in names}
    return LoopbackServer(type("Handler", (_RunHandler,), {"page": page.encode("utf-8"), "paths": paths}), port)


class _RunHandler(LoopbackHandler):
    policy = "default-src 'self' 'unsafe-inline' 'unsafe-eval' data: blob:; frame-ancestors 'self'"
    """Recordings contain their scripts; nothing may be loaded from another host."""
    page: bytes = b""
    paths: Mapping[str, Path] = {}

    def do_GET(self) -> None:
        if not self.is_addressed():
            return
        path = self.path.split("?")[0]
        file = self.paths.get(path)
        if path == "/":
            self.send(HTTPStatus.OK, "text/html; charset=utf-8", self.page, _RANGES)
        elif file is None or not is_own_file(file.parent, file.name):
            self.refuse(HTTPStatus.NOT_FOUND, "there is no such file")
        else:
            self._send_file(file)

    do_HEAD = do_GET

    def _send_file(self, file: Path) -> None:
        media_type = mimetypes.guess_type(file.name)[0] or "application/octet-stream"
        try:
            stream = open_regular(file)
        except OSError:
            self.refuse(HTTPStatus.NOT_FOUND, "there is no such file")
            return
        with stream:
            size = stream.seek(0, 2)
            requested = self._range(size)
            if requested is None:
                self.head(HTTPStatus.OK, media_type, size, _RANGES)
                first, last = 0, size - 1
            else:
                first, last = requested
                if first > last:
                    status = HTTPStatus.REQUESTED_RANGE_NOT_SATISFIABLE
                    self.refuse(status, "the file has no such bytes", {"Content-Range": f"bytes */{size}"})
                    return
                span = _RANGES | {"Content-Range": f"bytes {first}-{last}/{size}"}
                self.head(HTTPStatus.PARTIAL_CONTENT, media_type, last - first + 1, span)
            stream.seek(first)
            left = last - first + 1 if self.command != "HEAD" else 0
            while left > 0 and (chunk := stream.read(min(left, _CHUNK))):
                self.wfile.write(chunk)
                left -= len(chunk)

    def _range(self, size: int) -> tuple[int, int] | None:
        """Returns the first and last requested byte; None when all are requested, first > last when there are none."""
        requested = _RANGE.match(self.headers.get("Range", ""))
        if requested is None or requested.groups() == ("", ""):
            return None
        first, last = requested.groups()
        if first == "":
            return max(size - int(last), 0), size - 1
        return int(first), min(int(last), size - 1) if last else size - 1
