"""Prepares a track of your own cameras: checks the options, opens the footage, builds the diagram."""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.cameras.files.calibration_file import load_pose
from drake_tracker.cameras.files.camera_files import OWN, load_cameras
from drake_tracker.cameras.files.foreign_camera import UNKNOWN_SIZE
from drake_tracker.cameras.latency.camera_latency import load_latencies
from drake_tracker.core.errors import DrakeTrackerError, DrakeTrackerWarning
from drake_tracker.footage.copies import without_copies
from drake_tracker.footage.footage import Footage
from drake_tracker.footage.played_camera import Start
from drake_tracker.footage.recording import FootageRecorder, find_recordings
from drake_tracker.footage.sources import is_live, is_same_source, open_footage
from drake_tracker.footage.timeline import Timeline, align
from drake_tracker.own_cameras.choice import LEFT, check_choice, check_effect, read_pixel, read_window
from drake_tracker.own_cameras.detector_choice import Suited, can_suit, suited, suited_live
from drake_tracker.own_cameras.own_cameras_diagram import MAX_GAP, OwnCamerasDiagram, Plane
from drake_tracker.own_cameras.scale import ESTIMATOR_SETTINGS, is_scaled, own_estimator, usual_gap
from drake_tracker.scenarios.reader import read_option
from drake_tracker.vision.centroid.config import NormalFlow
from drake_tracker.vision.centroid.detectors import DETECTORS, SCENE_DETECTORS, make_detector
from drake_tracker.vision.centroid.plane_projection import project_to_plane
from drake_tracker.vision.image_tracks.image_tracker import ImageTracker
from drake_tracker.vision.image_tracks.pyramid_level import reduced_pixel, reduced_window

DETECTOR_SETTINGS = NormalFlow | DETECTORS.union(without=SCENE_DETECTORS)
LEAST_RATE, GREATEST_RATE = 0.01, 1e5
"""Lowest and highest number of images per second; the fastest cameras take some 1e5 at a useful size."""
_OFF_CENTRE = 0.08
"""Largest distance of a principal point from the middle of the image, as a share of the width and of the height. It is
accepted where a file does not contain the size of its images; images of 5/4 the size are further from it."""
_RAYS = 9
"""Number of rays across the width and the height of an image by which a plane is looked for."""
_MODULES = (
    "drake_tracker.estimation.coordinated_turn",
    "drake_tracker.own_cameras.overlay",
    "drake_tracker.vision.centroid.normal_flow",
    "drake_tracker.vision.centroid.normal_flow_parameters",
    "scipy.stats",
)
"""Modules that are slow to load, and loaded on first use elsewhere."""
_MODULES_OF_SEVERAL = ("scipy.optimize",)
"""The same for several objects."""


@dataclass(frozen=True, eq=False)
class PreparedTrack:
    """Everything that `make_track` needs. A caller that does not call `make_track` must close the footage.

    Attributes:
        footage: footage of each camera.
        timeline: common clock of the cameras.
        diagram: vision and estimation.
        cameras: calibration of each camera, or empty.
        age_cycles: cycles from the described image to the newest one.
        world: what the world frame W is: "board" or "camera_left"; None without calibration.
        facts: sources and settings, for the summary.
        recordings: of the live cameras; empty when nothing is recorded.
    """

    footage: list[Footage]
    timeline: Timeline
    diagram: OwnCamerasDiagram
    cameras: list[CameraModel]
    age_cycles: float
    world: str | None
    facts: dict[str, Any]
    recordings: Sequence[FootageRecorder] = ()


