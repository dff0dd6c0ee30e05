"""A video of your own cameras' images, with the measured and predicted motion drawn into them."""

from collections import deque
from collections.abc import Sequence
from math import ceil
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from drake_tracker.core.background import Background
from drake_tracker.core.messages import Centroid, Prediction, TrackPoint, predicted_points
from drake_tracker.run.video_file import VideoFile
from drake_tracker.tasks.style import bgr, draw_text
from drake_tracker.tracking.overlay_objects import draw_objects, is_hidden
from drake_tracker.vision.camera_model import CameraModel
from drake_tracker.vision.image_tracker import ImageObjects

_WIDEST, _TALLEST = 640, 480
"""Greatest size of a panel [px]."""
_BAND, _BETWEEN = 36, 4
_ENERGY, _PATH, _BRIGHT, _DIM, _GROUND = "#ffb000", "#4cc2ff", "#f2f4f6", "#a3abb5", "#15181c"
_AHEAD = np.arange(0.0, 1.01, 0.1)
"""Times [s] after the stamp at which the predicted path is evaluated."""
_WAITING = 4
"""Largest number of images that wait for being drawn and encoded."""
_SHIFT = 4
"""Fractional bits of the coordinates passed to OpenCV."""


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
    ) -> None:
        """Opens the video.

        Args:
            path: MP4 file to write; None writes none.
            period: period of the images [s].
            sizes: (width, height) of each camera's images [px].
            age_cycles: cycles from the described image to the newest one.
            cameras: calibration of each camera, to project predictions; or empty.
            onlooker: a sink of frames, such as that of the live view, which also gets each frame that it wants.
        """
        self._onlooker = onlooker
        self._cameras = cameras
        self._scales = [min(1.0, _WIDEST / width, _TALLEST / height) for width, height in sizes]
        self._panels = [(round(s * width), round(s * height)) for s, (width, height) in zip(self._scales, sizes)]
        width = sum(panel[0] for panel in self._panels) + _BETWEEN * (len(sizes) - 1)
        height = max(panel[1] for panel in self._panels) + _BAND
        self.size = (width + width % 2, height + height % 2)
        self._images: deque[list[tuple[np.ndarray, float, float]]] = deque()
        self._kept = ceil(age_cycles) + 1
        self._masks: list[np.ndarray] | None = None
        self._objects: list[ImageObjects | None] = [None] * len(sizes)
        self._ground = np.full((*self.size[::-1], 3), bgr(_GROUND), np.uint8)
        self._video = None if path is None else VideoFile(path, max(1, round(1.0 / period)), self.size)
        self._background = Background(self._draw, _WAITING)

    def add(
        self,
        images: Sequence[tuple[np.ndarray, np.ndarray]],
        energies: Sequence[Any],
        centroids: Sequence[np.ndarray],
        point: np.ndarray | None = None,
        packet: np.ndarray | None = None,
    ) -> None:
        """Takes the values of the ports in one cycle; draws the earlier image that they describe.

        Args:
            images: (RGB image, `FrameInfo` vector) of each camera.
            energies: `MotionEnergy` of each camera.
            centroids: `Centroid` vector of each camera.
            point: `TrackPoint` vector, None without calibration.
            packet: `Prediction` vector, None without calibration.
        """
        self._images.append([(image, frame[0], frame[1]) for image, frame in images])
        masks, self._masks = self._masks, [energy.mask for energy in energies]
        objects, self._objects = self._objects, [energy.objects for energy in energies]
        if len(self._images) <= self._kept:
            return
        vectors = [None if vector is None else np.array(vector) for vector in (point, packet)]
        self._background.put((self._images.popleft(), masks, objects, [np.array(each) for each in centroids], *vectors))

    def _draw(self, values: tuple[Any, ...]) -> None:
        """Draws one image and appends it to the video."""
        watched = self._onlooker is not None and self._onlooker.wanted
        if self._video is None and not watched:
            return
        seen, masks, objects, centroids, point, packet = values
        page = self._ground.copy()
        x = 0
        for k, (panel, scale, (image, _, fresh)) in enumerate(zip(self._panels, self._scales, seen)):
            view = page[: panel[1], x : x + panel[0]]
            small = image if scale == 1.0 else cv2.resize(image, panel, interpolation=cv2.INTER_AREA)
            cv2.cvtColor(small, cv2.COLOR_RGB2BGR, dst=view)
            if masks is not None:
                _tint(view, masks[k])
            if packet is not None and k < len(self._cameras):
                _draw_path(view, self._cameras[k], packet, scale)
            centroid = Centroid(np.array(centroids[k]))
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
        hidden = objects[0] is not None and is_hidden(objects[0])
        draw_text(page, _describe(centroids[0], point, hidden), 110, self.size[1] - 12, 15, _DIM, numbers=True)
        if self._video is not None:
            self._video.write(page)
        if watched:
            self._onlooker.write(page, None)

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
    if mask.size <= 1 or not mask.any():
        return
    moving = cv2.resize(mask, view.shape[1::-1], interpolation=cv2.INTER_NEAREST)
    x, y, width, height = cv2.boundingRect(moving)
    part = view[y : y + height, x : x + width]
    tinted = cv2.addWeighted(part, 0.35, np.full_like(part, bgr(_ENERGY)), 0.65, 0.0)
    np.copyto(part, tinted, where=moving[y : y + height, x : x + width, None] > 0)


def _draw_path(view: np.ndarray, camera: CameraModel, packet: np.ndarray, scale: float) -> None:
    header = Prediction(np.array(packet))
    if not header.valid:
        return
    path = camera.project(predicted_points(packet, header.stamp + _AHEAD))
    path = path[~np.isnan(path).any(axis=1)]
    if len(path) > 1:
        points = np.rint(np.clip((scale * path), -1e4, 1e4) * (1 << _SHIFT)).astype(np.int32)
        cv2.polylines(view, [points], False, bgr(_PATH), 2, cv2.LINE_AA, _SHIFT)


def _draw_cross(view: np.ndarray, centroid: Any, scale: float) -> None:
    u, v = (round(scale * value) for value in (centroid.u, centroid.v))
    for colour, width in (("#000000", 3), (_BRIGHT, 1)):
        cv2.line(view, (u - 9, v), (u + 9, v), bgr(colour), width, cv2.LINE_AA)
        cv2.line(view, (u, v - 9), (u, v + 9), bgr(colour), width, cv2.LINE_AA)


def _describe(centroid: np.ndarray, point: np.ndarray | None, hidden: bool) -> str:
    """Returns the line of text below the images."""
    if point is None:
        pixel = Centroid(np.array(centroid))
        return f"u {pixel.u:.1f}  v {pixel.v:.1f} px" if pixel.valid else "hidden" if hidden else "no motion"
    measured = TrackPoint(np.array(point))
    if not measured.valid:
        return "no point"
    gap = f"   gap {1e3 * measured.gap:.1f} mm" if measured.gap else ""
    return f"x {measured.x:.3f}  y {measured.y:.3f}  z {measured.z:.3f} m{gap}"
