"""``drake-tracker arm``: runs the arm's computer and its laboratory, with the host in another process."""

from argparse import Namespace

from drake_tracker.commands.common import (
    Commands,
    add_command,
    add_lcm,
    add_run,
    add_scenario,
    announce_code,
    quiet_drake,
    run_directory,
)
from drake_tracker.commands.report import report
from drake_tracker.core.errors import DrakeTrackerError

_STALE = "grasp.when_stale"
"""Setting that this command changes: because the host can die, the arm holds, unless the scenario sets it."""


def register(commands: Commands) -> None:
    """Adds the command to the parsers ``commands``."""
    command = add_command(
        commands,
        "arm",
        execute,
        help="run the arm's computer and the laboratory, with `host` in another process",
        description="Simulates laboratory and arm, sends the sensor data over LCM, and follows the packets of "
        "`drake-tracker host`. Without packets the hand holds still, high above the object. Leaves a run directory.",
        next_step="drake-tracker host SCENARIO in another terminal, with the same scenario and settings; then "
        "drake-tracker view RUN.",
    )
    add_scenario(command)
    add_run(command)
    add_lcm(command)
    command.add_argument(
        "--rate",
        type=float,
        default=1.0,
        metavar="R",
        help="greatest real-time rate, simulated seconds per second (default: 1; 0: as fast as possible)",
    )


def execute(options: Namespace) -> int:
    """Runs the arm's side; returns the exit code."""
    from drake_tracker.core.progress import Progress
    from drake_tracker.tasks import load_scenario

    if not 0.0 <= options.rate < float("inf"):
        raise DrakeTrackerError(f"--rate {options.rate:g}: must be 0 or more")
    request = (options.scenario, options.seed, options.duration)
    scenario = load_scenario(*request, options.overrides, allow_code=options.allow_code)

    from drake_tracker.network.bus import open_bus
    from drake_tracker.run.options import RunOptions
    from drake_tracker.run.simulation import simulate
    from drake_tracker.tasks.train.two_processes import make_arm_side, resolve_split

    quiet_drake()
    resolve_split(scenario)
    if _STALE not in scenario.origins:
        scenario = load_scenario(*request, [f"{_STALE}=hold", *options.overrides], allow_code=options.allow_code)
    announce_code(scenario, ["arm"])
    lcm = open_bus(options.lcm)
    progress = Progress(scenario.duration)
    diagram = make_arm_side(scenario, lcm, progress.say)
    run_options = RunOptions(record=not options.no_record, meshcat=options.meshcat, realtime_rate=options.rate)
    with run_directory(options.out, scenario.name) as out:
        try:
            summary = simulate(scenario, out, run_options, diagram=diagram, progress=progress, tell=progress.say)
        finally:
            progress.close()
    return report(scenario, summary, out)
