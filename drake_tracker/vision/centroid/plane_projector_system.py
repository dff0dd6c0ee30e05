"""The plane projector as a Drake System: one centroid in, one 3-D point out."""

from dataclasses import dataclass
from operator import attrgetter

import numpy as np
from numpy.typing import ArrayLike
from pydrake.common.value import AbstractValue
from pydrake.math import RigidTransform
from pydrake.systems.framework import BasicVector, Context, DiagramBuilder, InputPort, LeafSystem, OutputPort, State

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.core.frozen_state import FrozenState, declare_outputs, read_only
from drake_tracker.core.messages import Centroid, TrackPoint, message_size
from drake_tracker.core.timing import PROJECTOR_SLOT, VISION_PERIOD, vision_slot
from drake_tracker.vision.centroid.plane_projection import EveryPoint, LastPoint, PointFilter, project_to_plane
from drake_tracker.vision.triangulator_system import connect_centroids


@dataclass(frozen=True, eq=False)
class _Memory(FrozenState):
    """The last accepted point and the newest `TrackPoint` vector, read-only."""

    last: LastPoint
    point: np.ndarray


class _SingleCameraLocaliser(LeafSystem):
    """Base of the Systems that turn the ``centroid`` of one camera into a ``point``, a `Localiser`."""

    def __init__(self) -> None:
        super().__init__()
        self._centroid = self.DeclareVectorInputPort("centroid", message_size(Centroid))

    @property
    def centroid_ports(self) -> tuple[InputPort, ...]:
        """The input ``centroid``."""
        return (self._centroid,)

    @property
    def point_port(self) -> OutputPort:
        """The output ``point``."""
        return self.GetOutputPort("point")


class PlaneProjectorSystem(_SingleCameraLocaliser):
    """Intersects the ray of a centroid with the plane of the ball's centre (Nashman and Chaconas 1990, section 5).

    .. pydrake_system::

        name: PlaneProjectorSystem
        input_ports:
        - centroid
        output_ports:
        - point

    A `Localiser` for one camera. ``centroid`` is a `Centroid` vector [px], ``point`` a `TrackPoint` vector in W [m], of
    the ball's centre, with the same stamp and no gap: there is only one ray. It is invalid, with zeros beside its
    stamp, when the centroid is invalid, when its ray does not meet the plane, and when the point is rejected; it is all
    zeros before the first centroid. The input is read in an unrestricted update every ``period`` at ``offset``, by
    default after the centroid's delay line and before the estimator. A centroid that is no newer than the last one
    changes nothing.

    Args:
        camera: in the frame B of the board, or of any plane z_B = const.
        X_WB: (4, 4), takes p_BQ to p_WQ [m].
        height: of the centroid above the plane z_B = 0, along its normal [m].
        plausible: `PointFilter` that rejects outliers.
        period: of the update [s].
        offset: of the update [s].
    """

    def __init__(
        self,
        camera: CameraModel,
        X_WB: ArrayLike,
        height: float,
        plausible: PointFilter,
        *,
        period: float = VISION_PERIOD,
        offset: float = vision_slot(PROJECTOR_SLOT),
    ) -> None:
        super().__init__()
        self._camera, self._plausible = camera, plausible
        self._X_WB = np.array(X_WB, dtype=float)
        self._z = float(height)
        blank = _Memory(LastPoint(), read_only(np.zeros(message_size(TrackPoint))))
        self._memory = self.DeclareAbstractState(AbstractValue.Make(blank))
        declare_outputs(self, self._memory, {"point": (TrackPoint, attrgetter("point"))})
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, offset, self._update)

    def _update(self, context: Context, state: State) -> None:
        memory = context.get_abstract_state(self._memory).get_value()
        centroid = Centroid(self._centroid.Eval(context))
        point = TrackPoint(np.zeros(message_size(TrackPoint)))
        if centroid.stamp <= TrackPoint(memory.point).stamp:
            return
        point.stamp = centroid.stamp
        last = memory.last
        if centroid.valid:
            p_BQ = project_to_plane(self._camera, (centroid.u, centroid.v), self._z)
            if p_BQ is not None:
                accepted, last = self._plausible.judge(last, centroid.stamp, p_BQ)
                if accepted:
                    point.x, point.y, point.z = self._X_WB[:3, :3] @ p_BQ + self._X_WB[:3, 3]
                    point.valid = 1.0
        state.get_mutable_abstract_state(self._memory).set_value(_Memory(last, read_only(point[:])))


def add_plane_projector(
    builder: DiagramBuilder,
    *,
    camera: CameraModel,
    centroid: OutputPort | None = None,
    X_WP: RigidTransform | None = None,
    height: float = 0.0,
    plausible: PointFilter = EveryPoint(),
    period: float = VISION_PERIOD,
    offset: float = vision_slot(PROJECTOR_SLOT),
    name: str = "projector",
) -> PlaneProjectorSystem:
    """Adds a `PlaneProjectorSystem` for something that moves in a known plane, and connects the camera's centroid.

    Args:
        builder: of the diagram.
        camera: calibrated camera in W.
        centroid: output port with a `Centroid` vector; None connects nothing.
        X_WP: pose of the plane's frame P, whose z is the plane's normal; None is z_W = 0.
        height: of the moving centroid above the plane [m].
        plausible: `PointFilter` that rejects outliers.
        period: of the update [s].
        offset: of the update [s]; after the update of the centroid, before the update of the estimator.
        name: of the System.
    """
    X_WP = (X_WP or RigidTransform()).GetAsMatrix4()
    on_plane = camera.in_frame(X_WP)
    system: PlaneProjectorSystem = builder.AddNamedSystem(
        name, PlaneProjectorSystem(on_plane, X_WP, height, plausible, period=period, offset=offset)
    )
    connect_centroids(builder, () if centroid is None else (centroid,), system)
    return system


class PixelPointSystem(_SingleCameraLocaliser):
    """Outputs a centroid as a point whose unit of length is the pixel, so that it can be filtered like any other.

    .. pydrake_system::

        name: PixelPointSystem
        input_ports:
        - centroid
        output_ports:
        - point

    A `Localiser` for one camera that is not calibrated. ``centroid`` is a `Centroid` vector [px], and ``point`` a
    `TrackPoint` vector with x = u, y = v and z = 0 [px], the same stamp and no gap. When the centroid is invalid, so is
    the point, with zeros beside its stamp. There is no state: ``point`` belongs to the present ``centroid``.
    """

    def __init__(self) -> None:
        super().__init__()
        self.DeclareVectorOutputPort("point", message_size(TrackPoint), self._calc_point)

    def _calc_point(self, context: Context, output: BasicVector) -> None:
        centroid = Centroid(self._centroid.Eval(context))
        u, v = (centroid.u, centroid.v) if centroid.valid else (0.0, 0.0)
        output.SetFromVector([centroid.stamp, u, v, 0.0, 0.0, centroid.valid])
