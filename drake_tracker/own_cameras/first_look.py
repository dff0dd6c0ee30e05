"""A first look at a recording: size and speed of the object, from which the detector settings follow.

Motion is seen at edges. A slow object must be compared with an image farther away, a fast one with the next; and the
front and the rear edge of a large object without texture must be joined. Both are measured: silhouettes against the
median of some images show whole objects.
"""

import itertools
from collections.abc import Callable, Generator, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.vision.centroid.detectors import make_detector
from drake_tracker.vision.image_tracks.image_regions import find_regions
from drake_tracker.vision.image_tracks.pyramid_level import reduced, reduced_pixel, reduced_window
from drake_tracker.vision.light_gain import with_light_of

MOST_IMAGES, MOST_PIXELS = 240, 250_000_000
"""Largest number of images that are looked at, and of their pixels in all."""
WINDOWS = 12
"""Number of short sequences in which speed and edges are measured."""
REACH = 4
"""Images before and after the middle of such a sequence; the largest stride."""
SURE_STEP = 2.0
"""Speed from which on two images are enough to measure it [px/image]."""
LEAST_STEP = 1.0
"""Least motion from one of the images compared to the next [px]."""
LARGEST_STEP = 0.5
"""Largest motion, as a share of the object's size."""
LEAST_CHANGE, CHANGE_NOISE = 15.0, 6.0
"""Least difference of a silhouette from the background [grey levels], and the same in medians of all differences."""
LARGEST_SHARE = 0.3
"""Share of the image that differs from the background above which the camera itself moves."""
LEAST_AREA = 30
"""Least number of pixels of a silhouette."""
JOIN_DISTANCE, DOUBLED = 24, 4
"""Usual join distance [px], and how often it is doubled while objects fall apart."""
COVERED, ALONE = 0.5, 0.9
"""A region shows a whole object if it covers this share of its width and height, and contains this share of the moving
pixels there: its front and its rear edge. Edges along the motion do not move."""
ALWAYS, MOSTLY = 0.95, 0.6
"""Share of the sequences in which it must, and the share that is enough if no setting reaches that."""


@dataclass(frozen=True)
class FirstLook:
    """Result of a first look.

    Attributes:
        size: mean of width and height of the largest moving object, or of the one to follow [px].
        speed: its speed [px/image].
        stride: images from one that is compared to the next.
        join_distance: gap between edges of one object [px].
    """

    size: float
    speed: float
    stride: int
    join_distance: int


def take_a_look(
    images: Callable[[], Iterator[tuple[float, np.ndarray]]],
    count: int,
    settings: Any,
    period: float,
    window: np.ndarray | None = None,
    follow: tuple[float, float] | None = None,
    *,
    fixed_stride: bool = False,
    reduce_by: int = 1,
) -> FirstLook | None:
    """Returns the result for the first images, in pixels of the full images; None where nothing moves alone.

    With a long stride, a slow object stands out from the noise, but less of its outline may show: the longest stride is
    taken with which the regions show the whole object, and the least join distance.

    Args:
        images: function that returns an iterator over (time [s], RGB image), as of a `Footage`.
        count: number of images that there are.
        settings: of a detector with ``stride`` and ``join_distance``.
        period: of the images [s].
        window: uint8 (h, w), 0 where motion does not count; None uses the whole image.
        follow: pixel (u, v) of an object in the first image: of several silhouettes, those nearest to its area count;
            None, or a pixel where nothing moves: the largest.
        fixed_stride: whether the stride of the settings is kept.
        reduce_by: factor by which the images are reduced for the look, see `reduced`.
    """
    window, follow = reduced_window(window, reduce_by), reduced_pixel(follow, reduce_by)
    found = _look(_read(images, count, reduce_by), settings, period, window, follow, fixed_stride)
    if found is None:
        return None
    return FirstLook(reduce_by * found.size, reduce_by * found.speed, found.stride, reduce_by * found.join_distance)


def _look(
    sequences: list[list[np.ndarray]],
    settings: Any,
    period: float,
    window: np.ndarray | None,
    follow: tuple[float, float] | None,
    fixed_stride: bool,
) -> FirstLook | None:
    """Returns the result for sequences of grey images, see `take_a_look`."""
    if len(sequences) < 3:
        return None
    background = median_image([each[REACH] for each in sequences])
    area = None if follow is None else _area_at(sequences[0][0], background, window, follow)
    found = []
    for sequence in sequences:
        seen = [_find_object(sequence[k], background, window, area) for k in (0, REACH, REACH + 1, 2 * REACH)]
        if all(box is not None for box in seen):
            found.append((sequence, np.array(seen, dtype=float)))
    if len(found) < 3:
        return None
    boxes = np.array([each for _, each in found])
    size = float(np.median(boxes[:, 1, 2:4].mean(axis=1)))
    speed = float(np.median(np.hypot(*(boxes[:, 3, 4:] - boxes[:, 0, 4:]).T)) / (2 * REACH))
    if speed > SURE_STEP:  # it may have bounced meanwhile
        speed = float(np.median(np.hypot(*(boxes[:, 2, 4:] - boxes[:, 1, 4:]).T)))
    usual, usual_join = int(settings.stride), int(settings.join_distance or JOIN_DISTANCE)
    if fixed_stride:
        strides = [usual]
    else:
        longest = usual if speed == 0.0 else int(np.clip(max(usual, np.ceil(LEAST_STEP / speed)), 1, REACH))
        if longest * speed > LARGEST_STEP * size:
            longest = max(1, int(LARGEST_STEP * size / speed))
        strides = list(range(longest, 0, -1))
    best, most = FirstLook(size, speed, strides[0], usual_join), MOSTLY
    if strides[0] * speed > LARGEST_STEP * size:  # its edges never enclose it
        return best
    for stride in strides:
        detector = make_detector(replace(settings, stride=stride), period=period)
        masks = [_mask(detector, sequence) for sequence, _ in found]
        for distance in (usual_join << k for k in range(DOUBLED + 1)):
            share = float(np.mean([is_whole(mask, box, distance) for mask, box in zip(masks, boxes[:, 1])]))
            if share > most:
                best, most = FirstLook(size, speed, stride, distance), share
            if share >= ALWAYS:
                return best
    return best


