"""What `fuzz.py` watches while a command runs: its exit code, tracebacks, and everything that it writes."""

import contextlib
import io
import os
import signal
import subprocess
import sys
from pathlib import Path

from drake_tracker import cli

DOCUMENTED = {0, 1, 2}
"""Exit codes of a command that was not interrupted and has no fault."""
PASSED = ("/dev/null", "/dev/shm", "/proc/self", "/dev/dri")
"""Where a command may open files for writing."""
_WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC
_NAMES = {  # event: (positions of the paths that it changes, whether a link is followed)
    "os.mkdir": ((0,), False),
    "os.rename": ((0, 1), False),
    "os.remove": ((0,), False),
    "os.rmdir": ((0,), False),
    "os.symlink": ((1,), False),
    "os.link": ((1,), False),
    "os.truncate": ((0,), True),
    "os.chmod": ((0,), True),
}


class Defect(Exception):
    """What a case must not do."""


class Writes:
    """Remembers what this process changes outside of the allowed folder, on the whole file system.

    Native code is not seen here; `Watched` also compares the files around the folder.
    """

    def __init__(self):
        self.allowed, self.found = None, []
        sys.addaudithook(self._hear)

    def _hear(self, event, arguments):
        if self.allowed is None:
            return
        if event == "open":
            path, _, flags = arguments
            if not isinstance(flags, int) or not flags & _WRITING or isinstance(path, int):
                return
            self._judge(path, follow=True)
        elif event in _NAMES:
            places, follow = _NAMES[event]
            for place in places:
                self._judge(arguments[place], follow)

    def _judge(self, path, follow):
        if isinstance(path, int):
            return
        path = os.path.abspath(os.fsdecode(path))
        real = os.path.realpath(path)
        if not follow:
            real = os.path.join(os.path.realpath(os.path.dirname(path)), os.path.basename(path))
        if not any(real == folder or real.startswith(f"{folder}/") for folder in (*PASSED, self.allowed)):
            self.found.append(real)


writes = Writes()


def files(root, but):
    """Returns {path: what it is} of everything in a folder, except below the folder ``but``."""
    found = {}
    for folder, names, plain in os.walk(root):
        names[:] = [name for name in names if Path(folder, name) != but]
        for name in (*names, *plain):
            path = Path(folder, name)
            about = path.lstat()
            content = os.readlink(path) if path.is_symlink() else about.st_size, about.st_mtime_ns
            found[path] = (about.st_mode, content if not path.is_dir() else None)
    return found


@contextlib.contextmanager
def watched(root, allowed):
    """Raises Defect when the block writes anything but ``allowed``, a path in the folder ``root`` of the case.

    The working directory of the block is the folder ``here`` in it.
    """
    before = files(root, allowed)
    os.chdir(root / "here")
    writes.allowed, writes.found = os.path.realpath(allowed), []
    try:
        yield
    finally:
        writes.allowed = None
        os.chdir(root)
    after = files(root, allowed)
    changed = {path for path in before.keys() | after.keys() if before.get(path) != after.get(path)} - {allowed}
    found = sorted({*map(str, changed), *writes.found})
    if found:
        raise Defect(f"written outside: {', '.join(found)[:500]}")


def judge(code, errors):
    """Raises Defect for an exit code or an output that a user must not see."""
    if "Traceback" in errors or code == cli.FAULT:
        raise Defect(f"traceback: {errors[-3000:]}")
    if code not in DOCUMENTED:
        raise Defect(f"exit code {code}: {errors[-1000:]}")
    if code == cli.TROUBLE and not errors.strip():
        raise Defect("exit code 2 without a reason")


def command(root, allowed, *arguments):
    """Runs a command in this process and judges it. Returns its exit code."""
    errors = io.StringIO()
    with watched(root, allowed), contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(errors):
        try:
            code = cli.main(list(arguments))
        except SystemExit as error:  # argparse
            code = error.code
    judge(code, errors.getvalue())
    return code


def process(root, allowed, *arguments):
    """Runs a command in a process of its own and judges it; ``view`` is interrupted when it shows its page."""
    printed = root.parent / "printed"
    with printed.open("wb") as errors, watched(root, allowed):
        program = [sys.executable, "-m", "drake_tracker", *arguments]
        child = subprocess.Popen(program, stdout=subprocess.PIPE, stderr=errors)
        showing = False
        try:
            for line in child.stdout:
                if arguments[0] == "view" and line.startswith(b"http://127.0.0.1:"):
                    showing = True
                    child.send_signal(signal.SIGINT)
            code = child.wait()
        finally:
            child.kill()
            child.wait()
    judge(0 if showing and code == 130 else code, printed.read_text(errors="replace"))
    return code
