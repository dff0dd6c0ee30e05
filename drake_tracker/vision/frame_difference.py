"""Motion as a change of intensity between two images (Nashman and Chaconas 1990, section 4, the method chosen)."""

from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

from drake_tracker.vision.binary_detector import BinaryDetector, BinaryDetectorParameters
from drake_tracker.vision.light_gain import light_gain


@dataclass(frozen=True)
class FrameDifferenceParameters(BinaryDetectorParameters):
    """Settings of `FrameDifference`, besides those of `BinaryDetectorParameters`.

    Attributes:
        stride: cycles between the two images: 2 as in the paper, so that both are of the same field of an interlaced
            camera, or 1.
        threshold: a pixel moves when it changes by more [grey].
        normalise_gain: scales the first image to the mean brightness of the second, so that flickering light does not
            move. The paper does without.
    """

    stride: int = 2
    threshold: float = 5.0
    normalise_gain: bool = True

    _LEAST = {**BinaryDetectorParameters._LEAST, "stride": 1, "threshold": 1}


class DifferenceImages(NamedTuple):
    """What figure 4 of the paper shows, each uint8 of the image's shape.

    ``reference``, ``smoothed``: the image subtracted and the newest one; ``difference``: their absolute difference
    [grey]; ``motion_energy``: the mask, 255 where something moves.
    """

    reference: np.ndarray
    smoothed: np.ndarray
    difference: np.ndarray
    motion_energy: np.ndarray


class FrameDifference(BinaryDetector):
    """The detector of section 4: smooth, subtract two images, threshold, take the centroid.

    A ball that moved by less than its diameter changes two crescents, before and behind it; one that moved farther
    changes two discs. Either way the middle of all changed pixels is that between the ball's two places, and the stamp
    lies midway between the two captures. A ball is not equally visible all over: light from one side shifts the
    centroid in both places alike, for a ball of 8 px by some 0.6 px ("hull") or 0.8 px ("mean").

    It holds no image: the caller keeps the last `buffer_length` smoothed images and passes every ``stride``-th of them.

    Args:
        parameters: `FrameDifferenceParameters`.
        window: uint8 of the image's shape, 0 where motion is not to be looked at; None looks everywhere.
    """

    def __init__(self, parameters=FrameDifferenceParameters(), window=None):
        super().__init__(parameters, window)
        self.stride = int(parameters.stride)

    @property
    def buffer_length(self):
        """Images the caller must keep."""
        return self.stride + 1

    @property
    def stamp_age_cycles(self):
        """Age of the midpoint of both captures when the second image is captured, in cycles: half of the stride."""
        return self.stride / 2

    def mask(self, image0, image1):
        """Returns the binary image of two smoothed images, uint8, 255 where the intensity changed."""
        difference = self._difference(image0, image1)
        if difference is None:
            return np.zeros(image1.shape, np.uint8)
        return self._binary(difference, self.parameters.threshold)

    def images(self, image0, image1):
        """Returns the `DifferenceImages` of two smoothed images."""
        difference = self._difference(image0, image1)
        if difference is None:
            difference = np.zeros(image1.shape, np.uint8)
        return DifferenceImages(image0, image1, difference, self._binary(difference, self.parameters.threshold))

    def _difference(self, image0, image1):
        """|I1 - I0|, or None when the light changed too much to compare the two."""
        if self.parameters.normalise_gain:
            gain = light_gain(self._level(image0), self._level(image1))
            if gain is None:
                return None
            image0 = cv2.convertScaleAbs(image0, alpha=gain)
        return cv2.absdiff(image1, image0)
