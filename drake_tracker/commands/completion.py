"""``drake-tracker completion``: prints a script that completes commands and options in a shell."""

from argparse import ArgumentParser, Namespace
from functools import partial

from drake_tracker.commands.common import SUCCESS, Commands, add_command

SHELLS = {
    "bash": "~/.local/share/bash-completion/completions/drake-tracker",
    "zsh": "~/.zfunc/_drake-tracker",
    "fish": "~/.config/fish/completions/drake-tracker.fish",
}
"""Shells, each with the file in which one user installs the script; zsh needs ~/.zfunc in its fpath."""


def register(commands: Commands, root: ArgumentParser) -> None:
    """Adds the command to the parsers ``commands``.

    Args:
        commands: parsers of the commands.
        root: parser of ``drake-tracker``, whose commands and options are completed.
    """
    command = add_command(
        commands,
        "completion",
        partial(execute, root),
        help="print a completion script for a shell",
        description="\n".join(
            ["Prints a script that completes commands, options and files. To install it:"]
            + [f"  drake-tracker completion {shell} > {file}" for shell, file in SHELLS.items()]
        ),
    )
    command.add_argument("shell", choices=list(SHELLS), help="the shell")


def execute(root: ArgumentParser, options: Namespace) -> int:
    """Prints the script; returns the exit code."""
    import shtab

    print(shtab.complete(root, options.shell))
    return SUCCESS
