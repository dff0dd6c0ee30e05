"""A plain threshold of the scene (Nashman and Chaconas 1990, section 4: "not feasible" for a white ball on white)."""

import numpy as np

from drake_tracker.vision.centroid.binary_detector import BinaryDetector
from drake_tracker.vision.centroid.config import StaticThreshold
from drake_tracker.vision.centroid.frame_difference import DifferenceImages


class StaticThresholdDetector(BinaryDetector[StaticThreshold]):
    """The `MotionDetector` that takes all bright pixels as the object; it cannot find a white ball on a white board.

    The stamp is the capture time itself.

    Args:
        settings: `StaticThreshold`.
        window: uint8 (h, w) of the image's shape, 0 where pixels are ignored; None uses the whole image.

    Raises DrakeTrackerError when a setting is outside its range or the window is empty.
    """

    stride = 1
    buffer_length = 1
    stamp_age_cycles = 0

    def __init__(self, settings: StaticThreshold = StaticThreshold(), *, window: np.ndarray | None = None) -> None:
        super().__init__(settings, window=window)

    def mask(self, *images: np.ndarray) -> np.ndarray:
        """Returns the binary image of one smoothed image, uint8, 255 where it is brighter than the level."""
        (image,) = images
        return self._binary(image, self.settings.level)

    def images(self, *images: np.ndarray) -> DifferenceImages:
        """Returns the `DifferenceImages` of one smoothed image; its own brightness stands for the difference."""
        (image,) = images
        return DifferenceImages(image, image, image, self.mask(image))
