"""``drake-tracker view``: shows the page of a finished run."""

from argparse import Namespace
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from drake_tracker.commands.common import SUCCESS, Commands, add_browser, add_command, open_browser
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.files.atomic_file import write_text
from drake_tracker.core.files.regular_file import printable

if TYPE_CHECKING:
    from drake_tracker.core.processes.loopback_server import LoopbackServer

PORT = 8317
"""Default port of the page."""
PAGE = "report.html"
"""File of the page in the run directory."""


def register(commands: Commands) -> None:
    """Adds the command to the parsers ``commands``."""
    command = add_command(
        commands,
        "view",
        execute,
        help="show a finished run: recording, video, attempts, and the causes of a miss",
        description="Writes the page of a run, report.html in its directory, and shows it until Ctrl-C.",
        next_step="drake-tracker replay RUN --set KEY.PATH=VALUE tries other settings on the same recording.",
    )
    command.add_argument("run", type=Path, metavar="RUN", help="run directory of drake-tracker run")
    command.add_argument(
        "--port",
        type=int,
        default=PORT,
        metavar="N",
        help=f"port on this machine, 0 for any free one (default: {PORT})",
    )
    add_browser(command)


def execute(options: Namespace) -> int:
    """Shows the page until Ctrl-C; returns the exit code."""
    with serving(options.run, options.port) as server:
        if not options.no_browser:
            open_browser(server.url)
        serve(server)
    return SUCCESS


@contextmanager
def serving(folder: Path, port: int = 0) -> Iterator["LoopbackServer"]:
    """Writes the page of a run into the directory of the run, and yields a server of the page.

    Raises DrakeTrackerError when the directory has no run, or the port is taken.
    """
    from drake_tracker.report.page import page_of
    from drake_tracker.report.run_files import read_run
    from drake_tracker.report.server import make_server

    run = read_run(folder)
    page = page_of(run)
    with make_server(page, run.folder, run.names, port) as server:
        save_page(page, run.folder / PAGE)
        for note in run.notes:
            print(printable(note))
        yield server


def serve(server: "LoopbackServer") -> None:
    """Serves the page until Ctrl-C."""
    print(f"{server.url}  (Ctrl-C ends it)", flush=True)
    try:
        server.serve_forever()
    except KeyboardInterrupt:
        print()


def save_page(page: str, path: Path) -> None:
    """Writes the page into the run directory; where that is not possible, the page is only shown."""
    try:
        write_text(path, page)
    except DrakeTrackerError as error:
        print(error)
