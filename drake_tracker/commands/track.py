"""``drake-tracker track``: tracks what moves in front of your own cameras."""

from argparse import Namespace
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from drake_tracker.commands.common import (
    NOT_TAKEN,
    SUCCESS,
    Commands,
    add_command,
    one_thread,
    quiet_drake,
    run_directory,
    warn,
)
from drake_tracker.core.errors import DrakeTrackerError, load_extra
from drake_tracker.core.processes.signals import exit_code

LEAST_SEEN = 5
"""Number of images with motion in both cameras above which missing points indicate a mistake."""
CALIBRATION_SUFFIXES = (".yaml", ".yml", ".xml", ".json", ".cfg")
"""Suffixes of a second calibration file; ROS names some of its files .cfg."""
MOST_NAMED = 5
"""Number of dropped images whose times are printed."""


def register(commands: Commands) -> None:
    """Adds the command to the parsers ``commands``."""
    command = add_command(
        commands,
        "track",
        execute,
        help="track moving objects with your own cameras",
        description="Tracks the motion in one or two videos: a file, a folder or quoted pattern of images, the number "
        "of a camera, a ROS 2 bag as BAG:/topic, the folder of a recorded live session, or play:SOURCE, which plays a "
        "recording as if it were a camera. Leaves the track as a table, a picture and a video.",
        next_step="drake-tracker calibrate LEFT RIGHT --board CxR --square M -o FILE calibrates your cameras, so that "
        "the track is in metres.",
    )
    command.add_argument(
        "source", nargs="*", metavar="SOURCE", help="footage of the left or only camera; then of the right one"
    )
    command.add_argument(
        "--calibration",
        nargs="+",
        metavar="FILE",
        help="calibration of these cameras by drake-tracker calibrate, OpenCV, ROS or Kalibr; two files where the tool "
        "writes two",
    )
    command.add_argument("--plane", metavar="FILE", help="for a single camera: a file with X_WP, or the word board")
    command.add_argument("--height", type=float, default=0.0, metavar="M", help="height of the object above it [m]")
    command.add_argument(
        "--camera", default="camera_left", metavar="NAME", help="name of a single camera in the calibration"
    )
    command.add_argument("--fps", type=float, metavar="N", help="images per second, where the source does not say")
    command.add_argument("--offset", type=float, default=0.0, metavar="S", help="the right video began S later [s]")
    command.add_argument("--duration", type=float, metavar="S", help="longest time to use [s]")
    command.add_argument("--detector", default="NormalFlow {}", metavar="TAG", help="NormalFlow or FrameDifference")
    command.add_argument(
        "--estimator",
        default="CoordinatedTurn {}",
        metavar="TAG",
        help="CoordinatedTurn, ClosedPath, ArcLength, AlphaBetaGamma or Custom; without settings it adapts to the "
        "speed and the unit of length, with settings such as '!CoordinatedTurn {speed_noise: 0.01}' it is in metres; "
        "without --calibration it always adapts",
    )
    command.add_argument(
        "--max-gap",
        type=float,
        metavar="M",
        help="largest gap between the two rays of one point [m] (default: 16 pixels where the cameras look)",
    )
    command.add_argument(
        "--roi",
        action="append",
        default=[],
        metavar="X,Y,W,H",
        help="only motion in this rectangle of the image counts [px]; or 'X,Y X,Y X,Y ...', a polygon; with two "
        "cameras give it twice",
    )
    command.add_argument(
        "--follow",
        action="append",
        default=[],
        metavar="U,V",
        help="follow the object at this pixel of the first image; with two cameras give it twice",
    )
    command.add_argument(
        "--objects",
        type=int,
        default=1,
        metavar="N",
        help="track up to N objects, each with its number, its row per image and its own estimator",
    )
    command.add_argument(
        "--pick", action="store_true", help="show the object, or the part of the image, in a page of the browser"
    )
    command.add_argument("--no-overlay", action="store_true", help="write no video")
    command.add_argument("--live", action="store_true", help="show images, objects and strips on a page")
    command.add_argument("--port", type=int, default=0, metavar="N", help="port of the page (default: a free one)")
    command.add_argument(
        "--first-look",
        type=float,
        metavar="S",
        help="look at live cameras for S seconds, while the object moves, before the track begins, to suit its size "
        "and speed; recordings are always looked at [s]",
    )
    command.add_argument("--record", action="store_true", help="record the images of live cameras, to track them again")
    command.add_argument(
        "--mcap", action="store_true", help="also write the track as track.mcap, which Foxglove and Rerun show"
    )
    command.add_argument(
        "-o", "--out", type=Path, metavar="DIR", help="directory, new or empty (default: runs/track-TIME)"
    )


