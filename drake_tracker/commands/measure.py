"""``drake-tracker measure``: the error of a scenario's cameras, for runs without rendering."""

from pathlib import Path

from drake_tracker.commands.common import SUCCESS, add_scenario
from drake_tracker.core.errors import DrakeTrackerError


def register(commands):
    """Adds the command to the parsers ``commands``."""
    command = commands.add_parser(
        "measure",
        help="measure the error of a scenario's cameras, for runs without rendering",
        description="Runs the camera loop without a grasp and writes the error of its points, for vision: !Measured.",
    )
    add_scenario(command)
    command.add_argument("-o", "--out", type=Path, required=True, metavar="FILE", help="file to write")
    command.add_argument("--seeds", type=int, default=2, metavar="N", help="runs at each speed (default 2)")
    command.add_argument("--laps", type=int, default=2, metavar="N", help="laps of each run (default 2)")
    command.add_argument("--speeds", metavar="V,V,...", help="speeds of the train [m/s] (default: 0.05 to 0.6, seven)")
    command.set_defaults(action=execute)


def execute(options):
    from drake_tracker.tasks import load_scenario

    scenario = load_scenario(options.scenario, overrides=options.overrides)
    speeds = {}
    if options.speeds is not None:
        try:
            speeds = {"speeds": [float(text) for text in options.speeds.split(",")]}
        except ValueError:
            raise DrakeTrackerError(f"--speeds {options.speeds}: must be numbers separated by commas") from None

    from drake_tracker.calibration.measure_vision import (
        measure,  # Only now: bad input is answered without waiting for Drake.
    )

    measure(scenario, options.out, seeds=options.seeds, laps=options.laps, **speeds)
    return SUCCESS
