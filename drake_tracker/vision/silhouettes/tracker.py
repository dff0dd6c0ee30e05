"""Tracks several objects: associates the regions of two images with tracks, and keeps the tracks.

Per pair of images: each track predicts windows in both images; regions are found with them (`regions.make_regions`);
the regions of each image are assigned to the tracks, the nearest globally; two regions of a track that agree epipolarly
are triangulated. Pairs of moving regions that no track explains begin new tracks.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import linear_sum_assignment

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.core.frozen_state import FrozenState
from drake_tracker.core.messages import REGION_SLOTS, TRACK_SLOTS, TrackState
from drake_tracker.vision.camera_motion import Verdict
from drake_tracker.vision.check_settings import check_settings
from drake_tracker.vision.silhouettes.config import SilhouetteTracker
from drake_tracker.vision.silhouettes.foreground import Foreground
from drake_tracker.vision.silhouettes.object_appearance import learn_look, recognised, relearning
from drake_tracker.vision.silhouettes.object_shape import ObjectShape
from drake_tracker.vision.silhouettes.regions import Region, make_regions
from drake_tracker.vision.silhouettes.silhouettes import COVERED, covered_share, find_silhouettes
from drake_tracker.vision.silhouettes.split_silhouettes import place_objects
from drake_tracker.vision.silhouettes.stereo_geometry import GATE, StereoGeometry, projection_jacobian
from drake_tracker.vision.silhouettes.track_3d import STANDING_SPEED, Measurement, Track3D, new_track
from drake_tracker.vision.silhouettes.track_splitting import TrackSplitting
from drake_tracker.vision.silhouettes.validation_gate import ValidationGate

HEIGHT_WEIGHT = 0.5
"""How much a height outside of the middle of the work volume counts against a pair of regions, relative to the gap."""
SAME_OBJECT = 0.45
"""Two tracks whose centres are nearer than this fraction of their radii, in both images, follow one object."""
OUTSIDE = 1e6
"""Cost of an assignment that is not allowed."""
VISIBLE = 0.3
"""Share of an object that must be visible beside the arm for it to be located."""
SHORT_COAST = 0.1
"""Time without a measurement [s] after which the estimator's prediction, if there is one, replaces the filter's."""
EXPECTED_SPEED_STD = 0.1
"""Standard deviation per axis of the velocity that an estimator expects [m/s]."""


class Expected(NamedTuple):
    """Where an estimator expects an object.

    Attributes:
        p_WQ: position, shape (3,) [m].
        v_WQ: velocity, shape (3,) [m/s].
        std: standard deviation of the position [m].
    """

    p_WQ: np.ndarray
    v_WQ: np.ndarray
    std: float


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
    tracks: tuple[Track3D, ...] = ()
    next_number: int = 1
    regions: tuple[tuple[Region, ...], tuple[Region, ...]] = ((), ())
    overflow: int = 0
    usable: bool = True
    cameras: tuple[tuple[Verdict, float], ...] = ((Verdict.STILL, 0.0), (Verdict.STILL, 0.0))

    def confirmed(self) -> tuple[Track3D, ...]:
        """Returns the tracks that have a number."""
        return tuple(track for track in self.tracks if track.number)


class Tracker:
    """Tracks objects in the images of two cameras. All state is with the caller.

    Args:
        cameras: the left and the right camera, calibrated.
        settings: `SilhouetteTracker`.
        work_volume: lower and upper corner in W, shape (2, 3) [m]; None accepts objects anywhere.
        max_gap: largest distance between the two rays of one object [m].

    Raises DrakeTrackerError when the work volume is not a box, or a setting is outside its range.
    """

    def __init__(
        self,
        cameras: Sequence[CameraModel],
        settings: SilhouetteTracker = SilhouetteTracker(),
        *,
        work_volume: ArrayLike | None = None,
        max_gap: float = 0.03,
    ) -> None:
        check_settings(settings, "tracker")
        self.settings = settings
        self._geometry = StereoGeometry(cameras, work_volume=work_volume, margin=settings.margin, max_gap=max_gap)
        self._separation = TrackSplitting(self._geometry, settings.max_length, settings.min_pixels)

    def update(
        self,
        state: TrackerState,
        foregrounds: Sequence[Foreground],
        expected: Mapping[int, Expected] = {},
    ) -> TrackerState:
        """Returns the state after a pair of images.

        Args:
            state: the state before.
            foregrounds: of the left and the right image.
            expected: {number of a track: prediction of its estimator for the stamp of the images}.
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
        offsets = [self._geometry.offsets(track.position, [each.hand for each in foregrounds]) for track in tracks]
        windows = [self._geometry.windows(tracks, side, offsets) for side in range(2)]
        silhouettes = [
            find_silhouettes(foreground, views, self.settings.min_pixels)
            for foreground, views in zip(foregrounds, windows)
        ]
        stands = place_objects(silhouettes, [track.covariance[:3, :3] for track in tracks])
        found = [make_regions(each, centres) for each, centres in zip(silhouettes, stands)]
        places = [self._assign(tracks, views, regions) for views, regions in zip(windows, found)]
        tracks = [
            self._observe(
                track, (places[0][k], places[1][k]), found, foregrounds, (windows[0][k], windows[1][k]), offsets[k]
            )
            for k, track in enumerate(tracks)
        ]
        tracks = [relearning(track, tracks) for track in tracks]
        tracks, apart = self._separation.come_apart(recognised(tracks, found), found)
        tracks = self._separation.in_a_row(self._separation.joined(tracks, found), found)
        begun = apart or self._begin(stamp, found)
        if not begun:
            tracks, begun = self._separation.merged_in_one_image(tracks, found)
        tracks += begun
        tracks, next_number = self._confirm(self._cleaned(tracks, foregrounds), state.next_number)
        overflow = sum(max(len(regions) - REGION_SLOTS, 0) for regions in found) + max(len(tracks) - TRACK_SLOTS, 0)
        tracks = tracks[:TRACK_SLOTS]
        return TrackerState(
            stamp, tuple(tracks), next_number, (tuple(found[0]), tuple(found[1])), overflow, True, cameras
        )

    def _predict(self, track: Track3D, stamp: float, expected: Expected | None) -> Track3D:
        """Returns a track at the stamp of the images, in a gap where its estimator expects it.

        An object long out of view is expected with its estimator's heading; on a hill, the uncertainty keeps growing.
        """
        coasted = stamp - track.seen
        track = track.predicted(stamp)
        if expected is not None and coasted > SHORT_COAST and track.state != TrackState.STANDING:
            placed = track.placed(expected.p_WQ, max(expected.std, 0.005))
            track = replace(placed, covariance=track.covariance) if track.height_free else placed
            if track.state == TrackState.OUT_OF_VIEW:
                track = track.with_velocity(expected.v_WQ, EXPECTED_SPEED_STD)
                track = replace(track, shape=track.shape.turned(expected.v_WQ))
        return track

    def _assign(
        self, tracks: Sequence[Track3D], windows: Sequence[ValidationGate], regions: Sequence[Region]
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
        track: Track3D,
        places: tuple[int, int],
        found: Sequence[Sequence[Region]],
        foregrounds: Sequence[Foreground],
        windows: Sequence[ValidationGate],
        offsets: np.ndarray,
    ) -> Track3D:
        """Returns a track after its regions, or without a measurement if it has none that agree."""
        seen = places
        shown = [place >= 0 and _shows(found[side][place], track) for side, place in enumerate(places)]
        places = (places[0] if shown[0] else -1, places[1] if shown[1] else -1)
        regions = [found[side][place] if place >= 0 else None for side, place in enumerate(places)]
        regions = _inside(regions) if track.height_known else regions
        measurement = self._measured(track, regions, offsets)
        if (
            measurement is not None
            and self._geometry.contains(measurement.p_WQ)
            and track.distance_squared(measurement) <= 2 * GATE
        ):
            divided = any(region is not None and not region.whole for region in regions)
            track = track.updated(measurement, divided, places)
            track = learn_look(track, self._geometry.cameras, regions, measurement.p_WQ)
            if track.stamp < track.guessed_until:
                return track.without_point()
            moving = track.speed > STANDING_SPEED or any(
                region.moving > 0.02 for region in regions if region is not None
            )
            state = TrackState.MOVING if moving else TrackState.STANDING
            return track if track.state is state else replace(track, state=state)
        cut = any(place >= 0 and found[side][place].cut for side, place in enumerate(seen))
        state = TrackState.OUT_OF_VIEW if cut else unseen_state(foregrounds, windows)
        return replace(track, state=state, misses=track.misses + 1, places=(-1, -1))

    def _measured(self, track: Track3D, regions: Sequence[Region | None], offsets: np.ndarray) -> Measurement | None:
        """Returns the measurement of a track, None without one."""
        left, right = regions
        if left is not None and right is not None and left.whole and right.whole:
            return self._geometry.measure(left, right)
        if (left is None or right is None) and (track.number == 0 or not track.height_known):
            return None
        if left is None and right is None:
            return None
        measurement = self._geometry.measure_at_height(track, regions, offsets)
        if measurement is None or np.trace(measurement.covariance) > self.settings.largest_std**2:
            return None
        return measurement

    def _begin(self, stamp: float, found: Sequence[Sequence[Region]]) -> list[Track3D]:
        """Returns new tracks of moving regions that no track has, paired so that their rays pass each other closest."""
        left, right = ([region for region in regions if self._separation.is_new(region)] for regions in found)
        if not left or not right:
            return []
        cost = np.full((len(left), len(right)), OUTSIDE)
        measured: dict[tuple[int, int], Measurement] = {}
        for i, one in enumerate(left):
            for j, other in enumerate(right):
                measurement = self._geometry.measure(one, other)
                if measurement is not None and self._geometry.contains(measurement.p_WQ):
                    measured[i, j] = measurement
                    cost[i, j] = measurement.gap + HEIGHT_WEIGHT * self._geometry.height_error(measurement.p_WQ)
        tracks = []
        for i, j in zip(*linear_sum_assignment(cost)):
            if (i, j) in measured:
                pair = (left[i], right[j])
                jacobians = [projection_jacobian(camera, measured[i, j].p_WQ) for camera in self._geometry.cameras]
                shape = ObjectShape.guess(np.array(jacobians), np.array([each.extents for each in pair]))
                tracks.append(new_track(stamp, measured[i, j], shape, pair[0].colour))
        return tracks

    def _cleaned(self, tracks: Sequence[Track3D], foregrounds: Sequence[Foreground]) -> tuple[Track3D, ...]:
        """Returns the tracks without ended tracks, which were not seen for long, and without second tracks of one
        object."""
        settings = self.settings
        kept: list[Track3D] = []
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

    def _same_object(self, track: Track3D, other: Track3D) -> bool:
        """Returns whether two tracks lie on one object, in both images.

        Tracks of objects whose sizes are well known were apart for long: they pass each other.
        """
        if track.shape.settled and other.shape.settled:
            return False
        for camera in self._geometry.cameras:
            one, two = camera.project([track.position, other.position])
            J = projection_jacobian(camera, other.position)
            radius = 0.5 * min(
                float(np.linalg.norm(np.abs(J @ each.shape.edges).sum(axis=1))) for each in (track, other)
            )
            if not np.hypot(*(one - two)) < SAME_OBJECT * radius:
                return False
        return True

    def _confirm(self, tracks: Sequence[Track3D], next_number: int) -> tuple[list[Track3D], int]:
        """Returns the tracks, with numbers for tracks that have been seen often enough, and the next free number."""
        confirmed = []
        for track in tracks:
            if track.number == 0 and track.hits >= self.settings.confirm_after:
                track, next_number = replace(track, number=next_number), next_number + 1
            confirmed.append(track)
        return confirmed, next_number


