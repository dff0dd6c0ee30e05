"""``drake-tracker photograph``: takes photographs with one or two live cameras, for their calibration."""

from argparse import Namespace
from pathlib import Path

from drake_tracker.commands.common import SUCCESS, Commands, add_command
from drake_tracker.core.errors import DrakeTrackerError

MOST = 99
"""Largest number of photographs: their names have two digits."""


def register(commands: Commands) -> None:
    """Adds the command to the parsers ``commands``."""
    command = add_command(
        commands,
        "photograph",
        execute,
        help="take photographs with your own cameras, to calibrate them",
        description="Takes photographs with one or two live cameras, one every few seconds. Hold the board still, at "
        "another angle for each of them.",
        next_step="drake-tracker calibrate 'DIR/left*.png' 'DIR/right*.png' with the board's options.",
    )
    command.add_argument("source", nargs="+", metavar="CAMERA", help="number of the left or only camera; of the right")
    command.add_argument("-o", "--out", type=Path, required=True, metavar="DIR", help="folder for the photographs")
    command.add_argument("--every", type=float, default=4.0, metavar="S", help="time between photographs [s] (4)")
    command.add_argument("--count", type=int, default=15, metavar="N", help="number of photographs (15)")


def execute(options: Namespace) -> int:
    """Takes the photographs; returns the exit code."""
    from drake_tracker.footage.footage import Footage
    from drake_tracker.footage.photographs import take_photographs
    from drake_tracker.footage.played_camera import Start
    from drake_tracker.footage.sources import is_same_source, open_footage

    sources = options.source
    if len(sources) > 2:
        raise DrakeTrackerError(f"photograph: {len(sources)} cameras; give one or two")
    if len(sources) == 2 and is_same_source(*sources):
        raise DrakeTrackerError(f"photograph: {sources[0]} is given twice; each camera needs its own number")
    if not 0.1 <= options.every <= 3600.0:
        raise DrakeTrackerError(f"--every {options.every:g}: must be from 0.1 to 3600 s")
    if not 1 <= options.count <= MOST:
        raise DrakeTrackerError(f"--count {options.count}: must be from 1 to {MOST}")
    start, footage = Start(), list[Footage]()
    try:
        for source in sources:
            footage.append(open_footage(source, None, start))
        take_photographs(
            footage, options.out, every=options.every, count=options.count, say=lambda line: print(line, flush=True)
        )
    finally:
        for each in footage:
            each.close()
    print(f"wrote {options.count * len(sources)} photographs to {options.out}")
    return SUCCESS
