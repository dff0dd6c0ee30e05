"""The objects that one camera tracks as a Drake System: their numbers and centroids."""

from typing import Any

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import BasicVector, Context, LeafSystem, State

from drake_tracker.core.frozen_state import read_only
from drake_tracker.core.messages import Centroid, message_size
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.vision.centroid.motion_centroid_system import DetectionMask
from drake_tracker.vision.image_tracks.image_objects import target_centroid, target_number


class ImageTargetsSystem(LeafSystem):
    """Outputs the objects to report of a single camera one by one, as `StereoTracksSystem` does for two cameras.

    .. pydrake_system::

        name: ImageTargetsSystem
        input_ports:
        - motion
        output_ports:
        - number_1
        - number_2
        - centroid_2

    ``motion`` is the `DetectionMask` of the whole image, from a `MotionCentroidSystem` with a tracker. It is read every
    ``period`` at ``offset`` in an unrestricted update. At the instants at which that System is updated too, it is that
    of the cycle before: the outputs are then as late as those of the shortest delay line.

    ``number_1`` is the identity of the first object, 0 without one. There are ``number_2`` and ``centroid_2`` for the
    second object, and so on: ``centroid_2`` is its `Centroid` [px], invalid while the image does not show it. The
    centroid of the first object is that of the `MotionCentroidSystem`. All are zeros before the first image.

    Args:
        objects: number of objects to report.
        period: of the update [s].
        offset: of the update [s].
    """

    def __init__(self, objects: int, *, period: float = VISION_PERIOD, offset: float = 0.0) -> None:
        super().__init__()
        self._motion = self.DeclareAbstractInputPort("motion", AbstractValue.Make(object()))
        nothing = DetectionMask(0.0, read_only(np.zeros((1, 1), np.uint8)), (0, 0))
        state = self.DeclareAbstractState(AbstractValue.Make(nothing))
        ticket = {self.abstract_state_ticket(state)}
        for place in range(objects):
            outputs = [("number", 1, _pack_number), ("centroid", message_size(Centroid), _pack_centroid)]
            for name, size, pack in outputs if place else outputs[:1]:

                def calc(context: Context, output: BasicVector, pack: Any = pack, place: int = place) -> None:
                    output.SetFromVector(pack(context.get_abstract_state(0).get_value(), place))

                self.DeclareVectorOutputPort(f"{name}_{place + 1}", size, calc, ticket)
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, offset, self._update)

    def _update(self, context: Context, state: State) -> None:
        state.get_mutable_abstract_state(0).set_value(self._motion.Eval(context))


def _pack_number(energy: DetectionMask, place: int) -> np.ndarray:
    return np.array([float(target_number(energy.objects, place))])


def _pack_centroid(energy: DetectionMask, place: int) -> np.ndarray:
    return target_centroid(energy.objects, place, energy.stamp)
