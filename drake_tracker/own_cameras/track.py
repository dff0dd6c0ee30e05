"""Makes a track of your own cameras: runs the diagram of a `PreparedTrack` and writes the results."""

from collections.abc import Callable, Sequence
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

import av
import numpy as np
from pydrake.systems.analysis import Simulator

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.processes.signals import held
from drake_tracker.footage.decoding import reason
from drake_tracker.footage.recording import FOLDER
from drake_tracker.footage.timeline import share_a_clock
from drake_tracker.own_cameras.camera_order_check import are_swapped, places
from drake_tracker.own_cameras.mcap_track import MCAP_FILE, TrackMcap
from drake_tracker.own_cameras.moment_check import compare_moments, describe_moments
from drake_tracker.own_cameras.picture_process import PictureProcess
from drake_tracker.own_cameras.preparation import PreparedTrack
from drake_tracker.own_cameras.quality import TrackQuality
from drake_tracker.own_cameras.summary import describe_delay, describe_footage, describe_run, summarise_track
from drake_tracker.own_cameras.table import TrackTable, read_values
from drake_tracker.tasks.results import save_summary

if TYPE_CHECKING:
    from drake_tracker.own_cameras.live_view import TrackView
    from drake_tracker.own_cameras.overlay import TrackOverlay

_READ_AT = 0.75
"""Fraction of a cycle after which all updates of the cycle are done."""
_RECENT = 60
"""Rows over which the progress counts valid results."""


def make_track(
    track: PreparedTrack,
    out: Path,
    *,
    overlay: bool = True,
    mcap: bool = False,
    live: "TrackView | None" = None,
    progress: Callable[[float, str], object] | None = None,
) -> dict[str, Any]:
    """Makes a track and writes track.csv, overlay.mp4, track.png and summary.json to a folder.

    Ctrl-C ends it after the current image and keeps everything made so far. So does an error on the way: a damaged
    video, a full disk, or a custom estimator that raises.

    Args:
        track: the return value of `prepare_track`; its footage is closed.
        out: folder to write to.
        overlay: whether to write the video.
        mcap: whether to write track.mcap for Foxglove or Rerun; needs the extra ``mcap``.
        live: page that shows the track.
        progress: called with (time [s], text).

    Returns the summary.

    Raises:
        DrakeTrackerError: a video is damaged, or a file cannot be written; raised at the end, like whatever a custom
            estimator raises.
    """
    with held() as signals:
        summary = _make_track(track, out, overlay, mcap, live, progress, signals)
        if summary["interrupted"]:
            signals.clear()
    return summary


def _make_track(
    track: PreparedTrack,
    out: Path,
    overlay: bool,
    mcap: bool,
    live: "TrackView | None",
    progress: Callable[[float, str], object] | None,
    signals: Sequence[int],
) -> dict[str, Any]:
    """Makes a track, see `make_track`, until the list of signals is no longer empty."""
    diagram, timeline = track.diagram, track.timeline
    errors: list[Exception] = []
    interrupted = False
    video: TrackOverlay | None = None
    table: TrackTable | None = None
    export: TrackMcap | None = None
    quality = TrackQuality()
    picture = PictureProcess()
    dropped: list[list[float]] = [[] for _ in track.footage]
    seen: list[tuple[np.ndarray, np.ndarray]] = []
    try:
        with _Collected(errors, out):
            table = TrackTable(out / "track.csv", diagram.sides, diagram.in_space)
            if overlay or live is not None:
                video = _open_overlay(track, out / "overlay.mp4" if overlay else None, live)
            if live is not None and video is not None:
                live.watch_track(track, video, table.columns)
            if mcap:
                export = TrackMcap(out / MCAP_FILE, track)
            for side, recording in zip(diagram.sides, track.recordings):
                recording.begin(out / FOLDER / f"camera_{side}")
            interrupted = _run(track, table, video, export, live, dropped, quality, seen, progress, signals)
    except KeyboardInterrupt:
        interrupted = True
    for sequence in track.timeline.sequences:
        sequence.close()
    for each in track.footage:
        each.close()
    for part in (table, video, export, *track.recordings):
        if part is not None:
            with _Collected(errors, out):
                part.close()
    summary: dict[str, Any] = {}
    if live is not None:
        live.write()
    if table is not None:
        data = table.data()
        summary = summarise_track(data, timeline.period) | quality.summary()
        summary |= describe_footage(track.timeline, dropped)
        if track.footage[0].live:
            summary["too_slow"] = describe_delay(dropped, summary["described"], track.footage[0].size, timeline.period)
        summary["interrupted"] = interrupted
        if len(track.cameras) == 2:
            summary["swapped"] = are_swapped(data, track.cameras, track.facts["max_gap"], seen)
            moments = compare_moments(data, track.cameras, timeline.period)
            summary |= {"offset_found": moments and moments.offset, "ray_gap_px": moments and moments.gap}
            summary["moments"] = describe_moments(
                moments, track.facts["offset"], track.footage[0].live, share_a_clock(*track.footage)
            )
        with _Collected(errors, out):
            save_summary(describe_run(**summary, **track.facts), out / "summary.json")
        with _Collected(errors, out):
            names = " and ".join(each.name for each in track.footage)
            world = track.world or "board"
            picture.draw(data, out / "track.png", world=world, title=names, period=timeline.period, marks=quality.marks)
    picture.close()
    if errors:
        raise _with_what_is_kept(errors[0], summary.get("described", 0), out)
    return summary