def _read(
    images: Callable[[], Iterator[tuple[float, np.ndarray]]], count: int, reduce_by: int
) -> list[list[np.ndarray]]:
    """Returns short sequences of grey images, spread over the first images of a recording, up to the first damaged
    image."""
    sequences: list[list[np.ndarray]] = []
    length = 2 * REACH + 1
    gap = length
    source = images()
    for k in itertools.count():
        try:
            _, image = next(source)
        except (StopIteration, DrakeTrackerError):  # an error is reported where the images are tracked
            break
        if k == 0:
            used = min(count, MOST_IMAGES, MOST_PIXELS // (image.shape[0] * image.shape[1]))
            gap = max(length, used // WINDOWS)
        if k >= used or len(sequences) > WINDOWS:
            break
        if k % gap == 0:
            sequences.append([])
        if len(sequences[-1]) < length:
            sequences[-1].append(reduced(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), reduce_by))
    if isinstance(source, Generator):
        source.close()
    return [each for each in sequences if len(each) == length]


def median_image(images: Sequence[np.ndarray]) -> np.ndarray:
    """Returns the median of uint8 images (h, w), rounded down; `np.median` takes 15 times as long.

    It sorts whole images by exchanges of neighbours, as many rounds as there are images.
    """
    order = list(images)
    for done in range(len(order)):
        for k in range(done % 2, len(order) - 1, 2):
            order[k], order[k + 1] = cv2.min(order[k], order[k + 1]), cv2.max(order[k], order[k + 1])
    low, high = order[(len(order) - 1) // 2], order[len(order) // 2]
    return low + (high - low) // 2


def _find_object(
    image: np.ndarray, background: np.ndarray, window: np.ndarray | None, area: float | None
) -> tuple[float, ...] | None:
    """Returns (left, top, width, height, u, v) of the silhouette nearest to an area [px], or of the largest.

    None without any silhouette or where all has changed.
    """
    statistics, centres = _find_silhouettes(image, background, window)
    if not len(statistics):
        return None
    areas = statistics[:, cv2.CC_STAT_AREA]
    best = int(areas.argmax() if area is None else np.abs(np.log(areas / area)).argmin())
    return (*statistics[best, :4].tolist(), *centres[best].tolist())


def _area_at(
    image: np.ndarray, background: np.ndarray, window: np.ndarray | None, pixel: tuple[float, float]
) -> float | None:
    """Returns the area [px] of the silhouette at a pixel (u, v), None without one within `JOIN_DISTANCE`."""
    statistics, _ = _find_silhouettes(image, background, window)
    if not len(statistics):
        return None
    low = statistics[:, :2]
    outside = np.maximum(np.maximum(low - pixel, pixel - (low + statistics[:, 2:4] - 1)), 0.0)
    distances = np.hypot(*outside.T)
    best = int(distances.argmin())
    return float(statistics[best, cv2.CC_STAT_AREA]) if distances[best] <= JOIN_DISTANCE else None


def _find_silhouettes(
    image: np.ndarray, background: np.ndarray, window: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the silhouettes as OpenCV's statistics (n, 5) and centres (n, 2); none where all has changed."""
    difference = cv2.absdiff(with_light_of(background, image), background)
    level = max(LEAST_CHANGE, CHANGE_NOISE * float(np.median(difference[::4, ::4])))
    mask = cv2.threshold(difference, level, 255, cv2.THRESH_BINARY)[1]
    if window is not None:
        mask = cv2.bitwise_and(mask, window)
    mask = cv2.morphologyEx(mask, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
    if cv2.countNonZero(mask) > LARGEST_SHARE * mask.size:
        return np.empty((0, 5), int), np.empty((0, 2))
    _, _, statistics, centres = cv2.connectedComponentsWithStats(mask)
    large = np.flatnonzero(statistics[1:, cv2.CC_STAT_AREA] >= LEAST_AREA) + 1
    return statistics[large], centres[large]


def _mask(detector: Any, sequence: list[np.ndarray]) -> np.ndarray:
    """Returns where something moves in the middle one of grey images."""
    first = REACH - int(detector.stamp_age_cycles)
    used = sequence[first : first + detector.buffer_length : detector.stride]
    smoothed = [detector.smooth(image) for image in used]
    mask: np.ndarray = detector.mask(*[with_light_of(smoothed[len(smoothed) // 2], image) for image in smoothed])
    return mask


def is_whole(mask: np.ndarray, box: np.ndarray, join_distance: int) -> bool:
    """Returns whether one moving region shows a whole object, its front and its rear edge.

    Args:
        mask: of moving pixels.
        box: of the object: left, top, width, height, u, v [px].
        join_distance: of the regions [px].
    """
    width, height, u, v = box[2:].tolist()
    near = [each for each in find_regions(mask, join_distance, 1) if each.distance(u, v) <= 0.5 * max(width, height)]
    if not near:
        return False
    whole = max(near, key=lambda each: each.pixel_count)
    share = whole.pixel_count / sum(each.pixel_count for each in near)
    return share >= ALONE and whole.width >= COVERED * width and whole.height >= COVERED * height
