"""A camera's model of the empty belt, although the belt is never empty and its texture moves.

Whatever the texture, the same stretch of belt passes every pixel in turn. The appearance of the empty belt at a pixel
is therefore a mean and a spread over time, which the texture is part of; no picture of the texture is needed, and a
belt that stops or changes its speed looks the same. At the start, the neighbours along the belt take the place of the
past: the median over a stretch that is much longer than a part.
"""

from dataclasses import dataclass, replace

import cv2
import numpy as np

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.core.frozen_state import FrozenState, read_only
from drake_tracker.vision.check_settings import check_settings
from drake_tracker.vision.light_gain import SAME_LIGHT, light_gain
from drake_tracker.vision.parts.config import BeltParts
from drake_tracker.vision.shadow_test import bodies, largest_channel, opened, shadow_like

ACROSS, ALONG = 0.02, 0.25
"""Size of the cells in which the belt is taken to look alike at the start, across and along the belt [m]."""
FEW = 12
"""Pixels that a cell must have."""
LEARNING_PERIOD = 4
"""Images from one learned image to the next."""
SPREAD_SHARE = 0.8
"""Standard deviation of one channel as a fraction of the usual largest of three differences."""
EDGE_SHARE = 0.45
"""Smoothing spreads the outline of an object. A pixel on the outline belongs to the object if its difference is at
least this share of the largest difference beside it: then the object covers about half of the pixel."""
_NEAR, _BESIDE = np.ones((3, 3), np.uint8), np.ones((9, 9), np.uint8)


@dataclass(frozen=True, eq=False)
class BeltLook(FrozenState):
    """Memory of one camera's images.

    Attributes:
        mean: float32 (h, w, 3), the empty belt [grey levels].
        picture: the same, uint8.
        spread: float32 (h, w), standard deviation of its largest difference from an image [grey levels].
        mask: uint8 (h, w), 255 on the foreground of the newest image.
        doubtful: uint8 (h, w), 255 where the newest image shows a shadow.
        count: number of images so far.
    """

    mean: np.ndarray
    picture: np.ndarray
    spread: np.ndarray
    mask: np.ndarray
    doubtful: np.ndarray
    count: int


