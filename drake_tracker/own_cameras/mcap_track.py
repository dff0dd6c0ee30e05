"""Writes a track as an MCAP file with the message schemas of Foxglove."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from drake_tracker.core.files.mcap_file import McapFile
from drake_tracker.core.messages import Centroid, Filtered, Prediction, TrackPoint, predicted_points
from drake_tracker.own_cameras.own_cameras_diagram import place_suffix
from drake_tracker.own_cameras.preparation import PreparedTrack
from drake_tracker.own_cameras.table import ObjectValues
from drake_tracker.run.mcap_signals import write_sample

MCAP_FILE = "track.mcap"
"""Name of the file in the directory of a track."""
_CIRCLE = 24.0
"""Diameter of the mark round a centroid [px]."""
_AHEAD = np.arange(0.0, 1.01, 0.1)
"""Times [s] after the stamp at which a predicted path in the image is drawn."""
_PIXEL_FIELDS = ("stamp", "u", "v", "direction", "speed")
"""Fields of the filtered state in the image: stamp [s]; pixel [px]; direction of travel [rad]; speed [px/s]."""
_VIEWS = {"point": TrackPoint, "filtered": Filtered, "prediction": Prediction}


class TrackMcap:
    """An MCAP file with images, calibration, frames, points, predicted paths, and numbers for plots.

    The time of every message is the capture time of the described image, so that image, point and path of one moment
    are shown together.

    Args:
        path: file to write.
        track: the track.

    Raises DrakeTrackerError when the extra ``mcap`` is not installed, or the file cannot be written.
    """

    def __init__(self, path: Path, track: PreparedTrack) -> None:
        self._file = McapFile(path)
        self._names = [f"camera_{side}" for side in track.diagram.sides]
        self._in_space = track.diagram.in_space
        self._stamps: dict[str, float] = {}
        for name, camera in zip(self._names, track.cameras):
            size = (camera.width, camera.height)
            self._file.calibration(f"/{name}/calibration", 0.0, name, size, camera.K, camera.distortion)
            self._file.transforms("/tf", 0.0, {name: camera.X_WC})

    def add(self, images: Sequence[tuple[np.ndarray, np.ndarray]], values: Sequence[ObjectValues]) -> None:
        """Writes the news of one cycle; the channels of the second object have ``_2`` in their names.

        Args:
            images: (RGB image, `FrameInfo` vector) of each camera.
            values: of each object.
        """
        for name, (image, (stamp, fresh)) in zip(self._names, images):
            if fresh:
                self._file.image(f"/{name}/image", float(stamp), name, image)
        for place, each in enumerate(values):
            self._add_object(each, place_suffix(place))

    def _add_object(self, values: ObjectValues, suffix: str) -> None:
        for name, vector in zip(self._names, values.centroids):
            centroid = Centroid(np.array(vector))
            if self._add(f"{name}/centroid{suffix}", Centroid.get_fields(), vector) and centroid.valid:
                self._file.pixel(f"/{name}/marks{suffix}", centroid.stamp, centroid.u, centroid.v, _CIRCLE)
        if not self._in_space:
            self._add_pixels(values, suffix)
            return
        for (name, view), signal in zip(_VIEWS.items(), (values.point, values.filtered, values.packet)):
            self._add(f"{name}{suffix}", view.get_fields(), signal)

    def _add_pixels(self, values: ObjectValues, suffix: str) -> None:
        """Writes the filtered and predicted state in the image: numbers, and the predicted path as a line."""
        (camera,) = self._names
        filtered, header = Filtered(np.array(values.filtered)), Prediction(np.array(values.packet))
        row = np.array([filtered.stamp, filtered.x, filtered.y, filtered.yaw, filtered.speed])
        if self._add(f"filtered{suffix}", _PIXEL_FIELDS, row) and header.valid:
            path = predicted_points(values.packet, header.stamp + _AHEAD)[:, :2]
            self._file.line(f"/{camera}/path{suffix}", float(header.stamp), path)

    def close(self) -> None:
        """Completes the file. May be called again."""
        self._file.close()

    def _add(self, name: str, fields: Sequence[str], vector: np.ndarray) -> bool:
        """Writes a signal if it describes a new image; returns whether it does."""
        stamp = float(vector[0])
        if stamp == 0.0 or stamp <= self._stamps.get(name, 0.0):
            return False
        self._stamps[name] = stamp
        write_sample(self._file, name, stamp, fields, np.array(vector))
        return True
