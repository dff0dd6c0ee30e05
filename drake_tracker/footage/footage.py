"""What every kind of footage is: a sequence of images, each with the time at which it was taken."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True, eq=False)
class Footage:
    """The images of one camera.

    Attributes:
        name: as the user wrote it.
        size: (width, height) [px].
        frames: function that returns a new iterator over (time [s], RGB image uint8 (h, w, 3)), in the order of time,
            which counts from the first image. It may raise DrakeTrackerError midway, when a file is damaged.
        times: (n,) [s] of all images, known beforehand; None for a live camera.
        epoch: time of the first image [s] on a clock that other footage shares, or None: a clock of its own.
        counted: whether that clock is a count of images, which other footage that is counted shares if it counts
            through the same numbers.
        rate: images per second that a live camera announces.
        close: function that lets go of the source.
    """

    name: str
    size: tuple
    frames: Callable
    times: np.ndarray | None = None
    epoch: float | None = None
    counted: bool = False
    rate: float | None = None
    close: Callable = field(default=lambda: None)

    @property
    def live(self):
        """Whether the images are only just being taken."""
        return self.times is None
