"""What the detectors of the NIST paper share: 8-bit smoothing, a window, and the centroid of a binary image.

Source: Nashman and Chaconas, *Three-Dimensional Position Determination from Motion*, 1990, section 4. The three
detectors differ in the image that they threshold: `FrameDifference`, `BackgroundDifference`, `StaticThreshold`. All
arithmetic is on 8-bit images, as PIPE's was.
"""

import math
from dataclasses import dataclass, fields

import cv2
import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.vision.region_centroid import hull_centroid, mean_centroid

LEVEL_ROWS = 4
"""Every so many rows are enough to tell how bright an image is."""


@dataclass(frozen=True)
class BinaryDetectorParameters:
    """Settings that every detector with a binary image has.

    Attributes:
        smoothing_size, smoothing_sigma: Gaussian mask, odd side [px] and standard deviation [px].
        min_pixels: fewer white pixels make no centroid.
        centroid: "mean" of all white pixels (the paper's) or "hull" of the largest region, which leans less towards the
            side of the ball that its shading makes stand out from the board, and passes over stray pixels.
        join_distance: gap [px] across which the hull joins fragments of one object.

    Raises DrakeTrackerError on a value outside its range.
    """

    smoothing_size: int = 3
    smoothing_sigma: float = 1.0
    min_pixels: int = 6
    centroid: str = "hull"
    join_distance: int = 12

    _LEAST = {"smoothing_size": 1, "smoothing_sigma": 0.1, "min_pixels": 1, "join_distance": 1}
    """Least value of each number; a subclass adds its own."""

    def __post_init__(self):
        if self.centroid not in ("mean", "hull"):
            raise DrakeTrackerError(f"detector: centroid is {self.centroid!r}; it must be one of mean, hull")
        for field in fields(self):
            value, least = getattr(self, field.name), self._LEAST.get(field.name)
            if least is None:
                continue
            if not (math.isfinite(value) and value >= least):
                raise DrakeTrackerError(f"detector: {field.name} is {value}; it must be at least {least}")
            if field.type in (int, "int") and value != int(value):
                raise DrakeTrackerError(f"detector: {field.name} is {value}; it must be a whole number")
        if self.smoothing_size % 2 == 0:
            raise DrakeTrackerError(f"detector: smoothing_size is {self.smoothing_size} px; it must be odd")


class BinaryDetector:
    """Base of the detectors: smoothing before, window and centroid after the threshold.

    Args:
        parameters: `BinaryDetectorParameters` of the detector.
        window: uint8 of the image's shape, 0 where nothing is to be looked at; None looks everywhere.

    Raises DrakeTrackerError when the window is empty.
    """

    def __init__(self, parameters, window=None):
        self.parameters = parameters
        self._window = None
        if window is not None:
            self._window = np.where(np.asarray(window) > 0, np.uint8(255), np.uint8(0))
            if not self._window.any():
                raise DrakeTrackerError("detector: the window of interest is empty")

    def smooth(self, grey):
        """Returns a grey uint8 image convolved with the Gaussian mask, uint8."""
        p = self.parameters
        return cv2.GaussianBlur(grey, (int(p.smoothing_size),) * 2, p.smoothing_sigma)

    def centroid(self, mask):
        """Returns the `RegionCentroid` of a binary image, or None when too few of its pixels are white.

        The sums of the white pixels' addresses (accumulative histogram) over their number (frequency histogram);
        section 3 prints the division upside down.
        """
        p = self.parameters
        region = mean_centroid(mask) if p.centroid == "mean" else hull_centroid(mask, p.join_distance)
        if region is None or region.pixel_count < p.min_pixels:
            return None
        return region

    def _binary(self, image, threshold):
        """Returns a uint8 image's pixels above the threshold [grey] as 255, others and all outside the window as 0."""
        mask = cv2.threshold(image, threshold, 255, cv2.THRESH_BINARY)[1]
        return mask if self._window is None else cv2.bitwise_and(mask, self._window)

    def _level(self, image):
        """Mean of an image within the window [grey], from every fourth row: the light is the same everywhere."""
        return cv2.mean(image[::LEVEL_ROWS], mask=None if self._window is None else self._window[::LEVEL_ROWS])[0]
