"""Shows one page and the files beside it to this machine alone.

What may be asked for is a list of names, made before the server starts. A path from the network is looked up in it and
never used for anything else.
"""

import mimetypes
import re
from http import HTTPStatus
from pathlib import Path

from drake_tracker.core.loopback_server import LoopbackHandler, LoopbackServer
from drake_tracker.report.run_files import is_own_file

_CHUNK = 1 << 18
_RANGE = re.compile(r"bytes=(\d*)-(\d*)$")
_RANGES = {"Accept-Ranges": "bytes"}


def make_server(page, folder, names, port):
    """Returns a server of a page and of files of a folder, bound to loopback; `serve_forever` answers.

    Args:
      page: text of HTML, shown at /. folder: of the files. names: those that may be asked for. port: 0 is any that is
      free.

    Raises DrakeTrackerError when the port is taken, or none of this machine's.
    """
    files = {f"/{name}": Path(folder) / name for name in names}
    return LoopbackServer(type("Handler", (_Handler,), {"page": page.encode("utf-8"), "files": files}), port)


class _Handler(LoopbackHandler):
    policy = "default-src 'self' 'unsafe-inline' 'unsafe-eval' data: blob:; frame-ancestors 'self'"
    """Recordings carry their scripts within them; nothing may be fetched from elsewhere."""
    page, files = b"", {}

    def do_GET(self):
        if not self.is_addressed():
            return
        path = self.path.split("?")[0]
        file = self.files.get(path)
        if path == "/":
            self.send(HTTPStatus.OK, "text/html; charset=utf-8", self.page, _RANGES)
        elif file is None or not is_own_file(file.parent, file.name):
            self.refuse(HTTPStatus.NOT_FOUND, "there is no such file")
        else:
            self._send_file(file)

    do_HEAD = do_GET

    def _send_file(self, file):
        kind = mimetypes.guess_type(file.name)[0] or "application/octet-stream"
        with file.open("rb") as stream:
            size = stream.seek(0, 2)
            first, last = self._range(size)
            if first is None:
                self.head(HTTPStatus.OK, kind, size, _RANGES)
                first, last = 0, size - 1
            elif first > last:
                status = HTTPStatus.REQUESTED_RANGE_NOT_SATISFIABLE
                self.refuse(status, "there are no such bytes", {"Content-Range": f"bytes */{size}"})
                return
            else:
                span = _RANGES | {"Content-Range": f"bytes {first}-{last}/{size}"}
                self.head(HTTPStatus.PARTIAL_CONTENT, kind, last - first + 1, span)
            stream.seek(first)
            left = last - first + 1 if self.command != "HEAD" else 0
            while left > 0 and (chunk := stream.read(min(left, _CHUNK))):
                self.wfile.write(chunk)
                left -= len(chunk)

    def _range(self, size):
        """Returns the first and the last byte that are asked for, (None, None) for all, first > last for none."""
        asked = _RANGE.match(self.headers.get("Range", ""))
        if asked is None or asked.groups() == ("", ""):
            return None, None
        first, last = asked.groups()
        if first == "":
            return max(size - int(last), 0), size - 1
        return int(first), min(int(last), size - 1) if last else size - 1
