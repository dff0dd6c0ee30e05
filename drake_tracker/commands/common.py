"""What several commands share: exit codes, arguments, the directory that a job leaves."""

import re
import time
from pathlib import Path

from drake_tracker.core.errors import DrakeTrackerError

LONGEST_NAME = 100
"""Letters of a scenario's name that the name of a directory has, at most."""
SUCCESS, NOT_TAKEN, TROUBLE, FAULT, INTERRUPTED = 0, 1, 2, 3, 130


def add_scenario(command):
    """Adds the argument SCENARIO and ``--set`` to a parser."""
    command.add_argument("scenario", metavar="SCENARIO[:NAME]", help="a scenario of the list, or FILE.yaml[:NAME]")
    add_overrides(command)


def add_overrides(command):
    """Adds ``--set`` to a parser."""
    command.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY.PATH=VALUE",
        dest="overrides",
        help="change one setting, for example --set track.speed=0.2; may be given again",
    )


def add_run(command):
    """Adds the arguments of a run to a parser: seed, duration, directory, recordings."""
    command.add_argument("--seed", type=int, metavar="N", help="seed of every random draw")
    command.add_argument("--duration", type=float, metavar="S", help="longest simulated time [s]")
    command.add_argument(
        "--out", type=Path, metavar="DIR", help="run directory, new or empty (default: runs/NAME-TIME)"
    )
    command.add_argument("--no-record", action="store_true", help="leave no recording and no video")
    command.add_argument("--meshcat", action="store_true", help="show the scene alone in a browser")


def add_lcm(command):
    """Adds ``--lcm`` to a parser."""
    command.add_argument(
        "--lcm", metavar="URL", help="LCM address, the same for both processes (default: this machine alone)"
    )


def run_directory(out, name, what="run"):
    """Returns the new directory of a run; raises DrakeTrackerError rather than touch one that has something in it.

    ``what`` it is for stands in the message.
    """
    chosen = out is not None
    if not chosen:
        out = free_name(name)
    try:
        out.mkdir(parents=True, exist_ok=chosen)
        occupied = any(out.iterdir())
    except OSError as error:
        raise DrakeTrackerError(f"the {what} directory {out} cannot be made: {error.strerror}") from None
    if occupied:
        raise DrakeTrackerError(f"the {what} directory {out} is not empty; name a new one, nothing is ever overwritten")
    return out


def forget_if_empty(out):
    """Removes the directory of a job that came to nothing."""
    if not any(out.iterdir()):
        out.rmdir()


def free_name(name):
    """Returns the path of a directory in runs/ that is not there yet, named by a name and the time."""
    name = re.sub(r"[^\w.+-]", "-", name).lstrip(".")[:LONGEST_NAME]
    stem = Path("runs") / f"{name}-{time.strftime('%Y%m%d-%H%M%S')}"
    out, count = stem, 1
    while out.exists():
        count += 1
        out = stem.with_name(f"{stem.name}-{count}")
    return out
