"""Normal flow: which pixels move, from three smoothed images (Allen et al. 1991, section 3.1, steps 2-8).

Units, with images ``stride`` cycles of ``period`` seconds apart:

* I_t = I2 - I0 [grey] spans 2 stride period seconds, centred on I1.
* The 3x3 Sobel operator returns 8 times the gradient [grey/px] of I1.
* |I_t| / (|I_x| + |I_y|) is therefore the displacement along the gradient [px] during that span, in the L1 norm that
the
  paper's look-up table uses in place of the root in equation 3. "10 pixels per 60 msec" is 5.6 px for a stride of 1.
"""

import math
from typing import NamedTuple

import cv2
import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.vision.centroid.config import NormalFlow
from drake_tracker.vision.light_gain import light_gain
from drake_tracker.vision.region_centroid import RegionCentroid, brightness_gate, find_centroid

GREY_FRACTION = 32
"""Steps per grey level of the integer path's smoothed images. Their Sobel sums, up to 32640, just fit 16 bits."""
SOBEL_GAIN = 8.0
"""Sum of the weights on one side of the 3x3 Sobel operator times the distance between its two sides."""
SAMPLES = 1024
"""Pixels from which medians over the image are taken."""
MAD_TO_SIGMA = 1.4826
"""Standard deviation of a normal distribution divided by its median absolute deviation."""


class MotionImages(NamedTuple):
    """The images of figures 4 and 5 of the paper, each of shape (h, w).

    Attributes:
        smoothed: I1 [grey].
        difference: I_t [grey].
        gradient_x: gradient of I1 along u [grey/px].
        gradient_y: gradient of I1 along v [grey/px].
        normal_speed: normal flow [px/s], before the threshold.
        motion_energy: the mask, uint8, 255 where something moves.
    """

    smoothed: np.ndarray
    difference: np.ndarray
    gradient_x: np.ndarray
    gradient_y: np.ndarray
    normal_speed: np.ndarray
    motion_energy: np.ndarray


