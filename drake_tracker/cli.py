"""The command ``drake-tracker``.

Exit codes: 0 the job succeeded (a campaign: it ran, whatever its rates); 1 it ran and the object was not taken; 2 bad
input or a broken machine, with one clear line and no traceback; 3 a fault of the program, with its traceback; 130
interrupted, with what was recorded so far kept.
"""

import argparse
import sys
import time
import traceback
from pathlib import Path

from drake_tracker.errors import DrakeTrackerError

SUCCESS, NOT_TAKEN, TROUBLE, FAULT, INTERRUPTED = 0, 1, 2, 3, 130

_RESULT_ROWS = {
    "train": (
        ("success", "success", ""),
        ("failure_reason", "reason", ""),
        ("attempts", "attempts", ""),
        ("time_to_grasp_s", "time to grasp", "s"),
        ("lift_height_m", "lift height", "m"),
        ("hold_s", "held", "s"),
        ("prediction_rms_m", "prediction rms", "m"),
        ("real_time_factor", "real-time factor", ""),
    ),
    "ball": (
        ("success", "caught", ""),
        ("failure_reason", "reason", ""),
        ("hand_error_m", "hand error", "m"),
        ("hold_s", "held", "s"),
        ("position_rms_m", "position rms", "m"),
        ("board_in_camera_error", "board in camera", "m, rad"),
        ("board_in_world_error", "board in world", "m, rad"),
        ("real_time_factor", "real-time factor", ""),
    ),
}
"""What is printed of a task's summary: key, label, unit."""


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
    except Exception:  # Python's own exit code would be 1, which says that the run went well and took nothing.
        traceback.print_exc()
        return FAULT


class _Parser(argparse.ArgumentParser):
    def error(self, message):
        self.exit(TROUBLE, f"{self.prog}: {message}; see {self.prog} --help\n")