def prepare_track(
    sources: Sequence[str],
    *,
    calibration: str | Path | Sequence[str | Path] | None = None,
    plane: str | None = None,
    height: float = 0.0,
    camera: str = LEFT,
    fps: float | None = None,
    offset: float = 0.0,
    duration: float | None = None,
    detector: str = "NormalFlow {}",
    estimator: str = "CoordinatedTurn {}",
    max_gap: float | None = None,
    roi: Sequence[str] = (),
    follow: Sequence[str] = (),
    objects: int = 1,
    record: bool = False,
    first_look: float | None = None,
    tell: Callable[[str], object] = lambda line: None,
) -> PreparedTrack:
    """Checks the options, opens the footage and builds the diagram of a track. Nothing is written.

    Args:
        sources: one source or two, as `open_footage` takes them; or the folder of a recorded live session.
        calibration: file made by `drake-tracker calibrate` or another tool, or two files, see `load_cameras`; None
            gives the track of a single camera in pixels.
        plane: for a single camera, "board" (the board in the calibration's first photograph) or a YAML file with X_WP.
        height: height of the moving object above that plane [m].
        camera: name of a single camera in the calibration.
        fps: images per second, see `open_footage`.
        offset: time by which the second recording began later [s], see `align`.
        duration: longest time to use [s].
        detector: tag of `DETECTOR_SETTINGS` with settings, see `read_option`.
        estimator: tag of `ESTIMATOR_SETTINGS` with settings, see `read_option` and `own_estimator`.
        max_gap: largest gap between the two rays of one point [m]; None: see `usual_gap`.
        roi: for each camera, the part of the image in which motion counts, see `read_window`; or empty.
        follow: for each camera, "U,V", the pixel of the object to follow in the first image; or empty.
        objects: largest number of objects to track.
        record: whether the images of live cameras are recorded.
        first_look: time for which live cameras are looked at before the track begins [s], see `suited_live`; None: not.
        tell: called with a line of text before that.

    Raises:
        DrakeTrackerError: an option or a source is wrong; one line for each error.
    """
    positive = {"fps": fps, "duration": duration, "max-gap": max_gap, "first-look": first_look}
    _check_numbers(positive, {"height": height, "offset": offset})
    if len(sources) == 1:
        sources = find_recordings(sources[0]) or sources
    detector_settings = read_option(detector, DETECTOR_SETTINGS, "detector")
    estimator_settings = read_option(estimator, ESTIMATOR_SETTINGS, "estimator")
    check_choice(len(sources), roi, follow, objects)
    files = [calibration] if isinstance(calibration, str | Path) else list(calibration or ())
    _check_cameras(sources, files, plane)
    check_effect(len(sources), bool(files), plane, height, offset, max_gap, camera)
    if detector_settings.centroid != "hull" and (roi or follow or objects > 1):
        raise DrakeTrackerError("--roi, --follow and --objects need a detector with centroid: hull")
    names = ["camera_left", "camera_right"] if len(sources) == 2 else [camera]
    cameras, form = _load_cameras(files, names) if files else ([], OWN)
    known = load_latencies(files[0]) if files and form == OWN else {}
    latencies = [known.get(name, 0.0) for name in names]
    footage: list[Footage] = []
    recordings: list[FootageRecorder] = []
    start = Start()
    if any(map(is_live, sources)):
        load_ahead(objects)
    try:
        for source in sources:
            footage.append(open_footage(source, fps, start))
            footage[-1] = without_copies(footage[-1])
        windows = [read_window(roi[k], each.size) if roi else None for k, each in enumerate(footage)]
        pixels = [read_pixel(follow[k], each.size) if follow else None for k, each in enumerate(footage)]
        found = Suited(detector_settings, 1, [])
        if first_look is not None:
            _check_live(footage, first_look)
            if not can_suit(detector_settings):
                raise DrakeTrackerError(f"--first-look {first_look:g}: --detector leaves no setting open to be found")
            tell(f"Looking at the cameras for {first_look:g} s: move the object")
            found, footage = suited_live(detector_settings, footage, first_look, windows)
        for k, latency in enumerate(latencies):
            if record:
                recordings.append(FootageRecorder(footage[k]))
                footage[k] = recordings[-1].footage
            footage[k] = _earlier(footage[k], latency)
        where = " and ".join(map(str, files))
        cameras = [_sized(model, each, f"{where}: {name}") for model, name, each in zip(cameras, names, footage)]
        surface = _load_plane(plane, files[0], form, height) if plane and files else None
        if surface is not None:
            _check_plane(cameras[0], surface, str(plane))
        timeline = align(footage, offset=offset, duration=duration)
        footage = [sequence.footage for sequence in timeline.sequences]
        if first_look is None and can_suit(detector_settings):
            found = suited(detector_settings, footage, timeline.period, windows, pixels)
        detector_settings, reduce_by, looks = found
        detectors = [make_detector(detector_settings, period=timeline.period) for _ in footage]
        trackers = [
            ImageTracker(
                objects,
                reduced_pixel(pixel, reduce_by),
                reduced_window(window, reduce_by),
                period=timeline.period,
            )
            for pixel, window in zip(pixels, windows)
        ]
        if max_gap is None:
            max_gap = usual_gap(cameras) if len(cameras) == 2 else MAX_GAP
        diagram = OwnCamerasDiagram(
            timeline,
            detectors,
            cameras,
            own_estimator(estimator_settings, timeline.period, not cameras),
            plane=surface,
            max_gap=max_gap,
            trackers=trackers if detector_settings.centroid == "hull" else (),
            reduce_by=reduce_by,
        )
    except BaseException:
        for each in footage:
            each.close()
        raise
    facts = {
        "cameras": [{"source": each.name, "width": each.size[0], "height": each.size[1]} for each in footage],
        "frame_rate": 1.0 / timeline.period,
        "calibration": where or None,
        "latency_s": latencies,
        "offset": offset,
        "stamp_zero": None if footage[0].counted else footage[0].epoch,
        "plane": plane,
        "roi": list(roi),
        "follow": list(follow),
        "objects": objects,
        "max_gap": max_gap,
        "images_reduced_by": reduce_by,
        "first_look": [None if look is None else asdict(look) for look in looks],
        "detector": {"kind": type(detector_settings).__name__} | asdict(detector_settings),
        "estimator": {
            "kind": type(estimator_settings).__name__,
            "scaled_to_data": is_scaled(estimator_settings, not cameras),
        }
        | asdict(estimator_settings),
    }
    world = None
    if cameras:
        world = "camera_left" if np.array_equal(cameras[0].X_CW, np.eye(4)) else "board"
    return PreparedTrack(footage, timeline, diagram, cameras, detectors[0].stamp_age_cycles, world, facts, recordings)


