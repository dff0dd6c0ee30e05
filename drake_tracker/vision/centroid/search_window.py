"""A window of interest that follows the ball (Nashman and Chaconas 1990, section 5).

"The window locations would be based upon previous reading(s) and knowledge about the movement of the ball between
sampling instants." The paper mentions it as an alternative and rejects outliers instead.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.vision.region_centroid import RegionCentroid

Track = tuple[tuple[float, float, float], ...]
"""Up to two centroids (stamp [s], u, v [px]), oldest first."""


@dataclass(frozen=True)
class SearchWindow:
    """A disc around the position that the last two centroids predict at constant speed.

    Its memory is a `Track`, kept by the caller. With fewer than two centroids, or when the last one is older than
    ``forget``, nothing is predicted and the whole image is used.

    Attributes:
        radius: of the disc [px]: for half of the ball's displacement between two images, for the ball itself, and for
            the deflection by a peg.
        forget: largest age of the last centroid [s].

    Raises DrakeTrackerError on a value that is not above 0.
    """

    radius: float = 24.0
    forget: float = 0.2

    def __post_init__(self) -> None:
        for name in ("radius", "forget"):
            if not getattr(self, name) > 0.0:
                raise DrakeTrackerError(f"predicted window: {name} is {getattr(self, name)}; it must be above 0")

    def centre(self, track: Track, stamp: float) -> np.ndarray | None:
        """Returns the predicted position (u, v) [px] at a stamp [s], or None."""
        if len(track) < 2 or stamp - track[-1][0] > self.forget:
            return None
        (before, *first), (last, *second) = track
        uv_before, uv_last = np.array(first), np.array(second)
        return uv_last + (uv_last - uv_before) * (stamp - last) / (last - before)

    def apply(self, mask: np.ndarray, track: Track, stamp: float) -> np.ndarray:
        """Returns a mask (uint8) with all pixels outside the disc set to 0, or unchanged when nothing is predicted."""
        centre = self.centre(track, stamp)
        if centre is None:
            return mask
        disc = np.zeros_like(mask)
        cv2.circle(disc, tuple(int(value) for value in np.rint(centre)), int(self.radius), 255, -1)
        return cv2.bitwise_and(mask, disc)

    def remember(self, track: Track, stamp: float, region: RegionCentroid | None) -> Track:
        """Returns the track to pass next time, given the newest centroid or None."""
        if region is not None:
            return (*track[-1:], (stamp, region.u, region.v))
        return track if track and stamp - track[-1][0] <= self.forget else ()
