"""Tracks what moves before cameras of one's own: the same vision and estimation, behind footage."""

from dataclasses import asdict, dataclass
from typing import Any, Union

import av
import numpy as np
from pydrake.systems.analysis import Simulator

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.diagrams.estimators import estimator_of
from drake_tracker.estimation.config import AlphaBetaGamma, ArcLength, ClosedPath, CoordinatedTurn
from drake_tracker.footage.open_footage import open_footage
from drake_tracker.footage.timeline import Timeline, align
from drake_tracker.footage.video import reason
from drake_tracker.scenarios.base import Custom
from drake_tracker.scenarios.option import read_option
from drake_tracker.tasks.train.summary import save_summary
from drake_tracker.tracking.overlay import TrackOverlay
from drake_tracker.tracking.own_cameras_diagram import MAX_GAP, OwnCamerasDiagram, Plane
from drake_tracker.tracking.picture import draw_track
from drake_tracker.tracking.summary import describe_run, summarize_track
from drake_tracker.tracking.table import TrackTable
from drake_tracker.vision.calibration import load_calibration, load_pose
from drake_tracker.vision.config import FrameDifference, NormalFlow
from drake_tracker.vision.detectors import make_detector

DETECTORS = Union[NormalFlow, FrameDifference]
ESTIMATORS = Union[CoordinatedTurn, ClosedPath, ArcLength, AlphaBetaGamma, Custom]
_SPAN = 2 * VISION_PERIOD
"""Time [s] between two images that normal flow uses: that of the simulated cameras."""
_READ_AT = 0.75
"""Part of a cycle after which everything in it has been done."""


@dataclass(frozen=True, eq=False)
class Tracking:
    """A track about to be made: what `prepare` returns and `run` takes.

    footage: list of `Footage`. timeline: `Timeline`. diagram: `OwnCamerasDiagram`. cameras: list of `CameraModel`.
    age_cycles: from the image described to the newest. world: "board", "camera_left" or None. facts: for the summary.
    """

    footage: list
    timeline: Timeline
    diagram: Any
    cameras: list
    age_cycles: float
    world: str
    facts: dict


def prepare(
    specs,
    *,
    calibration=None,
    plane=None,
    height=0.0,
    camera="camera_left",
    fps=None,
    offset=0.0,
    duration=None,
    detector="NormalFlow {}",
    estimator="CoordinatedTurn {}",
    max_gap=MAX_GAP,
):
    """Opens everything that `run` needs and returns a `Tracking`. Nothing is written.

    Args:
        specs: one source or two, as `open_footage` takes them.
        calibration: file of `drake-tracker calibrate`; None: the 2-D centroid of a single camera.
        plane: for a single camera, "board" (of the calibration's first photograph) or a YAML file with X_WP.
        height: of what moves over that plane [m]. camera: name of a single camera in the calibration.
        fps, offset, duration: of `open_footage` and `align`.
        detector, estimator: tags with settings (`read_option`). max_gap: of a point's two rays [m].

    Raises DrakeTrackerError, one line for each error.
    """
    for name, value, least in (("fps", fps, 0.0), ("duration", duration, 0.0), ("max-gap", max_gap, 0.0)):
        if value is not None and not least < value < np.inf:
            raise DrakeTrackerError(f"--{name} {value:g}: must be above {least:g} and finite")
    for name, value in (("height", height), ("offset", offset)):
        if not np.isfinite(value):
            raise DrakeTrackerError(f"--{name} {value:g}: must be a finite number")
    detecting = read_option(detector, DETECTORS, "detector")
    estimating = read_option(estimator, ESTIMATORS, "estimator")
    names = ["camera_left", "camera_right"] if len(specs) == 2 else [camera]
    if len(specs) == 2 and calibration is None:
        raise DrakeTrackerError("two cameras need --calibration FILE; drake-tracker calibrate makes one")
    if len(specs) == 1 and calibration is not None and plane is None:
        raise DrakeTrackerError(
            "a single camera tells a direction only: say --plane board, or --plane FILE, for where things move"
        )
    if plane is not None and (calibration is None or len(specs) == 2):
        raise DrakeTrackerError(f"--plane {plane}: is for a single camera with --calibration FILE")
    cameras = [] if calibration is None else _load_cameras(calibration, names)
    footage = []
    try:
        for spec in specs:
            footage.append(open_footage(spec, fps))
        for model, name, each in zip(cameras, names, footage):
            if (model.width, model.height) != each.size:
                raise DrakeTrackerError(
                    f"{calibration}: {name} was calibrated at {model.width} x {model.height} px, but {each.name} has "
                    f"{each.size[0]} x {each.size[1]} px; calibrate with images of that size"
                )
        timeline = align(footage, offset=offset, duration=duration)
        if isinstance(detecting, NormalFlow) and detecting.preset == "scaled":
            detecting.stride = detecting.stride or int(np.clip(round(_SPAN / timeline.period), 1, 4))
        detectors = [make_detector(detecting, period=timeline.period) for _ in footage]
        diagram = OwnCamerasDiagram(
            timeline,
            detectors,
            cameras,
            estimator_of(estimating, "--estimator", timeline.period) if cameras else None,
            plane=_load_plane(plane, calibration, height) if plane else None,
            max_gap=max_gap,
        )
    except BaseException:
        for each in footage:
            each.close()
        raise
    facts = {
        "cameras": [{"source": each.name, "width": each.size[0], "height": each.size[1]} for each in footage],
        "frame_rate": 1.0 / timeline.period,
        "calibration": calibration and str(calibration),
        "plane": plane,
        "detector": {"kind": type(detecting).__name__} | asdict(detecting),
        "estimator": {"kind": type(estimating).__name__} | asdict(estimating) if cameras else None,
    }
    world = None
    if cameras:
        world = "camera_left" if np.array_equal(cameras[0].X_CW, np.eye(4)) else "board"
    return Tracking(footage, timeline, diagram, cameras, detectors[0].stamp_age_cycles, world, facts)


