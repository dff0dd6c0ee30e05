"""Faults of the images: a dark camera, a frozen image, flicker and noise."""

from dataclasses import dataclass

import cv2
import numpy as np

from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.faults.fault import FaultyView, ImageFault, PointFault, Sight
from drake_tracker.vision.light_gain import light_gain

SEEN_UNTIL, UNSEEN_FROM = 40.0, 60.0
"""Noise [grey levels] up to which the detector finds the train in every cycle, and from which it finds it in none. From
four levels of noise between 30 and 60 in the images of three runs."""
CENTROID_NOISE = 0.0016
"""Noise of a centroid [px] per square of the noise in the image [grey levels^2]. The noise hides more and more of the
train; from four levels of noise between 10 and 40 in the same images."""
IMAGE_SPAN = 4
"""Cycles between the first and the last image of the train's motion detector."""


@dataclass(frozen=True)
class CameraDarkFault(ImageFault, PointFault):
    """`CameraDark`: black images, in which nothing moves."""

    def image(self, image: np.ndarray, view: FaultyView, time: float, held: np.ndarray | None) -> np.ndarray:
        dark = np.zeros_like(image)
        dark[..., 3] = 255
        return dark

    def centroid(self, sight: Sight) -> np.ndarray | None:
        return None


@dataclass(frozen=True)
class FrozenImageFault(ImageFault, PointFault):
    """`FrozenImage`: the same image again and again, in which nothing moves."""

    def image(self, image: np.ndarray, view: FaultyView, time: float, held: np.ndarray | None) -> np.ndarray:
        return image if held is None else held

    def centroid(self, sight: Sight) -> np.ndarray | None:
        return None


@dataclass(frozen=True)
class FlickerFault(ImageFault, PointFault):
    """`Flicker`: a gain on the whole image.

    The motion detector scales its first image to the brightness of its last, and finds nothing when they differ too
    much (`light_gain`). Measured vision has no point in those cycles, and is otherwise undisturbed.
    """

    def gain(self, time: float) -> float:
        """Returns the gain of the light at a time [s]."""
        return 1.0 + self.settings.amplitude * np.sin(2.0 * np.pi * self.settings.frequency * (time - self.begin))

    def image(self, image: np.ndarray, view: FaultyView, time: float, held: np.ndarray | None) -> np.ndarray:
        changed = cv2.convertScaleAbs(image, alpha=self.gain(time))
        changed[..., 3] = 255
        return changed

    def centroid(self, sight: Sight) -> np.ndarray | None:
        half = 0.5 * IMAGE_SPAN * VISION_PERIOD  # the stamp is that of the middle image
        levels = [self.gain(time) if self.active(time) else 1.0 for time in (sight.time - half, sight.time + half)]
        return None if light_gain(*levels) is None else sight.uv


@dataclass(frozen=True)
class ImageNoiseFault(ImageFault, PointFault):
    """`ImageNoise`: white luminance noise. Measured vision gets noise of the centroid, or sees nothing."""

    def image(self, image: np.ndarray, view: FaultyView, time: float, held: np.ndarray | None) -> np.ndarray:
        random = self.random(len(view.camera), round(time / VISION_PERIOD))
        noise = self.settings.std * random.standard_normal(image.shape[:2], dtype=np.float32)
        changed = image.copy()
        changed[..., :3] = np.clip(np.rint(image[..., :3] + noise[..., np.newaxis]), 0.0, 255.0).astype(np.uint8)
        return changed

    def centroid(self, sight: Sight) -> np.ndarray | None:
        random, std = self.random(len(sight.camera), sight.cycle), self.settings.std
        hidden = (std - SEEN_UNTIL) / (UNSEEN_FROM - SEEN_UNTIL)
        if sight.uv is None or random.random() < hidden:
            return None
        return sight.uv + CENTROID_NOISE * std**2 * random.standard_normal(2)
