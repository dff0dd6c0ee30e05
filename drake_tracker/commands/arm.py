"""``drake-tracker arm``: the arm's computer and its laboratory, with the host in another process."""

from drake_tracker.commands.common import add_lcm, add_run, add_scenario, forget_if_empty, run_directory
from drake_tracker.commands.report import report
from drake_tracker.core.errors import DrakeTrackerError

_STALE = "grasp.when_stale"
"""Where the host can die, the arm holds, unless its scenario says otherwise."""


def register(commands):
    """Adds the command to the parsers ``commands``."""
    command = commands.add_parser(
        "arm",
        help="run the arm's computer and the laboratory, with `host` in another process",
        description="Runs laboratory and arm, sends what the sensors give over LCM, and goes by the packets of "
        "`drake-tracker host`. Without them the hand holds, high above the object. Leaves a run directory.",
    )
    add_scenario(command)
    add_run(command)
    add_lcm(command)
    command.add_argument(
        "--rate",
        type=float,
        default=1.0,
        metavar="R",
        help="simulated time to real time, at most (default 1; 0: as fast as it can)",
    )
    command.set_defaults(action=execute)


def execute(options):
    from drake_tracker.core.progress import Progress
    from drake_tracker.tasks import load_scenario

    if not 0.0 <= options.rate < float("inf"):
        raise DrakeTrackerError(f"--rate {options.rate:g}: it must be 0 or more")
    asked = (options.scenario, options.seed, options.duration)
    scenario = load_scenario(*asked, options.overrides)

    from drake_tracker.network.bus import open_bus
    from drake_tracker.run.simulation import simulate
    from drake_tracker.tasks.train.two_processes import check_task, make_arm_side

    check_task(scenario)
    if _STALE not in scenario.origins:
        scenario = load_scenario(*asked, [f"{_STALE}=hold", *options.overrides])
    lcm = open_bus(options.lcm)
    diagram = make_arm_side(scenario, lcm)
    out = run_directory(options.out, scenario.name)
    progress = Progress(scenario.duration)
    try:
        summary = simulate(
            scenario,
            out=out,
            record=not options.no_record,
            meshcat=options.meshcat,
            progress=progress,
            diagram=diagram,
            rate=options.rate,
        )
    except DrakeTrackerError:
        forget_if_empty(out)
        raise
    finally:
        progress.close()
    return report(scenario, summary, out)
