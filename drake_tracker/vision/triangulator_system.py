"""The triangulator as a Drake System: two centroids in, one 3-D point out."""

import numpy as np
from pydrake.systems.framework import LeafSystem

from drake_tracker.core.messages import Centroid, TrackPoint, message_size
from drake_tracker.vision.triangulation import triangulate
from drake_tracker.vision.window import check_box

STAMP_TOLERANCE = 1e-9
"""Stamps that differ by less [s] are of the same instant: both come from one 60 Hz clock."""


class TriangulatorSystem(LeafSystem):
    """Intersects the rays of two motion centroids (Allen et al. 1991, section 3.1, last paragraphs).

    .. pydrake_system::

        name: TriangulatorSystem
        input_ports:
        - centroid_left
        - centroid_right
        output_ports:
        - point

    Both inputs are `Centroid` vectors, the output is a `TrackPoint` vector in W [m]. There is no state and no clock:
    the output follows the inputs at once. It is invalid when either centroid is, when their stamps differ, when the
    rays do not meet or pass each other by more than ``max_gap`` [m], and, if a ``work_volume`` is given (shape (2, 3),
    lower and upper corner in W [m]), when the point lies outside it by more than ``margin`` [m]. An invalid point
    carries the newer of the two stamps and zeros, except for the gap where one was found.

    Cameras that nothing synchronises take their images at somewhat different instants; ``stamp_tolerance`` [s] is what
    passes for the same. The point's stamp is the middle between both.
    """

    def __init__(
        self,
        camera_left,
        camera_right,
        *,
        max_gap=0.03,
        work_volume=None,
        margin=0.05,
        stamp_tolerance=STAMP_TOLERANCE,
    ):
        super().__init__()
        self._cameras = (camera_left, camera_right)
        self._max_gap = float(max_gap)
        self._stamp_tolerance = float(stamp_tolerance)
        self._box = None
        if work_volume is not None:
            lower, upper = check_box(work_volume)
            self._box = (lower - margin, upper + margin)
        self._left = self.DeclareVectorInputPort("centroid_left", message_size(Centroid))
        self._right = self.DeclareVectorInputPort("centroid_right", message_size(Centroid))
        self.DeclareVectorOutputPort(
            "point",
            message_size(TrackPoint),
            self._calc_point,
            {self._left.ticket(), self._right.ticket()},
        )

    def _calc_point(self, context, output):
        left, right = Centroid(self._left.Eval(context)), Centroid(self._right.Eval(context))
        point = TrackPoint(np.zeros(message_size(TrackPoint)))
        point.stamp = max(left.stamp, right.stamp)
        if left.valid and right.valid and abs(left.stamp - right.stamp) < self._stamp_tolerance:
            point.stamp = (left.stamp + right.stamp) / 2.0
            meeting = triangulate(*self._cameras, (left.u, left.v), (right.u, right.v))
            if meeting is not None:
                point.gap = meeting.gap
                if meeting.gap <= self._max_gap and self._contains(meeting.p_WQ):
                    point.x, point.y, point.z = meeting.p_WQ
                    point.valid = 1.0
        output.SetFromVector(point[:])

    def _contains(self, p_WQ):
        if self._box is None:
            return True
        lower, upper = self._box
        return bool((p_WQ >= lower).all() and (p_WQ <= upper).all())