def _earlier(footage: Footage, latency: float) -> Footage:
    """Returns footage whose first image was captured earlier by a latency [s], where its time is known at all."""
    if footage.epoch is None or footage.counted:
        return footage
    return replace(footage, epoch=footage.epoch - latency)


def _check_live(footage: Sequence[Footage], first_look: float) -> None:
    """Raises DrakeTrackerError when footage to look at first is not live."""
    for each in footage:
        if not each.live:
            raise DrakeTrackerError(
                f"--first-look {first_look:g}: {each.name} is a recording, which is always looked at"
            )


def _check_numbers(positive: dict[str, float | None], finite: dict[str, float]) -> None:
    """Raises DrakeTrackerError when an option is out of range."""
    for name, value in positive.items():
        if value is not None and not 0.0 < value < np.inf:
            raise DrakeTrackerError(f"--{name} {value:g}: must be above 0 and finite")
    fps = positive["fps"]
    if fps is not None and not LEAST_RATE <= fps <= GREATEST_RATE:
        raise DrakeTrackerError(f"--fps {fps:g}: must be from {LEAST_RATE:g} to {GREATEST_RATE:g} images per second")
    for name, number in finite.items():
        if not np.isfinite(number):
            raise DrakeTrackerError(f"--{name} {number:g}: must be a finite number")


