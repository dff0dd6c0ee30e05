"""``drake-tracker run``: runs a scenario from its start to its verdict."""

import sys
from argparse import Namespace
from contextlib import AbstractContextManager, ExitStack, nullcontext
from pathlib import Path
from typing import Any

from drake_tracker.commands.common import (
    Commands,
    add_browser,
    add_command,
    add_run,
    add_scenario,
    announce_code,
    one_thread,
    open_browser,
    quiet_drake,
    run_directory,
)
from drake_tracker.commands.report import outcome, report
from drake_tracker.commands.view import serve, serving
from drake_tracker.core.errors import DrakeTrackerError


def register(commands: Commands) -> None:
    """Adds the command to the parsers ``commands``."""
    command = add_command(
        commands,
        "run",
        execute,
        help="run a scenario",
        description="Simulates a scenario and leaves a run directory with summary, signals, 3-D recording, video and "
        "pictures. The exit code is 0 when the object was grasped and 1 when it was not.",
        next_step="drake-tracker view RUN shows the run directory in a browser; drake-tracker replay RUN --set "
        "KEY.PATH=VALUE repeats its vision and filters with other settings.",
    )
    add_scenario(command)
    add_run(command)
    command.add_argument(
        "--record-images",
        action="store_true",
        help="keep the images that the vision reads, for drake-tracker replay --from images",
    )
    command.add_argument(
        "--mcap", action="store_true", help="also write the run as run.mcap, which Foxglove and Rerun show"
    )
    command.add_argument(
        "--live", action="store_true", help="show cameras, errors and scene on a page, with pause and single step"
    )
    command.add_argument("--port", type=int, default=0, metavar="N", help="port of that page (default: a free one)")
    add_browser(command)
    command.add_argument("--graphviz", type=Path, metavar="FILE", help="write the block diagram to FILE, in Graphviz")


def execute(options: Namespace) -> int:
    """Runs the scenario; returns the exit code."""
    one_thread()

    from drake_tracker.core.progress import Progress
    from drake_tracker.tasks import load_scenario

    scenario = load_scenario(
        options.scenario, options.seed, options.duration, options.overrides, allow_code=options.allow_code
    )
    _check_options(options)
    _check_duration(scenario)
    announce_code(scenario)
    progress = Progress(scenario.duration)
    with ExitStack() as pages:
        with _live_view(options, progress) as live, run_directory(options.out, scenario.name) as out:
            if live is not None:
                print(f"Live view: {live.url}  (open it in a browser; Ctrl-C ends the run)", flush=True)
                if not options.no_browser:
                    open_browser(live.url)
            try:
                summary = _simulate(options, scenario, out, progress, live)
            finally:
                progress.close()
            page = None
            if live is not None and live.state.watchers and sys.stdout.isatty() and not summary.get("interrupted"):
                page = pages.enter_context(serving(out))
            if live is not None:
                live.finish(outcome(scenario, summary, out) | {"report": page and page.url})
        code = report(scenario, summary, out)
        if page is not None:
            serve(page)
    return code


def _simulate(options: Namespace, scenario: Any, out: Path, progress: Any, live: Any) -> dict[str, Any]:
    """Simulates a scenario; bad input and the link of the live view do not wait for these imports."""
    from drake_tracker.run.options import RunOptions
    from drake_tracker.run.simulation import simulate
    from drake_tracker.tasks.registry import task_of

    quiet_drake()
    progress.say(f"Building {scenario.name} (seed {scenario.seed}), then up to {scenario.duration:g} s are simulated")
    preparation = task_of(scenario).preparation
    if preparation:
        progress.say(preparation)
    run_options = RunOptions(
        record=not options.no_record,
        images=options.record_images,
        mcap=options.mcap,
        meshcat=options.meshcat,
        graphviz=options.graphviz,
    )
    return simulate(scenario, out, run_options, progress=progress, live=live, tell=progress.say)


def _check_options(options: Namespace) -> None:
    """Raises DrakeTrackerError when options contradict each other or name no file."""
    if options.graphviz and not options.graphviz.absolute().parent.is_dir():
        raise DrakeTrackerError(f"--graphviz {options.graphviz}: there is no folder {options.graphviz.parent}")
    if options.graphviz and options.graphviz.is_dir():
        raise DrakeTrackerError(f"--graphviz {options.graphviz}: this is a folder; name a file")
    if options.port and not options.live:
        raise DrakeTrackerError(f"--port {options.port} is the port of the live view: add --live")


def _check_duration(scenario: Any) -> None:
    """Raises DrakeTrackerError when the run would end before the first measurement reaches the arm."""
    if scenario.duration < scenario.lag:
        raise DrakeTrackerError(
            f"{scenario.where('duration')}: {scenario.duration:g} s is too short, because the first measurement "
            f"reaches the arm after {scenario.lag:.3g} s"
        )


def _live_view(options: Namespace, progress: Any) -> AbstractContextManager[Any]:
    """Returns the `LiveView` when it is requested, else a context manager that gives None."""
    if not options.live:
        return nullcontext()
    from drake_tracker.live.view import LiveView

    return LiveView(options.port, progress.say)
