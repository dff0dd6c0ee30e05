"""The pairing of objects as a Drake System: the objects in the images of two cameras in, points of several out."""

from functools import partial
from typing import Any

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, LeafSystem, State

from drake_tracker.core.constants import SIDES
from drake_tracker.core.frozen_state import declare_outputs
from drake_tracker.core.messages import Centroid, TrackPoint
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.vision.image_tracks.image_objects import target_centroid
from drake_tracker.vision.image_tracks.stereo_tracks import StereoTracker, StereoTracks


class StereoTracksSystem(LeafSystem):
    """Pairs the objects of two cameras, and measures several objects.

    .. pydrake_system::

        name: StereoTracksSystem
        input_ports:
        - tracks_left
        - tracks_right
        output_ports:
        - objects
        - point_1
        - number_1
        - centroid_left_1
        - centroid_right_1

    ``tracks_*`` are the `ImageTracks` of each camera, from an `ImageTrackerSystem`. They are read every ``period`` at
    ``offset`` in an unrestricted update. At the instants at which that System is updated too, its outputs of the
    previous cycle are read: the outputs are then as late as with the shortest delay line.

    ``objects`` is a `StereoTracks`. There are the other outputs for each place, ``_1``, ``_2`` and so on: ``point_1``
    is a `TrackPoint` of the first object in W [m], invalid while not both cameras see it. ``number_1`` is its identity,
    0 without one. ``centroid_*_1`` is the `Centroid` [px] of the object in each image. Before the first pair, they
    describe the first target of each camera. All are zeros before the first images.

    Args:
        pairing: an `StereoTracker`.
        period: of the update [s].
        offset: of the update [s].
    """

    def __init__(self, pairing: StereoTracker, *, period: float = VISION_PERIOD, offset: float = 0.0) -> None:
        super().__init__()
        self._pairing = pairing
        self._tracks = [self.DeclareAbstractInputPort(f"tracks_{side}", AbstractValue.Make(object())) for side in SIDES]
        state = self.DeclareAbstractState(AbstractValue.Make(pairing.start()))
        ticket = {self.abstract_state_ticket(state)}
        self.DeclareAbstractOutputPort("objects", lambda: AbstractValue.Make(pairing.start()), self._calc, ticket)
        packers: list[tuple[str, Any, Any]] = [("point", TrackPoint, pack_point), ("number", 1, pack_number)]
        packers += [(f"centroid_{side}", Centroid, partial(pack_centroid, side=k)) for k, side in enumerate(SIDES)]
        for place in range(pairing.objects):
            for name, view, pack in packers:
                declare_outputs(self, state, {f"{name}_{place + 1}": (view, partial(pack, place=place))})
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, offset, self._update)

    def _paired(self, context: Context) -> StereoTracks:
        paired: StereoTracks = context.get_abstract_state(0).get_value()
        return paired

    def _calc(self, context: Context, output: AbstractValue) -> None:
        output.set_value(self._paired(context))

    def _update(self, context: Context, state: State) -> None:
        seen = [port.Eval(context) for port in self._tracks]
        paired, stamps = self._paired(context), [tracks.stamp for tracks in seen]
        if 0.0 in stamps or max(stamps) <= paired.stamp:
            return
        paired = self._pairing.update(paired, stamps, [tracks.objects for tracks in seen])
        state.get_mutable_abstract_state(0).set_value(paired)


def pack_point(paired: StereoTracks, place: int) -> np.ndarray:
    """Returns the `TrackPoint` vector of a place; the gap is 0 where the rays do not meet."""
    pair = paired.pair(place)
    if pair is None:
        return np.array([paired.stamp, 0.0, 0.0, 0.0, 0.0, 0.0])
    valid = pair.met == paired.stamp
    return np.array([paired.stamp, *(pair.p_WQ if valid else np.zeros(3)), pair.gap, float(valid)])


def pack_number(paired: StereoTracks, place: int) -> np.ndarray:
    """Returns the number of the object of a place, shape (1,), 0 without one."""
    pair = paired.pair(place)
    return np.array([0.0 if pair is None else float(pair.number)])


def pack_centroid(paired: StereoTracks, place: int, side: int) -> np.ndarray:
    """Returns the `Centroid` vector of a place in the left (0) or the right image (1)."""
    return target_centroid(paired.views[side], place, paired.stamp)