def _shows(region: Region, track: Track3D) -> bool:
    """Returns whether a region shows enough of a track's object to locate it.

    If a camera has turned away, an unknown part of an object is hidden. The area covered by the arm and the size of the
    object are known.
    """
    if region.covered:
        sized = track.shape.sized if region.beyond else track.shape.settled
        if not (track.height_known and sized and region.share >= VISIBLE):
            return False
    return not region.cut


def _inside(regions: Sequence[Region | None]) -> list[Region | None]:
    """Returns the regions of an object, without a region that the border cuts if the other image shows the whole
    object."""
    if any(region is not None and region.whole for region in regions):
        return [None if region is None or region.beyond else region for region in regions]
    return list(regions)


def unseen_state(foregrounds: Sequence[Foreground], windows: Sequence[ValidationGate]) -> TrackState:
    """Returns why an object has no measurement.

    Args:
        foregrounds: of the left and the right image.
        windows: the windows of the object in them.
    """
    if not all(foreground.shows(window.u, window.v) for foreground, window in zip(foregrounds, windows)):
        return TrackState.OUT_OF_VIEW
    for name, state in (("hidden", TrackState.OCCLUDED), ("missing", TrackState.OUT_OF_VIEW)):
        for foreground, window in zip(foregrounds, windows):
            mask: np.ndarray | None = getattr(foreground, name)
            if mask is not None and covered_share(mask, np.array(foreground.image_offset), window) > COVERED:
                return state
    return TrackState.NOT_OBSERVED
