"""The patch of an object: the part of an image that showed it, by which it is found where nothing moves."""

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np

from drake_tracker.core.frozen_state import read_only
from drake_tracker.vision.image_tracks.image_regions import ImageRegion
from drake_tracker.vision.subpixel_peak import peak_offset

LARGEST_PATCH = 96
"""Longer side above which a patch is used at lower resolution [px]."""
SAME = 0.7
"""Least correlation of a patch with the image at which the object counts as found."""
SURE = 0.8
"""The same near other objects or motion."""
SCENES, SCENE_STEP = 4, 0.5
"""Number of earlier images that are kept of each object, and the share of its size by which it moves between them."""
ALSO_BEFORE = 0.1
"""A patch that an image shows less than this better than the scene without the object shows the scene."""


class Scene(NamedTuple):
    """An earlier image, and the place of the object in it.

    Attributes:
        image: grey uint8 (h, w).
        u: column of the object [px].
        v: row [px].
    """

    image: np.ndarray
    u: float
    v: float

    def distance(self, u: float, v: float) -> float:
        """Returns the distance of the object from a pixel: the larger of the distances in columns and in rows [px]."""
        return max(abs(self.u - u), abs(self.v - v))


def cut_patch(image: np.ndarray, region: ImageRegion) -> tuple[np.ndarray, np.ndarray]:
    """Returns (the part of a grey image that a region covers, the place of its centroid in it [px])."""
    patch = image[region.top : region.top + region.height, region.left : region.left + region.width].copy()
    return read_only(patch), read_only(np.array([region.u - region.left, region.v - region.top]))


def find_patch(
    patch: np.ndarray, centre: np.ndarray, place: np.ndarray, image: np.ndarray, reach: float
) -> tuple[float, float, float]:
    """Returns (u, v [px], correlation) of the best match of a patch near a place.

    Args:
        patch: grey uint8.
        centre: place of the object's centroid in it (2,) [px].
        place: where the object is expected (2,) [px].
        image: grey uint8 (h, w).
        reach: search radius around this place [px].
    """
    h, w = patch.shape
    factor = max(1.0, max(h, w) / LARGEST_PATCH)
    u, v = place - centre
    left, top = max(int(np.floor(u - reach)), 0), max(int(np.floor(v - reach)), 0)
    right, bottom = int(np.ceil(u + reach)) + w, int(np.ceil(v + reach)) + h
    window = image[top : max(bottom, top), left : max(right, left)]
    if factor > 1.0 and min(window.shape) > factor:
        window = cv2.resize(window, None, fx=1.0 / factor, fy=1.0 / factor, interpolation=cv2.INTER_AREA)
        patch = cv2.resize(patch, None, fx=1.0 / factor, fy=1.0 / factor, interpolation=cv2.INTER_AREA)
    if window.shape[0] < patch.shape[0] or window.shape[1] < patch.shape[1] or min(patch.shape) < 3:
        return float(place[0]), float(place[1]), 0.0
    score = cv2.matchTemplate(window, patch, cv2.TM_CCOEFF_NORMED)
    _, best, _, (x, y) = cv2.minMaxLoc(score)
    across, down = score[y].astype(float), score[:, x].astype(float)
    corner = np.array([x + peak_offset(across, x, 0.5), y + peak_offset(down, y, 0.5)])
    found = corner * factor + (left, top) + centre
    return float(found[0]), float(found[1]), best if np.isfinite(best) else 0.0


def is_scene(patch: np.ndarray, centre: np.ndarray, found: tuple[float, float, float], scenes: Sequence[Scene]) -> bool:
    """Returns whether a patch was found in the scene behind the object, which looked alike before the object arrived.

    Args:
        patch: see `find_patch`.
        centre: see there.
        found: u, v [px] and correlation of the match.
        scenes: earlier images; the first one counts in which the object did not cover this place.
    """
    u, v, score = found
    without = next((scene for scene in scenes if scene.distance(u, v) >= max(patch.shape)), None)
    if without is None:
        return False
    return find_patch(patch, centre, np.array([u, v]), without.image, 1.0)[2] > score - ALSO_BEFORE


def with_scene(scenes: tuple[Scene, ...], image: np.ndarray, place: np.ndarray, size: float) -> tuple[Scene, ...]:
    """Returns the earlier images with the newest one, if the object has moved far enough since the last.

    Args:
        scenes: oldest first.
        image: grey uint8 (h, w).
        place: of the object in it (2,) [px].
        size: of the object [px].
    """
    u, v = float(place[0]), float(place[1])
    if scenes and scenes[-1].distance(u, v) < SCENE_STEP * size:
        return scenes
    return (*scenes[1 - SCENES :], Scene(image, u, v))