class BeltSurface:
    """Segments the objects on a belt in the images of one camera. All state is with the caller.

    Args:
        camera: calibrated camera.
        window: the part of the full image that the images show, (u0, v0, width, height) [px].
        seen: uint8 (h, w), not 0 where the image shows the belt.
        belt_height: z_W of the belt's upper face [m].
        settings: `BeltParts`.

    Raises DrakeTrackerError when a setting is out of range.
    """

    def __init__(
        self,
        camera: CameraModel,
        window: tuple[int, int, int, int],
        seen: np.ndarray,
        belt_height: float,
        settings: BeltParts = BeltParts(),
    ) -> None:
        check_settings(settings, "parts")
        self._settings = settings
        self._seen = np.where(seen > 0, np.uint8(255), np.uint8(0))
        u0, v0, width, height = window
        grid = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1).reshape(-1, 2) + (u0, v0)
        origin, directions = camera.rays(grid)
        with np.errstate(divide="ignore"):
            places = origin[:2] + directions[:, :2] * ((belt_height - origin[2]) / directions[:, 2])[:, None]
        self._cells, self._count = _cells(places, self._seen.reshape(-1) > 0)

    def start(self, image: np.ndarray) -> BeltLook:
        """Returns the state before the first image (h, w, 3), uint8, which already tells how the belt looks."""
        smooth = _smooth(image)
        pixels = smooth.reshape(-1, 3)
        mean = pixels.copy()
        whole = np.median(pixels[self._seen.reshape(-1) > 0], axis=0)
        for cell in range(self._count):
            inside = self._cells == cell
            mean[inside] = np.median(pixels[inside], axis=0) if np.count_nonzero(inside) >= FEW else whole
        mean = cv2.blur(mean.reshape(smooth.shape), _BESIDE.shape)
        difference = largest_channel(cv2.absdiff(smooth, mean))
        spread = SPREAD_SHARE * float(np.median(difference[self._seen > 0]))
        nothing = read_only(np.zeros(self._seen.shape, np.uint8))
        return BeltLook(
            read_only(mean.astype(np.float32)),
            read_only(mean),
            read_only(np.full(mean.shape[:2], spread, np.float32)),
            nothing,
            nothing,
            0,
        )

    def update(self, look: BeltLook, image: np.ndarray, hidden: np.ndarray | None = None) -> BeltLook:
        """Returns the state after an image.

        Args:
            look: the state before.
            image: (h, w, 3), uint8.
            hidden: uint8 (h, w), 255 where the robot's own arm covers the belt; None: nowhere.
        """
        settings = self._settings
        smooth = _smooth(image)
        free = self._seen if hidden is None else cv2.subtract(self._seen, hidden)
        picture, gain = look.picture, self._gain(look, smooth, free)
        if abs(gain - 1.0) >= SAME_LIGHT:
            picture = cv2.convertScaleAbs(picture, alpha=gain)
        difference = largest_channel(cv2.absdiff(smooth, picture))
        least = cv2.max(cv2.convertScaleAbs(look.spread, alpha=settings.noise_factor), settings.threshold)
        standing = cv2.bitwise_and(cv2.compare(difference, least, cv2.CMP_GT), free)
        # The outline of an object is where it covers half a pixel, not where it is first noticed.
        around = cv2.dilate(cv2.bitwise_and(difference, standing), _NEAR)
        weak = cv2.compare(difference, cv2.convertScaleAbs(around, alpha=EDGE_SHARE), cv2.CMP_LE)
        weak = cv2.subtract(weak, cv2.erode(standing, _NEAR))
        mask = opened(cv2.subtract(standing, weak))
        doubtful = cv2.bitwise_and(shadow_like(smooth, picture, settings), mask)
        if cv2.countNonZero(doubtful):
            body = bodies(mask, doubtful, settings.body_share)
            mask, doubtful = body, cv2.subtract(doubtful, body)
        look = replace(look, mask=read_only(mask), doubtful=read_only(doubtful), count=look.count + 1)
        return self._learn(look, smooth, difference, free) if look.count % LEARNING_PERIOD == 1 else look

    def _gain(self, look: BeltLook, smooth: np.ndarray, free: np.ndarray) -> float:
        """Returns the brightness of the belt as a share of the remembered brightness."""
        empty = cv2.subtract(free, look.mask)
        if not cv2.countNonZero(empty):
            return 1.0
        before, now = (sum(cv2.mean(each, mask=empty)[:3]) for each in (look.picture, smooth))
        return light_gain(before, now) or 1.0

    def _learn(self, look: BeltLook, smooth: np.ndarray, difference: np.ndarray, free: np.ndarray) -> BeltLook:
        """Returns the state after learning the empty belt from an image."""
        empty = cv2.subtract(free, cv2.dilate(cv2.bitwise_or(look.mask, look.doubtful), _BESIDE))
        mean, spread = look.mean.copy(), look.spread.copy()
        cv2.accumulateWeighted(smooth, mean, self._settings.learning_rate, empty)
        usual = cv2.multiply(difference, SPREAD_SHARE, dtype=cv2.CV_32F)
        cv2.accumulateWeighted(usual, spread, self._settings.learning_rate, empty)
        picture = read_only(cv2.convertScaleAbs(mean))
        return replace(look, mean=read_only(mean), picture=picture, spread=read_only(spread))


def _smooth(image: np.ndarray) -> np.ndarray:
    return cv2.GaussianBlur(image, (3, 3), 0.8)


def _cells(places: np.ndarray, seen: np.ndarray) -> tuple[np.ndarray, int]:
    """Returns the number of the cell of each pixel, -1 where the belt is not seen, and the number of cells."""
    cells = np.full(len(places), -1)
    index = np.floor(places[seen] / (ACROSS, ALONG)).astype(int)
    index -= index.min(axis=0)
    number = index[:, 0] * (index[:, 1].max() + 1) + index[:, 1]
    cells[seen] = number
    return cells, int(number.max()) + 1
