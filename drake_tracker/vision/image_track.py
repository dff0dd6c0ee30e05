"""The track of an object in the images of one camera: a Kalman filter of position and velocity in pixels.

All noises are proportional to the size and the speed of the object itself, so that they suit any scale.
"""

import math
from dataclasses import dataclass, replace
from enum import IntEnum

import cv2
import numpy as np

from drake_tracker.core.frozen_state import FrozenState, read_only
from drake_tracker.vision.image_regions import ImageRegion

SIZE_WEIGHT = 0.1
"""Weight of the newest region in the size of an object."""
POSITION_ERROR = 0.03
"""Standard deviation of a centroid as a fraction of the object's size, added to `PIXEL_ERROR`."""
PIXEL_ERROR = 0.3
"""See there [px]."""
SPEED_CHANGE = 1.0
"""Standard deviation of the change of the velocity within a second as a fraction of the speed."""
SIZE_CHANGE = 1.0
"""The same from the size: sizes per second."""
LIKE = 3.0
"""A region of this many times the size of an object, or of this fraction, does not show it alone."""
STEADY = 0.25
"""Share of its displacement by which an object may be beside the place where it is expected, for its patch to be taken,
see `with_region`."""
LARGEST_MARGIN = 0.4
"""Largest share of a region on each side that shows where its object was and will be."""
SLOW = 0.25
"""Speed below which an object may stand, in sizes per second."""
LARGEST_PATCH = 96
"""Longer side above which a patch is used at lower resolution [px]."""
SAME = 0.7
"""Least correlation of a patch with what the image shows, for the object to be there."""
SURE = 0.8
"""The same among other objects, or where something moves."""


class TrackState(IntEnum):
    """What an object does."""

    LOST = 0
    MOVING = 1
    STANDING = 2
    HIDDEN = 3


@dataclass(frozen=True, eq=False)
class ImageTrack(FrozenState):
    """The track of one object; all arrays are read-only.

    Attributes:
        number: its identity, from 1 on.
        stamp: of the estimate [s].
        mean: u, v [px] and their rates [px/s], shape (4,).
        covariance: of the mean, shape (4, 4).
        width: of the object [px].
        height: of the object [px].
        pixel_count: number of its moving pixels, smoothed.
        hits: number of images in which it was measured.
        seen: stamp at which it was seen last [s].
        state: `TrackState`.
        patch: grey uint8, the object when it was last seen alone.
        centre: place of the object's centroid in the patch (u, v) [px], shape (2,).
        unlike: number of newest images in which its region was too large or too small.
        since: stamp of the image in which it was seen first [s].
        place: u, v where it was seen last [px], shape (2,).
        moving: number of moving pixels when it was seen last, 0 if it was found by its patch.
        region: its region then, None if it was found by its patch.
        beside: number of newest images in which its patch was taken although it had a region.
    """

    number: int
    stamp: float
    mean: np.ndarray
    covariance: np.ndarray
    width: float
    height: float
    pixel_count: float
    hits: int
    seen: float
    state: TrackState
    patch: np.ndarray
    centre: np.ndarray
    place: np.ndarray
    moving: int = 0
    region: ImageRegion | None = None
    beside: int = 0
    unlike: int = 0
    since: float = 0.0

    @property
    def size(self) -> float:
        """Mean of width and height [px]."""
        return 0.5 * (self.width + self.height)

    @property
    def speed(self) -> float:
        """Speed in the image [px/s]."""
        return math.hypot(self.mean[2], self.mean[3])

    @property
    def slow(self) -> bool:
        """Whether it moves so slowly that it may stand."""
        return self.speed < SLOW * self.size

    @property
    def std(self) -> float:
        """Standard deviation of the position [px]."""
        return math.sqrt(max(self.covariance[0, 0], self.covariance[1, 1]))

    def alone(self, region: ImageRegion, reach: float) -> ImageRegion:
        """Returns the part of a region where the object is, without where it was and will be.

        Args:
            region: of the object.
            reach: time from the image to the others with which it was compared [s].
        """
        if region.exact or self.hits < 3:
            return region
        across = int(min(abs(self.mean[2]) * reach, LARGEST_MARGIN * region.width))
        down = int(min(abs(self.mean[3]) * reach, LARGEST_MARGIN * region.height))
        return region._replace(
            left=region.left + across,
            top=region.top + down,
            width=region.width - 2 * across,
            height=region.height - 2 * down,
        )

    def is_like(self, region: ImageRegion) -> bool:
        """Returns whether a region has about the size of the object."""
        ratio = region.width * region.height / (self.width * self.height)
        return 1.0 / LIKE < ratio < LIKE


