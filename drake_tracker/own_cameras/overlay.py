"""A video of your own cameras' images, with the measured and predicted motion drawn into them."""

from collections import deque
from collections.abc import Callable, Sequence
from math import ceil
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.core.messages import Centroid, Prediction, TrackPoint, predicted_points
from drake_tracker.core.processes.worker_thread import WorkerThread
from drake_tracker.own_cameras.table import ObjectValues
from drake_tracker.run.video_file import VideoFile
from drake_tracker.tasks.style import bgr, draw_text
from drake_tracker.vision.image_tracks.image_objects import ImageObjects
from drake_tracker.vision.image_tracks.reidentification import CONFIRM_AFTER
from drake_tracker.vision.image_tracks.track_2d import TrackState2D

_WIDEST, _TALLEST = 640, 480
"""Greatest size of a panel [px]."""
_BAND, _BETWEEN = 36, 4
_ENERGY, _BRIGHT, _DIM, _GROUND = "#ffb000", "#f2f4f6", "#a3abb5", "#15181c"
_AHEAD = np.arange(0.0, 1.01, 0.1)
"""Times [s] after the stamp at which the predicted path is evaluated."""
_STALE = 0.3
"""Age from which on the path of one of several objects is not drawn [s]."""
_GAP_LINE, _POINT_LINE, _PIXEL_LINE = 385, 264, 200
"""Widths of the text for one object below the images [px]: for a point with a gap, for a point, for a pixel."""
_WAITING = 4
"""Largest number of images that wait for being drawn and encoded."""
_Project = Callable[[np.ndarray], np.ndarray]
_SHIFT = 4
"""Fractional bits of the coordinates passed to OpenCV."""
COLOURS = ("#4cc2ff", "#7ee081", "#ff8fa3", "#c9a2ff", "#ffd166")
"""Colours of objects that are reported, by their number."""
OTHER = "#a3abb5"
"""Colour of all others."""
PATH = "#4cc2ff"
"""Colour of the path of a single object."""
SHOWN = 0.5
"""Time for which a leap is written into the video [s]."""