def split_calibration(values: list[str]) -> tuple[list[str], list[str]]:
    """Returns (calibration files, sources) from the arguments that follow ``--calibration``.

    After the first file, an argument without the suffix of a calibration file is footage.
    """
    count = 1
    while count < len(values) and Path(values[count]).suffix.lower() in CALIBRATION_SUFFIXES:
        count += 1
    return values[:count], values[count:]


def execute(options: Namespace) -> int:
    """Makes the track; returns the exit code."""
    if options.calibration:
        options.calibration, rest = split_calibration(options.calibration)
        options.source = options.source + rest
    if not options.source:
        raise DrakeTrackerError("track: no SOURCE; give a video, a folder of images, or the number of a camera")
    if len(options.source) > 2:
        raise DrakeTrackerError(f"track: {len(options.source)} sources; give one or two, and put patterns in quotes")

    if options.port and not options.live:
        raise DrakeTrackerError(f"--port {options.port} is the port of the live view: add --live")
    one_thread()
    from drake_tracker.core.progress import Progress
    from drake_tracker.own_cameras.filtered import describe_accuracy, describe_filtered, describe_object
    from drake_tracker.own_cameras.mcap_track import MCAP_FILE
    from drake_tracker.own_cameras.preparation import prepare_track
    from drake_tracker.own_cameras.quality import doubts
    from drake_tracker.own_cameras.track import make_track

    quiet_drake()
    if options.mcap:
        load_extra("foxglove", "mcap", MCAP_FILE)
    if options.pick:
        if options.roi or options.follow:
            raise DrakeTrackerError("--pick: not together with --roi or --follow, which it takes the place of")
        options.roi, options.follow = _pick(options)
    names = "calibration plane height camera fps offset duration detector estimator max_gap roi follow objects record"
    names += " first_look"
    track = prepare_track(
        options.source,
        **{name: getattr(options, name) for name in names.split()},
        tell=lambda line: print(line, flush=True),
    )
    if options.first_look and not any(track.facts["first_look"]):
        print("Nothing was seen to move by itself: the usual settings are used", flush=True)
    progress = Progress(track.timeline.duration)
    with _live_view(options, track, progress) as live, run_directory(options.out, "track") as out:
        try:
            summary = make_track(
                track, out, overlay=not options.no_overlay, mcap=options.mcap, live=live, progress=progress
            )
        finally:
            progress.close()
        if live is not None:
            _finish(live, summary, out)
    print(f"{'images described':<18}{summary['described']}, {summary['results']} of them with a result")
    print(f"{'images dropped':<18}{' and '.join(map(_dropped, summary['dropped_at_s'], summary['dropped']))}")
    if any(summary["surplus"]):
        print(f"{'images too early':<18}{' and '.join(map(str, summary['surplus']))}")
    for label, text in describe_accuracy(summary):
        print(f"{label:<18}{text}")
    print(f"{'points filtered':<18}{describe_filtered(summary['filtered'])}")
    for each in summary.get("by_object", ()):
        print(f"{'object {id}'.format(**each):<18}{describe_object(each)}")
    print(f"{'directory':<18}{out}")
    for line in (*summary["warnings"], summary.get("too_slow")):
        if line is not None:
            warn(line)
    if summary["interrupted"]:
        return exit_code()
    seen = summary.get("seen") or 0
    if summary.get("swapped"):
        print("The cameras are swapped: in the other order their rays meet. Name the left camera's images first")
    elif summary.get("offset_found"):
        print(summary["moments"])
    elif len(summary["dropped"]) == 2 and seen > LEAST_SEEN and summary["results"] < 0.5 * seen:
        print(
            f"Both cameras saw motion in {seen} images, but in most of them the gap between the two rays is larger "
            f"than {track.facts['max_gap']:.3g} m (--max-gap). Does the calibration belong to other cameras, or were "
            "the videos not taken at the same time?"
        )
    elif summary.get("moments"):
        print(summary["moments"])
    elif seen and not summary["results"]:
        print(f"Motion was seen in {seen} images, but always where the camera does not see the plane of the motion")
    elif not summary["described"]:
        print("There were too few images to see motion; does --duration leave enough of them?")
    elif not summary["results"] and not options.follow and not summary.get("too_slow"):
        print("No motion was found")
    note = doubts(summary | {"follow": options.follow, "roi": options.roi})
    if note is not None:
        print(note)
    if summary["results"] < 0.5 * summary["described"]:
        what = "The object was followed" if options.follow else "Something was tracked"
        print(f"{what} in {summary['results']} of {summary['described']} images only")
        if options.follow or options.roi or options.objects > 1:
            return NOT_TAKEN
    return SUCCESS if summary["results"] else NOT_TAKEN


