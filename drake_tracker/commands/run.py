"""``drake-tracker run``: a scenario, from its start to its verdict."""

from contextlib import nullcontext
from pathlib import Path

from drake_tracker.commands.common import add_run, add_scenario, forget_if_empty, run_directory
from drake_tracker.commands.report import outcome, report
from drake_tracker.core.errors import DrakeTrackerError


def register(commands):
    """Adds the command to the parsers ``commands``."""
    command = commands.add_parser(
        "run", help="run a scenario", description="Runs a scenario and leaves a run directory."
    )
    add_scenario(command)
    add_run(command)
    command.add_argument(
        "--record-images",
        action="store_true",
        help="keep the images that the vision reads, for drake-tracker replay --from images",
    )
    command.add_argument("--live", action="store_true", help="show cameras, errors and scene on a page; pause and step")
    command.add_argument("--port", type=int, default=0, metavar="N", help="port of that page (default: a free one)")
    command.add_argument("--graphviz", type=Path, metavar="FILE", help="write the picture of the diagram to FILE")
    command.set_defaults(action=execute)


def execute(options):
    from drake_tracker.core.progress import Progress
    from drake_tracker.tasks import load_scenario

    scenario = load_scenario(options.scenario, options.seed, options.duration, options.overrides)
    if options.graphviz and not options.graphviz.absolute().parent.is_dir():
        raise DrakeTrackerError(f"--graphviz {options.graphviz}: there is no folder {options.graphviz.parent}")
    if options.graphviz and options.graphviz.is_dir():
        raise DrakeTrackerError(f"--graphviz {options.graphviz}: it is a folder; name a file")
    if options.port and not options.live:
        raise DrakeTrackerError(f"--port {options.port} is that of the live view: add --live")

    from drake_tracker.run.simulation import simulate  # Only now: bad input is answered without waiting for Drake.

    progress = Progress(scenario.duration)
    with _live_view(options, progress) as live:
        out = run_directory(options.out, scenario.name)
        if live is not None:
            print(f"Live view: {live.url}", flush=True)
        if scenario.task == "ball":
            progress.say("The camera reads the board's circles, then the arm touches its marks: a quarter of a minute")
        try:
            summary = simulate(
                scenario,
                out=out,
                record=not options.no_record,
                meshcat=options.meshcat,
                progress=progress,
                graphviz=options.graphviz,
                images=options.record_images,
                live=live,
            )
        except (DrakeTrackerError, KeyboardInterrupt):
            forget_if_empty(out)
            raise
        finally:
            progress.close()
        if live is not None:
            live.finish(outcome(scenario, summary, out))
    return report(scenario, summary, out)


def _live_view(options, progress):
    """Returns the `LiveView` that is asked for, or what stands in for none."""
    if not options.live:
        return nullcontext()
    from drake_tracker.live.view import LiveView

    return LiveView(options.port, progress.say)
