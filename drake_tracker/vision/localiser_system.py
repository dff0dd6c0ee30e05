"""The role of a localiser: from the centroid in each camera to one point in the world, as a Drake System."""

from collections.abc import Iterable
from typing import Protocol

from pydrake.systems.framework import DiagramBuilder, InputPort, OutputPort


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