class NormalFlowDetector:
    """The `MotionDetector` of section 3.1: grey image -> smoothed image; three of them -> mask; mask -> centroid.

    Args:
        settings: `NormalFlow`.
        window: uint8 (h, w) of the image's shape, 0 where motion is ignored; None uses the whole image.
        period: time between consecutive images [s].

    Attributes:
        parameters: the `NormalFlowParameters` of the settings.
        stride: cycles between the images used.

    Raises DrakeTrackerError when a setting is outside its range or the window is empty.
    """

    def __init__(
        self,
        settings: NormalFlow = NormalFlow(),
        *,
        window: np.ndarray | None = None,
        period: float = VISION_PERIOD,
    ) -> None:
        self.parameters = parameters = settings.resolve(period)
        self.stride = int(parameters.stride)
        self._integer = parameters.path == "integer"
        self._scale = GREY_FRACTION if self._integer else 1
        self._floor = self._scale * parameters.denominator_floor
        self._kernel = cv2.getGaussianKernel(int(parameters.smoothing_size), parameters.smoothing_sigma)
        self._window: np.ndarray | None = None
        self._inside: np.ndarray | None = None
        if window is not None:
            inside = np.asarray(window) > 0
            if not inside.any():
                raise DrakeTrackerError("normal flow: the window of interest is empty")
            self._inside = np.flatnonzero(inside)
            self._window = inside
            # All bits are set inside the window: a bitwise "and" keeps the pixels of a 16-bit image.
            self._window_bits = np.where(inside, -1, 0).astype(np.int16)

    @property
    def buffer_length(self) -> int:
        """Images that the caller must keep: the newest is I2, the oldest I0."""
        return 2 * self.stride + 1

    @property
    def stamp_age_cycles(self) -> float:
        """Age of the described image I1 when I2 is captured, in cycles."""
        return self.stride

    def smooth(self, grey: np.ndarray) -> np.ndarray:
        """Step 2: returns a grey uint8 image (h, w) convolved with the Gaussian mask.

        The integer path returns int16 in 1/`GREY_FRACTION` grey levels, the float path float64 in grey levels.
        """
        if self._integer:
            root = math.sqrt(GREY_FRACTION)
            return cv2.sepFilter2D(grey, cv2.CV_16S, root * self._kernel, root * self._kernel)
        return cv2.sepFilter2D(grey.astype(np.float64), cv2.CV_64F, self._kernel, self._kernel)

    def mask(self, *images: np.ndarray) -> np.ndarray:
        """Steps 5-8: returns the motion energy of the smoothed images I0, I1, I2: uint8, 255 where I1 shows motion."""
        image0, image1, image2 = images
        energy = np.zeros(image1.shape, np.uint8)
        difference = self._difference(image0, image2)
        if difference is None:
            return energy
        size = np.abs(difference)
        least = max(self._gate(size), self.parameters.displacement_threshold * self._floor)
        if self._integer:
            least = math.ceil(least)  # The same bound for whole numbers, without a conversion to floats.
        candidates = size >= least
        if self._window is not None:
            candidates &= self._window
        # No pixel outside the candidates' rectangle can move: the gradients there are not needed.
        u0, v0, width, height = cv2.boundingRect(candidates.view(np.uint8))
        if width == 0:
            return energy
        inner = np.s_[v0 : v0 + height, u0 : u0 + width]
        top, left = max(0, v0 - 1), max(0, u0 - 1)
        gradients = (
            g[v0 - top : v0 - top + height, u0 - left : u0 - left + width]
            for g in self._sobel(image1[top : v0 + height + 1, left : u0 + width + 1])
        )
        exceeds = self._exceeds_integer if self._integer else self._exceeds_float
        energy[inner] = erode_isolated(candidates[inner] & exceeds(size[inner], *gradients))
        if self.parameters.brightness_gate:
            energy = brightness_gate(energy, (image0, image1, image2), self._median(image1))
        return energy

    def centroid(self, mask: np.ndarray) -> RegionCentroid | None:
        """Steps 9-11: returns the `RegionCentroid` of a mask, or None when too few pixels move."""
        parameters = self.parameters
        return find_centroid(mask, parameters.centroid, parameters.join_distance, parameters.min_pixels)

    def images(self, *images: np.ndarray) -> MotionImages:
        """Returns the `MotionImages` of the smoothed images I0, I1, I2, in grey levels and pixels for either path."""
        image0, image1, image2 = images
        difference = self._difference(image0, image2)
        if difference is None:
            difference = np.zeros(image1.shape)
        gradient_x, gradient_y = (g / (SOBEL_GAIN * self._scale) for g in self._sobel(image1))
        difference = difference / self._scale
        displacement = np.abs(difference) / np.maximum(
            self._gradient_size(gradient_x, gradient_y), self.parameters.denominator_floor
        )
        return MotionImages(
            image1 / self._scale,
            difference,
            gradient_x,
            gradient_y,
            displacement / self.parameters.span,
            self.mask(image0, image1, image2),
        )

    def _difference(self, image0: np.ndarray, image2: np.ndarray) -> np.ndarray | None:
        """Step 5: returns I_t = I2 - I0, or None when the light changed too much to compare the two."""
        gain = 1.0
        if self.parameters.normalise_gain:
            measured = light_gain(self._level(image0), self._level(image2))
            if measured is None:
                return None
            gain = measured
        if self._integer:
            return cv2.addWeighted(image2, 1.0, image0, -gain, 0.0)
        return image2 - gain * image0

    def _exceeds_integer(self, size: np.ndarray, gradient_x: np.ndarray, gradient_y: np.ndarray) -> np.ndarray:
        """Steps 7-8 in saturating 16-bit integers: compares |I_t| with T (|I_x| + |I_y|), without a division."""
        factor = self.parameters.displacement_threshold / SOBEL_GAIN
        if self.parameters.norm == "l1":
            return size >= cv2.addWeighted(np.abs(gradient_x), factor, np.abs(gradient_y), factor, 0.0)
        return size >= np.rint(factor * np.hypot(gradient_x, gradient_y))

    def _exceeds_float(self, size: np.ndarray, gradient_x: np.ndarray, gradient_y: np.ndarray) -> np.ndarray:
        """Steps 7-8 as in the text: the look-up table's division, then the threshold."""
        slope = self._gradient_size(gradient_x, gradient_y) / SOBEL_GAIN
        return size / np.maximum(slope, self._floor) >= self.parameters.displacement_threshold

    def _gate(self, size: np.ndarray) -> float:
        """Returns the least |I_t| of a moving pixel, in the unit of ``size`` = |I_t|."""
        gate = self.parameters.difference_gate * self._scale
        if self.parameters.noise_factor > 0.0:
            gate = max(gate, self.parameters.noise_factor * MAD_TO_SIGMA * self._median(size))
        return gate

    def _gradient_size(self, gradient_x: np.ndarray, gradient_y: np.ndarray) -> np.ndarray:
        if self.parameters.norm == "l1":
            return np.abs(gradient_x) + np.abs(gradient_y)
        return np.hypot(gradient_x, gradient_y)

    def _sobel(self, image: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Step 6: returns `SOBEL_GAIN` times the gradients along u and v, of the image's type."""
        return cv2.Sobel(image, -1, 1, 0), cv2.Sobel(image, -1, 0, 1)

    def _level(self, image: np.ndarray) -> float:
        """Returns the sum of the image inside the window."""
        if self._window is not None:
            image = image & self._window_bits if self._integer else np.where(self._window, image, 0.0)
        return cv2.sumElems(image)[0]

    def _median(self, image: np.ndarray) -> float:
        """Returns the median of about `SAMPLES` pixels spread over the window."""
        pixels = image.ravel()
        count = pixels.size if self._inside is None else self._inside.size
        step = max(1, count // SAMPLES) | 1  # Odd: the samples must not fall into a few columns.
        samples = pixels[::step] if self._inside is None else pixels[self._inside[::step]]
        middle = samples.size // 2
        return float(np.partition(samples, middle)[middle])


def erode_isolated(moving: np.ndarray) -> np.ndarray:
    """Step 8: returns a boolean image as a mask (uint8, 0 or 255) without the pixels that have no moving neighbour."""
    count = cv2.boxFilter(moving.view(np.uint8), -1, (3, 3), normalize=False, borderType=cv2.BORDER_CONSTANT)
    return (moving & (count > 1)).view(np.uint8) * np.uint8(255)
