"""``drake-tracker view``: shows the page of a finished run."""

from argparse import Namespace
from pathlib import Path

from drake_tracker.commands.common import SUCCESS, Commands, add_command
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.files.atomic_file import write_text
from drake_tracker.core.files.regular_file import printable

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
    command.add_argument("--no-browser", action="store_true", help="open no browser, print the link only")


def execute(options: Namespace) -> int:
    """Shows the page until Ctrl-C; returns the exit code."""
    from drake_tracker.report.page import page_of
    from drake_tracker.report.run_files import read_run
    from drake_tracker.report.server import make_server

    run = read_run(options.run)
    page = page_of(run)
    with make_server(page, run.folder, run.names, options.port) as server:
        save_page(page, run.folder / PAGE)
        for note in run.notes:
            print(printable(note))
        print(f"{server.url}  (Ctrl-C ends it)", flush=True)
        if not options.no_browser:
            import webbrowser

            webbrowser.open(server.url)
        try:
            server.serve_forever()
        except KeyboardInterrupt:
            print()
    return SUCCESS


def save_page(page: str, path: Path) -> None:
    """Writes the page into the run directory; where that is not possible, the page is only shown."""
    try:
        write_text(path, page)
    except DrakeTrackerError as error:
        print(error)
