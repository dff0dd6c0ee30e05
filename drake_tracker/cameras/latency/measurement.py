"""Measures the latency of a camera from its images."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import ArrayLike

from drake_tracker.cameras.latency.code_reader import CodeReader
from drake_tracker.cameras.latency.light import block_brightness, switch_bounds
from drake_tracker.cameras.latency.screen_code import RANGE
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.footage.footage import Footage
from drake_tracker.footage.read_ahead import read_ahead

LEAST_IMAGES = 10
"""Least number of images with a readable code, and of switches of the light."""
SEARCH = (-0.2, 3.0)
"""Range of latencies that is searched for a switched light, if camera and light share a clock [s]."""
_WAITING = 200
"""Images that may wait for being read: a driver that waits would give them a late stamp."""
_STEP_TOLERANCE = 3
"""Difference from the median within which a step belongs to the refresh of the screen [ms]."""
_AGREED = 0.9
"""Share of the largest number of agreeing images above which a latency counts as possible."""
_TO_DEVIATION = 1.4826
"""Standard deviation of a normal distribution by its median absolute deviation."""
_MIDDLE = 0.95
"""Share of the images from which the range of instants at which they fall is found."""


@dataclass(frozen=True)
class Latency:
    """A measured latency.

    Attributes:
        seconds: from the light to the stamp [s].
        uncertainty: two standard deviations of the latency, plus half of what the bounds leave open because the images
            do not fall at all instants between them [s].
        spread: standard deviation of the latency of a single image, from the median absolute deviation [s].
        images: number of images used.
    """

    seconds: float
    uncertainty: float
    spread: float
    images: int


@dataclass(frozen=True)
class LatencyMeasurement:
    """The latency of one camera.

    Attributes:
        name: of the source.
        latency: what was measured.
        seen: number of images looked at.
        absolute: whether the stamps are times of this machine's clock. Otherwise they count from the first image, and
            the number is the offset between two clocks; only the difference to another camera's number is useful.
        refresh: time from one change of the screen to the next [s]; None for a light.
    """

    name: str
    latency: Latency
    seen: int
    absolute: bool
    refresh: float | None = None


Notice = Callable[[float, int], object]
"""Function that is called with the time of the newest image [s] and the number of useful images."""


def measure_by_code(
    footage: Footage, *, duration: float | None = None, patience: float = np.inf, notice: Notice = lambda *_: None
) -> LatencyMeasurement:
    """Measures the latency of a camera that sees the running code.

    An image whose newest field shows the time c was exposed after c, and before the next field changed. The latency of
    its stamp is therefore between stamp - c - refresh and stamp - c.

    Args:
        footage: of the camera.
        duration: time to measure, from the first readable code on [s]; None uses all images.
        patience: longest time to wait for the first readable code [s].
        notice: called for each image.

    Raises DrakeTrackerError when the code is readable in fewer than `LEAST_IMAGES` images.
    """
    reader = CodeReader()
    stamps: list[float] = []
    times: list[int] = []
    steps: list[int] = []
    seen = 0
    for stamp, grey in _grey_images(footage):
        seen += 1
        reading = reader.read(grey)
        if reading is not None:
            stamps.append(stamp)
            times.append(reading.time)
            steps += reading.steps
        notice(stamp, len(stamps))
        if (stamps and duration is not None and stamp >= stamps[0] + duration) or (not stamps and stamp > patience):
            break
    if len(stamps) < LEAST_IMAGES or not steps:
        raise DrakeTrackerError(
            f"{footage.name}: the running code was readable in {len(stamps)} of {seen} images, and at least "
            f"{LEAST_IMAGES} are needed; the whole code must be in view, sharp, and without reflections"
        )
    refresh = _typical(steps)
    ages = 1e3 * ((footage.epoch or 0.0) % (1e-3 * RANGE) + np.array(stamps)) - np.array(times)
    ages = 1e-3 * ((ages + RANGE / 2) % RANGE - RANGE / 2)
    latency = estimate_latency(ages - refresh, ages)
    return LatencyMeasurement(footage.name, latency, seen, is_absolute(footage), refresh)


def measure_by_light(
    footage: Footage,
    switches: Callable[[], Sequence[tuple[float, int]]],
    *,
    duration: float | None = None,
    notice: Notice = lambda *_: None,
) -> LatencyMeasurement:
    """Measures the latency of a camera that sees a light.

    Args:
        footage: of the camera.
        switches: returns (time [s since 1970], state 0 or 1) of each switch of the light, when all images are read.
        duration: time to measure [s]; None uses all images.
        notice: called for each image.

    Raises DrakeTrackerError when the light is not seen, or was switched fewer than `LEAST_IMAGES` times.
    """
    stamps: list[float] = []
    blocks: list[np.ndarray] = []
    for stamp, grey in _grey_images(footage):
        stamps.append(stamp)
        blocks.append(block_brightness(grey))
        notice(stamp, len(stamps))
        if duration is not None and stamp >= duration:
            break
    times, states = np.array(switches(), dtype=float).reshape(-1, 2).T
    if len(times) < LEAST_IMAGES or len(stamps) < LEAST_IMAGES:
        raise DrakeTrackerError(
            f"{footage.name}: the light was switched {len(times)} times in {len(stamps)} images; at least "
            f"{LEAST_IMAGES} of both are needed"
        )
    start = footage.epoch if is_absolute(footage) and footage.epoch is not None else times[0]
    captured = np.array(stamps)
    search = SEARCH if is_absolute(footage) else (captured[0] - np.ptp(times), captured[-1])
    try:
        lowest, highest = switch_bounds(captured, np.array(blocks), times - start, states, search)
    except DrakeTrackerError as error:
        raise DrakeTrackerError(f"{footage.name}: {error}") from None
    if len(lowest) < LEAST_IMAGES:
        raise DrakeTrackerError(
            f"{footage.name}: {len(lowest)} switches of the light were seen; at least {LEAST_IMAGES} are needed"
        )
    latency = estimate_latency(lowest, highest)
    return LatencyMeasurement(footage.name, latency, len(stamps), is_absolute(footage))


def is_absolute(footage: Footage) -> bool:
    """Returns whether the times of the images are known on this machine's clock."""
    return footage.epoch is not None and not footage.counted


