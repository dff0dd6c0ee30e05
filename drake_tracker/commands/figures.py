"""``drake-tracker figures``: draws the figures of the 1991 paper from runs of this system."""

from argparse import Namespace
from pathlib import Path

from drake_tracker.commands.common import SUCCESS, Commands, add_command, quiet_drake, run_directory


def register(commands: Commands) -> None:
    """Adds the command to the parsers ``commands``."""
    command = add_command(
        commands,
        "figures",
        execute,
        help="draw the figures of the 1991 paper from runs of this system",
        description="Runs the scenarios behind the figures of Allen et al. 1991 and leaves the figures and their "
        "numbers (figures.json).",
    )
    command.add_argument(
        "-o", "--out", type=Path, required=True, metavar="DIR", help="directory for them, new or empty"
    )
    command.add_argument("--seed", type=int, default=0, metavar="N", help="seed of the random numbers (default: 0)")
    command.add_argument("--quick", action="store_true", help="make a preview from a few simulated seconds")
    command.add_argument(
        "--bounds",
        type=Path,
        metavar="FILE",
        help="bounds to draw, a JSON file of curves (default: the bounds of this laboratory)",
    )


def execute(options: Namespace) -> int:
    """Draws the figures; returns the exit code."""
    from drake_tracker.figures.command import OWN, read_bounds
    from drake_tracker.tasks import load_scenario

    load_scenario("train", seed=options.seed)  # reports a bad seed before anything is made
    bounds = read_bounds(options.bounds or OWN)
    with run_directory(options.out, "figures", "figures") as out:
        from drake_tracker.figures.command import make_figures

        quiet_drake()
        make_figures(out, options.seed, options.quick, bounds)
    return SUCCESS
