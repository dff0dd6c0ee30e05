"""``drake-tracker figures``: the paper's figures from runs of this system."""

from pathlib import Path

from drake_tracker.commands.common import SUCCESS, forget_if_empty, run_directory
from drake_tracker.core.errors import DrakeTrackerError


def register(commands):
    """Adds the command to the parsers ``commands``."""
    command = commands.add_parser("figures", help="draw the paper's figures from runs of this system")
    command.add_argument("--out", type=Path, required=True, metavar="DIR", help="directory for them, new or empty")
    command.add_argument("--seed", type=int, default=0, metavar="N", help="seed of every random draw (default: 0)")
    command.add_argument("--quick", action="store_true", help="a preview from a few seconds of the camera loop")
    command.add_argument(
        "--bounds",
        type=Path,
        metavar="FILE",
        help="bounds to draw in, a JSON file of curves (default: those of this world)",
    )
    command.set_defaults(action=execute)


def execute(options):
    from drake_tracker.figures.bound_curves import OWN, read_bounds
    from drake_tracker.tasks import load_scenario

    load_scenario("train", seed=options.seed)  # a bad seed is answered before anything is made
    bounds = read_bounds(options.bounds or OWN)
    out = run_directory(options.out, "figures", "figures")

    from drake_tracker.figures.command import make_figures

    try:
        make_figures(out, options.seed, options.quick, bounds)
    except DrakeTrackerError:
        forget_if_empty(out)
        raise
    return SUCCESS
