"""A window of interest that goes with the ball (Nashman and Chaconas 1990, section 5).

"The window locations would be based upon previous reading(s) and knowledge about the movement of the ball between
sampling instants." The paper names it as an alternative and filters readings instead.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from drake_tracker.core.errors import DrakeTrackerError


@dataclass(frozen=True)
class PredictedWindow:
    """A disc around the place to which the last two readings lead at constant speed.

    Its memory is a tuple of up to two readings (stamp [s], u, v [px]), oldest first, kept by the caller. With fewer
    than two, or when the last is older than ``forget`` [s], nothing is predicted and the whole image is looked at.

    Attributes:
        radius: of the disc [px], for half of a ball's way between two images, the ball itself, and what a peg does.
        forget: [s].

    Raises DrakeTrackerError on a value that is not above 0.
    """

    radius: float = 24.0
    forget: float = 0.2

    def __post_init__(self):
        for name in ("radius", "forget"):
            if not getattr(self, name) > 0.0:
                raise DrakeTrackerError(f"predicted window: {name} is {getattr(self, name)}; it must be above 0")

    def centre(self, readings, stamp):
        """Returns the predicted (u, v) [px] at a stamp [s], or None."""
        if len(readings) < 2 or stamp - readings[-1][0] > self.forget:
            return None
        (before, *first), (last, *second) = readings
        first, second = np.array(first), np.array(second)
        return second + (second - first) * (stamp - last) / (last - before)

    def apply(self, mask, readings, stamp):
        """Returns a mask (uint8) without what lies outside the disc; the mask itself when nothing is predicted."""
        centre = self.centre(readings, stamp)
        if centre is None:
            return mask
        disc = np.zeros_like(mask)
        cv2.circle(disc, tuple(int(value) for value in np.rint(centre)), int(self.radius), 255, -1)
        return cv2.bitwise_and(mask, disc)

    def remember(self, readings, stamp, region):
        """Returns the readings to pass next time, given the newest `RegionCentroid` or None."""
        if region is not None:
            return (*readings[-1:], (stamp, region.u, region.v))
        return readings if readings and stamp - readings[-1][0] <= self.forget else ()