def start_track(number: int, stamp: float, region: ImageRegion, image: np.ndarray) -> ImageTrack:
    """Returns the track of an object that was seen for the first time.

    Args:
        number: its identity.
        stamp: of the image [s].
        region: that shows it.
        image: grey uint8 (h, w).
    """
    patch, centre = cut_patch(image, region)
    spread = np.diag([1.0, 1.0, 900.0, 900.0]) * (POSITION_ERROR * region.extent + PIXEL_ERROR) ** 2
    return ImageTrack(
        number=number,
        stamp=stamp,
        mean=read_only(np.array([region.u, region.v, 0.0, 0.0])),
        covariance=read_only(spread),
        width=region.width,
        height=region.height,
        pixel_count=region.pixel_count,
        hits=1,
        seen=stamp,
        state=TrackState.MOVING,
        patch=patch,
        centre=centre,
        place=read_only(np.array([region.u, region.v])),
        moving=region.pixel_count,
        region=region,
        since=stamp,
    )


def predict_track(track: ImageTrack, stamp: float) -> ImageTrack:
    """Returns a track at a later time [s]; until it has two points, its velocity is unknown."""
    dt = stamp - track.stamp
    F = np.array([[1.0, 0.0, dt, 0.0], [0.0, 1.0, 0.0, dt], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
    q = (SPEED_CHANGE * track.speed + SIZE_CHANGE * track.size) ** 2
    a, b, c = dt**3 / 3.0 * q, dt**2 / 2.0 * q, dt * q
    Q = np.array([[a, 0.0, b, 0.0], [0.0, a, 0.0, b], [b, 0.0, c, 0.0], [0.0, b, 0.0, c]])
    covariance = F @ track.covariance @ F.T + Q
    return replace(track, stamp=stamp, mean=read_only(F @ track.mean), covariance=read_only(covariance))


def measure(track: ImageTrack, u: float, v: float, extra: float = 0.0) -> ImageTrack:
    """Returns a predicted track after a measurement of its position.

    A measurement that is farther away than the filter expects, and was accepted all the same, shows a change of the
    velocity, such as a bounce: the velocity then counts as unknown.

    Args:
        track: predicted for the time of the measurement.
        u: column [px].
        v: row [px].
        extra: standard deviation to be added to that of the measurement [px].
    """
    r = (POSITION_ERROR * track.size + PIXEL_ERROR) ** 2 + extra**2
    innovation = np.array([u, v]) - track.mean[:2]
    P = track.covariance
    S_inverse = _inverse(P, r)
    surprise = float(innovation @ S_inverse @ innovation)
    if surprise > 16.0:
        P = P * (surprise / 4.0)
        S_inverse = _inverse(P, r)
    K = P[:, :2] @ S_inverse
    mean = track.mean + K @ innovation
    P = P - K @ P[:2]
    return replace(
        track,
        mean=read_only(mean),
        covariance=read_only(0.5 * (P + P.T)),
        hits=track.hits + 1,
        seen=track.stamp,
        place=read_only(np.array([u, v])),
        moving=0,
        region=None,
    )


def _inverse(P: np.ndarray, r: float) -> np.ndarray:
    """Returns the inverse of the covariance of an innovation (2, 2), from those of the track and of one coordinate."""
    a, b, c = float(P[0, 0]) + r, float(P[0, 1]), float(P[1, 1]) + r
    return np.array([[c, -b], [-b, a]]) / (a * c - b * b)


def with_region(
    track: ImageTrack,
    region: ImageRegion,
    image: np.ndarray,
    extra: float = 0.0,
    patience: int | None = None,
) -> ImageTrack:
    """Returns a predicted track after the region that shows its object alone.

    While an object stops or turns back, its moving edges do not enclose it evenly: where its patch is found, that place
    counts.

    Args:
        track: predicted for the time of the image.
        region: of the object, see `ImageTrack.alone`.
        image: grey uint8 (h, w).
        extra: see `measure`.
        patience: number of images after which the region counts, not the patch, which may show a part of the object;
            None for never.
    """
    surprise = math.hypot(region.u - track.mean[0], region.v - track.mean[1])
    steady = surprise <= max(1.0, STEADY * track.speed * (track.stamp - track.seen))
    u, v = region.u, region.v
    beside = 0
    if steady or track.hits < 3 or (patience is not None and track.beside >= patience):
        patch, centre = cut_patch(image, region)
    else:
        patch, centre = track.patch, track.centre
        found_u, found_v, score = find_patch(track, image, surprise + 0.5 * track.size)
        if score >= SURE:
            u, v = found_u, found_v
            beside = track.beside + 1
    w = max(SIZE_WEIGHT, 1.0 / (track.hits + 1))
    return replace(
        measure(track, u, v, extra),
        moving=region.pixel_count,
        region=region,
        beside=beside,
        width=track.width + w * (region.width - track.width),
        height=track.height + w * (region.height - track.height),
        pixel_count=track.pixel_count + w * (region.pixel_count - track.pixel_count),
        state=TrackState.MOVING,
        patch=patch,
        centre=centre,
        unlike=0,
    )


def cut_patch(image: np.ndarray, region: ImageRegion) -> tuple[np.ndarray, np.ndarray]:
    """Returns (the part of a grey image that a region covers, the place of its centroid in it [px])."""
    patch = image[region.top : region.top + region.height, region.left : region.left + region.width].copy()
    return read_only(patch), read_only(np.array([region.u - region.left, region.v - region.top]))


def find_patch(track: ImageTrack, image: np.ndarray, reach: float) -> tuple[float, float, float]:
    """Returns (u, v [px], correlation) of the best match of an object's patch near its predicted place.

    Args:
        track: predicted for the time of the image.
        image: grey uint8 (h, w).
        reach: distance from the prediction that is searched [px].
    """
    h, w = track.patch.shape
    factor = max(1.0, max(h, w) / LARGEST_PATCH)
    u, v = track.mean[:2] - track.centre
    left, top = max(int(np.floor(u - reach)), 0), max(int(np.floor(v - reach)), 0)
    right, bottom = int(np.ceil(u + reach)) + w, int(np.ceil(v + reach)) + h
    window, patch = image[top : max(bottom, top), left : max(right, left)], track.patch
    if factor > 1.0 and min(window.shape) > factor:
        window = cv2.resize(window, None, fx=1.0 / factor, fy=1.0 / factor, interpolation=cv2.INTER_AREA)
        patch = cv2.resize(patch, None, fx=1.0 / factor, fy=1.0 / factor, interpolation=cv2.INTER_AREA)
    if window.shape[0] < patch.shape[0] or window.shape[1] < patch.shape[1] or min(patch.shape) < 3:
        return float(track.mean[0]), float(track.mean[1]), 0.0
    score = cv2.matchTemplate(window, patch, cv2.TM_CCOEFF_NORMED)
    _, best, _, (x, y) = cv2.minMaxLoc(score)
    place = np.array([x + _vertex(score[y], x), y + _vertex(score[:, x], y)]) * factor + (left, top) + track.centre
    return float(place[0]), float(place[1]), best if np.isfinite(best) else 0.0


def _vertex(values: np.ndarray, k: int) -> float:
    """Returns the place of the vertex of a parabola through three neighbouring values, relative to the middle one."""
    if not 0 < k < len(values) - 1:
        return 0.0
    before, middle, after = (float(value) for value in values[k - 1 : k + 2])
    bend = before - 2.0 * middle + after
    return 0.0 if bend >= 0.0 else float(np.clip(0.5 * (before - after) / bend, -0.5, 0.5))
