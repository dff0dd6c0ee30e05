"""Segments objects in front of the still scene with a background model that is learned from the images of one camera.

Motion is visible at the edges of an object only, and two objects that are close to each other leave edges that nobody
can tell apart. The difference from a picture of the empty scene shows whole objects. The picture is learned: a pixel
enters it once nothing moves at the pixel. Until then, the region enclosed by moving edges stands for the object.
"""

from dataclasses import dataclass, replace

import cv2
import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.frozen_state import FrozenState, read_only
from drake_tracker.vision.check_settings import check_settings
from drake_tracker.vision.light_gain import SAME_LIGHT, light_gain
from drake_tracker.vision.shadow_test import bodies, largest_channel, opened, shadow_like
from drake_tracker.vision.silhouettes.config import Silhouettes

GHOST_EDGE_RATIO = 1.3
"""A region that stands still is a ghost, a place that an object has left, when the edges along its outline are this
many times as strong in the background as in the image."""
LEARNING_PERIOD = 4
"""Images from one learned image to the next, once the background is known."""
NARROW_AFTER = 60
"""Images after which gaps between moving edges are bridged up to `NARROW_JOIN` only: the objects have left their first
places, and the remaining unknown area lies between the objects."""
NARROW_JOIN = 9
"""See there [px]."""
SHOWS = 0.5
"""Consecutive images show an object if they show this share of the area that the object has swept recently."""
EARLIER_IMAGE = 2
"""Images from the one with which an image is compared to find moving objects to the image itself."""
QUIET_IMAGES = 12
"""Images without motion after which a pixel counts as still."""
MOTION_SHARE = 0.6
"""Least threshold for motion between two images, as a share of that for the difference from the background: stray
pixels that move do no harm."""
MOTION_NOISE = 1.2
"""Noise of the difference of two images, as a share of the noise of the difference from the background."""
NOISE_OF_MEDIAN = 0.8
"""Standard deviation of the noise of one channel, as a fraction of the median of the largest of three differences."""
NOISE_WEIGHT = 0.3
"""Weight of the newest image in the estimate of the noise."""
LEVEL_ROWS = 4
"""One row in this many is enough to measure brightness and noise of an image."""
MARGIN = 3
"""Pixels around a silhouette that are looked at with it, and not learned from."""
BORDER = 3
"""Width [px] of the strip along the border of the image and of the window: an object that reaches it is cut off."""
_SMALL, _MEDIUM, _START = np.ones((3, 3), np.uint8), np.ones((5, 5), np.uint8), np.ones((9, 9), np.uint8)


@dataclass(frozen=True, eq=False)
class Background(FrozenState):
    """Memory of one camera's images.

    Attributes:
        mean: float32 (h, w, 3), the scene without objects [grey levels].
        picture: the same, uint8.
        known: uint8 (h, w), 255 where the scene is known.
        quiet: uint8 (h, w), images since something moved, up to 255.
        reference: the image with which the next one is compared to find motion, uint8 (h, w, 3).
        light: brightness of that image as a share of the background's.
        newest: the last two images and their brightness as a share of the background's, newest first.
        moving: uint8 (h, w), 255 where edges moved when that was last looked for.
        swept: uint8 (h, w), the same with the gaps between edges filled.
        mask: uint8 (h, w), the newest silhouettes.
        border: uint8 (h, w), 255 along the border of the examined area, and beyond it.
        noise: standard deviation of the difference from the background [grey levels].
        count: number of images so far.
    """

    mean: np.ndarray
    picture: np.ndarray
    known: np.ndarray
    quiet: np.ndarray
    reference: np.ndarray
    light: float
    newest: tuple[tuple[np.ndarray, float], ...]
    moving: np.ndarray
    swept: np.ndarray
    mask: np.ndarray
    border: np.ndarray
    noise: float
    count: int


