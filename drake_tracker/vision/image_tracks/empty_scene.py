"""The scene without objects, as it was last seen, and the silhouette of an object in front of it.

Motion and patch show an object only while it moves as a whole and keeps its look. A person who sits down, a wheel that
turns in place and an object that comes closer are seen whole in front of the scene that they cover.
"""

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np

from drake_tracker.core.frozen_state import read_only
from drake_tracker.vision.image_tracks.image_regions import CHANGE_NOISE, LEAST_CHANGE, ImageRegion, find_regions
from drake_tracker.vision.image_tracks.track_2d import LIKE, Track2D

MARGIN = 0.5
"""Margin round an object that is not learned as the scene, as a share of its longer side."""
JOIN_SHARE = 0.15
"""Gap across which parts of a silhouette are joined, as a share of the object's size."""
LEAST_SHARE = 0.5
"""Least area of a silhouette as a share of the area of its object: less is only a part of the object."""
GROWN = 3.0
"""An object with this many times the pixels that it covered in the first image beside them has grown."""
BEYOND = 0.1
"""Share of its size by which a silhouette is beyond a region or beside a patch that does not show its object well."""


class EmptyScene(NamedTuple):
    """The scene without objects.

    Attributes:
        image: grey uint8 (h, w), each pixel as it was last seen without an object, in the light of the first image.
        unknown: uint8 (h, w), 255 where it shows an object of the first image, 1 where it may show an object, else 0.
    """

    image: np.ndarray
    unknown: np.ndarray

    def light(self, image: np.ndarray) -> float:
        """Returns the brightness of an image relative to the scene."""
        return float(np.median(image[::8, ::8] / np.maximum(self.image[::8, ::8], 1.0))) or 1.0

    def silhouette(self, track: Track2D, image: np.ndarray) -> ImageRegion | None:
        """Returns the silhouette of an object, None where the scene or something of another size is seen.

        Args:
            track: of the object, predicted for the time of the image.
            image: grey uint8 (h, w).
        """
        place = _around(track, MARGIN)
        light = self.light(image)
        usual = float(np.median(np.abs(image[::8, ::8] / light - self.image[::8, ::8])))
        changed = np.abs(image[place] / light - self.image[place]) > max(LEAST_CHANGE, CHANGE_NOISE * usual)
        known, covered = self.unknown[place] == 0, self.unknown[place] == 255
        grown = np.count_nonzero(changed & known) > GROWN * np.count_nonzero(covered)
        mask = np.where(known, changed, covered & ~changed & grown).astype(np.uint8) * np.uint8(255)
        mask = cv2.morphologyEx(mask, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8)) if mask.size else mask
        regions = find_regions(mask, JOIN_SHARE * track.size, 1)
        if not regions or not LEAST_SHARE < regions[0].width * regions[0].height / (track.width * track.height) < LIKE:
            return None
        (u, v, _, left, top, *_), v0, u0 = regions[0], place[0].start, place[1].start
        return regions[0]._replace(u=u0 + u, v=v0 + v, left=u0 + left, top=v0 + top, exact=True)


def remember_empty(scene: EmptyScene | None, image: np.ndarray, tracks: Sequence[Track2D]) -> EmptyScene:
    """Returns the scene after an image.

    Args:
        scene: before; None without one.
        image: grey uint8 (h, w).
        tracks: of all objects in the image.
    """
    seen = image.copy() if scene is None else cv2.convertScaleAbs(image, alpha=1.0 / scene.light(image))
    unknown = np.zeros_like(image)
    for track in sorted(tracks, key=lambda track: track.hits):
        place = _around(track, MARGIN)
        if scene is None or track.hits == 1:
            unknown[_around(track, 0.0)] = 1
            if scene is None:
                axes = int(0.4 * track.width), int(0.4 * track.height)
                cv2.ellipse(unknown, track.mean[:2].astype(int).tolist(), axes, 0.0, 0.0, 360.0, 255, -1)
        else:
            seen[place], unknown[place] = scene.image[place], scene.unknown[place]
    return EmptyScene(read_only(seen), read_only(unknown))


def shows_more(whole: ImageRegion, part: ImageRegion) -> bool:
    """Returns whether a silhouette contains a region of motion, and reaches beyond it."""
    low = np.subtract(part[3:5], whole[3:5])
    beyond = np.concatenate([low, np.subtract(whole[5:7], part[5:7]) - low]) / whole.extent
    return bool(beyond.min() > -BEYOND and beyond.max() > BEYOND)


def _around(track: Track2D, margin: float) -> tuple[slice, slice]:
    """Returns the rows and columns of an image round an object, with a margin as a share of its longer side."""
    aside = 0.5 * np.array([track.height, track.width]) + margin * max(track.width, track.height)
    low, high = (np.maximum(track.mean[1::-1] + off, 0.0).astype(int).tolist() for off in (-aside, aside + 1.0))
    return slice(low[0], high[0]), slice(low[1], high[1])
