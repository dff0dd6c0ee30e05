"""The triangulator as a Drake System: two centroids in, one 3-D point out."""

from collections.abc import Iterable, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike
from pydrake.geometry import SceneGraph
from pydrake.systems.framework import BasicVector, Context, DiagramBuilder, InputPort, LeafSystem, OutputPort
from pydrake.systems.sensors import RgbdSensor

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.cameras.triangulation import triangulate
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.messages import Centroid, TrackPoint, message_size
from drake_tracker.vision.region_of_interest import check_box

STAMP_TOLERANCE = 1e-9
"""Stamps that differ by less [s] belong to the same instant: both come from one 60 Hz clock."""
MAX_GAP = 0.03
"""Two rays that pass each other at a larger distance [m] are not of one point."""
LEAST_DISTANCE = 1e-3
"""Least distance of two cameras [m]."""
_OTHER_FOCAL_LENGTH = 0.1
"""Relative difference of focal lengths from which on a camera is not that of its sensor; a calibration errs by less."""
_NEAR = 0.1
"""Sum of the distances of two sensors from two calibrated cameras [m] below which they are the same cameras."""
MARGIN = 0.05
"""A point may lie outside the work volume by this much [m]."""


class TriangulatorSystem(LeafSystem):
    """Intersects the rays of two motion centroids (Allen et al. 1991, section 3.1, last paragraphs); a `Localiser`.

    .. pydrake_system::

        name: TriangulatorSystem
        input_ports:
        - centroid_left
        - centroid_right
        output_ports:
        - point

    Both inputs are `Centroid` vectors [px]; the output ``point`` is a `TrackPoint` vector in W [m]. There is no state
    and no period: the output follows the inputs at once. The point is invalid when

    - either centroid is invalid,
    - their stamps differ by more than ``stamp_tolerance``,
    - the rays do not meet, or pass each other at more than ``max_gap``, or
    - it lies outside the work volume by more than ``margin``.

    A valid point has the mean of both stamps. An invalid point has the newer of the two stamps, the gap if the rays
    meet, and zeros otherwise. The output is all zeros while both inputs are all zeros.

    Args:
        camera_left: calibrated camera of ``centroid_left``.
        camera_right: calibrated camera of ``centroid_right``.
        max_gap: largest distance between the two rays [m].
        work_volume: lower and upper corner in W, shape (2, 3) [m]; None accepts points anywhere.
        margin: by which a point may lie outside the work volume [m].
        stamp_tolerance: largest difference of the stamps [s]; larger for cameras that are not synchronised.

    Raises DrakeTrackerError when the work volume is not a box, or both cameras are at one place.
    """

    def __init__(
        self,
        camera_left: CameraModel,
        camera_right: CameraModel,
        *,
        max_gap: float = MAX_GAP,
        work_volume: ArrayLike | None = None,
        margin: float = MARGIN,
        stamp_tolerance: float = STAMP_TOLERANCE,
    ) -> None:
        super().__init__()
        apart = float(np.linalg.norm(camera_left.X_WC[:3, 3] - camera_right.X_WC[:3, 3]))
        if apart < LEAST_DISTANCE:
            raise DrakeTrackerError(f"the two cameras are {1e3 * apart:.2g} mm apart; their rays do not fix a depth")
        self._cameras = (camera_left, camera_right)
        self._max_gap = float(max_gap)
        self._stamp_tolerance = float(stamp_tolerance)
        self._box = None
        if work_volume is not None:
            lower, upper = check_box(work_volume)
            self._box = (lower - margin, upper + margin)
        self._left = self.DeclareVectorInputPort("centroid_left", message_size(Centroid))
        self._right = self.DeclareVectorInputPort("centroid_right", message_size(Centroid))
        self._point = self.DeclareVectorOutputPort(
            "point",
            message_size(TrackPoint),
            self._calc_point,
            {self._left.ticket(), self._right.ticket()},
        )

    @property
    def centroid_ports(self) -> tuple[InputPort, ...]:
        """The inputs ``centroid_left`` and ``centroid_right``."""
        return self._left, self._right

    @property
    def point_port(self) -> OutputPort:
        """The output ``point``."""
        return self._point

    def _calc_point(self, context: Context, output: BasicVector) -> None:
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

    def _contains(self, p_WQ: np.ndarray) -> bool:
        if self._box is None:
            return True
        lower, upper = self._box
        return bool((p_WQ >= lower).all() and (p_WQ <= upper).all())


