"""Motions of objects in the benchmarks of others, implemented from their descriptions.

Each motion is a function of random numbers that returns points (x, y) in W of an open path, about every 2 mm,
shape (n, 2) [m]. The arm stands at the origin; the table covers x from 0.21 to 0.91 m and y from -0.50 to 0.50 m. What
a description leaves open is marked "chosen".
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from crossing_tracks import CENTRE, walk

STEP = 0.002
"""Distance of the points of a path [m]."""
TABLE = ((0.24, -0.47), (0.88, 0.47))
"""Lower and upper corner of the rectangle in which a path stays: the table, less 30 mm at each edge [m]."""
SHORTEST = 0.35
"""Length of the shortest path; a shorter one is drawn again [m]; chosen."""
WIDE, WIDE_TURNS = (0.28, 0.28), (45.0, 180.0)
"""Extent [m] and turns [deg] of the walks that the generator of DGBench makes."""
AREA = (0.40, 0.70)
"""Extent of DOMINO's table along x and y [m]. Their tasks use 0.40 to 0.50 m by 0.70 m."""
MEETING = (0.20, 0.44)
"""Extent of the part of it through which an object passes, where theirs are placed [m]."""
BEND, BEND_LENGTH = 0.10, 0.35
"""Largest coefficient of second and of third order of DOMINO's polynomial, and the length to which it refers [m];
chosen."""
CHAOS_STRAIGHTS = (0.05, 0.15)
"""Shortest and longest straight of DOMINO's chaotic motion [m]; chosen."""
AIM = 0.14
"""Largest distance from the table's centre, towards or away from the arm, of the place at which an object of DOM is
aimed [m]. Theirs is half of the distance of the arm from the centre, here 0.28 m, where the arm does not reach."""
RADII = (0.45, 0.65)
"""Smallest and largest distance of a conveyor of Columbia from the base of the arm [m]. Theirs is 0.15 to 0.4 m with a
Mico and 0.3 to 0.7 m with a UR5; chosen so that this arm reaches it."""
AZIMUTH = 15.0
"""Largest azimuth of the middle of such a conveyor [deg]. Theirs is 90; chosen, the table is in front of the arm."""
CONVEYOR = 1.0
"""Length of such a conveyor, of which the table carries a part [m]."""


@dataclass(frozen=True)
class Motion:
    """A motion of a rival.

    Attributes:
        points: function of random numbers that returns the points of a path [m].
        speeds: text of a speed or of a range from which it is drawn for each path, of each cell [m/s].
        work_volume: where vision looks, lower and upper corner in W [m]; None: that of the scenario. The default is
            the table, so that only the arm limits where it grasps.
    """

    points: Callable[[np.random.Generator], np.ndarray]
    speeds: tuple[str, ...]
    work_volume: tuple[tuple[float, ...], tuple[float, ...]] | None = ((0.22, -0.50, 0.45), (0.90, 0.50, 0.51))

    def draw(self, seed, speeds):
        """Returns the points of the path of a seed [m] and its speed [m/s]. The path does not depend on the speed."""
        low, _, high = speeds.partition(" to ")
        share = np.random.default_rng([seed, 1]).uniform()
        return self.points(np.random.default_rng(seed)), float(low) + share * (float(high or low) - float(low))


def narrow_walk(rng):
    """DGBench's walk in a square of 140 mm, as in `hard_paths.py`, with corners of 30 to 150 degrees."""
    return walk(rng)[0] + CENTRE


def wide_walk(rng):
    """DGBench's walk as its generator makes it: within 140 mm of the middle, with corners of 45 to 180 degrees."""
    return walk(rng, WIDE, WIDE_TURNS)[0] + CENTRE


def constant_velocity(rng):
    """DOMINO, level 1: a straight line across the table, through a place where objects are placed."""
    return _drawn(lambda: _chord(_meeting(rng), rng.uniform(-math.pi, math.pi), *_domino_area()))


def polynomial(rng):
    """DOMINO, level 2: a cubic across the table, through a place where objects are placed."""

    def draw():
        place, heading, (square, cube) = _meeting(rng), rng.uniform(-math.pi, math.pi), rng.uniform(-BEND, BEND, 2)
        u = np.linspace(-1.0, 1.0, 2001)
        along, aside = _direction(heading), _direction(heading + 0.5 * math.pi)
        curve = place + BEND_LENGTH * u[:, None] * along + (square * u**2 + cube * u**3)[:, None] * aside
        return _part_within(curve, *_domino_area())

    return _drawn(draw)


