"""The track of one's own cameras as a table that grows while it is being made."""

import csv

import numpy as np

from drake_tracker.core.messages import KNOT_SPACING, Centroid, Prediction, TrackPoint, evaluate_prediction

HORIZON = 0.25
"""How far ahead of its stamp [s] a prediction in the table is."""
POINT_COLUMNS = ("stamp", "x", "y", "z", "gap", "valid")
FILTER_COLUMNS = ("filtered_x", "filtered_y", "filtered_z", "filtered_yaw", "predicted_x", "predicted_y", "predicted_z")
_FLUSH_EVERY = 30
"""Rows after which what has been written is sure to be on disk."""


class TrackTable:
    """A CSV file with one row for each image described, and the same rows in memory as ``rows``.

    With points: stamp [s], x, y, z [m] in W, gap [m], valid (0 or 1); the filtered x, y, z [m] and yaw [rad] at the
    stamp; predicted x, y, z [m] at stamp + `HORIZON`, as foreseen at the stamp; u, v [px] of each camera's centroid.
    Without: stamp, u, v, pixel_count, valid. What there is not is empty in the file and NaN in memory.

    Args:
        path: file to write. sides: names of the cameras. has_points: whether there are points.
    """

    def __init__(self, path, sides, has_points):
        self._has_points = has_points
        if has_points:
            self.columns = (*POINT_COLUMNS, *FILTER_COLUMNS, *(f"{side}_{c}" for side in sides for c in "uv"))
        else:
            self.columns = tuple(Centroid.get_fields())
        self.rows = []
        self._file = open(path, "w", newline="", encoding="utf-8")
        self._writer = csv.writer(self._file)
        self._writer.writerow(self.columns)

    def add(self, centroids, point=None, filtered=None, packet=None):
        """Appends what the ports show, unless it is of the image of the row before, or of none.

        Args:
            centroids: `Centroid` vectors, one for each camera. point: a `TrackPoint` vector. filtered: a `Filtered`
            vector. packet: a `Prediction` vector.

        Returns whether there is a new row.
        """
        stamp = float((centroids[0] if point is None else point)[0])
        if stamp == 0.0 or (self.rows and stamp <= self.rows[-1][0]):
            return False
        row = self._centroid_row(centroids[0]) if point is None else self._row(centroids, point, filtered, packet)
        self.rows.append(row)
        self._writer.writerow(["" if np.isnan(value) else _text(value) for value in row])
        if len(self.rows) % _FLUSH_EVERY == 0:
            self._file.flush()
        return True

    def close(self):
        """Writes what is left. May be called again."""
        self._file.close()

    def data(self):
        """Returns all rows as {column: (n,)}."""
        return dict(zip(self.columns, np.array(self.rows, dtype=float).reshape(-1, len(self.columns)).T))

    @staticmethod
    def _centroid_row(centroid):
        centroid = Centroid(np.array(centroid))
        seen = (centroid.u, centroid.v) if centroid.valid else (np.nan, np.nan)
        return [float(value) for value in (centroid.stamp, *seen, centroid.pixel_count, centroid.valid)]

    @staticmethod
    def _row(centroids, point, filtered, packet):
        point = TrackPoint(np.array(point))
        row = [np.nan] * (len(POINT_COLUMNS) + len(FILTER_COLUMNS))
        row[0], row[5] = point.stamp, point.valid
        if point.valid:
            row[1:4] = point.x, point.y, point.z
        if point.gap:
            row[4] = point.gap
        if filtered[-1] and filtered[0] == point.stamp:
            row[6:10] = filtered[1:5]
        header = Prediction(np.array(packet))
        if header.valid and header.stamp == point.stamp and header.spacing == KNOT_SPACING:
            row[10:13] = evaluate_prediction(packet, point.stamp + HORIZON)[:3]
        for centroid in map(Centroid, map(np.array, centroids)):
            row += (centroid.u, centroid.v) if centroid.valid else (np.nan, np.nan)
        return [float(value) for value in row]


def _text(value):
    return f"{value:.6f}".rstrip("0").rstrip(".")
