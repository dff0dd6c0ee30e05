"""The two revisions that `golden.py` compares: their files, their interpreters, and how their commands run."""

import os
import shutil
import signal
import subprocess
import sys
import threading
import tomllib
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NamedTuple

from drake_tracker.core.errors import DrakeTrackerError

ROOT = Path(__file__).resolve().parents[2]
ENVIRONMENT = {
    "DRAKE_TRACKER_RENDER_PROCESSES": "0",
    **dict.fromkeys(("LP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "OPENCV_FOR_THREADS_NUM"), "1"),
    "OPENCV_IPP": "disabled",
}
"""Without these, two runs of the same code may differ in the last bits. A sum of several threads has no fixed order.
Functions that OpenCV takes from IPP, such as `cv2.magnitude`, round according to the address of an array."""


class Side(NamedTuple):
    """One of the two revisions.

    Attributes:
        name: in the output.
        checkout: folder of its files.
        python: interpreter that runs it.
    """

    name: str
    checkout: Path
    python: str


class Children:
    """Processes that run at present, all of which can be ended from the main thread."""

    def __init__(self):
        self._lock = threading.Lock()
        self._running = set()
        self._ended = False

    def run(self, side, arguments, folder):
        """Runs the interpreter of a side in a folder; returns (exit code, output, error output)."""
        variables = {name: value for name, value in os.environ.items() if not name.startswith("DRAKE_TRACKER_")}
        with self._lock:
            if self._ended:
                raise DrakeTrackerError("interrupted")
            child = subprocess.Popen(
                [side.python, *arguments],
                cwd=folder,
                env={**variables, **ENVIRONMENT, "PYTHONPATH": str(side.checkout)},
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
                errors="replace",
                start_new_session=True,  # a worker of a campaign ends with its parent
            )
            self._running.add(child)
        try:
            output, errors = child.communicate()
        finally:
            with self._lock:
                self._running.discard(child)
        return child.returncode, output, errors

    def end(self):
        """Ends all processes; no other one begins."""
        with self._lock:
            self._ended = True
            for child in self._running:
                with suppress(ProcessLookupError):
                    os.killpg(child.pid, signal.SIGKILL)


def tell(line):
    """Prints a line of progress."""
    sys.stderr.write(f"{line}\n")  # in one piece, since several threads print
    sys.stderr.flush()


def git(*arguments, check=True):
    """Runs git in the repository; returns the completed process. Raises DrakeTrackerError when it fails."""
    done = subprocess.run(["git", "-C", str(ROOT), *arguments], capture_output=True, text=True)
    if check and done.returncode:
        raise DrakeTrackerError(f"git {arguments[0]}: {(done.stderr.strip().splitlines() or ['it failed'])[-1]}")
    return done


def is_ancestor(commit, base):
    """Returns whether a revision contains a commit."""
    done = git("merge-base", "--is-ancestor", commit, base, check=False)
    if done.returncode not in (0, 1):
        raise DrakeTrackerError(f"RENAMES names the commit {commit}, which this clone does not have")
    return done.returncode == 0


@contextmanager
def checked_out(revision, folder):
    """Checks a revision out into a new folder, and removes it afterwards."""
    tell(f"Checking out {revision}")
    try:
        git("worktree", "add", "--quiet", "--detach", str(folder), revision)
        yield
    finally:
        git("worktree", "remove", "--force", "--force", str(folder), check=False)


def copy_working_tree(folder):
    """Copies the files of the working tree that a run needs, those that git does not know yet included."""
    parts = ("drake_tracker", "models", "pyproject.toml", "constraints.txt")
    listed = git("ls-files", "-z", "--cached", "--others", "--exclude-standard", "--", *parts).stdout
    for name in filter(None, listed.split("\0")):
        if (ROOT / name).is_file():  # and not deleted
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, folder / name)


def interpreter(checkout, folder):
    """Returns the interpreter of a revision: this one, or that of a new environment if it needs other packages."""
    if requirements(checkout) == requirements(ROOT):
        return sys.executable
    tell("The revision pins other packages; installing them takes some minutes")
    python = str(folder / "bin" / "python")
    pinned = ["--constraint", "constraints.txt"] if (checkout / "constraints.txt").exists() else []
    built = ["--build-constraint", "constraints.txt"] if pinned else []
    for command in (
        [sys.executable, "-m", "venv", str(folder)],
        [python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *pinned, "uv"],
        [python, "-m", "uv", "pip", "install", "--quiet", "--python", python, *pinned, *built, "--editable", "."],
    ):
        done = subprocess.run(command, cwd=checkout, capture_output=True, text=True)
        if done.returncode:
            said = (done.stderr.strip().splitlines() or ["it failed"])[-1]
            raise DrakeTrackerError(f"the packages of the revision cannot be installed: {said}")
    return python


def requirements(checkout):
    """Returns what decides on the packages of a checkout: its pins and its dependencies."""
    pins = checkout / "constraints.txt"
    project = tomllib.loads((checkout / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    return pins.read_bytes() if pins.exists() else b"", project.get("dependencies")


def check_side(side, folder, children):
    """Raises DrakeTrackerError unless a side imports the package of its own checkout."""
    _, output, errors = children.run(side, ("-c", "import drake_tracker; print(drake_tracker.__file__)"), folder)
    if not Path(output.strip()).is_relative_to(side.checkout):
        said = output.strip() or (errors.strip().splitlines() or ["nothing"])[-1]
        raise DrakeTrackerError(f"{side.name}: the package must be that of {side.checkout}, but is {said}")