def _check_cameras(sources: Sequence[str], calibration: Sequence[str | Path], plane: str | None) -> None:
    """Raises DrakeTrackerError when calibration and plane do not suit the cameras, or both cameras are the same."""
    count = len(sources)
    if count == 2 and is_same_source(*sources):
        raise DrakeTrackerError(f"{sources[0]} and {sources[1]} are the same images; each camera needs its own")
    if count == 2 and not calibration:
        raise DrakeTrackerError("two cameras need --calibration FILE; drake-tracker calibrate makes one")
    if count == 1 and calibration and plane is None:
        raise DrakeTrackerError(
            "a single camera measures only a direction: add --plane board or --plane FILE, the plane of the motion"
        )
    if plane is not None and (not calibration or count == 2):
        raise DrakeTrackerError(f"--plane {plane}: only for a single camera with --calibration FILE")


def _check_plane(model: CameraModel, plane: Plane, name: str) -> None:
    """Raises DrakeTrackerError when a camera does not see the plane."""
    view = model.in_frame(plane.X_WP)
    across = [np.linspace(0.0, size - 1.0, _RAYS) for size in (model.width, model.height)]
    if all(project_to_plane(view, (u, v), plane.height) is None for u in across[0] for v in across[1]):
        raise DrakeTrackerError(
            f"--plane {name}: the plane is out of view of the camera; is its pose that of this calibration (X_WP) and "
            f"the height of {plane.height:g} m on the side of its normal?"
        )


def _sized(model: CameraModel, footage: Footage, where: str) -> CameraModel:
    """Returns a camera with the image size of its footage, if its file did not contain one.

    Raises DrakeTrackerError when the camera was calibrated at another image size.
    """
    if model.width == UNKNOWN_SIZE:
        model = replace(model, width=footage.size[0], height=footage.size[1])
        suggested = 2.0 * model.K[:2, 2] + 1.0
        size = f"{suggested[0]:.0f} x {suggested[1]:.0f} px"
        if (np.abs(suggested / footage.size - 1.0) > 2.0 * _OFF_CENTRE).any():
            raise DrakeTrackerError(
                f"{where} does not contain the size of its images; the principal point suggests about {size}, but "
                f"{footage.name} has {footage.size[0]} x {footage.size[1]} px; calibrate with images of that size, or "
                "add the size to the file"
            )
        warnings.warn(
            f"{where} does not contain the size of its images; the principal point suggests about {size}, and "
            f"{footage.size[0]} x {footage.size[1]} px are assumed",
            DrakeTrackerWarning,
            stacklevel=2,
        )
    if (model.width, model.height) != footage.size:
        raise DrakeTrackerError(
            f"{where} was calibrated at {model.width} x {model.height} px, but {footage.name} has "
            f"{footage.size[0]} x {footage.size[1]} px; calibrate with images of that size"
        )
    return model


def _load_cameras(paths: Sequence[str | Path], names: list[str]) -> tuple[list[CameraModel], str]:
    """Returns the cameras of a calibration that have these names, and the format of its files."""
    models, form = load_cameras(paths)
    for name in names:
        if name not in models:
            where = " and ".join(map(str, paths))
            raise DrakeTrackerError(f"{where}: there is no {name}; found {', '.join(models) or 'none'}")
    return [models[name] for name in names], form


def _load_plane(plane: str, calibration: str | Path, form: str, height: float) -> Plane:
    if plane == "board":
        if form != OWN:
            raise DrakeTrackerError(
                f"--plane board: {calibration} does not say where a board was; give a file with the pose X_WP"
            )
        return Plane(load_pose(calibration, "notes", "X_WP"), height)
    return Plane(load_pose(plane, "X_WP"), height)


def load_ahead(objects: int) -> None:
    """Loads the modules.

    Args:
        objects: largest number of objects to track.
    """
    for name in _MODULES + (_MODULES_OF_SEVERAL if objects > 1 else ()):
        import_module(name)