def _grey_images(footage: Footage) -> Iterator[tuple[float, np.ndarray]]:
    """Yields (time [s], grey image), read in a thread so that no image of a live camera waits in its driver."""

    def grey() -> Iterator[tuple[float, np.ndarray]]:
        for stamp, image in footage.frames():
            yield stamp, cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)

    images = read_ahead(grey, _WAITING if footage.live else 2)
    try:
        yield from images
    finally:
        images.close()  # type: ignore[attr-defined]


def _typical(steps: Sequence[int]) -> float:
    """Returns the time from one change of the screen to the next [s]; the code is rounded to milliseconds."""
    near = np.array(steps)
    return 1e-3 * float(near[np.abs(near - np.median(near)) <= _STEP_TOLERANCE].mean())


def estimate_latency(lowest: ArrayLike, highest: ArrayLike) -> Latency:
    """Returns the `Latency` that lies within the bounds of most images.

    Each image says between which bounds the latency lies. The best latency is the middle of all that agree with nearly
    as many images as any does. Images at all instants of the screen's refresh narrow the range, and false readings do
    not move it.

    Args:
        lowest: lower bound of each image [s], shape (n,).
        highest: upper bound of each image [s], shape (n,).
    """
    low, high = np.asarray(lowest, dtype=float), np.asarray(highest, dtype=float)
    edges = np.sort(np.concatenate([low, high]))
    middles = 0.5 * (edges[:-1] + edges[1:])
    agreeing = np.searchsorted(np.sort(low), middles, "right") - np.searchsorted(np.sort(high), middles, "left")
    possible = np.flatnonzero(agreeing >= _AGREED * agreeing.max())
    first, last = edges[possible[0]], edges[possible[-1] + 1]
    centre = 0.5 * (first + last)
    off = 0.5 * (low + high) - centre
    spread = _TO_DEVIATION * float(np.median(np.abs(off - np.median(off))))
    agrees = (low <= centre) & (centre <= high)
    width, count = np.median(high - low), agrees.sum()
    covered = np.ptp(np.quantile(high[agrees], [0.5 - 0.5 * _MIDDLE, 0.5 + 0.5 * _MIDDLE])) / _MIDDLE
    uncertainty = 2.0 * off[agrees].std() / np.sqrt(count) + 0.5 * max(0.0, width - covered)
    return Latency(float(centre), float(uncertainty), spread, len(low))
