"""The track of your own cameras as a CSV table that is written row by row."""

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from pydrake.systems.framework import Context

from drake_tracker.core.messages import KNOT_SPACING, Centroid, Filtered, Prediction, TrackPoint, evaluate_prediction
from drake_tracker.own_cameras.own_cameras_diagram import OwnCamerasDiagram, place_suffix
from drake_tracker.vision.image_tracks.image_objects import ImageObjects
from drake_tracker.vision.image_tracks.track_2d import TrackState2D

HORIZON = 0.25
"""Look-ahead [s] of the predictions in the table."""
POINT_COLUMNS = ("stamp", "x", "y", "z", "gap", "valid")
FILTER_COLUMNS = ("filtered_x", "filtered_y", "filtered_z", "filtered_yaw", "predicted_x", "predicted_y", "predicted_z")
PIXEL_COLUMNS = tuple(Centroid.get_fields())
PIXEL_FILTER_COLUMNS = ("filtered_u", "filtered_v", "predicted_u", "predicted_v")
OBJECT_COLUMNS = ("id", "state")
_FLUSH_EVERY = 30
"""Number of rows after which the file is flushed to disk."""


class ObjectValues(NamedTuple):
    """Values of one object.

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


class TrackTable:
    """A CSV file with one row for each described image, and the same rows in memory.

    With calibration the columns are: stamp [s]; measured x, y, z [m] in W; gap [m]; valid (0 or 1); filtered x, y, z
    [m] and yaw [rad] at the stamp; predicted x, y, z [m] for the time stamp + `HORIZON`, computed at the stamp; u, v
    [px] of each camera's centroid. Without: stamp, u, v, pixel_count, valid; filtered u, v and predicted u, v [px], as
    above. Then follow id, the number of the object, empty until one is confirmed, and state, a `TrackState2D` by name
    in lower case, in memory its number. With two cameras, the id is the number in the left camera, or with several
    objects the number of the pair; the state is the less favourable state of both cameras. With several objects, there
    is one row for each object in each image. A missing value is empty in the file and NaN in memory.

    Attributes:
        columns: names of the columns.
        rows: rows so far.
    """

    def __init__(self, path: str | Path, sides: Sequence[str], in_space: bool) -> None:
        """Creates the file and writes its header.

        Args:
            path: file to write.
            sides: names of the cameras.
            in_space: whether the points are in W [m], and not in the image of a single camera [px].
        """
        self._in_space = in_space
        self.columns: tuple[str, ...] = (*PIXEL_COLUMNS, *PIXEL_FILTER_COLUMNS)
        if in_space:
            self.columns = (*POINT_COLUMNS, *FILTER_COLUMNS, *(f"{side}_{c}" for side in sides for c in "uv"))
        self.columns += OBJECT_COLUMNS
        self.rows: list[list[float]] = []
        self._file = open(path, "w", newline="", encoding="utf-8")  # noqa: SIM115 - closed by `close`
        self._writer = csv.writer(self._file)
        self._writer.writerow(self.columns)

    def add(self, values: Sequence[ObjectValues], objects: Sequence[ImageObjects | None] = ()) -> bool:
        """Appends the values of the ports if they describe a new image.

        Args:
            values: of each object that has ports; the first one has a row for every image, the others where they
                have a number.
            objects: of each camera in the described image, None where an image is missing.

        Returns whether there is a new row.
        """
        stamp = float(values[0].point[0])
        if stamp == 0.0 or (self.rows and stamp <= self.rows[-1][0]):
            return False
        rows = [
            self._object_row(each, objects, place) for place, each in enumerate(values) if place == 0 or each.number
        ]
        for row in rows:
            self.rows.append(row)
            number, state = row[-2:]
            texts = ["" if np.isnan(value) else _text(value) for value in (*row[:-2], number)]
            self._writer.writerow([*texts, TrackState2D(round(state)).name.lower()])
            if len(self.rows) % _FLUSH_EVERY == 0:
                self._file.flush()
        return True

    def close(self) -> None:
        """Closes the file. May be called again."""
        self._file.close()

    def data(self) -> dict[str, np.ndarray]:
        """Returns all rows as {column: array of shape (n,)}."""
        return dict(zip(self.columns, np.array(self.rows, dtype=float).reshape(-1, len(self.columns)).T))

    def _object_row(self, values: ObjectValues, objects: Sequence[ImageObjects | None], place: int) -> list[float]:
        """Returns the row of an object."""
        row = self._space_row(values) if self._in_space else self._pixel_row(values)
        number, state = _identity(row[self.columns.index("valid")] > 0.0, objects, place)
        if values.number is not None:
            number = float(values.number or np.nan)
        return [*row, number, state]

    @staticmethod
    def _pixel_row(values: ObjectValues) -> list[float]:
        centroid = Centroid(np.array(values.centroids[0]))
        seen = (centroid.u, centroid.v) if centroid.valid else (np.nan, np.nan)
        filtered, predicted = _filter_results(values)
        row = (centroid.stamp, *seen, centroid.pixel_count, centroid.valid, *filtered[:2], *predicted[:2])
        return [float(value) for value in row]

    @staticmethod
    def _space_row(values: ObjectValues) -> list[float]:
        point = TrackPoint(np.array(values.point))
        row = [point.stamp, *([np.nan] * 4), point.valid]
        if point.valid:
            row[1:4] = point.x, point.y, point.z
        if point.gap:
            row[4] = point.gap
        filtered, predicted = _filter_results(values)
        row += [*filtered, *predicted]
        for centroid in map(Centroid, map(np.array, values.centroids)):
            row += (centroid.u, centroid.v) if centroid.valid else (np.nan, np.nan)
        return [float(value) for value in row]


def _filter_results(values: ObjectValues) -> tuple[np.ndarray, np.ndarray]:
    """Returns (filtered x, y, z and yaw at the stamp of the point, x, y, z predicted for `HORIZON` later) of an object,
    NaN where there is none."""
    filtered, predicted = np.full(4, np.nan), np.full(3, np.nan)
    stamp, state, header = values.point[0], Filtered(np.array(values.filtered)), Prediction(np.array(values.packet))
    if state.valid and state.stamp == stamp:
        filtered[:] = state.x, state.y, state.z, state.yaw
    if header.valid and header.stamp == stamp and header.spacing == KNOT_SPACING:
        predicted[:] = evaluate_prediction(values.packet, stamp + HORIZON)[:3]
    return filtered, predicted


def axes_of(data: Mapping[str, np.ndarray]) -> tuple[tuple[str, ...], str]:
    """Returns (the columns of the measured point, their unit): x, y, z in "m", or u, v in "px" without calibration.

    Args:
        data: columns of the track, see `TrackTable.data`.
    """
    return (("x", "y", "z"), "m") if "x" in data else (("u", "v"), "px")


def split_objects(data: Mapping[str, np.ndarray]) -> dict[int, dict[str, np.ndarray]]:
    """Returns the rows of each object, {number: columns}; number 0 has the rows without one.

    A track with one row for each image, or without rows, is not divided: all of its rows have number 0.

    Args:
        data: columns of the track, see `TrackTable.data`.
    """
    ids = np.nan_to_num(data["id"]) if "id" in data else np.zeros(len(data["stamp"]))
    if len(np.unique(data["stamp"])) == len(data["stamp"]):
        ids = np.zeros(len(ids))
    numbers = np.unique(ids) if len(ids) else [0.0]
    return {int(number): {name: column[ids == number] for name, column in data.items()} for number in numbers}


def _identity(valid: bool, objects: Sequence[ImageObjects | None], place: int) -> list[float]:
    """Returns number and state of an object; it is less favourable to be lost than hidden, standing, moving."""
    tracks = [None if each is None else each.target(place) for each in objects]
    number = float(tracks[0].number) if tracks and tracks[0] is not None else np.nan
    if all(track is None for track in tracks):
        return [number, float(TrackState2D.MOVING if valid else TrackState2D.LOST)]
    order = (TrackState2D.LOST, TrackState2D.HIDDEN, TrackState2D.STANDING, TrackState2D.MOVING)
    states = [TrackState2D.LOST if track is None else track.state for track in tracks]
    return [number, float(min(states, key=order.index))]


def _text(value: float) -> str:
    return f"{value:.6f}".rstrip("0").rstrip(".")


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
