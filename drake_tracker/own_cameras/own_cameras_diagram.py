"""Vision and estimation for your own cameras: no world, no arm."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from pydrake.systems.framework import Diagram, DiagramBuilder

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.core.constants import SIDES
from drake_tracker.core.timing import ESTIMATOR_SLOT, PROJECTOR_SLOT, vision_slot
from drake_tracker.estimation.estimator_system import EstimatorSystem
from drake_tracker.footage.timeline import MOST_STAMP_DIFFERENCE, Timeline
from drake_tracker.footage.video_source_system import VideoSource
from drake_tracker.vision.centroid.motion_centroid_system import MotionCentroidSystem, add_motion_centroid
from drake_tracker.vision.centroid.plane_projection import EveryPoint
from drake_tracker.vision.centroid.plane_projector_system import PixelPointSystem, PlaneProjectorSystem
from drake_tracker.vision.centroid.vision_diagram import VisionDiagram
from drake_tracker.vision.image_tracks.image_tracker import ImageTracker
from drake_tracker.vision.image_tracks.image_tracker_system import ImageTargetsSystem, ImageTrackerSystem
from drake_tracker.vision.image_tracks.stereo_tracks import StereoTracker
from drake_tracker.vision.image_tracks.stereo_tracks_system import StereoTracksSystem
from drake_tracker.vision.triangulator_system import connect_centroids

MAX_GAP = 0.03
"""Largest gap [m] between the two rays of one point."""
EXTRA_CYCLES = 1
"""Cycles that a centroid spends in the delay line, its minimum: the lag of 1991 is not reproduced here."""


@dataclass(frozen=True, eq=False)
class Plane:
    """The plane over which an object moves.

    Attributes:
        X_WP: pose of the plane, shape (4, 4); its z axis is the normal.
        height: height of the object above the plane [m].
    """

    X_WP: np.ndarray
    height: float = 0.0


def _tracking(tracker: ImageTracker) -> Callable[..., MotionCentroidSystem]:
    """Returns the function that makes the System for tracking objects in the images of a camera."""
    return partial(ImageTrackerSystem, tracker=tracker)


def place_suffix(place: int) -> str:
    """Returns the suffix of the port names of an object: "" for the first object, "_2" for the second."""
    return f"_{place + 1}" if place else ""


class OwnCamerasDiagram(Diagram):
    """From footage to points and a predicted path, at the frame rate of the footage.

    .. pydrake_system::

        name: OwnCamerasDiagram
        output_ports:
        - camera_left
        - frame_left
        - centroid_left
        - motion_left
        - camera_right
        - frame_right
        - centroid_right
        - motion_right
        - point
        - filtered
        - prediction

    There are no input ports. A single camera is the left one. ``camera_*`` is an `ImageRgba8U` and ``frame_*`` a
    `FrameInfo` (stamp [s]), both of a `VideoSource` and functions of time. ``centroid_*`` is a `Centroid` (stamp [s],
    pixels) and ``motion_*`` a `DetectionMask`, both updated every period of the footage; with trackers there is
    ``tracks_*``, an `ImageTracks`. ``point`` is a `TrackPoint` in
    W [m], ``filtered`` a `Filtered` and ``prediction`` a `Prediction`, updated every period in the slots of vision and
    estimator (`core.timing`). For a single camera without a plane, lengths are in pixels in place of metres, and the
    point is (u, v, 0). A vector of zeros means that there is no result yet.

    With several objects, ``point``, ``filtered``, ``prediction``, ``centroid_*`` and ``number`` (the identity) belong
    to the first object; ``point_2`` and so on belong to the second object. Each object has an estimator. With two
    cameras, there is also ``objects``, a `StereoTracks`.

    Attributes:
        sides: ("left", "right"), or ("left",) for a single camera.
        in_space: whether points are in W [m], and not in the image of a single camera [px].
        places: number of objects with ports of their own.
    """

    def __init__(
        self,
        timeline: Timeline,
        detectors: Sequence[Any],
        cameras: Sequence[CameraModel],
        estimator: Any,
        *,
        plane: Plane | None = None,
        max_gap: float = MAX_GAP,
        trackers: Sequence[ImageTracker] = (),
        reduce_by: int = 1,
    ) -> None:
        """Wires the diagram.

        Args:
            timeline: common clock of one or two cameras.
            detectors: motion detector of each camera.
            cameras: calibration of each camera, or empty.
            estimator: an `Estimator`, for lengths in metres or in pixels.
            plane: plane of the motion; needed with a single calibrated camera only.
            max_gap: largest gap between the two rays of one point [m].
            trackers: `ImageTracker` of each camera; empty for everything that moves.
            reduce_by: factor by which the images are reduced, see `MotionCentroidSystem`.
        """
        super().__init__()
        self.set_name("own_cameras")
        self.sides = SIDES[: len(timeline.sequences)]
        period = timeline.period
        builder = DiagramBuilder()
        tracker = trackers[0] if trackers else None
        self.places = tracker.objects if tracker is not None else 1
        self.in_space = len(self.sides) == 2 or plane is not None
        if len(self.sides) == 2:
            vision = self._add_stereo(builder, cameras, detectors, period, max_gap, trackers, reduce_by)
            if self.places > 1:
                vision |= self._add_pairs(builder, cameras, vision, period, max_gap, trackers[0])
        else:
            vision = self._add_single(builder, cameras, detectors[0], period, plane, tracker, reduce_by)
        for side, sequence in zip(self.sides, timeline.sequences):
            source = builder.AddNamedSystem(f"source_{side}", VideoSource(sequence, period))
            for name, port in (("camera", "grey"), ("frame", "frame")):
                builder.Connect(source.GetOutputPort(port), vision[f"{name}_{side}"])
            for name, port in (("camera", "image"), ("frame", "frame")):
                builder.ExportOutput(source.GetOutputPort(port), f"{name}_{side}")
            for name in ("centroid", "motion", *(("tracks",) if trackers else ())):
                builder.ExportOutput(vision[f"{name}_{side}"], f"{name}_{side}")
        for place in range(self.places):
            self._add_host(builder, vision, estimator, period, place_suffix(place))
        if "objects" in vision:
            builder.ExportOutput(vision["objects"], "objects")
        if self.places > 1:
            for name in (f"centroid_{side}{place_suffix(k)}" for k in range(1, self.places) for side in self.sides):
                builder.ExportOutput(vision[name], name)
        builder.BuildInto(self)

    def _add_host(
        self, builder: DiagramBuilder, vision: dict[str, Any], estimator: Any, period: float, suffix: str
    ) -> None:
        """Adds the estimator of an object; exports its point and its path."""
        numbered, offset = self.places > 1, vision_slot(ESTIMATOR_SLOT, period)
        host = builder.AddNamedSystem(
            f"host{suffix}",
            EstimatorSystem(estimator, period=period, offset=offset, farthest=math.inf, numbered=numbered),
        )
        for name in ("point", "number") if numbered else ("point",):
            builder.Connect(vision[f"{name}{suffix}"], host.GetInputPort(name))
            builder.ExportOutput(vision[f"{name}{suffix}"], f"{name}{suffix}")
        for name in ("filtered", "prediction"):
            builder.ExportOutput(host.GetOutputPort(name), f"{name}{suffix}")

    @staticmethod
    def _add_stereo(
        builder: DiagramBuilder,
        camera_pair: Sequence[CameraModel],
        detector_pair: Sequence[Any],
        period: float,
        max_gap: float,
        trackers: Sequence[ImageTracker],
        reduce_by: int,
    ) -> dict[str, Any]:
        """Adds the vision of two cameras; returns its ports by name."""
        cameras, detectors = (dict(zip(SIDES, pair)) for pair in (camera_pair, detector_pair))
        vision = builder.AddSystem(
            VisionDiagram(
                cameras,
                detectors,
                lag_cycles=detectors["left"].stamp_age_cycles + EXTRA_CYCLES,
                period=period,
                own_stamps=True,
                grey=True,
                max_gap=max_gap,
                system_classes={side: _tracking(tracker) for side, tracker in zip(SIDES, trackers)}
                if trackers
                else None,
                stamp_tolerance=MOST_STAMP_DIFFERENCE * period,
                reduce_by=reduce_by,
            )
        )
        names = ("centroid", "motion", *(("tracks",) if trackers else ()))
        outputs = ["point"] + [f"{name}_{side}" for name in names for side in cameras]
        ports = {name: vision.GetOutputPort(name) for name in outputs}
        return ports | {
            f"{name}_{side}": vision.GetInputPort(f"{name}_{side}") for name in ("camera", "frame") for side in cameras
        }

    @staticmethod
    def _add_pairs(
        builder: DiagramBuilder,
        cameras: Sequence[CameraModel],
        vision: dict[str, Any],
        period: float,
        max_gap: float,
        tracker: ImageTracker,
    ) -> dict[str, Any]:
        """Adds the System that pairs the objects of two cameras; returns its ports by name."""
        pairing = StereoTracker(
            cameras,
            tracker.objects,
            max_gap=max_gap,
            stamp_tolerance=MOST_STAMP_DIFFERENCE * period,
            follow=tracker.follow is not None,
        )
        pairs = builder.AddNamedSystem("pairs", StereoTracksSystem(pairing, period=period))
        for side in SIDES:
            builder.Connect(vision[f"tracks_{side}"], pairs.GetInputPort(f"tracks_{side}"))
        ports = {"objects": pairs.GetOutputPort("objects")}
        for place in range(tracker.objects):
            for name in ("point", "number", *(f"centroid_{side}" for side in SIDES)):
                ports[f"{name}{place_suffix(place)}"] = pairs.GetOutputPort(f"{name}_{place + 1}")
        return ports

    def _add_single(
        self,
        builder: DiagramBuilder,
        cameras: Sequence[CameraModel],
        detector: Any,
        period: float,
        plane: Plane | None,
        tracker: ImageTracker | None,
        reduce_by: int,
    ) -> dict[str, Any]:
        """Adds the vision of a single camera; returns its ports by name."""
        motion = add_motion_centroid(
            builder,
            detector=detector,
            lag_cycles=detector.stamp_age_cycles + EXTRA_CYCLES,
            period=period,
            system_class=MotionCentroidSystem if tracker is None else _tracking(tracker),
            own_stamps=True,
            grey=True,
            reduce_by=reduce_by,
            name="motion",
        )
        ports = {
            "camera_left": motion.image_input_port,
            "frame_left": motion.frame_input_port,
            "centroid_left": motion.output_port,
            "motion_left": motion.system.GetOutputPort("motion_energy"),
        }
        if tracker is not None:
            ports["tracks_left"] = motion.system.GetOutputPort("tracks")
        if self.places > 1:
            targets = builder.AddNamedSystem("targets", ImageTargetsSystem(self.places, period=period))
            builder.Connect(ports["tracks_left"], targets.GetInputPort("tracks"))
            for place in range(self.places):
                ports[f"number{place_suffix(place)}"] = targets.GetOutputPort(f"number_{place + 1}")
                if place:
                    ports[f"centroid_left{place_suffix(place)}"] = targets.GetOutputPort(f"centroid_{place + 1}")
        for suffix in map(place_suffix, range(self.places)):
            localiser: Any = PixelPointSystem()
            if plane is not None:
                offset, camera = vision_slot(PROJECTOR_SLOT, period), cameras[0].in_frame(plane.X_WP)
                localiser = PlaneProjectorSystem(
                    camera, plane.X_WP, plane.height, EveryPoint(), period=period, offset=offset
                )
            builder.AddNamedSystem(f"localiser{suffix}", localiser)
            connect_centroids(builder, [ports[f"centroid_left{suffix}"]], localiser)
            ports[f"point{suffix}"] = localiser.point_port
        return ports
