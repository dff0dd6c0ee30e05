"""``drake-tracker run``: a scenario, from its start to its verdict."""

from pathlib import Path

from drake_tracker.commands.common import add_run, add_scenario, forget_if_empty, run_directory
from drake_tracker.commands.report import report
from drake_tracker.errors import DrakeTrackerError


def register(commands):
    """Adds the command to the parsers ``commands``."""
    command = commands.add_parser(
        "run", help="run a scenario", description="Runs a scenario and leaves a run directory."
    )
    add_scenario(command)
    add_run(command)
    command.add_argument("--record-images", action="store_true",
                         help="keep the images that the vision reads, for drake-tracker replay --from images")
    command.add_argument("--graphviz", type=Path, metavar="FILE", help="write the picture of the diagram to FILE")
    command.set_defaults(action=execute)


def execute(options):
    from drake_tracker.progress import Progress
    from drake_tracker.scenarios import load_scenario

    scenario = load_scenario(options.scenario, options.seed, options.duration, options.overrides)
    if options.graphviz and not options.graphviz.absolute().parent.is_dir():
        raise DrakeTrackerError(f"--graphviz {options.graphviz}: there is no folder {options.graphviz.parent}")

    from drake_tracker.simulation import simulate  # Only now: bad input is answered without waiting for Drake.

    out = run_directory(options.out, scenario.name)
    progress = Progress(scenario.duration)
    try:
        summary = simulate(
            scenario, out=out, record=not options.no_record, meshcat=options.meshcat, progress=progress,
            graphviz=options.graphviz, images=options.record_images,
        )
    except DrakeTrackerError:
        forget_if_empty(out)
        raise
    finally:
        progress.close()
    return report(scenario, summary, out)