def _parser():
    parser = _Parser(prog="drake-tracker", description="A robot that grasps what moves, by sight.")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    run = commands.add_parser("run", help="run a scenario", description="Runs a scenario and leaves a run directory.")
    _add_scenario(run)
    run.add_argument("--seed", type=int, metavar="N", help="seed of every random draw")
    run.add_argument("--duration", type=float, metavar="S", help="longest simulated time [s]")
    run.add_argument("--out", type=Path, metavar="DIR", help="run directory, new or empty (default: runs/NAME-TIME)")
    run.add_argument("--no-record", action="store_true", help="leave no recording and no video")
    run.add_argument("--meshcat", action="store_true", help="show the run in a browser while it goes on")
    run.add_argument("--graphviz", type=Path, metavar="FILE", help="write the picture of the diagram to FILE")
    run.set_defaults(action=_run)

    list_ = commands.add_parser("list", help="list the scenarios, or the settings of one")
    list_.add_argument("scenario", nargs="?", metavar="SCENARIO[:NAME]", help="show every setting of this scenario")
    list_.set_defaults(action=_list)

    doctor = commands.add_parser("doctor", help="look whether this machine can run it")
    doctor.set_defaults(action=_doctor)

    calibrate = commands.add_parser(
        "calibrate", help="calibrate a scenario's cameras, or your own from photographs of a board",
        description="One SCENARIO: its cameras, from rendered images. With --board: your own, from photographs of a "
        "chessboard, a folder or a quoted pattern for each camera, two for a pair of cameras.",
    )
    calibrate.add_argument("source", nargs="+", metavar="SCENARIO|IMAGES", help="a scenario, or one or two image sets")
    _add_overrides(calibrate)
    calibrate.add_argument("-o", "--out", type=Path, metavar="FILE", help="calibration file to write")
    calibrate.add_argument("--board", metavar="CxR", help="the board's inner corners, for example 9x6")
    calibrate.add_argument("--square", type=float, metavar="M", help="side of one of its squares [m]")
    calibrate.add_argument("--world", action="store_true",
                           help="the world's frame is the board of the first photograph, not the left camera")
    calibrate.set_defaults(action=_calibrate)

    track = commands.add_parser(
        "track", help="track what moves before your own cameras",
        description="Tracks what moves in one video or two: a file, a folder or quoted pattern of images, a camera's "
        "number, or a ROS 2 bag as BAG.mcap:/topic. Leaves the track as a table, a picture and a video.",
    )
    track.add_argument("source", nargs="+", metavar="SOURCE", help="the left camera's or a single one's; the right's")
    track.add_argument("--calibration", metavar="FILE", help="of these cameras, made by drake-tracker calibrate")
    track.add_argument("--plane", metavar="FILE", help="for a single camera: a file with X_WP, or the word board")
    track.add_argument("--height", type=float, default=0.0, metavar="M", help="of what moves over that plane [m]")
    track.add_argument("--camera", default="camera_left", metavar="NAME", help="a single camera's in the calibration")
    track.add_argument("--fps", type=float, metavar="N", help="images per second, where the source does not tell")
    track.add_argument("--offset", type=float, default=0.0, metavar="S", help="the right video began S later [s]")
    track.add_argument("--duration", type=float, metavar="S", help="use no more than this [s]")
    track.add_argument("--detector", default="NormalFlow {}", metavar="TAG", help="NormalFlow or FrameDifference")
    track.add_argument("--estimator", default="CoordinatedTurn {}", metavar="TAG",
                       help="CoordinatedTurn, ClosedPath, ArcLength or AlphaBetaGamma, for example "
                       "'!CoordinatedTurn {speed_noise: 0.01}'")
    track.add_argument("--max-gap", type=float, default=0.03, metavar="M",
                       help="two rays that pass each other by more are not of one point [m]")
    track.add_argument("--no-overlay", action="store_true", help="leave no video")
    track.add_argument("--out", type=Path, metavar="DIR", help="directory, new or empty (default: runs/track-TIME)")
    track.set_defaults(action=_track)

    measure = commands.add_parser(
        "measure", help="measure the error of a scenario's cameras, for runs without rendering",
        description="Runs the camera loop without a grasp and writes the error of its points, for vision: !Measured.",
    )
    _add_scenario(measure)
    measure.add_argument("-o", "--out", type=Path, required=True, metavar="FILE", help="file to write")
    measure.add_argument("--seeds", type=int, default=2, metavar="N", help="runs at each speed (default 2)")
    measure.add_argument("--laps", type=int, default=2, metavar="N", help="laps of each run (default 2)")
    measure.add_argument("--speeds", metavar="V,V,...", help="speeds of the train [m/s] (default: 0.05 to 0.6, seven)")
    measure.set_defaults(action=_measure)

    campaign = commands.add_parser(
        "campaign", help="run many trials, over seeds and a grid of settings",
        description="Runs every trial of a campaign that its directory does not hold yet, and leaves a table of all, "
        "success rates with their Wilson intervals, and a picture. With --out it goes on where it was stopped.",
    )
    _add_scenario(campaign)
    campaign.add_argument("--trials", type=int, required=True, metavar="N", help="seeds for each combination")
    campaign.add_argument("--vary", action="append", default=[], metavar="KEY.PATH=A,B,C",
                          help="values of a setting to go through; given again, every combination is run")
    campaign.add_argument("--vision", choices=["measured"], help="measured: render no images")
    campaign.add_argument("--first-seed", type=int, default=0, metavar="N", help="seeds count up from it (default 0)")
    campaign.add_argument("--workers", type=int, metavar="W", help="processes of this machine (default: all cores)")
    campaign.add_argument("--scheduler", metavar="ADDRESS", help="run on the workers of a dask scheduler, tcp://HOST:PORT")
    campaign.add_argument("--out", type=Path, metavar="DIR",
                          help="campaign directory, new or to go on with (default: runs/campaign-NAME-TIME)")
    campaign.add_argument("--parquet", action="store_true", help="write the table as Parquet, too")
    campaign.set_defaults(action=_campaign)

    figures = commands.add_parser("figures", help="draw the paper's figures from runs of this system")
    figures.add_argument("--out", type=Path, required=True, metavar="DIR", help="directory for them, new or empty")
    figures.add_argument("--seed", type=int, default=0, metavar="N", help="seed of every random draw (default: 0)")
    figures.add_argument("--quick", action="store_true", help="a preview from a few seconds of the camera loop")
    figures.add_argument("--bounds", type=Path, metavar="FILE", help="bounds to draw in, a JSON file of curves")
    figures.set_defaults(action=_figures)
    return parser


