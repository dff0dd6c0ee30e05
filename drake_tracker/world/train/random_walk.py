"""A random walk for the train: straights joined by rounded corners, which never crosses or touches itself."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.world.config import TRAIN_WIDTH

CLEARANCE = TRAIN_WIDTH + 0.010
"""Least distance of two passes of a walk [m]: the width of a train, and a margin."""
TURNS = (np.pi / 6, np.pi / 2)
"""Smallest and largest angle of a corner, to either side [rad]."""
_STEP, _SLACK = 0.01, 0.001
"""Distance of the points at which area and clearance are checked, and what the walk may do between them [m]."""
_NEIGHBOURS = 2.0 * CLEARANCE
"""Distance along the walk up to which two points belong to the same pass [m]."""
_ROUNDING = 1e-9
"""Length that counts as zero [m]."""
_STARTS, _LEGS, _TRIES = 40, 300, 10
"""Number of starts, of legs tried from each start, and of tries in one place before the walk goes back."""


@dataclass(frozen=True)
class _Pose:
    """A place (x, y) [m] and a heading [rad] in W."""

    x: float
    y: float
    heading: float


@dataclass(frozen=True)
class _Piece:
    """A straight or an arc: pose of its beginning, length [m] and curvature [1/m], positive to the left."""

    start: _Pose
    length: float
    curvature: float

    def points(self, s: np.ndarray) -> np.ndarray:
        """Returns the points (x, y) at the distances ``s`` from the beginning, shape (n, 2) [m]."""
        x, y, heading = self.start.x, self.start.y, self.start.heading
        if self.curvature == 0.0:
            return np.column_stack([x + s * np.cos(heading), y + s * np.sin(heading)])
        radius, turned = 1.0 / self.curvature, heading + self.curvature * s
        along, across = np.sin(turned) - np.sin(heading), np.cos(heading) - np.cos(turned)
        return np.column_stack([x + radius * along, y + radius * across])

    def end(self) -> _Pose:
        """Returns the pose of the end."""
        ((x, y),) = self.points(np.array([self.length]))
        return _Pose(float(x), float(y), self.start.heading + self.curvature * self.length)


def random_walk(
    rng: np.random.Generator,
    *,
    length: float,
    corner_radius: float,
    straight_range: Sequence[float],
    area: np.ndarray,
    samples: int,
) -> np.ndarray:
    """Returns a random walk, points equally spaced along it, shape (samples, 2) in W [m].

    It begins at a random place with a random heading. A straight and a corner follow each other in turn. The length of
    each straight is drawn from ``straight_range``, the angle of each corner from `TURNS`, to either side. The last
    piece is cut off where the walk is ``length`` long. The walk stays in the area, and two passes of it are at least
    `CLEARANCE` apart. A straight that would lead too far is shortened. Where there is no room for the shortest one, the
    walk tries another corner, or else goes back and tries another way.

    Args:
        rng: random numbers of this walk only.
        length: of the whole walk [m].
        corner_radius: radius of all corners [m].
        straight_range: shortest and longest straight between two corners [m].
        area: corners of a convex area in W, anticlockwise, shape (n, 2) [m].
        samples: number of points.

    Raises DrakeTrackerError when no such walk is found.
    """
    for _ in range(_STARTS):
        pieces = _walk(rng, length, corner_radius, straight_range, area)
        if pieces is not None:
            ends = np.cumsum([piece.length for piece in pieces])
            s = np.linspace(0.0, length, samples)
            number = np.minimum(np.searchsorted(ends, s), len(pieces) - 1)
            return np.concatenate(
                [piece.points(s[number == k] - (ends[k] - piece.length)) for k, piece in enumerate(pieces)]
            )
    raise DrakeTrackerError(
        f"track kind 'random_walk': no walk of {length:g} m was found that stays in the work volume and on the table, "
        f"{1e3 * CLEARANCE:.0f} mm from itself; lower track.length, track.corner_radius or track.straight_range"
    )


def _walk(
    rng: np.random.Generator, length: float, radius: float, straight_range: Sequence[float], area: np.ndarray
) -> list[_Piece] | None:
    """Returns the pieces of a walk from a random start, or None when the tries were used up."""
    x, y = rng.uniform(area.min(axis=0), area.max(axis=0))
    start = _Pose(float(x), float(y), float(rng.uniform(-np.pi, np.pi)))
    legs: list[list[_Piece]] = []
    points = [np.empty((0, 3))]  # and of each leg: x, y, distance from the beginning of the walk
    failures = 0
    for _ in range(_LEGS):
        travelled = sum(_length(leg) for leg in legs)
        leg = _draw_leg(rng, legs[-1][-1].end() if legs else start, bool(legs), radius, straight_range)
        shortest = _length(leg[:-1]) + straight_range[0]
        leg = _cut(leg, length - travelled)
        # Where the straight leads too far, it ends at a random place before.
        free = _free(_sampled(leg, travelled), np.concatenate(points), area) - travelled
        if shortest <= free < _length(leg):
            leg = _cut(leg, float(rng.uniform(shortest, free)))
        if _length(leg) <= free:
            legs.append(leg)
            points.append(_sampled(leg, travelled))
            if travelled + _length(leg) > length - _ROUNDING:
                return [piece for each in legs for piece in each]
            failures = 0
            continue
        failures += 1
        if failures == _TRIES:
            if not legs:
                return None
            del legs[-2:]
            del points[len(legs) + 1 :]
            failures = 0
    return None


def _length(leg: list[_Piece]) -> float:
    """Returns the length of a leg [m]."""
    return sum(piece.length for piece in leg)


def _draw_leg(
    rng: np.random.Generator, pose: _Pose, corner: bool, radius: float, straight_range: Sequence[float]
) -> list[_Piece]:
    """Returns a straight drawn at random, after a corner unless the walk begins with it."""
    leg = []
    if corner:
        side = 1.0 if rng.uniform() < 0.5 else -1.0
        leg.append(_Piece(pose, radius * float(rng.uniform(*TURNS)), side / radius))
        pose = leg[0].end()
    shortest, longest = straight_range
    return [*leg, _Piece(pose, float(rng.uniform(shortest, longest)), 0.0)]


def _cut(leg: list[_Piece], length: float) -> list[_Piece]:
    """Returns a leg, cut off where it is ``length`` long [m]."""
    kept = []
    for piece in leg:
        if length > _ROUNDING:
            kept.append(_Piece(piece.start, min(piece.length, length), piece.curvature))
            length -= piece.length
    return kept


def _sampled(leg: list[_Piece], travelled: float) -> np.ndarray:
    """Returns points of a leg (x, y, distance from the beginning of the walk), shape (n, 3) [m]."""
    rows = []
    for piece in leg:
        s = np.linspace(0.0, piece.length, max(int(np.ceil(piece.length / _STEP)), 1) + 1)
        rows.append(np.column_stack([piece.points(s), travelled + s]))
        travelled += piece.length
    return np.concatenate(rows)


def _free(points: np.ndarray, before: np.ndarray, area: np.ndarray) -> float:
    """Returns the distance [m] up to which points (x, y, distance) are in the area and clear of those before them."""
    edges = np.roll(area, -1, axis=0) - area
    sides = np.hypot(*edges.T)
    offsets = points[:, None, :2] - area
    bad = (edges[:, 0] * offsets[..., 1] - edges[:, 1] * offsets[..., 0] < _SLACK * sides).any(axis=1)
    both = np.concatenate([before, points])
    gaps = np.hypot(points[:, None, 0] - both[:, 0], points[:, None, 1] - both[:, 1])
    bad |= ((gaps < CLEARANCE + _SLACK) & (points[:, None, 2] - both[:, 2] > _NEIGHBOURS)).any(axis=1)
    if not bad.any():
        return float(points[-1, 2])
    return float(points[max(int(np.argmax(bad)) - 1, 0), 2])
