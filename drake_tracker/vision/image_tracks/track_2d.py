"""The track of an object in the images of one camera: a Kalman filter of position and velocity in pixels.

All noises are proportional to the size and the speed of the object itself, so that they suit any scale.
"""

import math
from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np

from drake_tracker.core.frozen_state import FrozenState, read_only
from drake_tracker.vision.image_tracks.image_patch import SURE, Scene, cut_patch, find_patch, is_scene, with_scene
from drake_tracker.vision.image_tracks.image_regions import ImageRegion

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
WHOLE, FORGET_AREA, AREA_KNOWN = 0.75, 0.995, 10
"""A region below this share of the area that its object had shows it partly hidden; that area shrinks by the second
factor from image to image, and is known after the third number of images. The patch is then not replaced: it would
increasingly show the occluding object."""
STEADY = 0.25
"""Share of its displacement by which an object may be beside the place where it is expected, for its patch to be taken,
see `with_region`."""
UNSTEADY_IMAGES = 15
"""Consecutive images after which the whole region counts although its patch lies beside the centre of the region: the
patch was cut out while the object was partly occluded."""
LARGEST_MARGIN = 0.4
"""Largest share of a region on each side that shows where its object was and will be."""
FAST, SWEPT = 0.75, 0.25
"""Least motion from image to image, in sizes, at which an exact region shows a fast object better; and the largest
relative error of the swept width and height."""
SURE_SIZE = 1.3
"""Largest ratio of the width or height of an exact region to the width or height of the object at which the region
gives the object's place."""
SLOW = 0.25
"""Speed below which an object may stand, in sizes per second."""


class TrackState2D(IntEnum):
    """Motion state of an object."""

    LOST = 0
    MOVING = 1
    STANDING = 2
    HIDDEN = 3


@dataclass(frozen=True, eq=False)
class Track2D(FrozenState):
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
        state: `TrackState2D`.
        patch: grey uint8, the object when it was last seen alone.
        centre: place of the object's centroid in the patch (u, v) [px], shape (2,).
        area: of its rectangle, the largest of late [px^2].
        unsteady: number of newest images in which its patch was found beside the place where it was expected.
        unlike: number of newest images in which its region was too large or too small.
        since: stamp of the image in which it was seen first [s].
        place: u, v where it was seen last [px], shape (2,).
        moving: number of moving pixels when it was seen last, 0 if it was found by its patch.
        region: its region then, None if it was found by its patch.
        scenes: earlier images of a camera that does not move, see `image_patch.with_scene`.
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
    state: TrackState2D
    patch: np.ndarray
    centre: np.ndarray
    place: np.ndarray
    area: float
    moving: int = 0
    region: ImageRegion | None = None
    unlike: int = 0
    unsteady: int = 0
    since: float = 0.0
    scenes: tuple[Scene, ...] = ()

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
    def was_exact(self) -> bool:
        """Whether its last region showed it where it was, without where it had been and would be."""
        return self.region is not None and self.region.exact

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
        inner = region.inner
        if inner is not None and self.sweeps(inner, region, reach):
            return inner
        if region.exact or self.hits < 3:
            return region
        across = int(min(abs(self.mean[2]) * reach, LARGEST_MARGIN * region.width))
        down = int(min(abs(self.mean[3]) * reach, LARGEST_MARGIN * region.height))
        part = region._replace(
            left=region.left + across,
            top=region.top + down,
            width=region.width - 2 * across,
            height=region.height - 2 * down,
        )
        return part if inner is None or self.is_like(part) or not self.is_like(inner) else inner

    def sweeps(self, inner: ImageRegion, region: ImageRegion, reach: float) -> bool:
        """Returns whether the object, if it has the size of an exact region, has swept the region round it.

        Args:
            inner: exact region, see `ImageRegion.inner`.
            region: round it.
            reach: see `alone`.
        """
        if self.hits < 2 or self.speed * reach < FAST * inner.extent:
            return False
        across, down = abs(self.mean[2]) * reach, abs(self.mean[3]) * reach
        return bool(
            abs(inner.width + 2.0 * across - region.width) < SWEPT * region.width
            and abs(inner.height + 2.0 * down - region.height) < SWEPT * region.height
        )

    def is_sure(self, region: ImageRegion) -> bool:
        """Returns whether a region is exact and has the object's width and height.

        Where an object turns back, an exact region may also contain the place where it was before and will be again.
        Width, height and patch of an object that turned back when it was new may be those of a region with all of these
        places: a smaller exact region then shows the object alone.
        """
        if not region.exact:
            return False
        ratios = region.width / self.width, region.height / self.height
        if all(1.0 / SURE_SIZE < ratio < SURE_SIZE for ratio in ratios):
            return True
        excess = self.patch.shape[1] / region.width, self.patch.shape[0] / region.height
        return self.hits < AREA_KNOWN and min(excess) > 1.0 / SURE_SIZE and max(excess) > SURE_SIZE

    def is_like(self, region: ImageRegion) -> bool:
        """Returns whether a region has about the size of the object."""
        ratio = region.width * region.height / (self.width * self.height)
        return 1.0 / LIKE < ratio < LIKE


