"""A video of what one's own cameras saw, with what was made of it drawn in."""

from collections import deque
from math import ceil

import cv2
import numpy as np

from drake_tracker.core.messages import Centroid, Prediction, TrackPoint, evaluate_prediction
from drake_tracker.run.video_file import VideoFile
from drake_tracker.tasks.style import bgr, draw_text

_WIDEST, _TALLEST = 640, 480
_BAND, _BETWEEN = 36, 4
_ENERGY, _PATH, _BRIGHT, _DIM, _GROUND = "#ffb000", "#4cc2ff", "#f2f4f6", "#a3abb5", "#15181c"
_AHEAD = np.arange(0.0, 1.01, 0.1)
"""Times [s] from the stamp on at which the predicted path is marked."""
_SHIFT = 4


class TrackOverlay:
    """Draws a page for each image that a centroid describes and appends it to a video.

    Args:
        path: MP4 file to write. period: of the images [s]. sizes: (width, height) [px] of each camera's.
        age_cycles: from the image described to the newest one. cameras: `CameraModel`s, or empty.
    """

    def __init__(self, path, period, sizes, age_cycles, cameras=()):
        self._cameras = cameras
        self._scales = [min(1.0, _WIDEST / width, _TALLEST / height) for width, height in sizes]
        self._panels = [(round(s * width), round(s * height)) for s, (width, height) in zip(self._scales, sizes)]
        width = sum(panel[0] for panel in self._panels) + _BETWEEN * (len(sizes) - 1)
        height = max(panel[1] for panel in self._panels) + _BAND
        self.size = (width + width % 2, height + height % 2)
        self._images, self._kept = deque(), ceil(age_cycles) + 1
        self._masks = None
        self._video = VideoFile(path, max(1, round(1.0 / period)), self.size)

    def add(self, ticks, energies, centroids, point=None, packet=None):
        """Takes what the ports show in one cycle; draws the image of some cycles ago, which it is about.

        Args:
            ticks: (RGBA image, `FrameInfo` vector) of each camera. energies: a `MotionEnergy` of each.
            centroids: a `Centroid` vector of each. point: a `TrackPoint` vector. packet: a `Prediction` vector.
        """
        self._images.append([(cv2.cvtColor(image, cv2.COLOR_RGBA2BGR), frame[0], frame[1]) for image, frame in ticks])
        masks, self._masks = self._masks, [energy.mask for energy in energies]
        if len(self._images) <= self._kept:
            return
        page = np.full((*self.size[::-1], 3), bgr(_GROUND), np.uint8)
        x = 0
        seen = self._images.popleft()
        for k, (panel, scale, (image, stamp, fresh)) in enumerate(zip(self._panels, self._scales, seen)):
            view = page[: panel[1], x : x + panel[0]]
            view[:] = cv2.resize(image, panel, interpolation=cv2.INTER_AREA)
            if masks is not None:
                _tint(view, masks[k])
            if packet is not None and k < len(self._cameras):
                _draw_path(view, self._cameras[k], packet, scale)
            centroid = Centroid(np.array(centroids[k]))
            if centroid.valid:
                _draw_cross(view, centroid, scale)
            if not fresh:
                draw_text(view, "no image taken", 10, 24, 15, _ENERGY, bold=True)
            x += panel[0] + _BETWEEN
        draw_text(page, f"{seen[0][1]:.2f} s", 12, self.size[1] - 12, 15, _BRIGHT, bold=True)
        draw_text(page, _words(centroids[0], point), 110, self.size[1] - 12, 15, _DIM)
        self._video.write(page)

    def close(self):
        """Ends the video."""
        self._video.close()


def _tint(view, mask):
    if mask.size <= 1 or not mask.any():
        return
    moving = cv2.resize(mask, view.shape[1::-1], interpolation=cv2.INTER_NEAREST) > 0
    view[moving] = 0.35 * view[moving] + 0.65 * np.array(bgr(_ENERGY))


def _draw_path(view, camera, packet, scale):
    header = Prediction(np.array(packet))
    if not header.valid:
        return
    path = camera.project([evaluate_prediction(packet, header.stamp + t)[:3] for t in _AHEAD])
    path = path[~np.isnan(path).any(axis=1)]
    if len(path) > 1:
        points = np.rint(np.clip((scale * path), -1e4, 1e4) * (1 << _SHIFT)).astype(np.int32)
        cv2.polylines(view, [points], False, bgr(_PATH), 2, cv2.LINE_AA, _SHIFT)


def _draw_cross(view, centroid, scale):
    u, v = (round(scale * value) for value in (centroid.u, centroid.v))
    for colour, width in (("#000000", 3), (_BRIGHT, 1)):
        cv2.line(view, (u - 9, v), (u + 9, v), bgr(colour), width, cv2.LINE_AA)
        cv2.line(view, (u, v - 9), (u, v + 9), bgr(colour), width, cv2.LINE_AA)


def _words(centroid, point):
    if point is None:
        centroid = Centroid(np.array(centroid))
        return f"u {centroid.u:.1f}  v {centroid.v:.1f} px" if centroid.valid else "nothing moves"
    point = TrackPoint(np.array(point))
    if not point.valid:
        return "no point"
    gap = f"   gap {1e3 * point.gap:.1f} mm" if point.gap else ""
    return f"x {point.x:.3f}  y {point.y:.3f}  z {point.z:.3f} m{gap}"
