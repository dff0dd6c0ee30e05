"""The role of a motion detector: which methods `MotionCentroidSystem` calls."""

from typing import Any, Protocol

import numpy as np

from drake_tracker.vision.region_centroid import RegionCentroid


class MotionDetector(Protocol):
    """Finds motion in the images of one camera.

    A detector holds no image. Once per cycle the caller smooths the newest image and keeps the last `buffer_length`
    smoothed images; every ``stride``-th of them, oldest first, is what `mask` and `images` are called with. All state
    is with the caller, so that a detector may be shared between Contexts.

    A custom detector is a class with these members; it need not derive from this one.
    """

    @property
    def stride(self) -> int:
        """Cycles from one of the images used to the next."""
        ...

    @property
    def buffer_length(self) -> int:
        """Smoothed images that the caller must keep, the newest included."""
        ...

    @property
    def stamp_age_cycles(self) -> float:
        """Age of the instant that a mask describes when the newest of its images is captured, in cycles."""
        ...

    def smooth(self, grey: np.ndarray) -> np.ndarray:
        """Returns a grey uint8 image (h, w) smoothed, in whatever type the detector computes with."""
        ...

    def mask(self, *images: np.ndarray) -> np.ndarray:
        """Returns the binary image (h, w), uint8, 255 where something moves, of smoothed images, oldest first."""
        ...

    def centroid(self, mask: np.ndarray) -> RegionCentroid | None:
        """Returns the centroid of a mask in the mask's pixel coordinates, or None when too few pixels move."""
        ...

    def images(self, *images: np.ndarray) -> Any:
        """Returns all intermediate images of smoothed images, for figures: a NamedTuple with ``motion_energy``."""
        ...
