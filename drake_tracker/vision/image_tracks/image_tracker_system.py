"""The tracks of one camera as Drake Systems: the tracker, and the numbers and centroids of its targets."""

from functools import partial
from typing import Any

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, LeafSystem, State

from drake_tracker.core.frozen_state import declare_outputs
from drake_tracker.core.messages import Centroid
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.vision.centroid.motion_centroid_system import MotionCentroidSystem
from drake_tracker.vision.centroid.motion_detector import MotionDetector
from drake_tracker.vision.centroid.search_window import Track
from drake_tracker.vision.image_tracks.image_objects import ImageTracks, target_centroid, target_number
from drake_tracker.vision.image_tracks.image_tracker import ImageTracker
from drake_tracker.vision.image_tracks.pyramid_level import enlarged
from drake_tracker.vision.region_centroid import RegionCentroid


class ImageTrackerSystem(MotionCentroidSystem):
    """Tracks the objects in the images of one camera, in place of the centroid of everything that moves.

    .. pydrake_system::

        name: ImageTrackerSystem
        input_ports:
        - color_image
        output_ports:
        - centroid
        - motion_energy
        - motion_images
        - tracks

    The ports are the ports of `MotionCentroidSystem`; ``centroid`` is the centroid of the first target. ``tracks`` is
    an `ImageTracks` of the same instant, in pixels of the full image.

    Args:
        detector: `MotionDetector`.
        tracker: `ImageTracker`, with pixels of the reduced image.
        **settings: of `MotionCentroidSystem`.
    """

    def __init__(self, detector: MotionDetector, *, tracker: ImageTracker, **settings: Any) -> None:
        super().__init__(detector, found=tracker.start(), **settings)
        self._tracker = tracker
        self.DeclareAbstractOutputPort(
            "tracks",
            lambda: AbstractValue.Make(ImageTracks(0.0)),
            self._calc_tracks,
            {self.abstract_state_ticket(self._memory)},
        )

    def find(
        self, found: Any, stamp: float, track: Track, images: tuple[np.ndarray, ...]
    ) -> tuple[Any, np.ndarray, RegionCentroid | None]:
        return self._tracker.update(found, stamp, self._detector, images)

    def _calc_tracks(self, context: Context, output: AbstractValue) -> None:
        memory = self._get_memory(context)
        seen = enlarged(memory.found, self._reduce_by) if memory.described else None
        output.set_value(ImageTracks(memory.energy.stamp, seen))


class ImageTargetsSystem(LeafSystem):
    """Outputs the objects to report of a single camera one by one, as `StereoTracksSystem` does for two cameras.

    .. pydrake_system::

        name: ImageTargetsSystem
        input_ports:
        - tracks
        output_ports:
        - number_1
        - number_2
        - centroid_2

    ``tracks`` is the `ImageTracks` of an `ImageTrackerSystem`. It is read every ``period`` at ``offset`` in an
    unrestricted update. At the instants at which that System is updated too, its output of the previous cycle is read:
    the outputs are then as late as with the shortest delay line.

    ``number_1`` is the identity of the first object, 0 without one. There are ``number_2`` and ``centroid_2`` for the
    second object, and so on: ``centroid_2`` is its `Centroid` [px], invalid while the image does not show it. The
    `ImageTrackerSystem` outputs the centroid of the first object. All are zeros before the first image.

    Args:
        objects: number of objects to report.
        period: of the update [s].
        offset: of the update [s].
    """

    def __init__(self, objects: int, *, period: float = VISION_PERIOD, offset: float = 0.0) -> None:
        super().__init__()
        self._tracks = self.DeclareAbstractInputPort("tracks", AbstractValue.Make(object()))
        state = self.DeclareAbstractState(AbstractValue.Make(ImageTracks(0.0)))
        for place in range(objects):
            outputs = [("number", 1, _pack_number), ("centroid", Centroid, _pack_centroid)]
            for name, view, pack in outputs if place else outputs[:1]:
                declare_outputs(self, state, {f"{name}_{place + 1}": (view, partial(pack, place=place))})
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, offset, self._update)

    def _update(self, context: Context, state: State) -> None:
        state.get_mutable_abstract_state(0).set_value(self._tracks.Eval(context))


def _pack_number(tracks: ImageTracks, place: int) -> np.ndarray:
    return np.array([float(target_number(tracks.objects, place))])


def _pack_centroid(tracks: ImageTracks, place: int) -> np.ndarray:
    return target_centroid(tracks.objects, place, tracks.stamp)
