"""Drake System of the faults of measured vision: the effect of faults of images, scene and calibration on the point."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.cameras.triangulation import RayIntersection, triangulate
from drake_tracker.core.messages import TrackPoint, message_size
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.faults.fault import CalibrationFault, Fault, PointFault, Sight, calibrated_with, faults_at
from drake_tracker.vision.triangulator_system import MARGIN, MAX_GAP


class PointFaultsSystem(LeafSystem):
    """Changes the points of measured vision as faults would change the points of cameras.

    The measured point is projected into both calibrated cameras, faults move or remove the two pixels, and the models
    that the controller has of the cameras triangulate them. The calibrated cameras stand for the true ones, since the
    measured error already contains the error of the calibration.

    .. pydrake_system::

        name: PointFaultsSystem
        input_ports:
        - point
        output_ports:
        - point

    Both ports are a `TrackPoint` vector in W [m] of the present cycle. While no fault acts, the output is the input. As
    in `TriangulatorSystem`, the point is invalid when a camera sees nothing, when the two rays pass each other at a
    larger distance than `MAX_GAP`, or when it lies outside the work volume by more than `MARGIN`. There is no state.

    Args:
        faults: all faults of the run.
        cameras: {"left": `CameraModel`, "right": `CameraModel`}, calibrated.
        work_volume: lower and upper corner in W, shape (2, 3) [m].
        period: of a cycle [s].
    """

    def __init__(
        self,
        faults: Sequence[Fault],
        cameras: Mapping[str, CameraModel],
        work_volume: ArrayLike,
        *,
        period: float = VISION_PERIOD,
    ) -> None:
        super().__init__()
        self._faults = faults_at(faults, PointFault)
        self._cameras, self._assumed = dict(cameras), calibrated_with(faults, cameras)
        self._misjudged = bool(faults_at(faults, CalibrationFault))
        lower, upper = np.asarray(work_volume, dtype=float)
        self._box, self._period = (lower - MARGIN, upper + MARGIN), period
        size = message_size(TrackPoint)
        self._input = self.DeclareVectorInputPort("point", size)
        self.DeclareVectorOutputPort("point", size, self._calc_point, {self.time_ticket(), self._input.ticket()})

    def _calc_point(self, context: Context, output: BasicVector) -> None:
        given, time = self._input.Eval(context), context.get_time()
        active = [fault for fault in self._faults if fault.active(time)]
        point = TrackPoint(np.array(given))
        if point.stamp > 0.0 and (active or (self._misjudged and point.valid)):
            p_WQ = np.array([point.x, point.y, point.z]) if point.valid else None
            meeting = self._meeting(active, p_WQ, time)
            point.gap = 0.0 if meeting is None else meeting.gap
            valid = meeting is not None and meeting.gap <= MAX_GAP and self._contains(meeting.p_WQ)
            point.x, point.y, point.z = meeting.p_WQ if meeting is not None and valid else (0.0, 0.0, 0.0)
            point.valid = float(valid)
        output.SetFromVector(point[:])

    def _meeting(self, active: Sequence[PointFault], p_WQ: np.ndarray | None, time: float) -> RayIntersection | None:
        """Returns the pixels of the object in both cameras, or None when one camera does not see it."""
        pixels = []
        for side, model in self._cameras.items():
            uv = None if p_WQ is None else model.project(p_WQ)[0]
            for fault in active:
                if fault.hits(side):
                    uv = fault.centroid(Sight(side, model, time, round(time / self._period), p_WQ, uv))
            if uv is None:
                return None
            pixels.append(uv)
        left, right = (self._assumed[side] for side in self._cameras)
        return triangulate(left, right, *pixels)

    def _contains(self, p_WQ: np.ndarray) -> bool:
        lower, upper = self._box
        return bool((p_WQ >= lower).all() and (p_WQ <= upper).all())
