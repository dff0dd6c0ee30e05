"""A plain threshold of the scene (Nashman and Chaconas 1990, section 4: "not feasible" for a white ball on white)."""

from dataclasses import dataclass

from drake_tracker.vision.binary_detector import BinaryDetector, BinaryDetectorParameters
from drake_tracker.vision.frame_difference import DifferenceImages


@dataclass(frozen=True)
class StaticThresholdParameters(BinaryDetectorParameters):
    """Settings of `StaticThreshold`, besides those of `BinaryDetectorParameters`.

    Attributes:
        level: pixels brighter than this [grey] are taken for the ball.
    """

    level: float = 200.0

    _LEAST = {**BinaryDetectorParameters._LEAST, "level": 0}


class StaticThreshold(BinaryDetector):
    """Takes all that is bright for the ball; its stamp is the capture. It cannot tell a white ball from a white board.

    Args:
        parameters: `StaticThresholdParameters`.
        window: uint8 of the image's shape, 0 where nothing is to be looked at; None looks everywhere.
    """

    stride = 1
    buffer_length = 1
    stamp_age_cycles = 0

    def __init__(self, parameters=StaticThresholdParameters(), window=None):
        super().__init__(parameters, window)

    def mask(self, image):
        """Returns the binary image of a smoothed image, uint8, 255 where it is brighter than the level."""
        return self._binary(image, self.parameters.level)

    def images(self, image):
        """Returns the `DifferenceImages` of a smoothed image, its own brightness in the difference's place."""
        return DifferenceImages(image, image, image, self.mask(image))
