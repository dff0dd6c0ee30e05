"""The effect of a camera's sensor on a rendered image: pixels that average light, noise, and the flicker of the
lamps."""

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.world.imaging.cameras import ImageWindow

_BANK_MARGIN = 256
_BANK_STREAM = 0
_FRAME_STREAM = 1


def flicker_gain(time: float, depth: float, frequency: float) -> float:
    """Returns the gain of the light, 1 + depth sin(2 pi frequency time).

    Args:
        time: [s].
        depth: amplitude as a fraction of the mean brightness.
        frequency: of the light [Hz], twice that of the mains: 100 Hz on 50 Hz mains, 120 Hz on 60 Hz mains.
    """
    return 1.0 + depth * np.sin(2.0 * np.pi * frequency * time)


def bin_pixels(image: np.ndarray, factor: int, out: np.ndarray | None = None) -> np.ndarray:
    """Returns an image in which squares of rendered pixels are averaged into one pixel, shape (h, w, 4), uint8.

    Args:
        image: shape (factor h, factor w, 4), uint8.
        factor: side of a square [px].
        out: array for the result, or None.
    """
    size = (image.shape[1] // factor, image.shape[0] // factor)
    return cv2.resize(image, size, dst=out, interpolation=cv2.INTER_AREA)


@dataclass(frozen=True)
class SensorNoise:
    """Gaussian sensor noise, and the flicker of the lamps.

    The noise is luminance noise (the same on red, green and blue), white from pixel to pixel, rounded to whole grey
    levels, and clipped like the image at 0 and 255. Every frame, time / ``period`` rounded, has its own noise. It is a
    random crop of a bank of normal deviates, placed by ``default_rng([seed, 1, camera_index, frame])``, because drawing
    65,536 new deviates would take 1.5 ms a frame. The bank has 257 x 257 places, so that frames repeat only after
    minutes; two cameras have different banks.

    The light of a render engine cannot change during a run, so flicker is a gain on the whole image, the same at every
    pixel: `flicker_gain` at the time of the frame. This is exact as long as nothing saturates and all light is lamp
    light.

    Attributes:
        width: of the full image [px].
        height: of the full image [px].
        std: standard deviation of the noise [grey levels]; 0 for none.
        window: part of the full image that is rendered; None is all of it. The noise of a pixel does not depend on the
            window.
        flicker: amplitude of the flicker as a fraction of the mean brightness; 0 for none.
        flicker_hz: frequency of the light [Hz].
        period: time between frames [s].
        seed: selects the random numbers.
        camera_index: selects the random numbers of one camera.
    """

    width: int
    height: int
    std: float
    window: ImageWindow | None = None
    flicker: float = 0.0
    flicker_hz: float = 100.0
    period: float = VISION_PERIOD
    seed: int = 0
    camera_index: int = 0

    def add(self, image: np.ndarray, time: float, out: np.ndarray) -> None:
        """Writes an image with noise and flicker, opaque.

        Args:
            image: the rendered image of the window, RGBA, shape (h, w, 4), uint8.
            time: of the image [s].
            out: the result, of the same shape and type.
        """
        if self.flicker > 0.0:
            image = cv2.convertScaleAbs(image, alpha=flicker_gain(time, self.flicker, self.flicker_hz))
        frame = round(time / self.period)
        u0, v0, width, height = self.window or (0, 0, self.width, self.height)
        random = np.random.default_rng([self.seed, _FRAME_STREAM, self.camera_index, frame])
        u, v = (u0, v0) + random.integers(0, _BANK_MARGIN, 2, endpoint=True)
        crop = np.s_[v : v + height, u : u + width]
        brighter, darker = self._banks
        # One of the two is zero at every pixel, so the order of the saturating sums does not matter. The first also
        # makes alpha opaque again.
        cv2.add(image, brighter[crop], dst=out)
        cv2.subtract(out, darker[crop], dst=out)

    @cached_property
    def _banks(self) -> tuple[np.ndarray, np.ndarray]:
        """What to add and what to subtract: with two unsigned banks, OpenCV's saturating sums are one pass each."""
        shape = (self.height + _BANK_MARGIN, self.width + _BANK_MARGIN)
        random = np.random.default_rng([self.seed, _BANK_STREAM, self.camera_index])
        grey = np.rint(self.std * random.standard_normal(shape, dtype=np.float32))
        return _as_rgba(grey, alpha=255), _as_rgba(-grey, alpha=0)


@dataclass(frozen=True)
class SensorModel:
    """From the rendered image of one camera to the image that the camera outputs.

    Attributes:
        supersampling: side of the square of rendered pixels that is averaged into one image pixel.
        noise: noise and flicker, or None for none.
    """

    supersampling: int = 1
    noise: SensorNoise | None = None

    def image(self, rendered: np.ndarray, time: float) -> np.ndarray:
        """Returns the image, RGBA, uint8, ``supersampling`` times smaller than the rendered one along u and along v.

        Args:
            rendered: RGBA, uint8.
            time: of the image [s].
        """
        image = rendered if self.supersampling == 1 else bin_pixels(rendered, self.supersampling)
        if self.noise is None:
            return image
        noisy = np.empty_like(image)
        self.noise.add(image, time, noisy)
        return noisy


def _as_rgba(grey: np.ndarray, alpha: int) -> np.ndarray:
    """Returns grey levels (h, w) as bytes (h, w, 4), negative grey levels as 0."""
    rgba = np.full((*grey.shape, 4), alpha, dtype=np.uint8)
    rgba[..., :3] = np.clip(grey, 0.0, 255.0)[..., np.newaxis]
    return rgba
