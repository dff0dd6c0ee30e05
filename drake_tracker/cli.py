"""The command ``drake-tracker``.

Exit codes: 0 the job succeeded (a campaign: it ran, whatever its rates); 1 it ran and the object was not taken; 2 bad
input or a broken machine, with one clear line and no traceback; 3 a fault of the program, with its traceback; 130
interrupted, with what was recorded so far kept.
"""

import argparse
import sys
import traceback

from drake_tracker.commands import (
    arm,
    calibrate,
    campaign,
    doctor,
    figures,
    host,
    list_scenarios,
    measure,
    replay,
    run,
    track,
    view,
)
from drake_tracker.commands.common import FAULT, INTERRUPTED, TROUBLE
from drake_tracker.core.errors import DrakeTrackerError

COMMANDS = (run, view, replay, list_scenarios, doctor, calibrate, track, measure, campaign, figures, host, arm)
"""In the order of ``--help``."""


def main(arguments=None):
    """Runs the command with the given arguments (the process's own by default). Returns the exit code."""
    options = _parser().parse_args(arguments)
    try:
        return options.action(options)
    except DrakeTrackerError as error:
        for line in str(error).splitlines():
            print(f"drake-tracker: {line}", file=sys.stderr)
        return TROUBLE
    except KeyboardInterrupt:
        print("drake-tracker: interrupted", file=sys.stderr)
        return INTERRUPTED
    except ImportError as error:
        remedy = "`make setup` installs what is missing, and `drake-tracker doctor` says more"
        print(f"drake-tracker: a package does not load ({error}); {remedy}", file=sys.stderr)
        return TROUBLE
    except (Exception, SystemExit):  # Python's own code, or that of a user's part, would tell that the run went well
        traceback.print_exc()
        return FAULT


class _Parser(argparse.ArgumentParser):
    def error(self, message):
        self.exit(TROUBLE, f"{self.prog}: {message}; see {self.prog} --help\n")


def _parser():
    parser = _Parser(prog="drake-tracker", description="A robot that grasps what moves, by sight.")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    for command in COMMANDS:
        command.register(commands)
    return parser
