"""The images of one camera, each with its capture time."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np


@dataclass(frozen=True, eq=False)
class Footage:
    """The images of one camera.

    Attributes:
        name: as the user wrote it.
        size: (width, height) [px].
        frames: function that returns a new iterator over (time [s], RGB image uint8 (h, w, 3)), in the order of time,
            which counts from the first image. It may raise DrakeTrackerError midway, when a camera stops.
        times: (n,) of all images, known beforehand [s]; None for a live camera.
        epoch: time of the first image on a clock that other footage shares [s], or None: a clock of its own.
        counted: whether that clock counts images; other counted footage shares it if the numbers overlap.
        rate: images per second that a live camera announces, also in its recording; None for any other footage.
        close: function that releases the source.
        warning: function that returns in one line what of the images read so far is missing, or None.
    """

    name: str
    size: tuple[int, int]
    frames: Callable[[], Iterator[tuple[float, np.ndarray]]]
    times: np.ndarray | None = None
    epoch: float | None = None
    counted: bool = False
    rate: float | None = None
    close: Callable[[], object] = lambda: None
    warning: Callable[[], str | None] = lambda: None

    @property
    def live(self) -> bool:
        """Whether the images are being captured now, not read from a recording."""
        return self.times is None

    def after(self, time: float) -> "Footage":
        """Returns the same footage without the images up to a time [s], from which the times now count."""

        def frames() -> Iterator[tuple[float, np.ndarray]]:
            for taken, image in self.frames():
                if taken > time:
                    yield taken - time, image

        return replace(self, frames=frames, epoch=None if self.epoch is None else self.epoch + time)

    def only(self, kept: np.ndarray) -> "Footage":
        """Returns the same recording with those images only that ``kept``, booleans (n,), selects."""
        assert self.times is not None  # it is not live

        def frames() -> Iterator[tuple[float, np.ndarray]]:
            return (image for image, is_kept in zip(self.frames(), kept) if is_kept)

        return replace(self, times=self.times[: len(kept)][kept], frames=frames)
