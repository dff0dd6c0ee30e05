"""Draws one frame of the camera video: the present image, and next to it the image that the centroid describes.

A centroid appears one vision lag after its images were captured. It is therefore drawn on the image of its stamp,
together with the motion energy of that stamp. The present image shows the result: the predicted path from now on.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from functools import lru_cache

import cv2
import numpy as np

from drake_tracker.run.track_marks import (
    RegionMark,
    TrackMark,
    draw_region,
    draw_track,
    legend_lost,
    legend_seen,
    legend_target,
)
from drake_tracker.run.video_marks import (
    BRIGHT,
    DIM,
    ENERGY,
    GOAL,
    GROUND,
    MEDIUM,
    OUTLINE,
    PATH,
    VOID,
    cross,
    diamond,
    dot,
    legend_centroid,
    legend_energy,
    legend_goal,
    legend_outline,
    legend_path,
    polyline,
    right_text,
    ring,
)
from drake_tracker.tasks.filming import HAND_BORDER
from drake_tracker.tasks.style import bgr, draw_text, phase_colour

_WIDTH, _MARGIN = 1280, 20
_PANEL_WIDTH, _TALLEST_PANEL, _SHORTEST_PANEL = 512, 308, 230
_TALLEST_SINGLE, _SHORTEST_SINGLE = 616, 500
_COLUMNS, _TOP, _ROW_GAP = (20, 544), 50, 42
_SIDEBAR = 1080
_STATUS_TOP, _STATUS_HEIGHT = 140, 290
_WIDEST_PITCH, _NOTES_HEIGHT = 27, 48
"""Distance from one phase to the next, and height of the two notes below the phases [px]."""
_LEGEND_TOP, _WIDEST_LEGEND_PITCH = 440, 24
"""Highest row of the legend's first line, and distance from one line to the next [px]."""
_BORDER = 4
"""Width of the border of the image shown around the windows of two cameras [px]."""
NO_PIXELS = np.zeros((0, 2))
NO_PIXELS.flags.writeable = False


@dataclass(frozen=True, eq=False)
class CameraSight:
    """Content of a frame for one camera. Pixel coordinates refer to the full image.

    Attributes:
        image: newest image, BGR uint8 of shape (height, width, 3).
        offset: (u0, v0) of its first pixel [px].
        path: predicted path of the object, from now on [px], shape (n, 2); n may be 0.
        late_image: image of the centroid's stamp, BGR, or None.
        energy: mask of the moving pixels at that stamp, or None.
        centroid: (u, v) [px], or None when it is not valid.
        goal: predicted arrival of the object and the ends of its error bar [px], shape (3, 2) or (0, 2).
        regions: what vision found in the late image, when it tracks several objects.
        tracks: the tracks then and now.
    """

    image: np.ndarray
    offset: tuple[int, int]
    path: np.ndarray
    late_image: np.ndarray | None
    energy: np.ndarray | None
    centroid: tuple[float, float] | None
    goal: np.ndarray = field(default_factory=lambda: NO_PIXELS)
    regions: tuple[RegionMark, ...] = ()
    tracks: tuple[TrackMark, ...] = ()


@dataclass(frozen=True)
class PageState:
    """Content of a frame in addition to the images.

    Attributes:
        time: simulated time [s].
        phase: present phase of the task.
        notes: two short lines of text below the phases.
        stamp: stamp of the centroid [s], or None.
        blind: whether the arm moves without vision.
        reason: why there is no point of the target, or "".
    """

    time: float
    phase: IntEnum
    notes: tuple[str, str]
    stamp: float | None
    blind: bool = False
    reason: str = ""