def chaotic(rng):
    """DOMINO, level 3: a walk on the table whose direction changes abruptly, at places that nobody can know."""
    return walk(rng, AREA, WIDE_TURNS, CHAOS_STRAIGHTS)[0] + CENTRE


def straight_pass(rng):
    """DOM: a straight line from a place on the table towards its middle, and on to its edge."""

    def draw():
        start = rng.uniform(*TABLE)
        aim = np.array(CENTRE) + [rng.uniform(-AIM, AIM), 0.0]
        line = _chord(start, math.atan2(*(aim - start)[::-1]), *TABLE)
        return line[np.hypot(*(line - start).T).argmin() :]

    return _drawn(draw)


def conveyor_line(rng):
    """Columbia, linear: a straight line at right angles to the direction of its middle from the arm."""

    def draw():
        distance, azimuth = rng.uniform(*RADII), math.radians(rng.uniform(-AZIMUTH, AZIMUTH))
        along = _direction(azimuth + 0.5 * math.pi)
        u = np.linspace(-0.5, 0.5, 2001)[:, None]
        return _part_within(distance * _direction(azimuth) + CONVEYOR * u * along, *TABLE)[:: rng.choice((-1, 1))]

    return _drawn(draw)


def conveyor_arc(rng):
    """Columbia, circular: an arc around the base of the arm."""

    def draw():
        radius, azimuth = rng.uniform(*RADII), math.radians(rng.uniform(-AZIMUTH, AZIMUTH))
        angles = azimuth + CONVEYOR / radius * np.linspace(-0.5, 0.5, 2001)
        arc = radius * np.column_stack([np.cos(angles), np.sin(angles)])
        return _part_within(arc, *TABLE)[:: rng.choice((-1, 1))]

    return _drawn(draw)


_WALKED = ("0.1", "0.125", "0.15", "0.175", "0.2")
_DRAWN = ("0.1 to 0.5",)
FAMILIES = {
    "dgbench": {"walk, 280 mm": Motion(wide_walk, _WALKED, None)},
    "dgbench_140": {"walk, 140 mm": Motion(narrow_walk, _WALKED, None)},
    "domino": {
        "1, constant velocity": Motion(constant_velocity, _DRAWN),
        "2, polynomial": Motion(polynomial, _DRAWN),
        "3, chaotic": Motion(chaotic, _DRAWN),
    },
    "dom": {"straight pass": Motion(straight_pass, ("0.15", "0.3", "0.45", "0.6", "0.75"))},
    "columbia": {
        "linear": Motion(conveyor_line, ("0.03", "0.05")),
        "circular": Motion(conveyor_arc, ("0.03", "0.05")),
    },
}
"""{family: {name of a motion: the motion}}."""


def length_of(points):
    """Returns the length of a path [m]."""
    return float(np.hypot(*np.diff(points, axis=0).T).sum())


def _meeting(rng):
    return np.array(CENTRE) + 0.5 * rng.uniform(-1.0, 1.0, 2) * MEETING


def _domino_area():
    return np.array(CENTRE) - 0.5 * np.array(AREA), np.array(CENTRE) + 0.5 * np.array(AREA)


def _direction(angle):
    return np.array([math.cos(angle), math.sin(angle)])


def _chord(place, heading, low, high):
    """Returns points of the straight line through a place, from edge to edge of a rectangle [m]."""
    reach = np.hypot(*np.subtract(high, low))
    return _part_within(place + np.linspace(-reach, reach, 4001)[:, None] * _direction(heading), low, high)


def _part_within(curve, low, high):
    """Returns the longest part of a curve in a rectangle that does not leave it, by points every `STEP` [m]."""
    good = np.concatenate([[False], ((curve >= low) & (curve <= high)).all(axis=1), [False]])
    (starts,), (ends,) = np.nonzero(good[1:] & ~good[:-1]), np.nonzero(good[:-1] & ~good[1:])
    longest = np.argmax(ends - starts)
    part = curve[starts[longest] : ends[longest]]
    s = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(part, axis=0).T))])
    places = np.linspace(0.0, s[-1], int(s[-1] / STEP) + 1)
    return np.column_stack([np.interp(places, s, column) for column in part.T])


def _drawn(draw):
    """Returns the first path that is not too short."""
    while length_of(points := draw()) < SHORTEST:
        pass
    return points
