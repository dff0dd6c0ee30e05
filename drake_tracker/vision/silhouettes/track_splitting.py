"""Tells objects apart whose silhouettes are merged from the start, and joins the tracks of pieces of one object."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.vision.silhouettes.object_appearance import is_alone
from drake_tracker.vision.silhouettes.object_shape import ObjectShape
from drake_tracker.vision.silhouettes.regions import Region
from drake_tracker.vision.silhouettes.stereo_geometry import StereoGeometry, projection_jacobian
from drake_tracker.vision.silhouettes.track_3d import GUESSED, HEIGHT_STD, Measurement, Track3D, new_track

SHRUNK = 0.75
"""An object whose silhouette has come apart and is now smaller than this share of its size was two objects."""
LENGTH_KNOWN = 12
"""Number of pairs of images from which the length of a silhouette is taken as the length of an object."""
LONGEST_ROW = 4
"""Number of objects into which a long silhouette is divided at most."""
GROWN, RIVAL = 1.25, 0.3
"""A silhouette that is this many times as long as its object may also show another object, if the other image shows a
second silhouette with at least this share of the pixels."""
SAME_VELOCITY = 0.1
"""Difference of the velocities [m/s] up to which two new tracks move alike."""
ROUGH_STD, ROUGH_SPEED_STD = np.array([0.015, 0.015, 0.01]), np.array([0.1, 0.1, 0.01])
"""Standard deviations of the position [m] and velocity [m/s] of an object that was merged with another one, along x, y
and z."""


class TrackSplitting:
    """Begins tracks of objects that had none because they were merged with another one.

    Args:
        geometry: of the two cameras.
        max_length: length of the longest object [m].
        min_pixels: of the smallest object.
    """

    def __init__(self, geometry: StereoGeometry, max_length: float, min_pixels: int) -> None:
        self._geometry = geometry
        self._max_length = max_length
        self._min_pixels = min_pixels

    def is_new(self, region: Region) -> bool:
        """Returns whether a region shows a moving object that has no track."""
        moves = region.moving > 0.0 and region.pixels >= self._min_pixels
        return moves and not region.track and not region.covered and not region.cut

    def merged_in_one_image(
        self, tracks: Sequence[Track3D], found: Sequence[Sequence[Region]]
    ) -> tuple[list[Track3D], list[Track3D]]:
        """Returns the tracks, and new tracks of objects that are separate in one image, and merged with the object of a
        track in the other.

        The image with separate silhouettes gives the directions to both objects. Their common height is the height at
        which the middle of both objects projects onto the merged silhouette of the other image. An object that is well
        known stays as it is.
        """
        kept, new = list(tracks), []
        for side, other in ((0, 1), (1, 0)):
            for region in filter(self.is_new, found[side]):
                for k, track in enumerate(kept):
                    if not track.number or min(track.places) < 0 or track.measurement is None:
                        continue
                    mine, common = (found[each][track.places[each]] for each in (side, other))
                    window = self._geometry.windows([track], other)[0]
                    if (common.extents <= GROWN * window.extents).all() or region.pixels < RIVAL * mine.pixels:
                        continue
                    known = track.shape.settled
                    height = track.expected_height if known else self._common_height(side, (mine, region), common)
                    pair = [
                        self._on_height(track, self._geometry.cameras[side], each, height) for each in (mine, region)
                    ]
                    places = self._geometry.cameras[other].project([each.position for each in pair])
                    inside = (np.abs(places - (common.u, common.v)) <= 0.5 * common.extents).all()
                    if inside and all(self._geometry.contains(each.position) for each in pair):
                        pair = [replace(each, guessed_until=-np.inf) for each in pair]
                        kept[k] = track if known else replace(pair[0], number=track.number, hits=track.hits)
                        new.append(pair[1])
                        break
        return kept, new

    def _common_height(self, side: int, apart: Sequence[Region], common: Region) -> float:
        """Returns the height at which two objects stand that one image shows apart, and the other one merged.

        Args:
            side: of the image that shows them apart.
            apart: their regions in it.
            common: the region of both in the other image.
        """
        camera, other = self._geometry.cameras[side], self._geometry.cameras[1 - side]
        origin, directions = camera.rays([(region.u, region.v) for region in apart])
        height = 0.0 if self._geometry.middle_height is None else self._geometry.middle_height
        for _ in range(3):
            points = [origin + (height + step - origin[2]) / d[2] * d for step in (0.0, HEIGHT_STD) for d in directions]
            views = other.project(points)
            middle, shifted = views[:2].mean(axis=0), views[2:].mean(axis=0)
            slope = (shifted - middle) / HEIGHT_STD
            height += float(slope @ ((common.u, common.v) - middle) / (slope @ slope))
        return height

    def come_apart(
        self, tracks: Sequence[Track3D], found: Sequence[Sequence[Region]]
    ) -> tuple[list[Track3D], list[Track3D]]:
        """Returns the tracks, and new tracks of objects whose silhouettes separated from the silhouette of a track in
        one image.

        While two objects were merged in both images, they were one track. From the image in which they are apart, and
        the height of the track, follow the positions of both; the merged silhouette in the other image is then divided.
        """
        kept, new = [], []
        for track in tracks:
            for side, (camera, regions) in enumerate(zip(self._geometry.cameras, found)):
                mine = next(
                    (
                        each
                        for each in regions
                        if each.track == track.number and each.apart and not each.covered and not each.cut
                    ),
                    None,
                )
                if not track.number or mine is None:
                    continue
                window = self._geometry.windows([track], side)[0]
                small = mine.extents < SHRUNK * window.extents
                others = [
                    each
                    for each in regions
                    if not each.track and np.hypot(each.u - window.u, each.v - window.v) < window.radius
                ]
                if not small.any() or not others:
                    continue
                pair = [
                    self._on_height(track, camera, each, track.expected_height)
                    for each in (mine, max(others, key=lambda each: each.pixels))
                ]
                track = replace(pair[0], number=track.number, hits=track.hits)
                new.append(pair[1])
                break
            kept.append(track)
        return kept, new

    def joined(self, tracks: Sequence[Track3D], found: Sequence[Sequence[Region]]) -> list[Track3D]:
        """Returns the tracks, with one instead of two that turned out to follow pieces of a single object.

        At the start only the moving edges of an object may be known, and each piece of its outline begins a track. When
        its whole silhouette is known, these tracks share it in both images. They are joined if they are new, move
        alike, and are not longer together than an object can be.
        """
        result = list(tracks)
        pieces = [track for track in tracks if not track.shape.settled and _is_shared(track, found)]
        for one, other in itertools.combinations(pieces, 2):
            if not (any(track is one for track in result) and any(track is other for track in result)):
                continue
            apart = float(np.linalg.norm(one.position - other.position))
            length = apart + 0.5 * float(one.shape.dimensions.max() + other.shape.dimensions.max())
            if length <= self._max_length and np.linalg.norm(one.mean[3:] - other.mean[3:]) < SAME_VELOCITY:
                whole = one.placed(0.5 * (one.position + other.position), 0.5 * apart).without_point()
                result = [whole if track is one else track for track in result if track is not other]
        return result

    def in_a_row(self, tracks: Sequence[Track3D], found: Sequence[Sequence[Region]]) -> list[Track3D]:
        """Returns the tracks; a track that is longer than an object can be is replaced by several tracks.

        Objects whose silhouettes are merged in both images from the start look like a single long one. They are guessed
        to be of equal lengths.
        """
        result = []
        for track in tracks:
            longest = int(np.argmax(track.shape.dimensions[:2]))
            length = float(track.shape.dimensions[longest])
            count = math.ceil(length / self._max_length)
            if count < 2 or not is_alone(track, found):
                result.append(track)
                continue
            if track.shape.count < LENGTH_KNOWN:
                result.append(track.without_point())
                continue
            count = min(count, LONGEST_ROW)
            direction = track.shape.edges[:, longest] / length
            for k in range(count):
                p_WQ = track.position + length * ((k + 0.5) / count - 0.5) * direction
                part = self._rough(track, p_WQ, track.shape.part(longest, count), track.colour)
                result.append(replace(part, number=track.number, hits=track.hits) if k == 0 else part)
        return result

    def _rough(
        self, track: Track3D, p_WQ: np.ndarray, shape: ObjectShape, colour: tuple[float, float, float]
    ) -> Track3D:
        """Returns a new track of an object that was found near another one, and moves like it at a guessed height."""
        begun = new_track(track.stamp, Measurement(p_WQ, np.diag(ROUGH_STD**2), 0.0, 1.0), shape, colour)
        begun = begun.with_velocity(track.mean[3:] * [1.0, 1.0, 0.0], ROUGH_SPEED_STD)
        return replace(begun, heights=GUESSED).without_point()

    def _on_height(self, track: Track3D, camera: CameraModel, region: Region, height: float) -> Track3D:
        """Returns a new track of a region in one image, at a height [m], with the velocity of another track."""
        origin, (direction,) = camera.rays([[region.u, region.v]])
        p_WQ = origin + (height - origin[2]) / direction[2] * direction
        shape = ObjectShape.guess(projection_jacobian(camera, p_WQ)[None], np.array([region.extents]))
        return self._rough(track, p_WQ, shape.turned(track.mean[3:]), region.colour)


def _is_shared(track: Track3D, found: Sequence[Sequence[Region]]) -> bool:
    """Returns whether a track shares its silhouettes in both images with others."""
    return min(track.places) >= 0 and all(found[side][place].shared for side, place in enumerate(track.places))
