"""``drake-tracker track``: what moves before one's own cameras."""

from pathlib import Path

from drake_tracker.commands.common import INTERRUPTED, NOT_TAKEN, SUCCESS, run_directory
from drake_tracker.core.errors import DrakeTrackerError

LEAST_SEEN = 5
"""Images in which both cameras saw motion, of which something should have come."""


def register(commands):
    """Adds the command to the parsers ``commands``."""
    command = commands.add_parser(
        "track",
        help="track what moves before your own cameras",
        description="Tracks what moves in one video or two: a file, a folder or quoted pattern of images, a camera's "
        "number, or a ROS 2 bag as BAG.mcap:/topic. Leaves the track as a table, a picture and a video.",
    )
    command.add_argument("source", nargs="+", metavar="SOURCE", help="the left camera's or a single one's; the right's")
    command.add_argument("--calibration", metavar="FILE", help="of these cameras, made by drake-tracker calibrate")
    command.add_argument("--plane", metavar="FILE", help="for a single camera: a file with X_WP, or the word board")
    command.add_argument("--height", type=float, default=0.0, metavar="M", help="of what moves over that plane [m]")
    command.add_argument("--camera", default="camera_left", metavar="NAME", help="a single camera's in the calibration")
    command.add_argument("--fps", type=float, metavar="N", help="images per second, where the source does not tell")
    command.add_argument("--offset", type=float, default=0.0, metavar="S", help="the right video began S later [s]")
    command.add_argument("--duration", type=float, metavar="S", help="use no more than this [s]")
    command.add_argument("--detector", default="NormalFlow {}", metavar="TAG", help="NormalFlow or FrameDifference")
    command.add_argument(
        "--estimator",
        default="CoordinatedTurn {}",
        metavar="TAG",
        help="CoordinatedTurn, ClosedPath, ArcLength, AlphaBetaGamma or Custom, for example "
        "'!CoordinatedTurn {speed_noise: 0.01}'",
    )
    command.add_argument(
        "--max-gap",
        type=float,
        default=0.03,
        metavar="M",
        help="two rays that pass each other by more are not of one point [m]",
    )
    command.add_argument("--no-overlay", action="store_true", help="leave no video")
    command.add_argument("--out", type=Path, metavar="DIR", help="directory, new or empty (default: runs/track-TIME)")
    command.set_defaults(action=execute)


def execute(options):
    if len(options.source) > 2:
        raise DrakeTrackerError(f"track: {len(options.source)} sources; give one or two, and put patterns in quotes")

    from drake_tracker.core.progress import Progress
    from drake_tracker.tracking.track import prepare, run

    names = "calibration plane height camera fps offset duration detector estimator max_gap"
    tracking = prepare(options.source, **{name: getattr(options, name) for name in names.split()})
    out = run_directory(options.out, "track")
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
    both = summary.get("seen_by_both") or 0
    if both > LEAST_SEEN and summary["results"] < 0.5 * both:
        print(
            f"both cameras saw motion in {both} images, but in most of them the rays pass each other by more than "
            f"{options.max_gap:g} m (--max-gap): are the cameras swapped, the calibration another one's, or the videos "
            "not of one moment?"
        )
    elif not summary["results"]:
        print("nothing was seen to move")
    return SUCCESS if summary["results"] else NOT_TAKEN
