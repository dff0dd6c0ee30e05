"""State of the objects in the images of one camera, and the number of rivals."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drake_tracker.core.frozen_state import FrozenState
from drake_tracker.vision.image_tracks.empty_scene import EmptyScene
from drake_tracker.vision.image_tracks.reidentification import CONFIRM_AFTER
from drake_tracker.vision.image_tracks.track_2d import Track2D

RIVAL_SHARE = 0.5
"""A moving object of at least this share of the size of the followed object is a rival."""


@dataclass(frozen=True, eq=False)
class ImageObjects(FrozenState):
    """State of the objects in the images of a camera.

    Attributes:
        tracks: all tracks.
        targets: numbers of the objects to report; 0 where there is none.
        next_number: of the next new track.
        displacement: of the whole image between the images compared [px], 0 when it is still.
        alert: images for which the motion of the camera is still looked for.
        rivals: number of other objects that are as large as the first target, or close to it.
        switches: number of times that a place in ``targets`` was given to another object.
        lost: last known track of each target that is lost, None where none is.
        leaps: number of times that a target was found again farther away than it can have moved.
        leapt: stamp of the last image in which that happened [s].
        scene: without objects; None while the camera moves.
    """

    tracks: tuple[Track2D, ...] = ()
    targets: tuple[int, ...] = ()
    next_number: int = 1
    displacement: float = 0.0
    alert: int = 0
    rivals: int = 0
    switches: int = 0
    lost: tuple[Track2D | None, ...] = ()
    leaps: int = 0
    leapt: float = -np.inf
    scene: EmptyScene | None = None

    def target(self, place: int = 0) -> Track2D | None:
        """Returns the track of one of the targets, or None."""
        number = self.targets[place] if place < len(self.targets) else 0
        return next((track for track in self.tracks if track.number == number), None)


def target_number(objects: ImageObjects | None, place: int) -> int:
    """Returns the number of the object of a place, 0 while it has none or there is no image."""
    track = None if objects is None else objects.target(place)
    return 0 if track is None else track.number


def target_centroid(objects: ImageObjects | None, place: int, stamp: float) -> np.ndarray:
    """Returns the `Centroid` vector of the object of a place, invalid while the image does not show it.

    Args:
        objects: in the image, None without one.
        place: of the object among those to report.
        stamp: of the image [s].
    """
    track = None if objects is None else objects.target(place)
    if track is None or track.seen < track.stamp:
        return np.array([stamp, 0.0, 0.0, 0.0, 0.0])
    return np.array([stamp, *track.place, float(track.moving), 1.0])


def count_rivals(tracks: Sequence[Track2D], targets: Sequence[int]) -> int:
    """Returns the number of confirmed objects that are no targets and about as large as the first target.

    Args:
        tracks: all tracks.
        targets: numbers of those to report.
    """
    first = next((track for track in tracks if track.number == targets[0]), None)
    if first is None:
        return 0
    return sum(
        track.hits >= CONFIRM_AFTER and track.pixel_count > RIVAL_SHARE * first.pixel_count
        for track in tracks
        if track.number not in targets
    )


@dataclass(frozen=True, eq=False)
class ImageTracks(FrozenState):
    """The objects of one camera at one instant, the message between the Systems of this folder.

    Attributes:
        stamp: capture time of the image described [s].
        objects: the objects in pixels of the camera's image; None where an image is missing.
    """

    stamp: float
    objects: ImageObjects | None = None
