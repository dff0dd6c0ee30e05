"""The role of a motion detector: which methods `MotionCentroidSystem` calls."""

from typing import Any, Protocol

import numpy as np

from drake_tracker.core.errors import DrakeTrackerError, raised
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


def check_detector(detector: Any) -> None:
    """Raises DrakeTrackerError, one line, when a detector cannot be used: a member is missing, or a result is wrong.

    The detector is given images of a square that moves. It must return a binary mask of their shape, must not change
    the images, and must give the same mask again after images of another camera.

    Args:
        detector: what is checked.
    """
    name = type(detector).__name__
    missing = [
        member for member in vars(MotionDetector) if not member.startswith("_") and not hasattr(detector, member)
    ]
    if missing:
        raise DrakeTrackerError(f"{name} has no {', '.join(missing)}; see MotionDetector")
    try:
        step, kept, age = detector.stride, detector.buffer_length, detector.stamp_age_cycles
        if not (isinstance(step, int) and isinstance(kept, int) and 1 <= step <= kept and 0.0 <= age <= kept):
            raise DrakeTrackerError(
                f"{name}: stride {step}, buffer_length {kept}, stamp_age_cycles {age}; the stride must be from 1 to "
                "buffer_length, and the age from 0 to buffer_length"
            )
        films = [_square_in_motion(kept, speed)[::-step][::-1] for speed in (2, 3)]
        smoothed = [[detector.smooth(image) for image in film] for film in films]
        copies = [np.array(image) for image in smoothed[0]]
        mask = detector.mask(*smoothed[0])
        if not isinstance(mask, np.ndarray) or mask.dtype != np.uint8 or mask.shape != films[0][0].shape:
            raise DrakeTrackerError(f"{name}.mask must return uint8 of the images' shape {films[0][0].shape}")
        if not np.isin(mask, (0, 255)).all():
            raise DrakeTrackerError(f"{name}.mask returned other values than 0 and 255")
        if not all(map(np.array_equal, copies, smoothed[0])):
            raise DrakeTrackerError(f"{name}.mask changed the images that it was given")
        detector.mask(*smoothed[1])
        if not np.array_equal(mask, detector.mask(*smoothed[0])):
            raise DrakeTrackerError(f"{name}.mask gave another mask for the same images; a detector has no memory")
        centroid = detector.centroid(mask)
        if centroid is not None and not isinstance(centroid, RegionCentroid):
            raise DrakeTrackerError(f"{name}.centroid returned a {type(centroid).__name__}; see RegionCentroid")
    except DrakeTrackerError:
        raise
    except (Exception, SystemExit) as error:
        raise DrakeTrackerError(f"{name} {raised(error)}") from error


def _square_in_motion(count: int, speed: int) -> list[np.ndarray]:
    """Returns grey images, uint8 (48, 64), of a bright square that moves by ``speed`` [px] from one to the next."""
    film = [np.full((48, 64), 40, np.uint8) for _ in range(count)]
    for k, image in enumerate(film):
        image[18:30, 8 + speed * k : 20 + speed * k] = 200
    return film
