"""The foreground of one image."""

from dataclasses import dataclass, field
from functools import cached_property

import cv2
import numpy as np

from drake_tracker.core.frozen_state import FrozenState, read_only
from drake_tracker.vision.camera_motion import Verdict


@dataclass(frozen=True, eq=False)
class Foreground(FrozenState):
    """The foreground of one image.

    Attributes:
        stamp: capture time of the image [s].
        image: uint8 (h, w, 3), RGB, smoothed.
        mask: uint8 (h, w), 255 on the silhouettes of objects.
        moving: uint8 (h, w), 255 where edges move.
        image_offset: full-frame coordinates (u0, v0) of the top left pixel [px].
        hidden: uint8 (h, w), 255 where the robot's own arm covers the scene, or None.
        usable: whether the image could be compared with the background.
        camera: whether the camera itself moved; its motion is compensated in the other attributes.
        displacement: of the camera's images by that motion [px].
        missing: uint8 (h, w), 255 where the image shows nothing, because the camera has turned away, or None.
        border: uint8 (h, w), 255 along the border of the examined area, and beyond it, or None.
        hand: displacement of the hand by its markers, to the right and downwards, shape (2,) [px].
    """

    stamp: float
    image: np.ndarray
    mask: np.ndarray
    moving: np.ndarray
    image_offset: tuple[int, int]
    hidden: np.ndarray | None = None
    usable: bool = True
    camera: Verdict = Verdict.STILL
    displacement: float = 0.0
    missing: np.ndarray | None = None
    border: np.ndarray | None = None
    hand: np.ndarray = field(default_factory=lambda: np.zeros(2))

    @cached_property
    def unseen(self) -> np.ndarray | None:
        """uint8 (h, w), 255 where the arm covers the scene, or nothing is looked at; None if neither is so anywhere."""
        if self.hidden is None or self.border is None:
            return self.border if self.hidden is None else self.hidden
        return read_only(cv2.bitwise_or(self.hidden, self.border))

    def shows(self, u: float, v: float) -> bool:
        """Returns whether the image contains the pixel at (u, v) of the full frame."""
        height, width = self.mask.shape
        return 0 <= round(u) - self.image_offset[0] < width and 0 <= round(v) - self.image_offset[1] < height
