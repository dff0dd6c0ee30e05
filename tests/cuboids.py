"""Cuboids on an oval, and their silhouettes in two cameras like those of the train's default scenario."""

from functools import cache

import cv2
import numpy as np

from drake_tracker.vision.silhouettes.foreground import Foreground
from drake_tracker.world.config import CamerasConfig
from drake_tracker.world.imaging.cameras import true_camera_models

_MODELS = true_camera_models(CamerasConfig())
CAMERAS = [_MODELS["camera_left"], _MODELS["camera_right"]]
"""The left and the right camera."""
WORK_VOLUME = [[0.33, -0.30, 0.45], [0.79, 0.30, 0.505]]
HEIGHT = 0.475
"""z_W of the centres of the cuboids [m]."""
PERIOD = 1 / 60
TRAIN = (0.11, 0.04, 0.05)
"""Length, width and height [m]."""
CENTRE, SEMI_AXES = np.array([0.56, 0.0]), np.array([0.16, 0.22])


@cache
def _lap(scale):
    """(angles, distances from the start [m]) along a lap of the oval."""
    angles = np.linspace(0.0, 2.0 * np.pi, 721)
    points = np.column_stack([np.cos(angles), np.sin(angles)]) * scale * SEMI_AXES
    return angles, np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])


def oval(time, speed=0.15, start=0.0, scale=1.0, centre=CENTRE):
    """Returns (p_WQ [m], velocity [m/s]) on an oval; a negative speed runs backwards.

    ``start`` is the place at time 0 as a share of a lap.
    """
    semi_axes = scale * SEMI_AXES
    angles, lengths = _lap(scale)
    angle = np.interp((start * lengths[-1] + speed * time) % lengths[-1], lengths, angles)
    along = np.array([-np.sin(angle), np.cos(angle)]) * semi_axes
    position = centre + np.array([np.cos(angle), np.sin(angle)]) * semi_axes
    return np.array([*position, HEIGHT]), np.array([*(speed * along / np.linalg.norm(along)), 0.0])


class Cuboid:
    """A box that stands upright, its length along its heading."""

    def __init__(self, dimensions=TRAIN, colour=(200, 170, 60)):
        self.dimensions, self.colour = np.array(dimensions, float), colour

    def corners(self, p_WQ, heading):
        """p_W of the eight corners, (8, 3) [m]; p_WQ is the centre."""
        signs = np.array([(i, j, k) for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)])
        c, s = np.cos(heading), np.sin(heading)
        R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        return p_WQ + 0.5 * signs * self.dimensions @ R.T

    def outline(self, camera, p_WQ, heading):
        """The outline in an image, (n, 2) [px]."""
        return cv2.convexHull(camera.project(self.corners(p_WQ, heading)).astype(np.float32))[:, 0].astype(float)

    def draw(self, camera, p_WQ, heading, image, mask):
        """Draws the cuboid into the image, and its silhouette into the mask."""
        outline = np.rint(self.outline(camera, p_WQ, heading) * 16).astype(np.int32)
        cv2.fillConvexPoly(image, outline, self.colour, shift=4)
        cv2.fillConvexPoly(mask, outline, 255, shift=4)


class Stage:
    """Cuboids on paths, and what two cameras show of them as `Foreground`s.

    Args:
        objects: list of (`Cuboid`, function of the time that returns (p_WQ, velocity), or None while it is absent).
        cover: function of (time, side) that returns what the arm hides, uint8, or None.
        missing: function of (time, side) that returns what a camera that turned away does not show, or None.
        borders: of the left and of the right image, uint8, 255 along the border of what is looked at and beyond.
    """

    def __init__(self, objects, cover=None, missing=None, borders=(None, None)):
        self.objects, self._cover, self._missing, self._borders = objects, cover, missing, borders
        self._headings = [0.0] * len(objects)
        self._before = [None, None]

    def truth(self, time):
        """[p_WQ or None] of all objects."""
        states = [path(time) for _, path in self.objects]
        return [None if state is None else state[0] for state in states]

    def foregrounds(self, time, usable=True):
        """The `Foreground` of the left and of the right image at a time; times must increase."""
        states = [path(time) for _, path in self.objects]
        for number, state in enumerate(states):
            if state is not None and np.hypot(*state[1][:2]) > 0.0:
                self._headings[number] = np.arctan2(state[1][1], state[1][0])
        found = []
        for side, camera in enumerate(CAMERAS):
            image = np.full((camera.height, camera.width, 3), 110, np.uint8)
            mask = np.zeros(image.shape[:2], np.uint8)
            shown = [number for number, state in enumerate(states) if state is not None]
            eye = camera.X_WC[:3, 3]
            for number in sorted(shown, key=lambda each: -np.linalg.norm(states[each][0] - eye)):
                self.objects[number][0].draw(camera, states[number][0], self._headings[number], image, mask)
            hidden = None if self._cover is None else self._cover(time, side)
            missing = None if self._missing is None else self._missing(time, side)
            border = self._borders[side]
            beyond = None if border is None else cv2.erode(border, np.ones((7, 7), np.uint8))
            for unseen in (hidden, missing, beyond):
                if unseen is not None:
                    mask = cv2.subtract(mask, unseen)
            moving = np.zeros_like(mask)
            if self._before[side] is not None:
                difference = cv2.max(*cv2.split(cv2.absdiff(image, self._before[side]))[:2])
                moving = cv2.threshold(difference, 20, 255, cv2.THRESH_BINARY)[1]
            self._before[side] = image
            found.append(Foreground(time, image, mask, moving, (0, 0), hidden, usable, missing=missing, border=border))
        return found
