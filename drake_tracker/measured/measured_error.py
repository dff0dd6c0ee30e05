"""The error of the triangulated point as it was measured in the camera loop, to be added to a true pose.

Errors are those of the point relative to the centre of the object's body, along and across its heading (left positive)
and vertical [m]. They have four parts:

- *bias*, a function of the heading, of the curvature of the path (proportional to it) and of the speed;
- the *pattern* of the pixels, which repeats whenever the object passes the same place: smooth over one pixel's
  footprint, otherwise random;
- *jitter*, which does not repeat and is correlated from cycle to cycle, as the images of successive centroids overlap;
- *drop-outs*: runs of cycles without a point, and an object too slow to be seen.

Nothing here has a memory: every random number is a function of the seed and of a counter (the number of the cycle, or
of the pixel), so that the same run has the same errors and any copy of a Context continues identically.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from drake_tracker.core.frozen_state import FrozenState, read_only

STREAM, PATTERN_STREAM = 50, 51
"""Streams of random numbers: default_rng([seed, STREAM, block]), default_rng([seed, PATTERN_STREAM, column, row])."""
OBJECT_STREAM = 52
"""Stream of the seeds of further objects."""
AXES = ("along", "across", "vertical")
"""Directions of the errors, relative to the heading."""
SHARPEST = 12.0
"""Curvature of a path [1/m] beyond which the bias stays constant."""
LONGEST_GAP = 60
"""Largest length of a drop-out [cycles]."""
CRAWL = 0.02
"""Speed [m/s] below which the curvature of a path cannot be distinguished from a rotation of the body."""
SMALLEST_STD = 1e-5
"""Smallest standard deviation of a point [m], so that its covariance is regular."""
_BLOCK = 256
_TILE = 32
_ORIGIN = 2**20


@dataclass(frozen=True, eq=False)
class MeasuredError(FrozenState):
    """The error model at one or more speeds, interpolated between them and constant outside their range.

    Attributes:
        speeds: (s,) [m/s], increasing.
        bias: (s, 2, h, 3) at h headings in W, evenly spaced from 0: on a straight path [m], and the increment for each
            1/m of curvature to the left [m^2].
        pattern: (s, 3) standard deviation of the part that repeats at the same place [m].
        jitter: (s, 3, 2 q + 1) weights of a moving average of unit white noise [m].
        missing: (s, 2) fraction of the cycles without a point, and mean length of such a gap [cycles].
        pixel: footprint of a pixel at the object [m].
        seen_from: speed [m/s] below which nothing is seen.
    """

    speeds: np.ndarray
    bias: np.ndarray
    pattern: np.ndarray
    jitter: np.ndarray
    missing: np.ndarray
    pixel: float
    seen_from: float

    def at(
        self, seed: int, cycle: int, xy: Sequence[float], yaw: float, speed: float, yaw_rate: float
    ) -> np.ndarray | None:
        """Returns the error (3,) [m] along W's axes of the point seen in a cycle, or None in a drop-out.

        Args:
            seed: of all random numbers, 0 or more.
            cycle: number of the cycle, 0 or more.
            xy: true position (x, y) in W [m].
            yaw: heading in W [rad].
            speed: [m/s].
            yaw_rate: [rad/s].
        """
        if speed < self.seen_from or self.drops(seed, cycle, speed):
            return None
        along, across, vertical = self.mean(yaw, speed, yaw_rate) + self.noise(seed, cycle, xy, speed)
        cos, sin = math.cos(yaw), math.sin(yaw)
        return np.array([cos * along - sin * across, sin * along + cos * across, vertical])

    def mean(self, yaw: float, speed: float, yaw_rate: float) -> np.ndarray:
        """Returns the bias (3,) [m] along, across, vertical."""
        first, second, weight = heading_bin(yaw, self.bias.shape[2])
        here = (1.0 - weight) * self.bias[:, :, first] + weight * self.bias[:, :, second]
        straight, bent = self._between(here, speed)
        return straight + curvature(speed, yaw_rate) * bent

    def noise(self, seed: int, cycle: int, xy: Sequence[float], speed: float) -> np.ndarray:
        """Returns the sum of pattern and jitter (3,) [m] along, across, vertical."""
        reach = self.jitter.shape[2] // 2
        white = _rows(seed, cycle - reach, cycle + reach)[:, :3]
        jitter = (self._between(self.jitter, speed) * white.T).sum(axis=1)
        return jitter + self._between(self.pattern, speed) * pattern_at(seed, xy, self.pixel)

    def covariance(self, heading: float, speed: float) -> np.ndarray:
        """Returns the covariance of pattern and jitter along W's axes, shape (3, 3) [m^2].

        Args:
            heading: direction of travel in W [rad].
            speed: [m/s].
        """
        variances = self._between(self.pattern, speed) ** 2 + (self._between(self.jitter, speed) ** 2).sum(axis=1)
        cos, sin = math.cos(heading), math.sin(heading)
        R = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
        return R @ np.diag(np.maximum(variances, SMALLEST_STD**2)) @ R.T

    def drops(self, seed: int, cycle: int, speed: float) -> bool:
        """Returns whether a cycle belongs to a drop-out."""
        if not self.missing[:, 0].any():
            return False
        share, length = self._between(self.missing, speed)
        if share <= 0.0:
            return False
        # A gap begins with a small probability in every cycle, and its length is geometric.
        begin = -math.log1p(-min(share, 0.999)) / length
        draws = _rows(seed, cycle - LONGEST_GAP + 1, cycle)[::-1, 3:]
        begins = draws[:, 0] < begin
        lasts = draws[:, 1] < (1.0 - 1.0 / max(length, 1.0)) ** np.arange(LONGEST_GAP)
        return bool(np.any(begins & lasts))

    def _between(self, table: np.ndarray, speed: float) -> np.ndarray:
        """Returns a table (s, ...) interpolated at a speed [m/s]."""
        if len(self.speeds) == 1:
            return table[0]
        k = min(max(int(self.speeds.searchsorted(speed)) - 1, 0), len(self.speeds) - 2)
        weight = (speed - self.speeds[k]) / (self.speeds[k + 1] - self.speeds[k])
        weight = min(max(weight, 0.0), 1.0)
        return (1.0 - weight) * table[k] + weight * table[k + 1]


def object_seed(seed: int, number: int) -> int:
    """Returns the seed of the errors of an object: that of the run for the first train, number 0.

    Args:
        seed: of the run.
        number: of the object.
    """
    if number == 0:
        return seed
    return int(np.random.SeedSequence([seed, OBJECT_STREAM, number]).generate_state(1, np.uint64)[0])


def curvature(speed: Any, yaw_rate: Any) -> Any:
    """Returns the curvature [1/m] of the path of an object, positive to the left.

    Args:
        speed: number or array [m/s].
        yaw_rate: the same [rad/s].
    """
    return np.clip(yaw_rate / np.maximum(speed, CRAWL), -SHARPEST, SHARPEST)


def heading_bin(yaw: Any, count: int) -> tuple[Any, Any, Any]:
    """Returns (first, second, weight of the second) of the ``count`` table headings on both sides of ``yaw`` [rad]."""
    position = np.mod(yaw, 2.0 * np.pi) / (2.0 * np.pi) * count
    first = np.floor(position)
    weight = position - first
    first = np.asarray(first, dtype=int) % count
    return first, (first + 1) % count, weight


def pattern_at(seed: int, xy: Sequence[float] | np.ndarray, pixel: float) -> np.ndarray:
    """Returns the pattern (3,) of unit variance at a place: random numbers on a grid, smooth in between.

    Args:
        seed: of the random numbers.
        xy: the place in W, shape (2,) [m].
        pixel: side of the grid [m].
    """
    column, row = xy[0] / pixel, xy[1] / pixel
    i, j = math.floor(column), math.floor(row)
    a, b = column - i, row - j
    weights = np.array([(1.0 - a) * (1.0 - b), (1.0 - a) * b, a * (1.0 - b), a * b])
    places = [(x, y) for x in (i, i + 1) for y in (j, j + 1)]
    corners = [_tile(seed, x // _TILE, y // _TILE)[x % _TILE, y % _TILE] for x, y in places]
    return weights @ np.array(corners) / math.sqrt(weights @ weights)


@lru_cache(maxsize=256)
def _tile(seed: int, i: int, j: int) -> np.ndarray:
    tile = np.random.default_rng([seed, PATTERN_STREAM, i + _ORIGIN, j + _ORIGIN]).standard_normal((_TILE, _TILE, 3))
    return read_only(tile)


def _rows(seed: int, first: int, last: int) -> np.ndarray:
    """Returns a row of five random numbers, three normal and two uniform, per cycle from ``first`` to ``last``."""
    first, last = first + _BLOCK, last + _BLOCK  # cycles before the first one have numbers too
    blocks = range(first // _BLOCK, last // _BLOCK + 1)
    rows = np.concatenate([_block(seed, number) for number in blocks]) if len(blocks) > 1 else _block(seed, blocks[0])
    start = first - blocks[0] * _BLOCK
    return rows[start : start + last - first + 1]


@lru_cache(maxsize=64)
def _block(seed: int, number: int) -> np.ndarray:
    rng = np.random.default_rng([seed, STREAM, number])
    block = np.column_stack([rng.standard_normal((_BLOCK, 3)), rng.random((_BLOCK, 2))])
    return read_only(block)
