"""The scene without objects, as it was last seen, and the silhouette of an object in front of it.

Motion and patch show an object only while it moves as a whole and keeps its look. A person who sits down, a wheel that
turns in place and an object that comes closer are seen whole in front of the scene that they cover.
"""

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np

from drake_tracker.core.frozen_state import read_only
from drake_tracker.vision.image_tracks.image_regions import CHANGE_NOISE, LEAST_CHANGE, ImageRegion
from drake_tracker.vision.image_tracks.track_2d import LIKE, Track2D

MARGIN = 0.5
"""Margin round an object that is not learned as the scene, as a share of its longer side."""
JOIN_SHARE = 0.15
"""Gap across which parts of a silhouette are joined, as a share of the object's size."""
COVERED, UNSURE = 255, 1
"""See `EmptyScene.unknown`."""
LEAST_SHARE = 0.4
"""Least area of a silhouette as a share of the area that its object had: less is not all of it."""
BEYOND = 0.1
"""Share of its size by which a silhouette reaches beyond a region that shows only a part of the object."""


class EmptyScene(NamedTuple):
    """The scene without objects.

    Attributes:
        image: grey uint8 (h, w), each pixel as it was last seen without an object.
        unknown: uint8 (h, w), 0 where that image shows the scene, `COVERED` where it shows an object at the very
            start, and `UNSURE` round it.
    """

    image: np.ndarray
    unknown: np.ndarray

    def silhouette(self, track: Track2D, image: np.ndarray) -> ImageRegion | None:
        """Returns the silhouette of an object, None where the scene is visible, or where another object
        or too little is seen.

        Args:
            track: of the object, predicted for the time of the image.
            image: grey uint8 (h, w).
        """
        place = _around(track, 2.0 * MARGIN, image.shape)
        change = cv2.absdiff(image[place], self.image[place])
        if not change.size:
            return None
        usual = float(np.median(cv2.absdiff(image[::8, ::8], self.image[::8, ::8])))
        mask = cv2.threshold(change, max(LEAST_CHANGE, CHANGE_NOISE * usual), 255, cv2.THRESH_BINARY)[1]
        unknown = self.unknown[place]
        mask[unknown > 0] = 255 * ((unknown == COVERED) & (mask == 0))[unknown > 0]
        mask = cv2.morphologyEx(mask, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
        mask = cv2.morphologyEx(mask, cv2.MORPH_CLOSE, np.ones((int(JOIN_SHARE * track.size) | 1,) * 2, np.uint8))
        contours = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)[0]
        outline = max(contours, key=cv2.contourArea, default=None)
        if outline is None or (moments := cv2.moments(cv2.convexHull(outline)))["m00"] == 0.0:
            return None
        v0, u0 = (part.start for part in place)
        left, top, width, height = cv2.boundingRect(outline)
        u, v = u0 + moments["m10"] / moments["m00"], v0 + moments["m01"] / moments["m00"]
        whole = ImageRegion(u, v, int(cv2.contourArea(outline)), u0 + left, v0 + top, width, height, exact=True)
        return whole if LEAST_SHARE < width * height / (track.width * track.height) < LIKE else None


def remember_scene(scene: EmptyScene | None, image: np.ndarray, tracks: Sequence[Track2D]) -> EmptyScene:
    """Returns the scene after an image.

    Args:
        scene: before; None without one, or where the camera has moved.
        image: grey uint8 (h, w).
        tracks: of all objects in the image.
    """
    seen, unknown = image.copy(), np.zeros_like(image)
    for track in sorted(tracks, key=lambda track: track.hits):
        place = _around(track, MARGIN, image.shape)
        if scene is None or track.hits == 1:
            unknown[_around(track, 0.0, image.shape)] = UNSURE
            if scene is not None:
                continue
            centre, axes = track.mean[:2].round().astype(int).tolist(), (0.4 * track.width, 0.4 * track.height)
            cv2.ellipse(unknown, centre, tuple(map(int, axes)), 0.0, 0.0, 360.0, COVERED, -1)
        else:
            seen[place], unknown[place] = scene.image[place], scene.unknown[place]
    return EmptyScene(read_only(seen), read_only(unknown))


def shows_more(whole: ImageRegion, part: ImageRegion) -> bool:
    """Returns whether a silhouette contains a region, and reaches beyond it.

    Args:
        whole: silhouette.
        part: region of motion.
    """
    beyond = [part.left - whole.left, whole.left + whole.width - part.left - part.width]
    beyond += [part.top - whole.top, whole.top + whole.height - part.top - part.height]
    least = BEYOND * whole.extent
    return min(beyond) > -least and max(beyond) > least


def _around(track: Track2D, margin: float, shape: tuple[int, ...]) -> tuple[slice, slice]:
    """Returns the rows and columns of an image round an object, with a margin as a share of its longer side."""
    aside = margin * max(track.width, track.height)
    u, v = track.mean[:2].tolist()
    low = int(max(v - 0.5 * track.height - aside, 0.0)), int(max(u - 0.5 * track.width - aside, 0.0))
    high = int(v + 0.5 * track.height + aside) + 2, int(u + 0.5 * track.width + aside) + 2
    return slice(low[0], max(high[0], low[0])), slice(low[1], max(high[1], low[1]))