def _add_scenario(command):
    command.add_argument("scenario", metavar="SCENARIO[:NAME]", help="a scenario of the list, or FILE.yaml[:NAME]")
    _add_overrides(command)


def _add_overrides(command):
    command.add_argument("--set", action="append", default=[], metavar="KEY.PATH=VALUE", dest="overrides",
                         help="change one setting, for example --set track.speed=0.2; may be given again")


def _run(options):
    from drake_tracker.progress import Progress
    from drake_tracker.scenarios import load_scenario

    scenario = load_scenario(options.scenario, options.seed, options.duration, options.overrides)
    if options.graphviz and not options.graphviz.absolute().parent.is_dir():
        raise DrakeTrackerError(f"--graphviz {options.graphviz}: there is no folder {options.graphviz.parent}")

    from drake_tracker.simulation import simulate  # Only now: bad input is answered without waiting for Drake.

    out = _run_directory(options.out, scenario.name)
    progress = Progress(scenario.duration)
    try:
        summary = simulate(
            scenario, out=out, record=not options.no_record, meshcat=options.meshcat, progress=progress,
            graphviz=options.graphviz,
        )
    except DrakeTrackerError:
        if not any(out.iterdir()):
            out.rmdir()
        raise
    finally:
        progress.close()
    for key, label, unit in _RESULT_ROWS[scenario.task]:
        if summary.get(key) is not None:
            values = summary[key] if isinstance(summary[key], list) else [summary[key]]
            words = ", ".join(f"{value:.4g}" if isinstance(value, float) else str(value) for value in values)
            print(f"{label:<18}{words} {unit}".rstrip())
    print(f"{'run directory':<18}{out}")
    if summary.get("interrupted"):
        return INTERRUPTED
    return SUCCESS if summary["success"] else NOT_TAKEN


def _run_directory(out, name, what="run"):
    """Returns the new directory of a run; raises DrakeTrackerError rather than touch one that has something in it.

    ``what`` it is for stands in the message.
    """
    chosen = out is not None
    if not chosen:
        out = _free_name(name)
    try:
        out.mkdir(parents=True, exist_ok=chosen)
        occupied = any(out.iterdir())
    except OSError as error:
        raise DrakeTrackerError(f"the {what} directory {out} cannot be made: {error.strerror}") from None
    if occupied:
        raise DrakeTrackerError(f"the {what} directory {out} is not empty; name a new one, nothing is ever overwritten")
    return out


def _free_name(name):
    """Returns the path of a directory in runs/ that is not there yet, named by a name and the time."""
    stem = Path("runs") / f"{name.replace(':', '-')}-{time.strftime('%Y%m%d-%H%M%S')}"
    out, count = stem, 1
    while out.exists():
        count += 1
        out = stem.with_name(f"{stem.name}-{count}")
    return out


def _list(options):
    from drake_tracker.scenarios import list_scenarios, load_scenario
    from drake_tracker.scenarios.reader import describe_settings

    if options.scenario:
        rows = describe_settings(load_scenario(options.scenario))
    else:
        rows = list_scenarios()
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    for row in rows:
        print("  ".join(f"{cell:<{width}}" for cell, width in zip(row, widths)).rstrip())
    return SUCCESS


def _doctor(options):
    from drake_tracker import doctor

    return doctor.main()