class TrackOverlay:
    """A video with one frame for each image that a centroid describes, drawn and encoded in a thread.

    Attributes:
        size: (width, height) of the video [px].
    """

    def __init__(
        self,
        path: Path | None,
        period: float,
        sizes: Sequence[tuple[int, int]],
        age_cycles: float,
        cameras: Sequence[CameraModel] = (),
        onlooker: Any = None,
        *,
        live: bool = False,
    ) -> None:
        """Opens the video.

        Args:
            path: MP4 file to write; None writes none.
            period: period of the images [s].
            sizes: (width, height) of each camera's images [px].
            age_cycles: cycles from the described image to the newest one.
            cameras: calibration of each camera, to project predictions; empty for predictions in pixels.
            onlooker: a sink of frames, such as that of the live view, which also gets each frame that it wants.
            live: whether the cameras are live. Cycles without an image are then not drawn: while the computer is
                behind, drawing them would make it drop more images.
        """
        self._onlooker, self._live = onlooker, live
        self._in_space = bool(cameras)
        self._projections: list[_Project] = [camera.project for camera in cameras] or [_same_pixels]
        self._scales = [min(1.0, _WIDEST / width, _TALLEST / height) for width, height in sizes]
        self._panels = [(round(s * width), round(s * height)) for s, (width, height) in zip(self._scales, sizes)]
        width = sum(panel[0] for panel in self._panels) + _BETWEEN * (len(sizes) - 1)
        height = max(panel[1] for panel in self._panels) + _BAND
        self.size = (width + width % 2, height + height % 2)
        self._images: deque[list[tuple[np.ndarray, float, float]]] = deque()
        self._kept = ceil(age_cycles) + 1
        self._ground = np.full((*self.size[::-1], 3), bgr(_GROUND), np.uint8)
        self._video = None if path is None else VideoFile(path, max(1, round(1.0 / period)), self.size, 1)
        self._background = WorkerThread(self._draw, _WAITING)

    def add(
        self,
        images: Sequence[tuple[np.ndarray, np.ndarray]],
        masks: Sequence[np.ndarray | None],
        objects: Sequence[ImageObjects | None],
        values: Sequence[ObjectValues],
    ) -> None:
        """Takes the values of the ports in one cycle; draws the earlier image that they describe.

        Args:
            images: (RGB image, `FrameInfo` vector) of each camera.
            masks: moving pixels in the described image of each camera, None where there is none.
            objects: the objects in it, None where there are none.
            values: of each object.
        """
        self._images.append([(image, frame[0], frame[1]) for image, frame in images])
        if len(self._images) > self._kept:
            self._background.put((self._images.popleft(), masks, objects, [each.copied() for each in values]))

    def _draw(self, values: tuple[Any, ...]) -> None:
        """Draws one image and appends it to the video."""
        watched = self._onlooker is not None and self._onlooker.wanted
        if self._video is None and not watched:
            return
        seen, masks, objects, found = values
        if self._live and not any(fresh for _, _, fresh in seen):
            if self._video is not None:
                self._video.skip()
            return
        page = self._ground.copy()
        x = 0
        for k, (panel, scale, (image, _, fresh)) in enumerate(zip(self._panels, self._scales, seen)):
            view = page[: panel[1], x : x + panel[0]]
            small = image if scale == 1.0 else cv2.resize(image, panel, interpolation=cv2.INTER_AREA)
            cv2.cvtColor(small, cv2.COLOR_RGB2BGR, dst=view)
            if masks[k] is not None:
                _tint(view, masks[k])
            for each in found:
                if not _is_stale(each):
                    _draw_path(view, self._projections[k], each.packet, scale, colour_of(each.number))
            for each in found:
                centroid = Centroid(each.centroids[k])
                if centroid.valid:
                    _draw_cross(view, centroid, scale)
            known = objects[k]
            marks = [] if known is None else draw_objects(view, known, scale)
            for line, mark in enumerate(marks):
                draw_text(view, mark, 10, 24 + 20 * (line + (not fresh)), 15, _ENERGY, bold=True)
            if not fresh:
                draw_text(view, "no image", 10, 24, 15, _ENERGY, bold=True)
            x += panel[0] + _BETWEEN
        draw_text(page, f"{seen[0][1]:.2f} s", 12, self.size[1] - 12, 15, _BRIGHT, bold=True, numbers=True)
        self._write_line(page, found, objects[0])
        if self._video is not None:
            self._video.write(page)
        if watched:
            self._onlooker.write(page, None)

    def _write_line(self, page: np.ndarray, found: Sequence[ObjectValues], known: ImageObjects | None) -> None:
        """Writes the line of text below the images, in place: the place of each object that fits.

        ``known`` are the objects in the first camera's image.
        """
        left, width = 110, _PIXEL_LINE
        if self._in_space:
            width = _POINT_LINE if len(self._panels) == 1 else _GAP_LINE
        for place, each in enumerate(found):
            if each.number == 0 and len(found) > 1:
                continue
            colour = _DIM if each.number is None else colour_of(each.number)
            name = "" if each.number is None else f"{each.number}:  "
            hidden = known is not None and is_hidden(known, place)
            words = _describe_point(each) if self._in_space else _describe_pixel(each, hidden)
            draw_text(page, name + words, left, self.size[1] - 12, 15, colour, numbers=True)
            left += width
            if left + width > self.size[0]:
                break

    def panels(self) -> list[tuple[int, int, int, int]]:
        """Returns the place (x, y, width, height) [px] of each camera's image in a frame."""
        lefts = [sum(panel[0] + _BETWEEN for panel in self._panels[:k]) for k in range(len(self._panels))]
        return [(left, 0, *panel) for left, panel in zip(lefts, self._panels)]

    def close(self) -> None:
        """Completes the video file. Raises DrakeTrackerError when an image could not be written."""
        try:
            self._background.close()
        finally:
            if self._video is not None:
                self._video.close()


def _tint(view: np.ndarray, mask: np.ndarray) -> None:
    """Colours the moving pixels of a panel, in place."""
    if mask.size <= 1 or not cv2.hasNonZero(mask):
        return
    moving = mask
    if mask.shape != view.shape[:2]:
        moving = cv2.resize(mask, view.shape[1::-1], interpolation=cv2.INTER_NEAREST)
    x, y, width, height = cv2.boundingRect(moving)
    part = view[y : y + height, x : x + width]
    tinted = cv2.addWeighted(part, 0.35, np.full_like(part, bgr(_ENERGY)), 0.65, 0.0)
    cv2.copyTo(tinted, moving[y : y + height, x : x + width], part)


