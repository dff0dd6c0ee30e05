"""The plane projector as a Drake System: one centroid in, one 3-D point out."""

from dataclasses import dataclass

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import LeafSystem

from drake_tracker.core.frozen_state import read_only
from drake_tracker.core.messages import Centroid, TrackPoint, message_size
from drake_tracker.core.timing import PROJECTOR_SLOT, VISION_PERIOD, vision_slot
from drake_tracker.vision.plane_projection import LastReading, project_to_plane


@dataclass(frozen=True, eq=False)
class _Memory:
    """The last reading believed and the newest point, read-only."""

    last: LastReading
    point: np.ndarray

    def __deepcopy__(self, memo):
        return self


class PlaneProjectorSystem(LeafSystem):
    """Intersects the ray of a centroid with the plane of the ball's centre (Nashman and Chaconas 1990, section 5).

    .. pydrake_system::

        name: PlaneProjectorSystem
        input_ports:
        - centroid
        output_ports:
        - point

    ``centroid`` is a `Centroid`, ``point`` a `TrackPoint` in W [m], of the ball's centre, with the same stamp and no
    gap: there is only one ray. It is invalid when the centroid is, and when the reading is not believed; then it
    carries zeros beside its stamp. The input is read in an unrestricted update every ``period`` [s] in a slot of its
    own, after the centroid's delay line and before the estimator; a centroid that is no newer than the last one leaves
    everything as it is.

    Args:
        camera: a `CameraModel` in the board's frame B.
        X_WB: (4, 4), takes p_BQ to p_WQ [m].
        height: of the centroid over the plane, along its normal [m].
        plausible: `PlausibleReadings`.
    """

    def __init__(self, camera, X_WB, height, plausible, *, period=VISION_PERIOD, offset=vision_slot(PROJECTOR_SLOT)):
        super().__init__()
        self._camera, self._plausible = camera, plausible
        self._X_WB = np.array(X_WB, dtype=float)
        self._z = float(height)
        self._centroid = self.DeclareVectorInputPort("centroid", message_size(Centroid))
        blank = _Memory(LastReading(), read_only(np.zeros(message_size(TrackPoint))))
        self._memory = self.DeclareAbstractState(AbstractValue.Make(blank))
        self.DeclareVectorOutputPort(
            "point", message_size(TrackPoint), self._calc_point, {self.abstract_state_ticket(self._memory)}
        )
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, offset, self._update)

    def _update(self, context, state):
        memory = context.get_abstract_state(self._memory).get_value()
        centroid = Centroid(self._centroid.Eval(context))
        point = TrackPoint(np.zeros(message_size(TrackPoint)))
        if centroid.stamp <= memory.point[0]:
            return
        point.stamp = centroid.stamp
        last = memory.last
        if centroid.valid:
            p_BQ = project_to_plane(self._camera, (centroid.u, centroid.v), self._z)
            if p_BQ is not None:
                believed, last = self._plausible.judge(last, centroid.stamp, p_BQ)
                if believed:
                    point.x, point.y, point.z = self._X_WB[:3, :3] @ p_BQ + self._X_WB[:3, 3]
                    point.valid = 1.0
        state.get_mutable_abstract_state(self._memory).set_value(_Memory(last, read_only(point[:])))

    def _calc_point(self, context, output):
        output.SetFromVector(context.get_abstract_state(self._memory).get_value().point)
