"""The common part of the detectors of the NIST paper: 8-bit smoothing, a window, and the centroid of a binary image.

Source: Nashman and Chaconas, *Three-Dimensional Position Determination from Motion*, 1990, section 4. The three
detectors differ in the image that they threshold: `FrameDifferenceDetector`, `BackgroundDifferenceDetector`,
`StaticThresholdDetector`. All arithmetic is on 8-bit images, as in PIPE.
"""

from typing import Generic, TypeVar

import cv2
import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.vision.centroid.config import BinaryImage
from drake_tracker.vision.check_settings import check_odd, check_settings
from drake_tracker.vision.region_centroid import RegionCentroid, find_centroid

LEVEL_ROWS = 4
"""One row in this many is enough to measure the brightness of an image."""

Settings = TypeVar("Settings", bound=BinaryImage)


class BinaryDetector(Generic[Settings]):
    """Base of the detectors: smoothing before the threshold, window and centroid after it.

    Args:
        settings: of the detector, a subclass of `BinaryImage`.
        window: uint8 (h, w) of the image's shape, 0 where motion is ignored; None uses the whole image.

    Raises DrakeTrackerError when a setting is outside its range or the window is empty.
    """

    def __init__(self, settings: Settings, *, window: np.ndarray | None = None) -> None:
        check_settings(settings, "detector")
        check_odd(settings.smoothing_size, "detector")
        self.settings = settings
        self._window = None
        if window is not None:
            self._window = np.where(np.asarray(window) > 0, np.uint8(255), np.uint8(0))
            if not self._window.any():
                raise DrakeTrackerError("detector: the window of interest is empty")

    def smooth(self, grey: np.ndarray) -> np.ndarray:
        """Returns a grey uint8 image (h, w) convolved with the Gaussian mask, uint8."""
        settings = self.settings
        return cv2.GaussianBlur(grey, (int(settings.smoothing_size),) * 2, settings.smoothing_sigma)

    def centroid(self, mask: np.ndarray) -> RegionCentroid | None:
        """Returns the `RegionCentroid` of a binary image, or None when too few of its pixels are white.

        The mean is the sum of the white pixels' addresses (accumulative histogram) divided by their number (frequency
        histogram); section 3 prints the division upside down.
        """
        settings = self.settings
        return find_centroid(mask, settings.centroid, settings.join_distance, settings.min_pixels)

    def _binary(self, image: np.ndarray, threshold: float) -> np.ndarray:
        """Returns a mask: 255 where a uint8 image is above the threshold [grey] and inside the window, else 0."""
        mask = cv2.threshold(image, threshold, 255, cv2.THRESH_BINARY)[1]
        return mask if self._window is None else cv2.bitwise_and(mask, self._window)

    def _level(self, image: np.ndarray) -> float:
        """Returns the mean of an image inside the window [grey], from every fourth row: illumination is uniform."""
        return cv2.mean(image[::LEVEL_ROWS], mask=None if self._window is None else self._window[::LEVEL_ROWS])[0]
