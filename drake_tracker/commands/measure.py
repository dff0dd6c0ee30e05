"""``drake-tracker measure``: measures the error of a scenario's vision, for runs without rendering."""

from argparse import Namespace
from pathlib import Path

from drake_tracker.commands.common import SUCCESS, Commands, add_command, add_scenario, announce_code, quiet_drake
from drake_tracker.core.errors import DrakeTrackerError


def register(commands: Commands) -> None:
    """Adds the command to the parsers ``commands``."""
    command = add_command(
        commands,
        "measure",
        execute,
        help="measure the error of a scenario's vision, for runs without rendering",
        description="Runs cameras and vision without a grasp and writes the error of the measured points to a file.",
        next_step="drake-tracker run SCENARIO --set 'vision=!Measured {file: FILE}' uses the file.",
    )
    add_scenario(command)
    command.add_argument("-o", "--out", type=Path, required=True, metavar="FILE", help="file to write")
    command.add_argument("--seeds", type=int, default=2, metavar="N", help="runs at each speed (default: 2)")
    command.add_argument("--laps", type=int, default=2, metavar="N", help="laps of each run (default: 2)")
    command.add_argument("--speeds", metavar="V,V,...", help="speeds of the train [m/s] (default: seven, 0.05 to 0.6)")


def execute(options: Namespace) -> int:
    """Measures the error; returns the exit code."""
    from drake_tracker.tasks import load_scenario

    scenario = load_scenario(options.scenario, overrides=options.overrides, allow_code=options.allow_code)
    announce_code(scenario)
    speeds = None
    if options.speeds is not None:
        try:
            speeds = [float(text) for text in options.speeds.split(",")]
        except ValueError:
            raise DrakeTrackerError(f"--speeds {options.speeds}: must be numbers separated by commas") from None

    from drake_tracker.calibration.measure_vision import SPEEDS, measure

    quiet_drake()
    measure(scenario, options.out, seeds=options.seeds, laps=options.laps, speeds=SPEEDS if speeds is None else speeds)
    return SUCCESS