@contextmanager
def _live_view(options: Namespace, track: Any, progress: Any) -> Iterator[Any]:
    """Yields the page of the track when it is requested, else None. Closes the footage when there can be no page."""
    if not options.live:
        yield None
        return
    from drake_tracker.own_cameras.live_view import TrackView

    try:
        view = TrackView(options.port, progress.say)
    except DrakeTrackerError:
        for each in track.footage:
            each.close()
        raise
    with view:
        view.introduce_track(track)
        print(f"Live view: {view.url}  (open it in a browser; Ctrl-C ends the track)", flush=True)
        yield view


def _finish(live: Any, summary: dict[str, Any], out: Path) -> None:
    """Shows the outcome of the track on its page."""
    from drake_tracker.own_cameras.filtered import describe_accuracy

    described, results = summary["described"], summary["results"]
    rows = [("Images described", str(described)), ("With a result", str(results))]
    rows.append(("Images dropped", " and ".join(map(str, summary["dropped"]))))
    rows += [(label.capitalize(), text) for label, text in describe_accuracy(summary)]
    title = "The track was ended" if summary["interrupted"] else "The track is complete"
    live.finish(
        {
            "success": bool(results),
            "title": title,
            "reason": summary.get("too_slow") or "",
            "rows": rows,
            "out": str(out),
        }
    )


def _pick(options: Namespace) -> tuple[list[str], list[str]]:
    """Returns the values of --roi and --follow that the user draws."""
    from drake_tracker.own_cameras.pick import pick

    def show(url: str) -> None:
        print(f"Show the object in your browser: {url}", flush=True)

    roi, follow = pick(options.source, options.fps, show)
    again = [f"--{name} '{text}'" for name, texts in (("roi", roi), ("follow", follow)) for text in texts]
    print(f"{'picked':<18}{' '.join(again)}", flush=True)
    return roi, follow


def _dropped(stamps: list[float], count: int) -> str:
    """Returns the number of dropped images of a camera, and the times [s] of the first ones."""
    if not stamps:
        return str(count)
    more = ", …" if count > MOST_NAMED else ""
    return f"{count} (at {', '.join(f'{stamp:.2f}' for stamp in stamps[:MOST_NAMED])}{more} s)"
