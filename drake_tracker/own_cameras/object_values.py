"""The values of the ports of an `OwnCamerasDiagram` in one cycle, object by object."""

from typing import NamedTuple

import numpy as np
from pydrake.systems.framework import Context

from drake_tracker.own_cameras.own_cameras_diagram import OwnCamerasDiagram, place_suffix


class ObjectValues(NamedTuple):
    """What is known of one object.

    Attributes:
        centroids: `Centroid` vector of each camera.
        point: `TrackPoint` vector; without calibration in pixels, like the next two.
        filtered: `Filtered` vector.
        packet: `Prediction` vector.
        number: its identity, 0 without one; None unless several objects are tracked.
    """

    centroids: list[np.ndarray]
    point: np.ndarray
    filtered: np.ndarray
    packet: np.ndarray
    number: int | None = None

    def copied(self) -> "ObjectValues":
        """Returns the values as arrays of their own, which outlive the cycle."""
        point, filtered, packet = (np.array(vector) for vector in (self.point, self.filtered, self.packet))
        return ObjectValues([np.array(each) for each in self.centroids], point, filtered, packet, self.number)


def read_values(diagram: OwnCamerasDiagram, context: Context) -> list[ObjectValues]:
    """Returns the values of each object that has ports of its own.

    Args:
        diagram: the diagram.
        context: of the diagram.
    """

    def read(name: str, place: int) -> np.ndarray:
        vector: np.ndarray = diagram.GetOutputPort(f"{name}{place_suffix(place)}").Eval(context)
        return vector

    values = []
    for place in range(diagram.places):
        centroids = [read(f"centroid_{side}", place) for side in diagram.sides]
        point, filtered, packet = (read(name, place) for name in ("point", "filtered", "prediction"))
        number = int(read("number", place)[0]) if diagram.places > 1 else None
        values.append(ObjectValues(centroids, point, filtered, packet, number))
    return values
