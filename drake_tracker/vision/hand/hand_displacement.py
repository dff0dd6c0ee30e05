"""By how much the robot's own hand is displaced in an image from where the joint angles predict it.

A wrong calibration displaces all pixels of an image almost alike. What the markers show of the hand therefore holds
for the rest of the arm near it as well.
"""

from dataclasses import dataclass

import numpy as np

from drake_tracker.core.frozen_state import FrozenState, read_only
from drake_tracker.vision.hand.hand_markers import FoundMarkers

NEWEST = 9
"""Number of the newest measurements whose median counts; as many are needed before the first displacement."""


@dataclass(frozen=True, eq=False)
class HandDisplacement(FrozenState):
    """What the images of one camera have shown so far.

    Attributes:
        measured: the newest displacements to the right and downwards, oldest first, each of shape (2,) [px].
        missed: number of images since the newest one.
    """

    measured: tuple[np.ndarray, ...] = ()
    missed: int = 0

    @property
    def median(self) -> np.ndarray:
        """Displacement to the right and downwards, shape (2,) [px]; zeros while it is not known."""
        return np.median(self.measured, axis=0) if len(self.measured) == NEWEST else np.zeros(2)


def with_image(state: HandDisplacement, found: FoundMarkers | None, kept_images: int) -> HandDisplacement:
    """Returns the state after another image.

    Args:
        state: the state before.
        found: the markers in the image, None if they were not found.
        kept_images: number of images in a row without markers after which the displacement is forgotten.
    """
    if found is not None:
        return HandDisplacement((*state.measured[-NEWEST + 1 :], read_only(found.uv - found.predicted)))
    missed = state.missed + 1
    return HandDisplacement() if missed > kept_images else HandDisplacement(state.measured, missed)
