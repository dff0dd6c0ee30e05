"""The detection at one instant, for pictures: one message for the motion centroid, silhouettes and parts."""

from dataclasses import dataclass

import numpy as np

from drake_tracker.core.frozen_state import FrozenState


@dataclass(frozen=True, eq=False)
class DetectionMask(FrozenState):
    """The detection at one instant, for figures and video.

    Attributes:
        stamp: capture time of the image described [s].
        mask: uint8, read-only, 255 where something moves; of the shape of the image, or of the reduced one.
        image_offset: full-frame coordinates (u0, v0) of the mask's top left pixel.
    """

    stamp: float
    mask: np.ndarray
    image_offset: tuple[int, int]
