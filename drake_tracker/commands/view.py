"""``drake-tracker view``: the page of a finished run."""

from pathlib import Path

from drake_tracker.commands.common import SUCCESS

PORT = 8317
PAGE = "report.html"


def register(commands):
    """Adds the command to the parsers ``commands``."""
    command = commands.add_parser(
        "view",
        help="look at a finished run: recording, video, attempts, and what a miss came from",
        description="Makes the page of a run, report.html in its directory, and shows it on this machine until Ctrl-C.",
    )
    command.add_argument("run", type=Path, metavar="RUN", help="a run directory")
    command.add_argument(
        "--port",
        type=int,
        default=PORT,
        metavar="N",
        help=f"port on this machine, 0 for any that is free (default: {PORT})",
    )
    command.add_argument("--no-browser", action="store_true", help="open no browser, print the link only")
    command.set_defaults(action=execute)


def execute(options):
    from drake_tracker.report.page import page_of
    from drake_tracker.report.run_files import read_run
    from drake_tracker.report.server import make_server

    run = read_run(options.run)
    page = page_of(run)
    with make_server(page, run.folder, run.names, options.port) as server:
        keep(page, run.folder / PAGE)
        for note in run.notes:
            print(note)
        print(f"{server.url}  (Ctrl-C ends it)", flush=True)
        if not options.no_browser:
            import webbrowser

            webbrowser.open(server.url)
        try:
            server.serve_forever()
        except KeyboardInterrupt:
            print()
    return SUCCESS


def keep(page, path):
    """Writes the page into the run directory; one that cannot be written to has the page on the screen alone."""
    try:
        path.write_text(page, encoding="utf-8")
    except OSError as error:
        print(f"{path} cannot be written: {error.strerror}")