def _calibrate(options):
    from drake_tracker.scenarios import load_scenario

    sources, board = options.source, options.board
    if board is None and (len(sources) > 1 or options.square is not None or options.world):
        raise DrakeTrackerError("calibrate: photographs need --board, the chessboard's inner corners, for example 9x6")
    if board is None:
        from drake_tracker.calibrate import calibrate

        calibrate(load_scenario(sources[0], overrides=options.overrides), options.out)
        return SUCCESS
    if len(sources) > 2:
        raise DrakeTrackerError(f"calibrate: {len(sources)} image sets; give one or two, and put patterns in quotes")
    if options.overrides:
        raise DrakeTrackerError("calibrate: --set changes a scenario, and photographs have none")
    if options.out is None:
        raise DrakeTrackerError("calibrate: -o FILE is missing: the calibration file to write")
    from drake_tracker.calibrate_photographs import calibrate_photographs, parse_board

    calibrate_photographs(sources, parse_board(board, options.square), options.out, world=options.world)
    return SUCCESS


def _track(options):
    if len(options.source) > 2:
        raise DrakeTrackerError(f"track: {len(options.source)} sources; give one or two, and put patterns in quotes")

    from drake_tracker.progress import Progress
    from drake_tracker.track import prepare, run

    names = "calibration plane height camera fps offset duration detector estimator max_gap"
    tracking = prepare(options.source, **{name: getattr(options, name) for name in names.split()})
    out = _run_directory(options.out, "track")
    progress = Progress(tracking.timeline.duration)
    try:
        summary = run(tracking, out, overlay=not options.no_overlay, progress=progress)
    finally:
        progress.close()
    print(f"{'images described':<18}{summary['described']}, {summary['results']} of them with a result")
    print(f"{'images dropped':<18}{' and '.join(map(str, summary['dropped']))}")
    for key, label in (("gap_rms_m", "gap"), ("prediction_rms_m", "prediction rms")):
        if summary.get(key) is not None:
            print(f"{label:<18}{1e3 * summary[key]:.2f} mm")
    print(f"{'directory':<18}{out}")
    if summary["interrupted"]:
        return INTERRUPTED
    if not summary["results"]:
        print("nothing was seen to move")
    return SUCCESS if summary["results"] else NOT_TAKEN


def _figures(options):
    from drake_tracker.figures.bound_curves import read_bounds
    from drake_tracker.scenarios import load_scenario

    load_scenario("train", seed=options.seed)  # a bad seed is answered before anything is made
    bounds = read_bounds(options.bounds) if options.bounds else None
    out = _run_directory(options.out, "figures", "figures")

    from drake_tracker.figures.command import make_figures

    try:
        make_figures(out, options.seed, options.quick, bounds)
    except DrakeTrackerError:
        if not any(out.iterdir()):
            out.rmdir()
        raise
    return SUCCESS


def _campaign(options):
    from drake_tracker.campaign.grid import parse_vary
    from drake_tracker.campaign.run import RATES, TABLE, run_campaign
    from drake_tracker.progress import TrialsProgress

    vary = parse_vary(options.vary)
    out = options.out or _free_name("campaign-" + Path(options.scenario).stem)
    progress = TrialsProgress()
    try:
        campaign = run_campaign(
            options.scenario, options.trials, vary, options.overrides, options.first_seed, options.vision,
            options.workers, options.scheduler, out, options.parquet, progress,
        )
    finally:
        progress.close()
    for line in campaign.lines():
        print(line)
    print(f"campaign directory  {out}: {TABLE} has a line for each trial, {RATES} one for each rate")
    if campaign.interrupted:
        print(f"drake-tracker: interrupted; what has ended is kept, go on with --out {out}", file=sys.stderr)
        return INTERRUPTED
    return SUCCESS


def _measure(options):
    from drake_tracker.scenarios import load_scenario

    scenario = load_scenario(options.scenario, overrides=options.overrides)
    speeds = {}
    if options.speeds is not None:
        try:
            speeds = {"speeds": [float(text) for text in options.speeds.split(",")]}
        except ValueError:
            raise DrakeTrackerError(f"--speeds {options.speeds}: must be numbers separated by commas") from None

    from drake_tracker.measure import measure  # Only now: bad input is answered without waiting for Drake.

    measure(scenario, options.out, seeds=options.seeds, laps=options.laps, **speeds)
    return SUCCESS
