"""The difference from a static image (Nashman and Chaconas 1990, section 4, the second method, which was dropped)."""

from dataclasses import dataclass

import cv2
import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.vision.binary_detector import BinaryDetector, BinaryDetectorParameters
from drake_tracker.vision.frame_difference import DifferenceImages


@dataclass(frozen=True)
class BackgroundDifferenceParameters(BinaryDetectorParameters):
    """Settings of `BackgroundDifference`, besides those of `BinaryDetectorParameters`.

    Attributes:
        threshold: a pixel shows the object when it differs by more from the static image [grey].
    """

    threshold: float = 6.0

    _LEAST = {**BinaryDetectorParameters._LEAST, "threshold": 1}


class BackgroundDifference(BinaryDetector):
    """Finds what an image taken at the start, without the ball, does not show.

    The stamp is the capture itself. Whatever else changes shows as well: the paper gave the method up because of
    flickering lamps and the vibrations of closing doors.

    Args:
        background: grey uint8 image of the scene without the ball, not smoothed.
        parameters: `BackgroundDifferenceParameters`.
        window: uint8 of the image's shape, 0 where nothing is to be looked at; None looks everywhere.

    Raises DrakeTrackerError when the background is not a grey uint8 image.
    """

    stride = 1
    buffer_length = 1
    stamp_age_cycles = 0

    def __init__(self, background, parameters=BackgroundDifferenceParameters(), window=None):
        super().__init__(parameters, window)
        background = np.asarray(background)
        if background.ndim != 2 or background.dtype != np.uint8:
            raise DrakeTrackerError("background difference: the static image must be grey with 8 bits")
        self._background = self.smooth(background)

    def mask(self, image):
        """Returns the binary image of a smoothed image, uint8, 255 where it differs from the static image.

        Raises DrakeTrackerError when it is not of the static image's size.
        """
        return self._binary(self._difference(image), self.parameters.threshold)

    def images(self, image):
        """Returns the `DifferenceImages` of a smoothed image and the static one."""
        return DifferenceImages(self._background, image, self._difference(image), self.mask(image))

    def _difference(self, image):
        if image.shape != self._background.shape:
            raise DrakeTrackerError(
                f"background difference: an image of {image.shape[1]} x {image.shape[0]} px cannot be compared with "
                f"the static image of {self._background.shape[1]} x {self._background.shape[0]} px; take it anew"
            )
        return cv2.absdiff(image, self._background)