def add_triangulator(
    builder: DiagramBuilder,
    *,
    cameras: Sequence[CameraModel],
    centroids: Sequence[OutputPort] = (),
    work_volume: ArrayLike | None = None,
    max_gap: float = MAX_GAP,
    margin: float = MARGIN,
    stamp_tolerance: float = STAMP_TOLERANCE,
    name: str = "triangulator",
) -> TriangulatorSystem:
    """Adds a `TriangulatorSystem` and connects the centroids of its two cameras.

    It has no period and no offset: its output follows its inputs at once.

    Args:
        builder: of the diagram.
        cameras: the two calibrated cameras, first left, then right.
        centroids: output ports with a `Centroid` vector, in the order of the cameras; empty connects nothing.
        work_volume: lower and upper corner in W, shape (2, 3) [m]; None accepts points anywhere.
        max_gap: largest distance between the two rays [m].
        margin: by which a point may lie outside the work volume [m].
        stamp_tolerance: largest difference of the stamps [s].
        name: of the System.

    Raises DrakeTrackerError when the work volume is not a box, when there are not two cameras and two centroids, or
    when the centroids come from sensors of this diagram that contradict the cameras: in another order, or of another
    size.
    """
    if len(cameras) != 2 or len(centroids) not in (0, 2):
        raise DrakeTrackerError(
            f"{name}: {len(cameras)} cameras and {len(centroids)} centroids; a triangulator has two of each"
            + ("; for one camera and a plane there is add_plane_projector" if len(cameras) == 1 else "")
        )
    _check_sensors(builder, cameras, centroids, name)
    system: TriangulatorSystem = builder.AddNamedSystem(
        name,
        TriangulatorSystem(
            *cameras, max_gap=max_gap, work_volume=work_volume, margin=margin, stamp_tolerance=stamp_tolerance
        ),
    )
    connect_centroids(builder, centroids, system)
    return system


def _check_sensors(
    builder: DiagramBuilder, cameras: Sequence[CameraModel], centroids: Sequence[OutputPort], name: str
) -> None:
    """Raises DrakeTrackerError when centroids come from `RgbdSensor` Systems that contradict the cameras."""
    sensors = [_sensor_of(builder, port) for port in centroids]
    for k, (camera, sensor) in enumerate(zip(cameras, sensors)):
        if sensor is None:
            continue
        info = sensor.default_color_render_camera().core().intrinsics()
        # The images may be a part of the camera's; their focal length is the same.
        larger = info.width() > camera.width or info.height() > camera.height
        if larger or abs(info.focal_x() / camera.focal_lengths[0] - 1.0) > _OTHER_FOCAL_LENGTH:
            raise DrakeTrackerError(
                f"{name}: cameras[{k}] has {camera.width} x {camera.height} px and a focal length of "
                f"{camera.focal_lengths[0]:.0f} px, and the sensor {sensor.get_name()} of its centroid {info.width()} "
                f"x {info.height()} px and {info.focal_x():.0f} px"
            )
    if len(sensors) != 2 or any(
        each is None or each.default_parent_frame_id() != SceneGraph.world_frame_id() for each in sensors
    ):
        return
    seen = [
        (each.default_X_PB() @ each.default_color_render_camera().core().sensor_pose_in_camera_body()).translation()
        for each in sensors
        if each is not None
    ]
    known = [camera.X_WC[:3, 3] for camera in cameras]
    as_given, exchanged = (
        sum(float(np.linalg.norm(p - q)) for p, q in zip(seen, order)) for order in (known, known[::-1])
    )
    if exchanged < _NEAR and exchanged < as_given:
        raise DrakeTrackerError(
            f"{name}: the cameras are in another order than the centroids, which come from the sensors "
            f"{' and '.join(each.get_name() for each in sensors if each is not None)}"
        )


def _sensor_of(builder: DiagramBuilder, port: OutputPort) -> RgbdSensor | None:
    """Returns the only `RgbdSensor` from whose images the value of a port is computed, None if there is no such one."""
    sources: dict[Any, set[Any]] = {}
    for (system, _), (source, _) in builder.connection_map().items():
        sources.setdefault(system, set()).add(source)
    found, known = [port.get_system()], set()
    for system in found:
        if system not in known:
            known.add(system)
            if not isinstance(system, RgbdSensor):
                found += sources.get(system, ())
    sensors = [system for system in known if isinstance(system, RgbdSensor)]
    return sensors[0] if len(sensors) == 1 else None


class Localiser(Protocol):
    """A System that turns centroids into a point: `TriangulatorSystem`, `PlaneProjectorSystem`, or your own.

    A custom localiser is a Drake System with these two properties; it need not derive from this class.
    """

    @property
    def centroid_ports(self) -> tuple[InputPort, ...]:
        """The input ports for a `Centroid` vector each, one per camera, in the order of the cameras."""
        ...

    @property
    def point_port(self) -> OutputPort:
        """The output port with a `TrackPoint` vector, p_WQ [m]: invalid, never absent, when there is no point."""
        ...


def connect_centroids(builder: DiagramBuilder, centroids: Iterable[OutputPort], localiser: Localiser) -> None:
    """Connects output ports with a `Centroid` each to the inputs of a localiser, in the order of its cameras."""
    for centroid, port in zip(centroids, localiser.centroid_ports):
        builder.Connect(centroid, port)
