"""``drake-tracker calibrate``: calibrates a scenario's cameras from rendered images, or your own from photographs."""

from argparse import Namespace
from pathlib import Path
from typing import Any

from drake_tracker.commands.board import add_board
from drake_tracker.commands.common import SUCCESS, Commands, add_command, add_overrides, quiet_drake
from drake_tracker.core.errors import DrakeTrackerError


def register(commands: Commands) -> None:
    """Adds the command to the parsers ``commands``."""
    command = add_command(
        commands,
        "calibrate",
        execute,
        help="calibrate a scenario's cameras, or your own from photographs of a board",
        description="With one SCENARIO: calibrates its cameras from rendered images. With --board: calibrates your own "
        "cameras from photographs of a board, given as a folder or a quoted pattern for each camera; two for a pair of "
        "cameras.",
        next_step="drake-tracker track LEFT RIGHT --calibration FILE for your own cameras; drake-tracker run SCENARIO "
        "--set cameras.calibration=FILE for a scenario.",
    )
    command.add_argument("source", nargs="+", metavar="SCENARIO|IMAGES", help="a scenario, or one or two image sets")
    add_overrides(command)
    command.add_argument("-o", "--out", type=Path, metavar="FILE", help="calibration file to write")
    add_board(command)
    command.add_argument(
        "--lens",
        choices=("pinhole", "rational", "fisheye"),
        default="pinhole",
        help="model of the lens: pinhole with 5 or with 8 (rational, for wide lenses) coefficients, or fisheye",
    )
    command.add_argument(
        "--format",
        choices=("drake", "opencv", "ros", "kalibr"),
        default="drake",
        help="format of the file: of drake-tracker, OpenCV (.xml and .json by the suffix of FILE, otherwise YAML), ROS "
        "(two cameras: FILE_left, FILE_right), or Kalibr",
    )
    command.add_argument(
        "--baseline", type=float, metavar="M", help="distance between the cameras that you measured, as a check [m]"
    )
    command.add_argument(
        "--wrist", action="store_true", help="calibrate the camera on the hand of a scenario, not its fixed cameras"
    )
    command.add_argument(
        "--world",
        action="store_true",
        help="take the board in the first photograph as the world frame, not the left camera",
    )


def execute(options: Namespace) -> int:
    """Calibrates the cameras; returns the exit code."""
    from drake_tracker.tasks import in_package, load_scenario

    sources, board = options.source, options.board
    if board is None and (len(sources) > 1 or options.square is not None or options.world):
        raise DrakeTrackerError(
            "calibrate: photographs need --board, the columns and rows of the board, for example 9x6"
        )
    if board is None:
        scenario = load_scenario(sources[0], overrides=options.overrides)
        if options.wrist:
            return _calibrate_wrist(scenario, options.out)
        cameras = getattr(scenario, "cameras", None)  # the ball has none to calibrate, which `calibrate` reports
        if options.out is None and cameras is not None and in_package(cameras.calibration):
            raise DrakeTrackerError("calibrate: -o FILE is missing; the package's own calibration is not overwritten")

        from drake_tracker.calibration.rendered_boards import calibrate

        quiet_drake()
        calibrate(scenario, options.out)
        return SUCCESS
    if options.wrist:
        raise DrakeTrackerError("calibrate: --wrist is for a scenario; it takes no photographs")
    if len(sources) > 2:
        raise DrakeTrackerError(f"calibrate: {len(sources)} image sets; give one or two, and put patterns in quotes")
    if options.overrides:
        raise DrakeTrackerError("calibrate: --set changes a scenario; photographs have no settings")
    if options.out is None:
        raise DrakeTrackerError("calibrate: -o FILE is missing: the calibration file to write")
    if options.baseline is not None and not (len(sources) == 2 and options.baseline > 0.0):
        raise DrakeTrackerError(f"--baseline {options.baseline:g}: a distance above 0 m between two cameras")
    from drake_tracker.calibration.board_page import parse_board
    from drake_tracker.calibration.photographs import calibrate_photographs

    described = parse_board(board, options.square, options.kind, options.marker, options.family)
    calibrate_photographs(
        sources,
        described,
        options.out,
        world=options.world,
        lens=options.lens,
        baseline=options.baseline,
        form=options.format,
    )
    return SUCCESS


def _calibrate_wrist(scenario: Any, out: Path | None) -> int:
    """Calibrates the camera on the hand; returns the exit code."""
    from drake_tracker.tasks import in_package

    wrist = getattr(getattr(scenario, "cameras", None), "wrist", None)
    if out is None and in_package(getattr(wrist, "calibration", "")):
        raise DrakeTrackerError("calibrate: -o FILE is missing; the package's own calibration is not overwritten")

    from drake_tracker.calibration.wrist_boards import calibrate_wrist

    quiet_drake()
    calibrate_wrist(scenario, out)
    return SUCCESS