def _open_overlay(track: PreparedTrack, path: Path | None, live: "TrackView | None") -> "TrackOverlay":
    """Returns the video of a track, which goes to a file, to a page, or to both."""
    from drake_tracker.own_cameras.overlay import TrackOverlay  # slow to load

    sizes = [each.size for each in track.footage]
    sink = None if live is None else live.frames
    live_cameras = track.footage[0].live
    return TrackOverlay(path, track.timeline.period, sizes, track.age_cycles, track.cameras, sink, live=live_cameras)


def _with_what_is_kept(error: Exception, described: int, out: Path) -> Exception:
    """Returns an error of the footage with a note on the images tracked before it; any other error as it is."""
    if not described or not isinstance(error, DrakeTrackerError) or "is kept" in str(error):
        return error
    return DrakeTrackerError(f"{error}; the track of {described} images before is kept in {out}")


class _Collected:
    """Context manager that appends an error to a list and does not raise it, so that the other files are written."""

    def __init__(self, errors: list[Exception], out: Path) -> None:
        self._errors, self._out = errors, out

    def __enter__(self) -> None:
        pass

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> bool:
        if isinstance(error, (OSError, av.error.FFmpegError)):
            words = f"{self._out}: cannot be written: {reason(error)}; what was written before is kept"
            self._errors.append(DrakeTrackerError(words))
        elif isinstance(error, Exception):  # a DrakeTrackerError, or an error of a custom estimator
            self._errors.append(error)
        else:
            return False
        return True


def _run(
    track: PreparedTrack,
    table: TrackTable,
    video: "TrackOverlay | None",
    export: TrackMcap | None,
    live: "TrackView | None",
    dropped: list[list[float]],
    quality: TrackQuality,
    seen: list[tuple[np.ndarray, np.ndarray]],
    progress: Callable[[float, str], object] | None,
    signals: Sequence[int],
) -> bool:
    """Runs the diagram cycle by cycle and records the values of its ports.

    The stamps of dropped images are added to ``dropped``, and doubts are counted in ``quality``. With several objects,
    their places in both images are added to ``seen``. Returns whether a signal ended it.
    """
    diagram, timeline = track.diagram, track.timeline
    simulator = Simulator(diagram)
    simulator.Initialize()
    context = simulator.get_context()

    def read(name: str) -> Any:
        return diagram.GetOutputPort(name).Eval(context)

    valid_column = table.columns.index("valid")
    tracked = diagram.HasOutputPort("tracks_left")
    before: list[Any] = [None] * len(diagram.sides)  # what the centroids describe, which are a cycle late
    number, last = 0, timeline.count  # one cycle more than there are images empties the delay line
    while last is None or number <= last:
        if signals:
            return True
        now = (number + _READ_AT) * timeline.period
        simulator.AdvanceTo(now)
        frames = [read(f"frame_{side}") for side in diagram.sides]
        if last is None or number < last:
            for k, frame in enumerate(frames):
                if not frame[1]:
                    dropped[k].append(round(float(frame[0]), 3))
        values = read_values(diagram, context)
        described = [(read(f"motion_{side}"), read(f"tracks_{side}") if tracked else None) for side in diagram.sides]
        objects = [None if each is None or each[1] is None else each[1].objects for each in before]
        if diagram.places > 1 and len(diagram.sides) == 2:
            objects = list(read("objects").views)
        known = len(table.rows)
        if table.add(values, objects):
            quality.add(table.rows[-1][0], objects)
            if diagram.places > 1 and len(objects) == 2:
                seen.append(places(objects))
        images = [(sequence.at(number).image, frame) for sequence, frame in zip(timeline.sequences, frames)]
        if video is not None:
            video.add(images, [None if each is None else each[0].mask for each in before], objects, values)
        if export is not None:
            export.add(images, values)
        if live is not None:
            row = table.rows[known] if len(table.rows) > known else None
            live.show(now, row, objects, lambda: bool(signals))
        before = described
        if progress is not None:
            valid = sum(row[valid_column] for row in table.rows[-_RECENT:])
            progress(now, f"{valid:.0f} of the last {_RECENT}")
        if last is None and any(sequence.ended for sequence in timeline.sequences):
            last = number + 1
        number += 1
    return False