class BackgroundModel:
    """Learns the background of a camera's images, and segments the foreground.

    A pixel is foreground when one of its channels differs from the background by more than a threshold, which follows
    the noise of the images. Pixels that are darker than the background but of the same colour are shadow, provided that
    the region also has other pixels; a dark object has only dark pixels. All state is with the caller.

    Args:
        settings: `Silhouettes`.
        window: uint8 (h, w) of the image's shape, 0 where objects are ignored; None uses the whole image.
        update_cycles: cycles from one image to the next. Numbers of images above are numbers of cycles.

    Raises DrakeTrackerError when a setting is outside its range or the window is empty.
    """

    def __init__(
        self, settings: Silhouettes = Silhouettes(), *, window: np.ndarray | None = None, update_cycles: int = 1
    ) -> None:
        check_settings(settings, "silhouettes")
        self.settings, self._cycles = settings, update_cycles
        self._learning_period = max(LEARNING_PERIOD // update_cycles, 1)
        self._earlier = max(EARLIER_IMAGE // update_cycles, 1)
        self._window = None
        if window is not None:
            self._window = np.where(np.asarray(window) > 0, np.uint8(255), np.uint8(0))
            if not self._window.any():
                raise DrakeTrackerError("silhouettes: the window of interest is empty")
        self._joins = [int(distance) | 1 for distance in (settings.join_distance, NARROW_JOIN)]

    def smooth(self, image: np.ndarray) -> np.ndarray:
        """Returns an image (h, w, 3), uint8, with less noise."""
        return read_only(cv2.GaussianBlur(image, (3, 3), 0.8))

    def start(self, image: np.ndarray) -> Background:
        """Returns the state after the first smoothed image (h, w, 3): nothing is known of the background yet."""
        blank = read_only(np.zeros(image.shape[:2], np.uint8))
        mean = read_only(image.astype(np.float32))
        border = self._border(image.shape[:2])
        return Background(mean, image, blank, blank, image, 1.0, (), blank, blank, blank, border, 1.0, 1)

    def _border(self, shape: tuple[int, int]) -> np.ndarray:
        """Returns the border of the examined area, and the area beyond it, uint8 of a shape (h, w)."""
        inside = np.full(shape, 255, np.uint8) if self._window is None else self._window
        wide = cv2.copyMakeBorder(inside, 1, 1, 1, 1, cv2.BORDER_CONSTANT)
        side = 2 * BORDER + 1
        return read_only(cv2.bitwise_not(cv2.erode(wide, np.ones((side, side), np.uint8))[1:-1, 1:-1]))

    def difference(self, state: Background, image: np.ndarray) -> np.ndarray:
        """Returns the largest difference of a smoothed image from the background over the channels, uint8 (h, w)."""
        return largest_channel(cv2.absdiff(image, state.picture))

    def update(
        self,
        state: Background,
        image: np.ndarray,
        hidden: np.ndarray | None = None,
        tolerance: np.ndarray | None = None,
        difference: np.ndarray | None = None,
    ) -> tuple[Background, bool]:
        """Returns the state after an image, and whether the image could be compared with the background.

        Args:
            state: the state before the image.
            image: smoothed image, uint8 (h, w, 3).
            hidden: uint8 (h, w), 255 where the robot's own arm is expected, or None.
            tolerance: uint8 (h, w), further difference that does not count [grey levels], or None.
            difference: as from `difference`, if it is known.
        """
        settings = self.settings
        gain = self._gain(state, image)
        if gain is None:
            blank = read_only(np.zeros_like(state.mask))
            return replace(state, mask=blank, count=state.count + 1), False
        picture = state.picture
        if abs(gain - 1.0) >= SAME_LIGHT:
            picture, difference = cv2.convertScaleAbs(picture, alpha=gain), None
        if difference is None:
            difference = largest_channel(cv2.absdiff(image, picture))
        if tolerance is not None:
            difference = cv2.subtract(difference, tolerance)
        learning = self._is_starting(state) or state.count % self._learning_period == 0
        if state.count == 1:
            first = NOISE_OF_MEDIAN * float(np.median(difference[::LEVEL_ROWS]))
            state = replace(state, noise=first)
        motion_threshold = max(MOTION_SHARE * settings.threshold, MOTION_NOISE * settings.noise_factor * state.noise)
        if learning:
            state = self._find_motion(state, image, gain, motion_threshold)
        threshold = max(settings.threshold, settings.noise_factor * state.noise)
        mask = cv2.threshold(difference, threshold, 255, cv2.THRESH_BINARY)[1]
        unknown = self._within(cv2.bitwise_not(state.known), hidden)
        if cv2.countNonZero(unknown):
            here = self._moving_objects(state, image, gain, motion_threshold)
            cv2.copyTo(here, unknown, mask)
        mask = opened(self._within(mask, hidden))
        mask = self._without_shadows(mask, state.known, image, picture)
        newest = ((image, gain), *state.newest)[: self._earlier]
        state = replace(state, mask=read_only(mask), newest=newest, count=state.count + 1)
        return (self._learn(state, image, picture, difference, gain, hidden) if learning else state), True

    def _is_starting(self, state: Background) -> bool:
        return state.count * self._cycles <= QUIET_IMAGES

    def _gain(self, state: Background, image: np.ndarray) -> float | None:
        """Returns the brightness of the still scene as a share of the background's, None when the light has changed."""
        still = cv2.subtract(state.known[::LEVEL_ROWS], state.mask[::LEVEL_ROWS])
        if not cv2.countNonZero(still):
            return 1.0
        before, now = (sum(cv2.mean(each[::LEVEL_ROWS], mask=still)[:3]) for each in (state.picture, image))
        return light_gain(before, now)

    def _find_motion(self, state: Background, image: np.ndarray, light: float, threshold: float) -> Background:
        """Returns the state with the pixels that changed since the reference image, and the area that they enclose."""
        moving = opened(self._within(_changed(image, state.reference, light / state.light, threshold)))
        swept = self._filled(moving, state.count)
        starting = self._is_starting(state)
        quiet = cv2.add(state.quiet, self._cycles * (1 if starting else self._learning_period))
        quiet = cv2.subtract(quiet, cv2.dilate(swept, _START if starting else _SMALL))
        newest = state.count % self._learning_period == 0
        return replace(
            state,
            reference=image if newest else state.reference,
            light=light if newest else state.light,
            moving=read_only(moving),
            swept=read_only(swept),
            quiet=read_only(quiet),
        )

    def _moving_objects(self, state: Background, image: np.ndarray, light: float, threshold: float) -> np.ndarray:
        """Returns the moving objects of an image where nothing is known of the background, uint8 (h, w), 255 on them.

        The difference of two images shows an object where it is and where it was. The shorter the time between them,
        the smaller the error, but a slow object does not show in images that follow each other closely.
        """
        if len(state.newest) < self._earlier or not cv2.countNonZero(state.swept):
            return state.swept
        earlier, its_light = state.newest[-1]
        close = self._filled(opened(self._within(_changed(image, earlier, light / its_light, threshold))), state.count)
        count, labels = cv2.connectedComponents(cv2.bitwise_or(state.swept, close), connectivity=8)
        small, large = (np.bincount(labels[each > 0], minlength=count) for each in (close, state.swept))
        shows = small >= SHOWS * large
        return np.where(shows[labels], close, state.swept)

    def _filled(self, moving: np.ndarray, count: int) -> np.ndarray:
        """Returns the area that moving pixels enclose, uint8 (h, w).

        Args:
            moving: uint8 (h, w), 255 where edges move.
            count: number of images before this one.
        """
        filled = _closed(moving, self._joins[count * self._cycles > NARROW_AFTER])
        for outline in cv2.findContours(filled, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)[0]:
            cv2.fillConvexPoly(filled, cv2.convexHull(outline), 255)
        return filled

    def _learn(
        self,
        state: Background,
        image: np.ndarray,
        picture: np.ndarray,
        difference: np.ndarray,
        gain: float,
        hidden: np.ndarray | None,
    ) -> Background:
        """Returns the state after learning the background from an image.

        Args:
            state: the state after the image.
            image: the smoothed image.
            picture: the background in the light of the image.
            difference: the largest difference of the two over the channels.
            gain: brightness of the image as a share of the background's.
            hidden: the area that the robot's own arm covers, or None.
        """
        known, mask, mean = state.known, state.mask, state.mean.copy()
        ghosts = self._ghosts(state, image, picture)
        if ghosts is not None:
            mask, known = (read_only(cv2.subtract(each, ghosts)) for each in (mask, known))
        learn = cv2.threshold(state.quiet, QUIET_IMAGES - 1, 255, cv2.THRESH_BINARY)[1]
        if hidden is not None:
            learn = cv2.subtract(learn, hidden)
        scene = cv2.convertScaleAbs(image, alpha=1.0 / gain)
        fresh = cv2.subtract(learn, known)
        if cv2.countNonZero(fresh):
            np.copyto(mean, scene, where=fresh[..., None] > 0)
            known = read_only(cv2.bitwise_or(known, fresh))
        still = cv2.subtract(learn, cv2.dilate(mask, _MEDIUM))
        cv2.accumulateWeighted(scene, mean, self.settings.learning_rate, still)
        values = difference[::LEVEL_ROWS][still[::LEVEL_ROWS] > 0]
        noise = state.noise
        if len(values):
            noise += NOISE_WEIGHT * (NOISE_OF_MEDIAN * _median(values) - noise)
        return replace(
            state,
            mean=read_only(mean),
            picture=read_only(cv2.convertScaleAbs(mean)),
            known=known,
            mask=mask,
            noise=noise,
        )

    def _within(self, mask: np.ndarray, hidden: np.ndarray | None = None) -> np.ndarray:
        if self._window is not None:
            mask = cv2.bitwise_and(mask, self._window)
        return mask if hidden is None else cv2.subtract(mask, hidden)

    def _without_shadows(
        self, mask: np.ndarray, known: np.ndarray, image: np.ndarray, picture: np.ndarray
    ) -> np.ndarray:
        """Returns the silhouettes without shadows: pixels that are darker than the background, of the same colour."""
        settings = self.settings
        u0, v0, width, height = cv2.boundingRect(mask)
        if width == 0:
            return mask
        box = slice(v0, v0 + height), slice(u0, u0 + width)
        shadow = cv2.bitwise_and(shadow_like(image[box], picture[box], settings), known[box])
        whole = mask[box]
        if not cv2.countNonZero(cv2.bitwise_and(shadow, whole)):
            return mask
        body = bodies(whole, shadow, settings.body_share)
        result = np.zeros_like(mask)
        result[box] = body
        return result

    def _ghosts(self, state: Background, image: np.ndarray, picture: np.ndarray) -> np.ndarray | None:
        """Returns the places that objects have left since they became part of the background, uint8, None without any.

        A region in which nothing moves either shows an object that stands, which has edges along its outline in the
        image, or a place that an object has left, which has them in the background only.
        """
        still = cv2.compare(state.quiet, QUIET_IMAGES, cv2.CMP_GE)
        if not cv2.countNonZero(cv2.bitwise_and(state.mask, still)):
            return None
        count, labels, statistics, _ = cv2.connectedComponentsWithStats(state.mask, connectivity=8)
        found = None
        for label in range(1, count):
            u0, v0, width, height, _ = statistics[label]
            box = slice(max(v0 - MARGIN, 0), v0 + height + MARGIN), slice(max(u0 - MARGIN, 0), u0 + width + MARGIN)
            region = (labels[box] == label).view(np.uint8)
            if cv2.countNonZero(cv2.subtract(region, still[box])):
                continue
            outline = cv2.morphologyEx(region, cv2.MORPH_GRADIENT, _SMALL)
            now, before = (_edges(each[box], outline) for each in (image, picture))
            if before > GHOST_EDGE_RATIO * now:
                found = np.zeros_like(state.mask) if found is None else found
                found[box][cv2.dilate(region, _MEDIUM) > 0] = 255
        return found


def _closed(mask: np.ndarray, side: int) -> np.ndarray:
    """Returns a mask whose gaps are closed by a square, its side odd [px].

    Beyond the image, nothing is set. OpenCV would treat the area beyond the border as unknown, and fill the gap between
    a region and the border of the image, where an object has just entered.
    """
    half = side // 2
    wide = cv2.copyMakeBorder(mask, half, half, half, half, cv2.BORDER_CONSTANT)
    wide = cv2.morphologyEx(wide, cv2.MORPH_CLOSE, np.ones((side, side), np.uint8))
    return wide[half:-half, half:-half].copy()


def _changed(image: np.ndarray, earlier: np.ndarray, gain: float, threshold: float) -> np.ndarray:
    """Returns the pixels at which an image differs from an earlier image, uint8 (h, w), 255 there.

    Args:
        image: smoothed, uint8 (h, w, 3).
        earlier: smoothed, of the same shape.
        gain: brightness of the image as a share of the earlier one's.
        threshold: least difference that counts [grey levels].
    """
    if abs(gain - 1.0) >= SAME_LIGHT:
        earlier = cv2.convertScaleAbs(earlier, alpha=gain)
    return cv2.threshold(largest_channel(cv2.absdiff(image, earlier)), threshold, 255, cv2.THRESH_BINARY)[1]


def _median(values: np.ndarray) -> float:
    """Returns the median of values, uint8 (n,), which are reordered: ``np.median`` in less time."""
    middle = len(values) // 2
    lower = middle if len(values) % 2 else middle - 1
    values.partition((lower, middle))
    return 0.5 * (float(values[lower]) + float(values[middle]))


def _edges(picture: np.ndarray, outline: np.ndarray) -> float:
    """Returns the mean strength of the edges of a picture (h, w, 3) on an outline (h, w) [grey levels/px]."""
    grey = cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY)
    du, dv = (cv2.Sobel(grey, cv2.CV_32F, *order, scale=0.125) for order in ((1, 0), (0, 1)))
    return cv2.mean(cv2.magnitude(du, dv), mask=outline)[0]
