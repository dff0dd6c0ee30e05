"""``drake-tracker calibrate``: a scenario's cameras from rendered images, or one's own from photographs."""

from pathlib import Path

from drake_tracker.commands.common import SUCCESS, add_overrides
from drake_tracker.core.errors import DrakeTrackerError


def register(commands):
    """Adds the command to the parsers ``commands``."""
    command = commands.add_parser(
        "calibrate",
        help="calibrate a scenario's cameras, or your own from photographs of a board",
        description="One SCENARIO: its cameras, from rendered images. With --board: your own, from photographs of a "
        "chessboard, a folder or a quoted pattern for each camera, two for a pair of cameras.",
    )
    command.add_argument("source", nargs="+", metavar="SCENARIO|IMAGES", help="a scenario, or one or two image sets")
    add_overrides(command)
    command.add_argument("-o", "--out", type=Path, metavar="FILE", help="calibration file to write")
    command.add_argument("--board", metavar="CxR", help="the board's inner corners, for example 9x6")
    command.add_argument("--square", type=float, metavar="M", help="side of one of its squares [m]")
    command.add_argument(
        "--world",
        action="store_true",
        help="the world's frame is the board of the first photograph, not the left camera",
    )
    command.set_defaults(action=execute)


def execute(options):
    from drake_tracker.tasks import in_package, load_scenario

    sources, board = options.source, options.board
    if board is None and (len(sources) > 1 or options.square is not None or options.world):
        raise DrakeTrackerError("calibrate: photographs need --board, the chessboard's inner corners, for example 9x6")
    if board is None:
        scenario = load_scenario(sources[0], overrides=options.overrides)
        if options.out is None and scenario.task == "train" and in_package(scenario.cameras.calibration):
            raise DrakeTrackerError("calibrate: -o FILE is missing: the package's own calibration is not written over")

        from drake_tracker.calibration.rendered_boards import calibrate

        calibrate(scenario, options.out)
        return SUCCESS
    if len(sources) > 2:
        raise DrakeTrackerError(f"calibrate: {len(sources)} image sets; give one or two, and put patterns in quotes")
    if options.overrides:
        raise DrakeTrackerError("calibrate: --set changes a scenario, and photographs have none")
    if options.out is None:
        raise DrakeTrackerError("calibrate: -o FILE is missing: the calibration file to write")
    from drake_tracker.calibration.photographs import calibrate_photographs, parse_board

    calibrate_photographs(sources, parse_board(board, options.square), options.out, world=options.world)
    return SUCCESS
