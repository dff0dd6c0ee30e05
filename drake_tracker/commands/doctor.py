"""``drake-tracker doctor``: checks whether this machine can run the simulations."""

from argparse import Namespace

from drake_tracker.commands.common import Commands, add_command


def register(commands: Commands) -> None:
    """Adds the command to the parsers ``commands``."""
    add_command(
        commands,
        "doctor",
        execute,
        help="check whether this machine can run the simulations",
        description="Checks Python, packages, system libraries, models and the renderer, and names missing parts.",
        next_step="drake-tracker run train",
    )


def execute(options: Namespace) -> int:
    """Prints the findings; returns the exit code."""
    from drake_tracker.core import system_check as machine

    return machine.main()