class VideoPage:
    """Draws the frames of the camera video.

    Two cameras are shown side by side, each above its late image. A single camera is shown to the left of its late
    image. The height of the frames depends on the shape of the windows.

    Args:
        polygons: {side: corners of the window of interest [px], shape (n, 2)}.
        image_size: (width, height) of the full images [px].
        title: first line of text.
        subtitle: second line of text.
        lag: time from the stamp of a centroid until it appears [s].
        goal: name of the mark at `CameraSight.goal`, or None if there is no such mark.
        several: whether vision tracks several objects.

    Attributes:
        size: (width, height) of a frame [px], both even.
        lag: time from the stamp of a centroid until it appears [s].
        goal: name of the mark, or None.
        several: whether vision tracks several objects.
    """

    def __init__(
        self,
        polygons: Mapping[str, np.ndarray],
        image_size: tuple[int, int],
        title: str,
        subtitle: str,
        lag: float,
        goal: str | None = None,
        several: bool = False,
    ) -> None:
        single = len(polygons) == 1
        border = HAND_BORDER if single else _BORDER
        _u0, _v0, width, height = self._view = _common_view(polygons.values(), image_size, border)
        tallest, shortest = (_TALLEST_SINGLE, _SHORTEST_SINGLE) if single else (_TALLEST_PANEL, _SHORTEST_PANEL)
        self._scale = min(_PANEL_WIDTH / width, tallest / height)
        panel_height = 2 * math.ceil(max(self._scale * height, shortest) / 2)
        self._panel = (_PANEL_WIDTH, panel_height)
        # Width of the margin in a panel to the left of its view and above it [px].
        self._margin = tuple((panel - round(self._scale * n)) // 2 for panel, n in zip(self._panel, (width, height)))
        self._rows = (_TOP,) if single else (_TOP, _TOP + panel_height + _ROW_GAP)
        self.size = (_WIDTH, self._rows[-1] + panel_height + _MARGIN)
        # For each side, the corners (x, y) of the panels for its present and its late image [px].
        if single:
            (side,) = polygons
            self._places = {side: tuple((x, _TOP) for x in _COLUMNS)}
        else:
            self._places = {side: tuple((x, y) for y in self._rows) for side, x in zip(polygons, _COLUMNS)}
        self.lag, self.goal, self.several = lag, goal, several
        self._polygons = {side: self._to_panel(polygon) for side, polygon in polygons.items()}
        self._blank = np.full((*reversed(self.size), 3), bgr(GROUND), np.uint8)
        self._draw_fixed(title, subtitle, lag, goal)

    @property
    def panels(self) -> list[tuple[str, bool, tuple[int, int, int, int]]]:
        """Images in a frame: (side, whether it is the late image, its rectangle (x, y, width, height) [px])."""
        (dx, dy), size = self._margin, (round(self._scale * self._view[2]), round(self._scale * self._view[3]))
        return [
            (side, late, (x + dx, y + dy, *size))
            for side, spots in self._places.items()
            for late, (x, y) in zip((False, True), spots)
        ]

    def places(self, sights: Mapping[str, CameraSight]) -> dict[int, list[tuple[float, float]]]:
        """Returns {number of a track: its position in each of the `panels`, relative to their corners [px]}.

        Args:
            sights: {side: what is shown of its camera}.
        """
        found: dict[int, list[tuple[float, float]]] = {}
        for side, late, _ in self.panels:
            for mark in sights[side].tracks:
                ((x, y),) = self._to_panel(np.array([mark.then if late else mark.now])) - self._margin
                found.setdefault(mark.row.number, []).append((float(x), float(y)))
        return found

    def draw(self, sights: Mapping[str, CameraSight], state: PageState) -> np.ndarray:
        """Returns a frame, BGR uint8 of shape (height, width, 3).

        Args:
            sights: {side: what is shown of its camera}.
            state: what is shown in addition.
        """
        frame = self._blank.copy()
        for side, places in self._places.items():
            sight = sights[side]
            now, late = (frame[y : y + self._panel[1], x : x + self._panel[0]] for x, y in places)
            self._draw_now(now, sight, side)
            self._draw_late(late, sight)
        if state.stamp is not None:
            words = f"{'not in use: ' if state.blind else ''}image at {state.stamp:.2f} s"
            right_text(frame, words, _COLUMNS[1] + self._panel[0], self._rows[-1] - 13, 15, MEDIUM)
        if state.reason:
            words = f"no point: {state.reason}"
            right_text(frame, words, _COLUMNS[1] + self._panel[0], self._rows[0] - 14, 15, ENERGY)
        draw_text(frame, f"{state.time:.2f} s", _SIDEBAR - 2, 116, 34, BRIGHT, bold=True)
        status = _status(state.phase, state.notes)
        frame[_STATUS_TOP : _STATUS_TOP + len(status), _SIDEBAR:] = status
        return frame

    def _draw_fixed(self, title: str, subtitle: str, lag: float, goal: str | None) -> None:
        page = self._blank
        for x in _COLUMNS:
            for y in self._rows:
                page[y : y + self._panel[1], x : x + self._panel[0]] = bgr(VOID)
        single = len(self._places) == 1
        (x_now, y_now), (x_late, y_late) = next(iter(self._places.values()))
        y = y_now - 14
        x = draw_text(page, "Now", x_now, y, 17, BRIGHT, bold=True)
        words = "image and predicted path" if single else "images and predicted path"
        draw_text(page, words, x + 12, y, 15, MEDIUM)
        y = y_late - (14 if single else 13)
        x = draw_text(page, f"{lag:.2f} s late", x_late, y, 17, BRIGHT, bold=True)
        words = "motion" if single else "newest motion energy and its centroid"
        if self.several:
            words = "newest silhouettes, with the regions and tracks found in them"
        draw_text(page, words, x + 12, y, 15, MEDIUM)
        draw_text(page, title, _SIDEBAR, _TOP - 14, 17, BRIGHT, bold=True)
        draw_text(page, subtitle, _SIDEBAR, _TOP + 8, 13, MEDIUM)
        legend = [
            (legend_path, "predicted path" if goal else "predicted, next second"),
            *([(legend_goal, goal)] if goal else []),
            (legend_energy, "silhouettes" if self.several else "moving pixels"),
            (legend_centroid, "centroid of the target" if self.several else "their centroid"),
            (legend_outline, "window of interest"),
        ]
        if self.several:
            legend += [(legend_target, "target"), (legend_seen, "another object"), (legend_lost, "object not seen now")]
        bottom = self.size[1] - _MARGIN - 4
        pitch = min(_WIDEST_LEGEND_PITCH, (bottom - _LEGEND_TOP) // (len(legend) - 1))
        y = bottom - pitch * (len(legend) - 1)
        for draw, words in legend:
            draw(page, _SIDEBAR + 10, y - 5)
            draw_text(page, words, _SIDEBAR + 28, y, 13, MEDIUM)
            y += pitch

    def _draw_now(self, panel: np.ndarray, sight: CameraSight, side: str) -> None:
        self._place(panel, sight.image, sight.offset, cv2.INTER_LINEAR)
        polyline(panel, self._polygons[side], OUTLINE, 1, closed=True)
        if len(sight.path):
            path = self._to_panel(sight.path)
            for point in path[1:]:
                dot(panel, point, 2.5, PATH)
            ring(panel, path[0], 9.0, PATH)
        if len(sight.goal):
            at, *ends = self._to_panel(sight.goal)
            if np.isfinite(ends).all():
                polyline(panel, ends, VOID, 5)
                polyline(panel, ends, GOAL, 2)
            diamond(panel, at, 7.0, GOAL)
        for mark in sight.tracks:
            (point,) = self._to_panel(np.array([mark.now]))
            draw_track(panel, point, mark.row)

    def _draw_late(self, panel: np.ndarray, sight: CameraSight) -> None:
        if sight.late_image is None:
            return
        grey = cv2.cvtColor(sight.late_image, cv2.COLOR_BGR2GRAY)
        dim = cv2.cvtColor(cv2.convertScaleAbs(grey, alpha=0.55), cv2.COLOR_GRAY2BGR)
        if sight.energy is not None and sight.energy.shape == grey.shape:
            dim[sight.energy > 0] = bgr(ENERGY)
        self._place(panel, dim, sight.offset, cv2.INTER_NEAREST_EXACT)
        self._draw_regions(panel, sight)
        if sight.centroid is not None:
            (point,) = self._to_panel(np.array([sight.centroid]))
            cross(panel, point, gap=7.0 if len(self._places) == 1 else 0.0)

    def _draw_regions(self, panel: np.ndarray, sight: CameraSight) -> None:
        targets = {mark.row.number for mark in sight.tracks if mark.row.target}
        for region in sight.regions:
            half = 0.5 * np.array([region.width, region.height])
            corners = self._to_panel(np.array([region.u, region.v]) + np.array([-half, half]))
            draw_region(panel, corners, region, region.number in targets)
        for mark in sight.tracks:
            (point,) = self._to_panel(np.array([mark.then]))
            draw_track(panel, point, mark.row)

    def _place(self, panel: np.ndarray, image: np.ndarray, offset: tuple[int, int], interpolation: int) -> None:
        """Draws the part of an image that is in view into a panel."""
        u0, v0, width, height = self._view
        left, top = max(u0, offset[0]), max(v0, offset[1])
        right = min(u0 + width, offset[0] + image.shape[1])
        bottom = min(v0 + height, offset[1] + image.shape[0])
        if left >= right or top >= bottom:
            return
        part = image[top - offset[1] : bottom - offset[1], left - offset[0] : right - offset[0]]
        x0, y0 = (round(self._scale * a) + b for a, b in zip((left - u0, top - v0), self._margin))
        x1, y1 = (round(self._scale * a) + b for a, b in zip((right - u0, bottom - v0), self._margin))
        panel[y0:y1, x0:x1] = cv2.resize(part, (x1 - x0, y1 - y0), interpolation=interpolation)

    def _to_panel(self, uv: np.ndarray) -> np.ndarray:
        """Returns the positions in a panel of pixels of the full image, both [px], shape (n, 2).

        In both, the centres of pixels have whole coordinates.
        """
        return (np.asarray(uv) - self._view[:2] + 0.5) * self._scale - 0.5 + self._margin


@lru_cache(maxsize=64, typed=True)  # typed, since phases of different tasks are equal numbers
def _status(phase: IntEnum, notes: tuple[str, str]) -> np.ndarray:
    """Returns the part of the sidebar with phases and notes, BGR. It changes rarely."""
    status = np.full((_STATUS_HEIGHT, _WIDTH - _SIDEBAR, 3), bgr(GROUND), np.uint8)
    y, pitch = 18, min(_WIDEST_PITCH, (_STATUS_HEIGHT - _NOTES_HEIGHT - 18) // len(type(phase)))
    for each in type(phase):
        current = each == phase
        dot(status, (8, y - 5), 6.0 if current else 3.0, phase_colour(each))
        draw_text(status, each.name.capitalize(), 26, y, 16, BRIGHT if current else DIM, bold=current)
        y += pitch
    for words, below, size in zip(notes, (12, 38), (15, 13)):
        draw_text(status, words, 0, y + below, size, MEDIUM)
    return status


def _common_view(polygons: Iterable[np.ndarray], image_size: tuple[int, int], border: int) -> tuple[int, int, int, int]:
    """Returns the part (u0, v0, width, height) of the full images [px] that contains the windows of all cameras."""
    corners = np.concatenate([np.asarray(polygon) for polygon in polygons])
    low = np.clip(np.floor(corners.min(axis=0)).astype(int) - border, 0, image_size)
    high = np.clip(np.ceil(corners.max(axis=0)).astype(int) + 1 + border, 0, image_size)
    return int(low[0]), int(low[1]), int(high[0] - low[0]), int(high[1] - low[1])