def _same_pixels(points: np.ndarray) -> np.ndarray:
    """Returns the pixels (n, 2) of points (n, 3) that are in pixels themselves, (u, v, 0)."""
    return points[:, :2]


def _draw_path(view: np.ndarray, project: _Project, packet: np.ndarray, scale: float, colour: str) -> None:
    header = Prediction(np.array(packet))
    if not header.valid:
        return
    path = project(predicted_points(packet, header.stamp + _AHEAD))
    path = path[~np.isnan(path).any(axis=1)]
    if len(path) > 1:
        points = np.rint(np.clip((scale * path), -1e4, 1e4) * (1 << _SHIFT)).astype(np.int32)
        cv2.polylines(view, [points], False, bgr(colour), 2, cv2.LINE_AA, _SHIFT)


def _is_stale(values: ObjectValues) -> bool:
    """Returns whether one of several objects is lost, or its path was predicted long ago."""
    return values.number is not None and (values.number == 0 or bool(values.point[0] - values.packet[0] > _STALE))


def _draw_cross(view: np.ndarray, centroid: Any, scale: float) -> None:
    u, v = (round(scale * value) for value in (centroid.u, centroid.v))
    for colour, width in (("#000000", 3), (_BRIGHT, 1)):
        cv2.line(view, (u - 9, v), (u + 9, v), bgr(colour), width, cv2.LINE_AA)
        cv2.line(view, (u, v - 9), (u, v + 9), bgr(colour), width, cv2.LINE_AA)


def _describe_pixel(values: ObjectValues, hidden: bool) -> str:
    """Returns where an object is in the image."""
    pixel = Centroid(values.centroids[0])
    return f"u {pixel.u:.1f}  v {pixel.v:.1f} px" if pixel.valid else "hidden" if hidden else "no motion"


def _describe_point(values: ObjectValues) -> str:
    """Returns where an object is in space."""
    measured = TrackPoint(values.point)
    if not measured.valid:
        return "no point"
    gap = f"   gap {1e3 * measured.gap:.1f} mm" if measured.gap else ""
    return f"x {measured.x:.3f}  y {measured.y:.3f}  z {measured.z:.3f} m{gap}"


def colour_of(number: int | None) -> str:
    """Returns the colour of an object that is reported: by its number, or `PATH` if there is only one."""
    return PATH if number is None else COLOURS[number % len(COLOURS)]


def draw_objects(view: np.ndarray, objects: ImageObjects, scale: float) -> list[str]:
    """Draws a rectangle with number and state round each confirmed object, in place; returns what to note.

    An object whose number is negative has no partner in the other image, and gets a question mark.

    Args:
        view: BGR image.
        objects: of the image.
        scale: pixels of the view per pixel of the image.
    """
    for track in objects.tracks:
        if track.hits < CONFIRM_AFTER:
            continue
        chosen = track.number in objects.targets
        colour = colour_of(track.number) if chosen else OTHER
        half = 0.5 * np.array([track.width, track.height])
        corners = [tuple(int(x) for x in np.rint(scale * (track.mean[:2] + sign * half))) for sign in (-1, 1)]
        cv2.rectangle(view, corners[0], corners[1], bgr(colour), 2 if chosen else 1, cv2.LINE_AA)
        state = "" if track.state == TrackState2D.MOVING else f" {track.state.name.lower()}"
        name = str(track.number) if track.number > 0 else "?"
        draw_text(view, f"{name}{state}", corners[0][0], corners[0][1] - 4, 13, colour, bold=chosen)
    notes = []
    if objects.displacement > 0.0:
        notes.append(f"camera moves {objects.displacement:.1f} px")
    if objects.leaps and max((track.stamp for track in objects.tracks), default=0.0) - objects.leapt < SHOWN:
        notes.append("leap")
    if objects.rivals:
        notes.append("other large object")
    return notes


def is_hidden(objects: ImageObjects, place: int = 0) -> bool:
    """Returns whether the object of a place among those that are reported is hidden."""
    track = objects.target(place)
    return track is not None and track.state == TrackState2D.HIDDEN
