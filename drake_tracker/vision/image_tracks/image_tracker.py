"""Tracks the objects that move in the images of one camera, and selects the object to follow.

Needs no calibration: `vision/silhouettes/tracker.py` tracks objects in space with two calibrated cameras.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import cv2
import numpy as np

from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.vision.image_tracks.empty_scene import remember_empty, shows_more
from drake_tracker.vision.image_tracks.global_image_motion import (
    STILL,
    align_to,
    clear_border,
    find_shifts,
    shift_estimate,
    suggests_shift,
)
from drake_tracker.vision.image_tracks.image_objects import ImageObjects, count_rivals
from drake_tracker.vision.image_tracks.image_regions import ImageRegion, changed_twice, find_regions, join_fast
from drake_tracker.vision.image_tracks.reidentification import (
    CONFIRM_AFTER,
    SETTLED,
    distance_from,
    found_again,
    in_company,
    is_leap,
    is_same_object,
    left_its_place,
    may_be_fast,
    without_doubles,
    without_region,
)
from drake_tracker.vision.image_tracks.track_2d import (
    Track2D,
    TrackState2D,
    predict_track,
    remember_scene,
    start_track,
    with_region,
)
from drake_tracker.vision.light_gain import with_light_of
from drake_tracker.vision.region_centroid import RegionCentroid

COAST_TIME = 1.0
"""Time after which an object that is not seen is lost [s]."""
MERGED_TIME = 2.5
"""The same for an object in a merged region, which other objects may occlude for longer [s]."""
ALERT_IMAGES = 30
"""Images for which the motion of the camera is looked for after it has moved."""
UNLIKE_IMAGES = 15
"""Images after which a region of another size is taken for the object itself."""
CLOSE_SHARE = 0.05
"""Farthest distance of the object from the pixel that was given, as a share of the image's diagonal."""
KNOWN = 2.0
"""Assignment bonus of a confirmed object over a candidate; other costs are of the order of 1."""
LEFT = 1.0
"""Assignment cost added when a new object, last seen as an exact region, is matched to an inexact region."""
_FORBIDDEN = 1e6


