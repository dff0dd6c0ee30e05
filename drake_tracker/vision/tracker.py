"""Tracks several objects: associates the regions of two images with tracks, and keeps the tracks.

Per pair of images: each track predicts windows in both images; regions are found with them (`regions.find_regions`);
the regions of each image are assigned to the tracks, the nearest globally; two regions of a track that agree epipolarly
are triangulated. Pairs of moving regions that no track explains begin new tracks.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import linear_sum_assignment

from drake_tracker.core.frozen_state import FrozenState
from drake_tracker.core.messages import REGION_SLOTS, TRACK_SLOTS
from drake_tracker.vision.camera_model import CameraModel
from drake_tracker.vision.camera_motion import Verdict
from drake_tracker.vision.check_settings import check_settings
from drake_tracker.vision.config import Several
from drake_tracker.vision.foreground import Foreground
from drake_tracker.vision.object_shape import ObjectShape, outline_area
from drake_tracker.vision.object_track import (
    COLOUR_WEIGHT,
    STANDING_SPEED,
    Measurement,
    ObjectTrack,
    TrackState,
    new_track,
)
from drake_tracker.vision.regions import COVERED, UNCONFIRMED, ObjectWindow, Region, covered_share, find_regions
from drake_tracker.vision.triangulation import triangulate
from drake_tracker.vision.window import check_box

GATE = 16.0
"""Squared Mahalanobis distance up to which a region may belong to a track: 99.97 % in two dimensions."""
HEIGHT_WEIGHT = 0.5
"""How much a height outside of the middle of the work volume counts against a pair of regions, relative to the gap."""
SAME_OBJECT = 0.45
"""Two tracks whose centres are nearer than this fraction of their radii, in both images, follow one object."""
SHRUNK = 0.75
"""An object whose silhouette has come apart and is now smaller than this share of its size was two objects."""
LENGTH_KNOWN = 12
"""Number of pairs of images from which the length of a silhouette is taken for that of an object."""
GUESS_TIME = 2.0
"""Time [s] after which even a guessed size divides silhouettes well, as the background is known."""
LONGEST_ROW = 4
"""Number of objects into which a long silhouette is divided at most."""
GROWN, RIVAL = 1.25, 0.3
"""A silhouette that is this many times as long as its object may show another one too, if the other image shows one
that has at least this share of its pixels."""
ROUGH_STD, ROUGH_SPEED_STD = 0.015, 0.1
"""Standard deviations of the position [m] and velocity [m/s] of an object that is seen apart in one image only."""
WIDEST_GATE = 12.0
"""Largest standard deviation of an expected centroid [px]."""
OUTSIDE = 1e6
"""Cost of an assignment that is not allowed."""
HEIGHT_STD = 0.004
"""Standard deviation of the height of an object that moves on a surface [m]."""
RECENTLY, NEARBY = 1.0, 0.3
"""Time since two objects were merged [s], and distance between them [m], up to which their identities are checked."""
WRONG_SIZE_TIME = 4.0
"""Time [s] for which an object without others near it can have a silhouette that is too large for it."""
CLEAR_COLOUR = 60.0
"""By how much the colours of two objects must fit better to the identities exchanged [grey levels, all channels]."""
SHORT_COAST = 0.1
"""Time without a measurement [s] after which the estimator's prediction, if there is one, replaces the filter's."""


@dataclass(frozen=True, eq=False)
class TrackerState(FrozenState):
    """All tracks after a pair of images.

    Attributes:
        stamp: of the images [s].
        tracks: the tracks, confirmed ones first, oldest first.
        next_number: number of the next confirmed track.
        regions: regions of the left and of the right image.
        overflow: regions and tracks that found no slot.
        usable: whether both images could be used.
        cameras: of the left and the right camera, whether it moved itself, and displacement of its image [px].
    """

    stamp: float = -np.inf
    tracks: tuple[ObjectTrack, ...] = ()
    next_number: int = 1
    regions: tuple[tuple[Region, ...], tuple[Region, ...]] = ((), ())
    overflow: int = 0
    usable: bool = True
    cameras: tuple[tuple[Verdict, float], ...] = ((Verdict.STILL, 0.0), (Verdict.STILL, 0.0))

    def confirmed(self) -> tuple[ObjectTrack, ...]:
        """Returns the tracks that have a number."""
        return tuple(track for track in self.tracks if track.number)


class Tracker:
    """Tracks objects in the images of two cameras. All state is with the caller.

    Args:
        cameras: the left and the right camera, calibrated.
        settings: `Several`.
        work_volume: lower and upper corner in W, shape (2, 3) [m]; None accepts objects anywhere.
        margin: by which an object may lie outside the work volume [m].
        max_gap: largest distance between the two rays of one object [m].

    Raises DrakeTrackerError when the work volume is not a box, or a setting is outside its range.
    """

    def __init__(
        self,
        cameras: Sequence[CameraModel],
        settings: Several = Several(),
        *,
        work_volume: ArrayLike | None = None,
        margin: float = 0.05,
        max_gap: float = 0.03,
    ) -> None:
        check_settings(settings, "tracker")
        self.settings = settings
        self._cameras = (cameras[0], cameras[1])
        self._max_gap = max_gap
        self._box: tuple[np.ndarray, np.ndarray] | None = None
        self._height: float | None = None
        if work_volume is not None:
            lower, upper = check_box(work_volume)
            self._box = (lower - margin, upper + margin)
            self._height = 0.5 * float(lower[2] + upper[2])

    def update(
        self,
        state: TrackerState,
        foregrounds: Sequence[Foreground],
        expected: Mapping[int, tuple[np.ndarray, float]] = {},
    ) -> TrackerState:
        """Returns the state after a pair of images.

        Args:
            state: the state before.
            foregrounds: of the left and the right image.
            expected: {number of a track: (position p_WQ (3,) [m], standard deviation [m])}, which the estimators
                predict for the stamp of the images.
        """
        stamp = 0.5 * (foregrounds[0].stamp + foregrounds[1].stamp)
        tracks = [self._predict(track, stamp, expected.get(track.number)) for track in state.tracks]
        cameras = tuple((each.camera, each.displacement) for each in foregrounds)
        if not all(each.usable for each in foregrounds):
            tracks = [replace(track, state=TrackState.NOT_OBSERVED, misses=track.misses + 1) for track in tracks]
            return replace(
                state,
                stamp=stamp,
                tracks=self._cleaned(tracks, foregrounds),
                regions=((), ()),
                overflow=0,
                usable=False,
                cameras=cameras,
            )
        windows = [self._windows(tracks, side) for side in range(2)]
        found = [
            find_regions(foreground, views, self.settings.min_pixels) for foreground, views in zip(foregrounds, windows)
        ]
        places = [self._assign(tracks, views, regions) for views, regions in zip(windows, found)]
        tracks = [
            self._observe(track, (places[0][k], places[1][k]), found, foregrounds, (windows[0][k], windows[1][k]))
            for k, track in enumerate(tracks)
        ]
        tracks = [self._relearning(track, tracks) for track in tracks]
        tracks, apart = self._come_apart(self._recognised(tracks, found), found)
        tracks = self._in_a_row(tracks, found)
        begun = apart or self._begin(stamp, found)
        if not begun:
            tracks, begun = self._merged_in_one_image(tracks, found)
        tracks += begun
        tracks, next_number = self._confirm(self._cleaned(tracks, foregrounds), state.next_number)
        overflow = sum(max(len(regions) - REGION_SLOTS, 0) for regions in found) + max(len(tracks) - TRACK_SLOTS, 0)
        tracks = tracks[:TRACK_SLOTS]
        return TrackerState(
            stamp, tuple(tracks), next_number, (tuple(found[0]), tuple(found[1])), overflow, True, cameras
        )

    def measure(self, left: Region, right: Region) -> Measurement | None:
        """Returns the triangulated point of two regions, or None when their rays do not meet within ``max_gap``."""
        meeting = triangulate(*self._cameras, (left.u, left.v), (right.u, right.v))
        if meeting is None or meeting.gap > self._max_gap:
            return None
        information = np.zeros((3, 3))
        for camera, region in zip(self._cameras, (left, right)):
            J = projection_jacobian(camera, meeting.p_WQ)
            information += (J.T / (region.var_u, region.var_v)) @ J
        return Measurement(meeting.p_WQ, np.linalg.inv(information), meeting.gap, min(left.share, right.share))

    def measure_at_height(
        self, start: np.ndarray, height: float, regions: Sequence[Region | None]
    ) -> Measurement | None:
        """Returns the point that agrees best with the regions of an object whose height is known.

        Where the silhouettes of two objects are merged in one image, the other image and the height still determine the
        point.

        Args:
            start: a point near it, shape (3,) [m].
            height: z_W of the point [m].
            regions: the region in the left and in the right image, None where there is none.

        Returns None when the regions contradict each other.
        """
        p_WQ = np.array([start[0], start[1], height])
        views = [(camera, region) for camera, region in zip(self._cameras, regions) if region is not None]
        for _ in range(2):
            information, vector = np.diag([0.0, 0.0, HEIGHT_STD**-2]), np.zeros(3)
            vector[2] = (height - p_WQ[2]) / HEIGHT_STD**2
            for camera, region in views:
                J = projection_jacobian(camera, p_WQ)
                weighted = J.T / (region.var_u, region.var_v)
                information += weighted @ J
                vector += weighted @ ((region.u, region.v) - camera.project(p_WQ)[0])
            p_WQ = p_WQ + np.linalg.solve(information, vector)
        for camera, region in views:
            residual = (region.u, region.v) - camera.project(p_WQ)[0]
            if not residual @ (residual / (region.var_u, region.var_v)) <= GATE:
                return None
        share = min(region.share for _, region in views)
        return Measurement(p_WQ, np.linalg.inv(information), 0.0, share)

    def _predict(self, track: ObjectTrack, stamp: float, expected: tuple[np.ndarray, float] | None) -> ObjectTrack:
        """Returns a track at the stamp of the images, in a gap where its estimator expects it."""
        coasted = stamp - track.seen
        track = track.predicted(stamp)
        if expected is not None and coasted > SHORT_COAST and track.state != TrackState.STANDING:
            track = track.placed(expected[0], max(expected[1], 0.005))
        return track

    def _windows(self, tracks: Sequence[ObjectTrack], side: int) -> list[ObjectWindow]:
        """Returns the windows of all tracks in one image; a track behind the camera has none that can be reached."""
        if not tracks:
            return []
        camera = self._cameras[side]
        views = camera.project([track.position for track in tracks]).tolist()
        windows = []
        for track, (u, v) in zip(tracks, views):
            J = projection_jacobian(camera, track.position)
            S = J @ track.covariance[:3, :3] @ J.T
            std = min(math.sqrt(0.5 * (S[0, 0] + S[1, 1])), WIDEST_GATE)
            if not (math.isfinite(u) and math.isfinite(v) and math.isfinite(std)):
                u, v, std = -1e6, -1e6, 0.0
            edges = J @ track.shape.edges
            pixels = track.shape.fill * outline_area(edges)
            depth = math.dist(track.position, camera.X_WC[:3, 3])
            windows.append(
                ObjectWindow(track.number or UNCONFIRMED, u, v, std, edges, pixels, depth, track.shape.settled)
            )
        return windows

    def _assign(
        self, tracks: Sequence[ObjectTrack], windows: Sequence[ObjectWindow], regions: Sequence[Region]
    ) -> list[int]:
        """Returns the region of each track in one image, -1 without one: the assignment of the least total distance."""
        places = [-1] * len(windows)
        if not windows or not regions:
            return places
        cost = np.full((len(windows), len(regions)), OUTSIDE)
        for i, window in enumerate(windows):
            for j, region in enumerate(regions):
                var_u, var_v = window.std**2 + region.var_u, window.std**2 + region.var_v
                distance = (region.u - window.u) ** 2 / var_u + (region.v - window.v) ** 2 / var_v
                if distance <= GATE:
                    cost[i, j] = distance + (0.0 if tracks[i].number else GATE)
        for i, j in zip(*linear_sum_assignment(cost)):
            if cost[i, j] < OUTSIDE:
                places[i] = int(j)
        return places

    def _observe(
        self,
        track: ObjectTrack,
        places: tuple[int, int],
        found: Sequence[Sequence[Region]],
        foregrounds: Sequence[Foreground],
        windows: Sequence[ObjectWindow],
    ) -> ObjectTrack:
        """Returns a track after its regions, or without a measurement if it has none that agree."""
        regions = [found[side][place] if place >= 0 else None for side, place in enumerate(places)]
        measurement = self._measured(track, regions)
        if (
            measurement is not None
            and self._contains(measurement.p_WQ)
            and track.distance_squared(measurement) <= 2 * GATE
        ):
            track = self._learn_look(replace(track.updated(measurement), places=places), regions, measurement.p_WQ)
            if track.stamp < track.guessed_until:
                return track.without_point()
            moving = track.speed > STANDING_SPEED or any(
                region.moving > 0.02 for region in regions if region is not None
            )
            return replace(track, state=TrackState.MOVING if moving else TrackState.STANDING)
        state = unseen_state(foregrounds, windows)
        return replace(track, state=state, misses=track.misses + 1, places=(-1, -1))

    def _measured(self, track: ObjectTrack, regions: Sequence[Region | None]) -> Measurement | None:
        """Returns the measurement of a track, None without one."""
        left, right = regions
        if any(region is not None and region.covered for region in regions):
            return None
        if left is not None and right is not None and not (left.shared or right.shared):
            return self.measure(left, right)
        if (left is None and right is None) or (track.number == 0 and (left is None or right is None)):
            return None
        measurement = self.measure_at_height(track.position, track.height, regions)
        if measurement is None or np.trace(measurement.covariance) > self.settings.largest_std**2:
            return None
        return measurement

    def _learn_look(self, track: ObjectTrack, regions: Sequence[Region | None], p_WQ: np.ndarray) -> ObjectTrack:
        """Returns the track with the extents and colour of its regions, unless other objects cover a part of them."""
        weight = max(COLOUR_WEIGHT, 1.0 / track.hits)
        (red, green, blue), height, merged = track.colour, track.height, track.merged
        alone, guessed_until = track.alone, track.guessed_until
        if any(region is None or region.shared for region in regions):
            merged = track.stamp
        elif regions[0] is not None:
            height += weight * (p_WQ[2] - height)
            red, green, blue = (old + weight * (new - old) for old, new in zip(track.colour, regions[0].colour))
        shape = track.shape.turned(track.mean[3:])
        views = [
            (projection_jacobian(camera, track.position), region)
            for camera, region in zip(self._cameras, regions)
            if region is not None and not region.shared
        ]
        if views:
            shape = shape.learned(
                np.array([J for J, _ in views]),
                np.array([region.extents for _, region in views]),
                np.array([region.pixels for _, region in views]),
            )
            alone, guessed_until = track.stamp, -np.inf
        return replace(
            track,
            shape=shape,
            height=float(height),
            colour=(red, green, blue),
            merged=merged,
            alone=alone,
            guessed_until=guessed_until,
        )

    def _relearning(self, track: ObjectTrack, tracks: Sequence[ObjectTrack]) -> ObjectTrack:
        """Returns a track, whose size is learned anew if its silhouettes are too large for long without another object.

        Such an object was only seen in part when its size was learned.
        """
        if track.stamp - track.alone < WRONG_SIZE_TIME or not track.shape.settled:
            return track
        near = (np.linalg.norm(other.position - track.position) < NEARBY for other in tracks if other is not track)
        return track if any(near) else replace(track, shape=replace(track.shape, count=0), alone=track.stamp)

    def _recognised(self, tracks: Sequence[ObjectTrack], found: Sequence[Sequence[Region]]) -> list[ObjectTrack]:
        """Returns the tracks, with the identities of two exchanged whose colours say so when they have just separated.

        While the silhouettes of two objects are merged in both images, positions do not always tell which is which.
        """
        tracks = list(tracks)
        alone = [k for k, track in enumerate(tracks) if track.number and _is_alone(track, found)]
        for i in alone:
            for j in alone:
                one, other = tracks[i], tracks[j]
                recent = one.stamp - max(one.merged, other.merged) < RECENTLY
                near = float(np.linalg.norm(one.position - other.position)) < NEARBY
                if i < j and recent and near:
                    colours = [np.array(found[0][track.places[0]].colour) for track in (one, other)]
                    known = [np.array(track.colour) for track in (one, other)]
                    same = sum(np.abs(a - b).sum() for a, b in zip(colours, known))
                    exchanged = sum(np.abs(a - b).sum() for a, b in zip(colours, reversed(known)))
                    if exchanged + CLEAR_COLOUR < same:
                        tracks[i], tracks[j] = one.as_object_of(other), other.as_object_of(one)
        return tracks

    def _begin(self, stamp: float, found: Sequence[Sequence[Region]]) -> list[ObjectTrack]:
        """Returns new tracks of moving regions that no track has, paired so that their rays pass each other closest."""
        left, right = ([region for region in regions if self._is_new(region)] for regions in found)
        if not left or not right:
            return []
        cost = np.full((len(left), len(right)), OUTSIDE)
        measured: dict[tuple[int, int], Measurement] = {}
        for i, one in enumerate(left):
            for j, other in enumerate(right):
                measurement = self.measure(one, other)
                if measurement is not None and self._contains(measurement.p_WQ):
                    measured[i, j] = measurement
                    cost[i, j] = measurement.gap + HEIGHT_WEIGHT * self._height_error(measurement.p_WQ)
        tracks = []
        for i, j in zip(*linear_sum_assignment(cost)):
            if (i, j) in measured:
                pair = (left[i], right[j])
                jacobians = [projection_jacobian(camera, measured[i, j].p_WQ) for camera in self._cameras]
                shape = ObjectShape.guess(np.array(jacobians), np.array([each.extents for each in pair]))
                tracks.append(new_track(stamp, measured[i, j], shape, pair[0].colour))
        return tracks

    def _is_new(self, region: Region) -> bool:
        """Returns whether a region shows a moving object that has no track."""
        moves = region.moving > 0.0 and region.pixels >= self.settings.min_pixels
        return moves and not region.track and not region.covered

    def _merged_in_one_image(
        self, tracks: Sequence[ObjectTrack], found: Sequence[Sequence[Region]]
    ) -> tuple[list[ObjectTrack], list[ObjectTrack]]:
        """Returns the tracks, and new ones of objects that one image shows apart, and the other merged with a track's.

        The places of both objects follow from the image that shows them apart, and from the height at which the middle
        of both appears in the other image where the merged silhouette is. An object that is well known stays as it is.
        """
        kept, new = list(tracks), []
        for side, other in ((0, 1), (1, 0)):
            for region in filter(self._is_new, found[side]):
                for k, track in enumerate(kept):
                    if not track.number or min(track.places) < 0 or track.measurement is None:
                        continue
                    mine, common = (found[each][track.places[each]] for each in (side, other))
                    window = self._windows([track], other)[0]
                    if (common.extents <= GROWN * window.extents).all() or region.pixels < RIVAL * mine.pixels:
                        continue
                    known = track.shape.settled
                    height = track.height if known else self._common_height(side, (mine, region), common)
                    pair = [self._on_height(track, self._cameras[side], each, height) for each in (mine, region)]
                    places = self._cameras[other].project([each.position for each in pair])
                    inside = (np.abs(places - (common.u, common.v)) <= 0.5 * common.extents).all()
                    if inside and all(self._contains(each.position) for each in pair):
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
        camera, other = self._cameras[side], self._cameras[1 - side]
        origin, directions = camera.rays([(region.u, region.v) for region in apart])
        height = 0.0 if self._height is None else self._height
        for _ in range(3):
            points = [origin + (height + step - origin[2]) / d[2] * d for step in (0.0, HEIGHT_STD) for d in directions]
            views = other.project(points)
            middle, shifted = views[:2].mean(axis=0), views[2:].mean(axis=0)
            slope = (shifted - middle) / HEIGHT_STD
            height += float(slope @ ((common.u, common.v) - middle) / (slope @ slope))
        return height

    def _come_apart(
        self, tracks: Sequence[ObjectTrack], found: Sequence[Sequence[Region]]
    ) -> tuple[list[ObjectTrack], list[ObjectTrack]]:
        """Returns the tracks, and new ones of objects whose silhouettes came apart from that of a track in one image.

        While two objects were merged in both images, they were one track. From the image in which they are apart, and
        the height of the track, follow the positions of both; the merged silhouette in the other image is then divided.
        """
        kept, new = [], []
        for track in tracks:
            for side, (camera, regions) in enumerate(zip(self._cameras, found)):
                mine = next(
                    (each for each in regions if each.track == track.number and each.apart and not each.covered), None
                )
                if not track.number or mine is None:
                    continue
                window = self._windows([track], side)[0]
                small = mine.extents < SHRUNK * window.extents
                others = [
                    each
                    for each in regions
                    if not each.track and np.hypot(each.u - window.u, each.v - window.v) < window.radius
                ]
                if not small.any() or not others:
                    continue
                pair = [
                    self._on_height(track, camera, each, track.height)
                    for each in (mine, max(others, key=lambda each: each.pixels))
                ]
                track = replace(pair[0], number=track.number, hits=track.hits)
                new.append(pair[1])
                break
            kept.append(track)
        return kept, new

    def _in_a_row(self, tracks: Sequence[ObjectTrack], found: Sequence[Sequence[Region]]) -> list[ObjectTrack]:
        """Returns the tracks, with several instead of each one that is longer than an object can be.

        Objects whose silhouettes are merged in both images from the start look like a single long one. They are guessed
        to be of equal lengths.
        """
        result = []
        for track in tracks:
            longest = int(np.argmax(track.shape.dimensions[:2]))
            length = float(track.shape.dimensions[longest])
            count = math.ceil(length / self.settings.max_length)
            if count < 2 or not _is_alone(track, found):
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
                part = replace(part, guessed_until=track.stamp + GUESS_TIME)
                result.append(replace(part, number=track.number, hits=track.hits) if k == 0 else part)
        return result

    def _rough(
        self, track: ObjectTrack, p_WQ: np.ndarray, shape: ObjectShape, colour: tuple[float, float, float]
    ) -> ObjectTrack:
        """Returns a new track of an object that was found near another one, and moves like it."""
        measurement = Measurement(p_WQ, np.diag([ROUGH_STD**2, ROUGH_STD**2, HEIGHT_STD**2]), 0.0, 1.0)
        begun = new_track(track.stamp, measurement, shape, colour)
        return begun.with_velocity(track.mean[3:] * [1.0, 1.0, 0.0], ROUGH_SPEED_STD).without_point()

    def _on_height(self, track: ObjectTrack, camera: CameraModel, region: Region, height: float) -> ObjectTrack:
        """Returns a new track of a region in one image, at a height [m], with the velocity of another track."""
        origin, (direction,) = camera.rays([[region.u, region.v]])
        p_WQ = origin + (height - origin[2]) / direction[2] * direction
        shape = ObjectShape.guess(projection_jacobian(camera, p_WQ)[None], np.array([region.extents]))
        return self._rough(track, p_WQ, shape.turned(track.mean[3:]), region.colour)

    def _cleaned(self, tracks: Sequence[ObjectTrack], foregrounds: Sequence[Foreground]) -> tuple[ObjectTrack, ...]:
        """Returns the tracks without those that ended: not seen for long, or the second track of one object."""
        settings = self.settings
        kept: list[ObjectTrack] = []
        for track in sorted(tracks, key=lambda each: (each.number == 0, each.number, -each.hits)):
            patience = settings.coast_time if track.number else 0.05
            if track.state == TrackState.OCCLUDED:
                patience *= 3.0
            if track.stamp - track.seen > patience:
                continue
            if any(self._same_object(track, other) for other in kept):
                continue
            kept.append(track)
        return tuple(kept)

    def _same_object(self, track: ObjectTrack, other: ObjectTrack) -> bool:
        """Returns whether two tracks lie on one object, in both images.

        Tracks of objects whose sizes are well known were apart for long: they pass each other.
        """
        if track.shape.settled and other.shape.settled:
            return False
        for camera in self._cameras:
            one, two = camera.project([track.position, other.position])
            J = projection_jacobian(camera, other.position)
            radius = 0.5 * min(
                float(np.linalg.norm(np.abs(J @ each.shape.edges).sum(axis=1))) for each in (track, other)
            )
            if not np.hypot(*(one - two)) < SAME_OBJECT * radius:
                return False
        return True

    def _confirm(self, tracks: Sequence[ObjectTrack], next_number: int) -> tuple[list[ObjectTrack], int]:
        """Returns the tracks with numbers for those that have been seen often enough, and the next free number."""
        confirmed = []
        for track in tracks:
            if track.number == 0 and track.hits >= self.settings.confirm_after:
                track, next_number = replace(track, number=next_number), next_number + 1
            confirmed.append(track)
        return confirmed, next_number

    def _contains(self, p_WQ: np.ndarray) -> bool:
        if self._box is None:
            return True
        lower, upper = self._box
        return bool((p_WQ >= lower).all() and (p_WQ <= upper).all())

    def _height_error(self, p_WQ: np.ndarray) -> float:
        return 0.0 if self._height is None else abs(float(p_WQ[2]) - self._height)


def _is_alone(track: ObjectTrack, found: Sequence[Sequence[Region]]) -> bool:
    """Returns whether a track is measured in both images with silhouettes that show its object only."""
    return min(track.places) >= 0 and not any(found[side][place].shared for side, place in enumerate(track.places))


def unseen_state(foregrounds: Sequence[Foreground], windows: Sequence[ObjectWindow]) -> TrackState:
    """Returns why an object has no measurement.

    Args:
        foregrounds: of the left and the right image.
        windows: the windows of the object in them.
    """
    if not all(foreground.shows(window.u, window.v) for foreground, window in zip(foregrounds, windows)):
        return TrackState.OUT_OF_VIEW
    for foreground, window in zip(foregrounds, windows):
        offset = np.array(foreground.image_offset)
        if foreground.hidden is not None and covered_share(foreground.hidden, offset, window) > COVERED:
            return TrackState.OCCLUDED
    return TrackState.NOT_OBSERVED


def projection_jacobian(camera: CameraModel, p_WQ: np.ndarray) -> np.ndarray:
    """Returns the derivative of the pixel (u, v) by the position p_WQ, shape (2, 3) [px/m], without lens distortion."""
    R_CW = camera.X_CW[:3, :3]
    x, y, z = R_CW @ p_WQ + camera.X_CW[:3, 3]
    fx, fy = camera.K[0, 0], camera.K[1, 1]
    return np.array([[fx / z, 0.0, -fx * x / z**2], [0.0, fy / z, -fy * y / z**2]]) @ R_CW
