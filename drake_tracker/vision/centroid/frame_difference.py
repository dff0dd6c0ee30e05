"""Motion as a change of intensity between two images (Nashman and Chaconas 1990, section 4, the method chosen)."""

from typing import NamedTuple

import cv2
import numpy as np

from drake_tracker.vision.centroid.binary_detector import BinaryDetector
from drake_tracker.vision.centroid.config import FrameDifference
from drake_tracker.vision.light_gain import light_gain


class DifferenceImages(NamedTuple):
    """The images of figure 4 of the paper, each uint8 (h, w).

    Attributes:
        reference: the image that was subtracted, smoothed.
        smoothed: the newest image, smoothed.
        difference: their absolute difference [grey].
        motion_energy: the mask, 255 where something moves.
    """

    reference: np.ndarray
    smoothed: np.ndarray
    difference: np.ndarray
    motion_energy: np.ndarray


class FrameDifferenceDetector(BinaryDetector[FrameDifference]):
    """The `MotionDetector` of section 4: smooth, subtract two images, threshold, take the centroid.

    A ball that moved by less than its diameter changes two crescents, one in front and one behind; a ball that moved
    farther changes two discs. In both cases the centre of all changed pixels is midway between the two positions of the
    ball, and the stamp is midway between the two captures. A ball is not equally visible all over: light from one side
    shifts the centroid at both positions alike, for a ball of 8 px by about 0.6 px ("hull") or 0.8 px ("mean").

    Args:
        settings: `FrameDifference`. The default stride of 2 is the paper's: both images are of the same field of an
            interlaced camera.
        window: uint8 (h, w) of the image's shape, 0 where motion is ignored; None uses the whole image.

    Raises DrakeTrackerError when a setting is outside its range or the window is empty.
    """

    def __init__(self, settings: FrameDifference = FrameDifference(), *, window: np.ndarray | None = None) -> None:
        super().__init__(settings, window=window)
        self.stride = int(settings.stride)

    @property
    def buffer_length(self) -> int:
        """Images that the caller must keep."""
        return self.stride + 1

    @property
    def stamp_age_cycles(self) -> float:
        """Age of the midpoint between both captures when the second image is captured, in cycles: half the stride."""
        return self.stride / 2

    def mask(self, *images: np.ndarray) -> np.ndarray:
        """Returns the binary image of two smoothed images, uint8, 255 where the intensity changed."""
        image0, image1 = images
        difference = self._difference(image0, image1)
        if difference is None:
            return np.zeros(image1.shape, np.uint8)
        return self._binary(difference, self.settings.threshold)

    def images(self, *images: np.ndarray) -> DifferenceImages:
        """Returns the `DifferenceImages` of two smoothed images."""
        image0, image1 = images
        difference = self._difference(image0, image1)
        if difference is None:
            difference = np.zeros(image1.shape, np.uint8)
        return DifferenceImages(image0, image1, difference, self._binary(difference, self.settings.threshold))

    def _difference(self, image0: np.ndarray, image1: np.ndarray) -> np.ndarray | None:
        """Returns |I1 - I0|, or None when the light changed too much to compare the two."""
        if self.settings.normalise_gain:
            gain = light_gain(self._level(image0), self._level(image1))
            if gain is None:
                return None
            image0 = cv2.convertScaleAbs(image0, alpha=gain)
        return cv2.absdiff(image1, image0)
