"""The track of your own cameras as a CSV table that is written row by row."""

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from drake_tracker.core.messages import KNOT_SPACING, Centroid, Filtered, Prediction, TrackPoint, evaluate_prediction
from drake_tracker.tracking.object_values import ObjectValues
from drake_tracker.vision.image_objects import ImageObjects
from drake_tracker.vision.image_track import TrackState

HORIZON = 0.25
"""Look-ahead [s] of the predictions in the table."""
POINT_COLUMNS = ("stamp", "x", "y", "z", "gap", "valid")
FILTER_COLUMNS = ("filtered_x", "filtered_y", "filtered_z", "filtered_yaw", "predicted_x", "predicted_y", "predicted_z")
OBJECT_COLUMNS = ("id", "state")
_FLUSH_EVERY = 30
"""Number of rows after which the file is flushed to disk."""


class TrackTable:
    """A CSV file with one row for each described image, and the same rows in memory.

    With calibration the columns are: stamp [s]; measured x, y, z [m] in W; gap [m]; valid (0 or 1); filtered x, y, z
    [m] and yaw [rad] at the stamp; predicted x, y, z [m] for the time stamp + `HORIZON`, computed at the stamp; u, v
    [px] of each camera's centroid. Without: stamp, u, v, pixel_count, valid. Then follow id, the number of the object,
    empty until one is confirmed, and state, the name of a `TrackState` in lower case, in memory its number. With two
    cameras, the id is that of the left one, or with several objects that of the pair, and the state the less favourable
    of both. With several objects, there is one row for each object in each image. A missing value is empty in the file
    and NaN in memory.

    Attributes:
        columns: names of the columns.
        rows: rows so far.
    """

    def __init__(self, path: str | Path, sides: Sequence[str], has_points: bool) -> None:
        """Creates the file and writes its header.

        Args:
            path: file to write.
            sides: names of the cameras.
            has_points: whether the cameras are calibrated, so that there are points.
        """
        self._has_points = has_points
        self.columns: tuple[str, ...]
        if has_points:
            self.columns = (*POINT_COLUMNS, *FILTER_COLUMNS, *(f"{side}_{c}" for side in sides for c in "uv"))
        else:
            self.columns = tuple(Centroid.get_fields())
        self.columns += OBJECT_COLUMNS
        self.rows: list[list[float]] = []
        self._file = open(path, "w", newline="", encoding="utf-8")  # noqa: SIM115 - closed by `close`
        self._writer = csv.writer(self._file)
        self._writer.writerow(self.columns)

    def add(self, values: Sequence[ObjectValues], objects: Sequence[ImageObjects | None] = ()) -> bool:
        """Appends the values of the ports, unless they describe no image or that of the previous row.

        Args:
            values: of each object that has ports; the first one has a row for every image, the others where they
                have a number.
            objects: of each camera in the described image, None where an image is missing.

        Returns whether there is a new row.
        """
        first = values[0]
        stamp = float((first.centroids[0] if first.point is None else first.point)[0])
        if stamp == 0.0 or (self.rows and stamp <= self.rows[-1][0]):
            return False
        rows = [
            self._object_row(each, objects, place) for place, each in enumerate(values) if place == 0 or each.number
        ]
        if len(objects) == 1:
            rows += _others(stamp, objects)
        for row in rows:
            self.rows.append(row)
            number, state = row[-2:]
            texts = ["" if np.isnan(value) else _text(value) for value in (*row[:-2], number)]
            self._writer.writerow([*texts, TrackState(round(state)).name.lower()])
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
        if values.point is None or values.filtered is None or values.packet is None:
            row = self._centroid_row(values.centroids[0])
        else:
            row = self._row(values.centroids, values.point, values.filtered, values.packet)
        number, state = _identity(row[self.columns.index("valid")] > 0.0, objects, place)
        if values.number is not None:
            number = float(values.number or np.nan)
        return [*row, number, state]

    @staticmethod
    def _centroid_row(vector: np.ndarray) -> list[float]:
        centroid = Centroid(np.array(vector))
        seen = (centroid.u, centroid.v) if centroid.valid else (np.nan, np.nan)
        return [float(value) for value in (centroid.stamp, *seen, centroid.pixel_count, centroid.valid)]

    @staticmethod
    def _row(
        centroids: Sequence[np.ndarray], vector: np.ndarray, filtered: np.ndarray, packet: np.ndarray
    ) -> list[float]:
        point, state = TrackPoint(np.array(vector)), Filtered(np.array(filtered))
        row = [np.nan] * (len(POINT_COLUMNS) + len(FILTER_COLUMNS))
        row[0], row[5] = point.stamp, point.valid
        if point.valid:
            row[1:4] = point.x, point.y, point.z
        if point.gap:
            row[4] = point.gap
        if state.valid and state.stamp == point.stamp:
            row[6:10] = state.x, state.y, state.z, state.yaw
        header = Prediction(np.array(packet))
        if header.valid and header.stamp == point.stamp and header.spacing == KNOT_SPACING:
            row[10:13] = evaluate_prediction(packet, point.stamp + HORIZON)[:3]
        for centroid in map(Centroid, map(np.array, centroids)):
            row += (centroid.u, centroid.v) if centroid.valid else (np.nan, np.nan)
        return [float(value) for value in row]


def split_objects(data: Mapping[str, np.ndarray]) -> dict[int, dict[str, np.ndarray]]:
    """Returns the rows of each object, {number: columns}; number 0 has the rows without one.

    A track with one row for each image is of one object at a time, and is not divided: all of its rows have number 0.

    Args:
        data: columns of the track, see `TrackTable.data`.
    """
    ids = np.nan_to_num(data["id"]) if "id" in data else np.zeros(len(data["stamp"]))
    if len(np.unique(data["stamp"])) == len(data["stamp"]):
        ids = np.zeros(len(ids))
    return {int(number): {name: column[ids == number] for name, column in data.items()} for number in np.unique(ids)}


def _identity(valid: bool, objects: Sequence[ImageObjects | None], place: int) -> list[float]:
    """Returns number and state of an object; it is less favourable to be lost than hidden, standing, moving."""
    tracks = [None if each is None else each.target(place) for each in objects]
    number = float(tracks[0].number) if tracks and tracks[0] is not None else np.nan
    if all(track is None for track in tracks):
        return [number, float(TrackState.MOVING if valid else TrackState.LOST)]
    order = (TrackState.LOST, TrackState.HIDDEN, TrackState.STANDING, TrackState.MOVING)
    states = [TrackState.LOST if track is None else track.state for track in tracks]
    return [number, float(min(states, key=order.index))]


def _others(stamp: float, objects: Sequence[ImageObjects | None]) -> list[list[float]]:
    """Returns the rows of the second and all further objects in the image of a single camera."""
    rows = []
    for place in range(1, len(objects[0].targets) if objects and objects[0] is not None else 0):
        track = objects[0].target(place) if objects[0] is not None else None
        if track is not None:
            seen = track.seen >= track.stamp
            u, v = track.place.tolist() if seen else (np.nan, np.nan)
            count = float(track.moving) if seen else 0.0
            rows.append([stamp, u, v, count, float(seen), float(track.number), float(track.state)])
    return rows


def _text(value: float) -> str:
    return f"{value:.6f}".rstrip("0").rstrip(".")