class ImageTracker:
    """Follows one object or several.

    Args:
        objects: number of objects to report.
        follow: pixel (u, v) of the first object in the first image; None follows the largest.
        window: uint8 (h, w), 0 where motion is ignored; None uses the whole image.
        period: of the images [s].
    """

    def __init__(
        self,
        objects: int = 1,
        follow: tuple[float, float] | None = None,
        window: np.ndarray | None = None,
        *,
        period: float = VISION_PERIOD,
    ) -> None:
        self.objects, self.follow, self.window, self.period = objects, follow, window, period

    def start(self) -> ImageObjects:
        """Returns the state before the first image."""
        return ImageObjects(targets=(0,) * self.objects, lost=(None,) * self.objects)

    def update(
        self, objects: ImageObjects, stamp: float, detector: Any, images: Sequence[np.ndarray]
    ) -> tuple[ImageObjects, np.ndarray, RegionCentroid | None]:
        """Returns (the objects after an image, the mask of moving pixels, centroid of the first target).

        Args:
            objects: before.
            stamp: of the image that the mask describes [s].
            detector: `MotionDetector` of the images.
            images: smoothed by it, oldest first.
        """
        middle = _grey(images[len(images) // 2])
        images, mask, displacement, alert = self._aligned(objects, detector, images)
        mask = self._within(mask, displacement)
        reach = 0.5 * (len(images) - 1) * detector.stride * self.period
        settings = getattr(detector, "parameters", None) or detector.settings
        regions = find_regions(mask, settings.join_distance, settings.min_pixels)
        if len(images) == 3 and (len(regions) > 1 or may_be_fast(objects.tracks, reach)):
            twice = self._within(changed_twice([_grey(image) for image in images]), displacement)
            regions = join_fast(regions, find_regions(twice, settings.join_distance, settings.min_pixels))
        tracks = [predict_track(track, stamp) for track in objects.tracks]
        tracks, free = self._match(tracks, regions, middle, objects, displacement, reach)
        tracks = without_doubles(objects.tracks, tracks, objects.targets)
        number = objects.next_number
        for region in free:
            tracks.append(start_track(number, stamp, region, middle))
            number += 1
        found = replace(
            objects,
            tracks=tuple(remember_scene(track, middle, displacement) for track in tracks),
            next_number=number,
            displacement=displacement,
            alert=alert,
        )
        found = self._choose(found, middle, stamp)
        found = replace(
            found, scene=None if displacement > 0.0 else remember_empty(objects.scene, middle, found.tracks)
        )
        return found, mask, self._centroid(found, regions)

    def _aligned(
        self, objects: ImageObjects, detector: Any, images: Sequence[np.ndarray]
    ) -> tuple[Sequence[np.ndarray], np.ndarray, float, int]:
        """Returns (the images in the same light and without motion of the camera, the mask of moving pixels, the
        camera's motion [px], images for which to look for it)."""
        reference = images[len(images) // 2]
        images = [image if image is reference else with_light_of(reference, image) for image in images]
        mask = detector.mask(*images)
        if not (objects.alert or suggests_shift(mask)) and shift_estimate(images[0], images[-1]) < 2.0 * STILL:
            return images, mask, 0.0, 0
        middle = len(images) // 2
        shifts = find_shifts(_grey(images[middle]), [_grey(image) for image in (images[0], images[-1])])
        if shifts is None or max(shift.displacement for shift in shifts) < STILL:
            return images, mask, 0.0, max(objects.alert - 1, 0)
        aligned = list(images)
        aligned[-1] = align_to(images[-1], shifts[1])
        if len(images) > 2:
            aligned[0] = align_to(images[0], shifts[0])
        return aligned, detector.mask(*aligned), max(shift.displacement for shift in shifts), ALERT_IMAGES

    def _within(self, mask: np.ndarray, displacement: float) -> np.ndarray:
        """Returns a mask cleared outside of the window, and at borders that not all images show."""
        if displacement > 0.0:
            mask = clear_border(mask, displacement)
        return mask if self.window is None else cv2.bitwise_and(mask, self.window)

    def _match(
        self,
        tracks: list[Track2D],
        regions: list[ImageRegion],
        image: np.ndarray,
        objects: ImageObjects,
        displacement: float,
        reach: float,
    ) -> tuple[list[Track2D], list[ImageRegion]]:
        """Returns (tracks after the assignment of the regions of an image, regions without a track)."""
        before = {track.number: track for track in objects.tracks}
        gates = []
        for track in tracks:
            dt = track.stamp - before[track.number].stamp
            step = track.speed * dt if track.hits > 1 else 3.0 * track.size
            gates.append(0.5 * track.size + 2.2 * step + 3.0 * track.std + displacement)
        cost = np.full((len(tracks), len(regions)), _FORBIDDEN)
        for i, track in enumerate(tracks):
            for j, region in enumerate(regions):
                alone = track.alone(region, reach)
                distance = math.hypot(alone.u - track.mean[0], alone.v - track.mean[1])
                alike = track.is_like(alone) or track.hits < CONFIRM_AFTER
                if alone is region.inner:
                    alike = alike or track.sweeps(alone, region, reach)
                if distance < gates[i] and (alike or track.unlike >= UNLIKE_IMAGES):
                    ratio = abs(math.log(alone.width * alone.height / (track.width * track.height)))
                    known = KNOWN if track.hits >= CONFIRM_AFTER else 0.0
                    left = LEFT if track.was_exact and not (known or alone.exact or region.inner) else 0.0
                    cost[i, j] = distance / gates[i] + 0.3 * ratio - known + left
        pairs = {}
        if cost.size:
            pairs = {int(i): int(j) for i, j in zip(*assign(cost)) if cost[i, j] < _FORBIDDEN}
        members: dict[int, list[int]] = {}
        for i, track in enumerate(tracks):
            if track.hits >= CONFIRM_AFTER:
                for j, region in enumerate(regions):
                    if region.distance(track.mean[0], track.mean[1]) <= 0.25 * track.size:
                        members.setdefault(j, []).append(i)
        merged = {j for j, inside in members.items() if len(inside) > 1 and not self._one_each(j, inside, pairs)}
        after, parts = [], set()
        for i, track in enumerate(tracks):
            own = pairs.get(i, -1)
            company, whole = in_company(track, tracks), None
            settled = track.hits >= CONFIRM_AFTER and before[track.number].speed < SETTLED * track.size
            if objects.scene is not None and displacement == 0.0 and settled and not company:
                whole = objects.scene.silhouette(track, image)
            if own >= 0 and own not in merged and not left_its_place(track, regions[own], image):
                alone = track.alone(regions[own], reach)
                if whole is not None and whole.width * whole.height > track.area and shows_more(whole, alone):
                    track, alone = replace(track, width=whole.width, height=whole.height), whole
                    parts |= {j for j, each in enumerate(regions) if whole.distance(each.u, each.v) == 0.0}
                after.append(with_region(track, alone, image, 0.5 * displacement, company))
                continue
            inside = any(i in some for some in members.values())
            after.append(without_region(track, image, gates[i], inside, whole))
        taken = set(pairs.values()) | merged | set(members) | parts
        among = {i for inside in members.values() if len(inside) > 1 for i in inside}
        kept = []
        for i, track in enumerate(after):
            longest = 0.0 if track.hits < CONFIRM_AFTER else MERGED_TIME if i in among else COAST_TIME
            if track.stamp - track.seen <= longest:
                kept.append(track)
        return kept, [region for j, region in enumerate(regions) if j not in taken]

    @staticmethod
    def _one_each(j: int, inside: list[int], pairs: dict[int, int]) -> bool:
        """Returns whether each other track inside a region has a separate region."""
        return sum(pairs.get(i, j) == j for i in inside) <= 1

    def _choose(self, objects: ImageObjects, image: np.ndarray, stamp: float) -> ImageObjects:
        """Returns the objects with their targets."""
        tracks = {track.number: track for track in objects.tracks}
        targets, lost, switches = list(objects.targets), list(objects.lost), objects.switches
        leaps, leapt = objects.leaps, objects.leapt
        for place, number in enumerate(targets):
            if number in tracks and tracks[number].state == TrackState2D.HIDDEN:
                free = [track for track in tracks.values() if track.number not in targets]
                found = found_again(tracks[number], free, 2.5 * self.period)
                if found is not None:
                    leap = is_leap(tracks[number], found)
                    leaps, leapt = (leaps + 1, stamp) if leap else (leaps, leapt)
                    del tracks[found.number]
                    tracks[number] = replace(found, number=number, since=tracks[number].since)
            if number in tracks:
                lost[place] = tracks[number]
                continue
            free = [track for track in tracks.values() if track.number not in targets]
            chosen = self._candidate(place, free, lost[place], image)
            if chosen is None:
                continue
            old = lost[place]
            if old is not None and self.follow is not None and place == 0:
                # The same object again: it keeps its number.
                again = replace(chosen, number=old.number)
                tracks = {track.number: track for track in tracks.values() if track.number != chosen.number}
                tracks[again.number] = chosen = again
            elif number:
                switches += 1
            targets[place], lost[place] = chosen.number, chosen
        return replace(
            objects,
            tracks=tuple(tracks.values()),
            targets=tuple(targets),
            lost=tuple(lost),
            switches=switches,
            rivals=count_rivals(tuple(tracks.values()), targets),
            leaps=leaps,
            leapt=leapt,
        )

    def _candidate(self, place: int, free: list[Track2D], old: Track2D | None, image: np.ndarray) -> Track2D | None:
        """Returns the track to give a free place in the list of targets, or None."""
        if place == 0 and self.follow is not None:
            if old is None:
                limit = CLOSE_SHARE * np.hypot(*image.shape)
                near = [(distance_from(track, self.follow), track.number, track) for track in free]
                return min([each for each in near if each[0] <= limit], default=(0.0, 0, None))[2]
            alike = [track for track in free if track.hits >= CONFIRM_AFTER and is_same_object(old, track)]
            return max(alike, key=lambda track: track.hits, default=None)
        confirmed = [track for track in free if track.hits >= CONFIRM_AFTER]
        return max(confirmed, key=lambda track: track.pixel_count, default=None)

    def _centroid(self, objects: ImageObjects, regions: list[ImageRegion]) -> RegionCentroid | None:
        """Returns the centroid of the first target; before a target is confirmed, the centroid of the largest
        region."""
        if objects.targets[0] == 0 and self.follow is None:
            return RegionCentroid(*regions[0][:3]) if regions else None
        track = objects.target()
        if track is None or track.seen < track.stamp:
            return None
        return RegionCentroid(float(track.place[0]), float(track.place[1]), track.moving)


def assign(cost: np.ndarray) -> tuple[Sequence[int], Sequence[int]]:
    """Returns (rows, columns) of the cheapest assignment, for costs of shape (n, m) with n and m above 0."""
    if min(cost.shape) == 1:
        best = int(cost.argmin())
        return [best // cost.shape[1]], [best % cost.shape[1]]
    from scipy.optimize import linear_sum_assignment  # slow to load, and not needed for a single object

    rows, columns = linear_sum_assignment(cost)
    return rows, columns


def _grey(image: np.ndarray) -> np.ndarray:
    """Returns a smoothed image as uint8: the integer path of the normal flow has 1/32 grey levels."""
    if image.dtype == np.uint8:
        return image
    return cv2.convertScaleAbs(image, alpha=1.0 / 32.0 if image.dtype == np.int16 else 1.0)
