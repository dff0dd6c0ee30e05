"""The difference from a static image (Nashman and Chaconas 1990, section 4, the second method, which was dropped)."""

import cv2
import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.vision.centroid.binary_detector import BinaryDetector
from drake_tracker.vision.centroid.config import BackgroundDifference
from drake_tracker.vision.centroid.frame_difference import DifferenceImages


class BackgroundDifferenceDetector(BinaryDetector[BackgroundDifference]):
    """The `MotionDetector` that finds differences from a static image of the empty scene.

    The stamp is the capture time itself. Any other change is detected as well: the paper abandoned the method because
    of flickering lamps and the vibrations of closing doors.

    Args:
        settings: `BackgroundDifference`.
        image: the scene without the object, not smoothed: uint8, RGB (h, w, 3) or grey (h, w).
        window: uint8 (h, w) of the image's shape, 0 where motion is ignored; None uses the whole image.

    Raises DrakeTrackerError when a setting is outside its range, the window is empty, or the image is of another type.
    """

    stride = 1
    buffer_length = 1
    stamp_age_cycles = 0

    def __init__(
        self,
        settings: BackgroundDifference = BackgroundDifference(),
        *,
        image: np.ndarray,
        window: np.ndarray | None = None,
    ) -> None:
        super().__init__(settings, window=window)
        image = np.asarray(image)
        if image.dtype != np.uint8 or not (image.ndim == 2 or (image.ndim == 3 and image.shape[2] == 3)):
            raise DrakeTrackerError(
                "background difference: the image of the empty scene must have 8 bits, RGB (h, w, 3) or grey (h, w)"
            )
        grey = image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
        self._background = self.smooth(grey)

    def mask(self, *images: np.ndarray) -> np.ndarray:
        """Returns the binary image of one smoothed image, uint8, 255 where it differs from the static image.

        Raises DrakeTrackerError when it does not have the static image's size.
        """
        (image,) = images
        return self._binary(self._difference(image), self.settings.threshold)

    def images(self, *images: np.ndarray) -> DifferenceImages:
        """Returns the `DifferenceImages` of one smoothed image and the static one."""
        (image,) = images
        return DifferenceImages(self._background, image, self._difference(image), self.mask(image))

    def _difference(self, image: np.ndarray) -> np.ndarray:
        if image.shape != self._background.shape:
            raise DrakeTrackerError(
                f"background difference: an image of {image.shape[1]} x {image.shape[0]} px cannot be compared with "
                f"the static image of {self._background.shape[1]} x {self._background.shape[0]} px; take a new one"
            )
        return cv2.absdiff(image, self._background)