def start_track(number: int, stamp: float, region: ImageRegion, image: np.ndarray) -> Track2D:
    """Returns the track of an object that was seen for the first time.

    Args:
        number: its identity.
        stamp: of the image [s].
        region: that shows it.
        image: grey uint8 (h, w).
    """
    patch, centre = cut_patch(image, region)
    spread = np.diag([1.0, 1.0, 900.0, 900.0]) * (POSITION_ERROR * region.extent + PIXEL_ERROR) ** 2
    return Track2D(
        number=number,
        stamp=stamp,
        mean=read_only(np.array([region.u, region.v, 0.0, 0.0])),
        covariance=read_only(spread),
        width=region.width,
        height=region.height,
        pixel_count=region.pixel_count,
        hits=1,
        seen=stamp,
        state=TrackState2D.MOVING,
        patch=patch,
        centre=centre,
        place=read_only(np.array([region.u, region.v])),
        area=float(region.width * region.height),
        moving=region.pixel_count,
        region=region,
        since=stamp,
    )


def remember_scene(track: Track2D, image: np.ndarray, displacement: float) -> Track2D:
    """Returns a track with the image among its scenes, if the image shows the object; without scenes when the camera
    moves.

    Args:
        track: after the image.
        image: grey uint8 (h, w).
        displacement: of the whole image [px].
    """
    if displacement > 0.0:
        return replace(track, scenes=())
    if track.seen < track.stamp:
        return track
    return replace(track, scenes=with_scene(track.scenes, image, track.place, track.size))


def predict_track(track: Track2D, stamp: float) -> Track2D:
    """Returns a track at a later time [s]; until it has two points, its velocity is unknown."""
    dt = stamp - track.stamp
    mean, covariance = constant_velocity(track.mean, track.covariance, dt, track.speed, track.size)
    return replace(track, stamp=stamp, mean=mean, covariance=covariance)


def constant_velocity(
    mean: np.ndarray, covariance: np.ndarray, dt: float, speed: float, size: float
) -> tuple[np.ndarray, np.ndarray]:
    """Returns (mean, covariance), both read-only, after a time in which the velocity changes by white noise.

    Args:
        mean: n coordinates and their rates, shape (2n,).
        covariance: of the mean, shape (2n, 2n).
        dt: the time [s].
        speed: of the object.
        size: of the object, in the unit of the coordinates.
    """
    n = len(mean) // 2
    position = np.arange(n)
    rate = position + n
    q = (SPEED_CHANGE * speed + SIZE_CHANGE * size) ** 2
    F, Q = np.eye(2 * n), np.zeros((2 * n, 2 * n))
    F[position, rate] = dt
    Q[position, position] = dt**3 / 3.0 * q
    Q[position, rate] = Q[rate, position] = dt**2 / 2.0 * q
    Q[rate, rate] = dt * q
    return read_only(F @ mean), read_only(F @ covariance @ F.T + Q)


def measure(track: Track2D, u: float, v: float, extra: float = 0.0) -> Track2D:
    """Returns a predicted track after a measurement of its position.

    An accepted measurement that is farther away than the filter expects shows a change of the velocity, such as a
    bounce: the velocity then counts as unknown.

    Args:
        track: predicted for the time of the measurement.
        u: column [px].
        v: row [px].
        extra: additional standard deviation of the measurement [px].
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
    """Returns the inverse of the covariance of an innovation (2, 2), from the covariance of the track and the variance
    of one coordinate."""
    a, b, c = float(P[0, 0]) + r, float(P[0, 1]), float(P[1, 1]) + r
    return np.array([[c, -b], [-b, a]]) / (a * c - b * b)


def with_region(
    track: Track2D, region: ImageRegion, image: np.ndarray, extra: float = 0.0, company: bool = False
) -> Track2D:
    """Returns a predicted track after the region that shows its object alone.

    While an object stops or turns back, its moving edges do not enclose it evenly. If its patch is found, the place of
    the patch counts, unless the scene looked alike before the object arrived. The patch stays as it is while the object
    is partly hidden.

    Args:
        track: predicted for the time of the image.
        region: of the object, see `Track2D.alone`.
        image: grey uint8 (h, w).
        extra: see `measure`.
        company: whether the region may show another object near it.
    """
    surprise = math.hypot(region.u - track.mean[0], region.v - track.mean[1])
    steady = surprise <= max(1.0, STEADY * track.speed * (track.stamp - track.seen))
    u, v = region.u, region.v
    patch, centre = track.patch, track.centre
    whole = track.hits < AREA_KNOWN or region.width * region.height >= WHOLE * track.area
    if steady or track.hits < 3 or track.is_sure(region) or (whole and track.unsteady >= UNSTEADY_IMAGES):
        unsteady = 0
        if whole:
            patch, centre = cut_patch(image, region)
    else:
        found = find_patch(patch, centre, track.mean[:2], image, surprise + 0.5 * track.size)
        unsteady = track.unsteady + 1 if found[2] >= SURE and not company else 0
        if found[2] >= SURE and not is_scene(patch, centre, found, track.scenes):
            u, v, _ = found
    w = 1.0 if region.exact and not track.is_like(region) else max(SIZE_WEIGHT, 1.0 / (track.hits + 1))
    width = track.width + w * (region.width - track.width)
    height = track.height + w * (region.height - track.height)
    area = width * height if track.hits < AREA_KNOWN else max(width * height, FORGET_AREA * track.area)
    return replace(
        measure(track, u, v, extra),
        moving=region.pixel_count,
        region=region,
        width=width,
        height=height,
        area=area,
        pixel_count=track.pixel_count + w * (region.pixel_count - track.pixel_count),
        state=TrackState2D.MOVING,
        patch=patch,
        centre=centre,
        unlike=0,
        unsteady=unsteady,
    )