def run(tracking, out, *, overlay=True, progress=None):
    """Makes a track and leaves track.csv, overlay.mp4, track.png and summary.json in the folder ``out``.

    A key press of Ctrl-C ends it, with everything made so far. So does trouble on the way, a damaged video or a full
    disk; then DrakeTrackerError, one line, is raised at the end, or what an estimator of one's own raised.

    Args:
        tracking: `Tracking`. overlay: whether to write the video. progress: called with (time [s], text).

    Returns the summary, a dict.
    """
    diagram, timeline = tracking.diagram, tracking.timeline
    trouble, interrupted, video, table = [], False, None, None
    dropped = [0] * len(tracking.footage)
    try:
        with _kept(trouble, out):
            table = TrackTable(out / "track.csv", diagram.sides, diagram.has_points)
            if overlay:
                sizes = [each.size for each in tracking.footage]
                video = TrackOverlay(out / "overlay.mp4", timeline.period, sizes, tracking.age_cycles, tracking.cameras)
            _follow(tracking, table, video, dropped, progress)
    except KeyboardInterrupt:
        interrupted = True
    for each in tracking.footage:
        each.close()
    for part in (table, video):
        if part is not None:
            with _kept(trouble, out):
                part.close()
    summary = {}
    if table is not None:
        data = table.data()
        summary = summarize_track(data, timeline.period) | {"dropped": dropped, "interrupted": interrupted}
        with _kept(trouble, out, "summary.json"):
            save_summary(describe_run(**summary, **tracking.facts), out / "summary.json")
        with _kept(trouble, out, "track.png"):
            names = " and ".join(each.name for each in tracking.footage)
            world = tracking.world or "board"
            draw_track(data, out / "track.png", world=world, title=names, period=timeline.period)
    if trouble:
        raise trouble[0]
    return summary


class _kept:
    """Collects trouble, so that what has been made is kept and the rest is tried; a file cut short is taken away."""

    def __init__(self, trouble, out, whole=None):
        self._trouble, self._out, self._whole = trouble, out, whole

    def __enter__(self):
        pass

    def __exit__(self, kind, error, _):
        if isinstance(error, DrakeTrackerError):
            self._trouble.append(error)
        elif isinstance(error, (OSError, av.error.FFmpegError)):
            words = f"{self._out}: cannot be written: {reason(error)}; what was written before is kept"
            self._trouble.append(DrakeTrackerError(words))
            if self._whole is not None:
                (self._out / self._whole).unlink(missing_ok=True)
        elif isinstance(error, Exception):  # of an estimator of the user's own, say
            self._trouble.append(error)
        else:
            return False
        return True


def _follow(tracking, table, video, dropped, progress):
    """Lets the diagram run, cycle by cycle, and writes down what its ports show."""
    diagram, timeline = tracking.diagram, tracking.timeline
    simulator = Simulator(diagram)
    simulator.Initialize()
    context = simulator.get_context()

    def show(name):
        return diagram.GetOutputPort(name).Eval(context)

    number, last = 0, None if timeline.count is None else timeline.count  # one cycle more empties the delay line
    while last is None or number <= last:
        now = (number + _READ_AT) * timeline.period
        simulator.AdvanceTo(now)
        frames = [show(f"frame_{side}") for side in diagram.sides]
        if last is None or number < last:
            for k, frame in enumerate(frames):
                dropped[k] += not frame[1]
        centroids = [show(f"centroid_{side}") for side in diagram.sides]
        spatial = [show(name) for name in ("point", "filtered", "prediction")] if diagram.has_points else []
        table.add(centroids, *spatial)
        if video is not None:
            ticks = [(show(f"camera_{side}").data, frame) for side, frame in zip(diagram.sides, frames)]
            energies = [show(f"motion_{side}") for side in diagram.sides]
            video.add(ticks, energies, centroids, *spatial[::2])
        if progress is not None:
            progress(now, f"{sum(row[table.columns.index('valid')] for row in table.rows[-60:]):.0f} of the last 60")
        number += 1


def _load_cameras(path, names):
    models = load_calibration(path)
    for name in names:
        if name not in models:
            raise DrakeTrackerError(f"{path}: there is no {name}; found {', '.join(models) or 'none'}")
    return [models[name] for name in names]


def _load_plane(plane, calibration, height):
    if plane == "board":
        return Plane(load_pose(calibration, "notes", "X_WP"), height)
    return Plane(load_pose(plane, "X_WP"), height)
