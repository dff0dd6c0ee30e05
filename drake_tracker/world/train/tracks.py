"""Tracks for the train: smooth curves, level or with a profile of heights, stored as dense polylines by arc length."""

import math
from collections.abc import Iterable, Sequence
from typing import Self

import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.world.config import CLOSED_KINDS, TRACK_KINDS
from drake_tracker.world.train.random_walk import random_walk
from drake_tracker.world.train.track_file import read_track_file

NODE_SPACING = 2e-3  # [m] a chord this long leaves a bend of 0.1 m radius by 5 um
MAX_NODES = 1000  # bounds the cost of `Track.locate`, which visits every node
SAMPLES = 20001  # of the exact curve, from which the nodes are taken
WINDOW = 0.02  # [m] to either side of a known place: no other branch is as near along the track
LOST = 0.03  # [m] beside the track: a place is no longer known
HEADING_WEIGHT = 0.05  # [m] a piece of track at right angles counts as this much farther away
MIN_RADIUS = 0.01  # [m] at 0.2 m/s the train follows such a corner within 0.4 mm and 6 deg, at 0.8 m/s within 6 mm
NODES_PER_RADIUS = 3  # a bend of fewer nodes per radius is not resolved: 30 mm on a track of 10 m
CHORD_ERROR = 0.01  # share of the radius by which nodes this far apart show a bend too tight
FILE_ERROR = 0.09  # the same for points of a file: every 5 mm, or rounded to 10 um, they show a 10 mm corner as 9.13 mm
STEEPEST_DEG = 15.0  # [deg] the friction of the wheels (`hill.FRICTION`) holds a train up to 19 deg
LARGEST_LEAN_DEG = 20.0  # [deg] a train that leans more tips over; the limit of `TrackConfig.bank_deg`
CLEARANCE = 0.01  # [m] below this height above the table a train that leans or pitches touches the table
MIN_LENGTH, MAX_LENGTH = 0.3, 10.0  # [m] outside this range the unit of the file is not the metre


class Track:
    """A curve in W, parametrised by arc length s [m] and travelled in the direction of growing s.

    Headings are angles of the tangent about W's z axis [rad], continuous along the track (they are not wrapped). On a
    track with heights s is the arc length of its plan, that is of the curve seen from above.

    Args:
        points: nodes (x, y), shape (n, 2) [m], equally spaced along the curve. A closed track does not repeat its first
            point.
        closed: whether the last point is joined to the first.
        heights: of the nodes above the table, shape (n,) [m]; None: the track lies on the table.
        leans: angles by which the track leans to the left at the nodes, shape (n,) [rad]; None: nowhere.

    Attributes:
        points: as given.
        closed: as given.
        length: length of the track, seen from above [m].
        heights: as given.
    """

    def __init__(
        self, points: np.ndarray, closed: bool, heights: np.ndarray | None = None, leans: np.ndarray | None = None
    ) -> None:
        points = np.array(points, dtype=float)
        self.closed = bool(closed)
        self.points = points
        chords = np.diff(points, axis=0, append=points[:1])
        steps = np.hypot(*chords.T)
        if not self.closed:
            steps = steps[:-1]
        self.length = float(steps.sum())
        self._spacing = self.length / len(steps)
        self._reach = max(round(WINDOW / self._spacing), 2)
        self._window = np.arange(-self._reach, self._reach + 1)

        # The chord over two neighbours is parallel to the tangent between them to second order.
        if self.closed:
            spans = np.roll(points, -1, axis=0) - np.roll(points, 1, axis=0)
        else:
            spans = np.gradient(points, axis=0, edge_order=2)
        heading = np.unwrap(np.arctan2(spans[:, 1], spans[:, 0]))
        if self.closed:
            last_turn = math.remainder(heading[0] - heading[-1], 2 * math.pi)
            self._turn = float(heading[-1] + last_turn - heading[0])
            padded = np.concatenate([[heading[-1] - self._turn], heading, [heading[0] + self._turn]])
            curvature = (padded[2:] - padded[:-2]) / (2 * self._spacing)
        else:
            self._turn = 0.0
            curvature = np.gradient(heading, self._spacing)

        tangent = np.column_stack([np.cos(heading), np.sin(heading)])
        # |p - node|^2 + 2 w^2 (1 - h.t), up to a constant, is one matrix product for all nodes.
        self._cost_rows = np.ascontiguousarray(np.hstack([-2 * points, -2 * HEADING_WEIGHT**2 * tangent]))
        self._cost_constant = np.sum(points**2, axis=1)
        # Plain floats: scalar arithmetic on them is several times faster than on array elements.
        self._nodes = list(zip(*points.T.tolist(), *tangent.T.tolist(), curvature.tolist()))

        rows = np.column_stack([points, heading, curvature])
        if self.closed:
            rows = np.vstack([rows, rows[0] + [0.0, 0.0, self._turn, 0.0]])
        self._s_grid = self._spacing * np.arange(len(rows))
        self._x_grid, self._y_grid, self._heading_grid, self._curvature_grid = np.ascontiguousarray(rows.T)
        self.heights, self._leans = heights, leans
        if heights is not None:
            around = np.arange(-1, len(heights) + 1)
            padded = np.take(heights, around, mode="wrap" if self.closed else "clip")
            slopes = (padded[2:] - padded[:-2]) / (2 * self._spacing)
            if not self.closed:
                slopes = np.gradient(heights, self._spacing)
            profile = np.column_stack([heights, slopes, np.zeros(len(heights)) if leans is None else leans])
            self._profile = np.vstack([profile, profile[:1]]).T if self.closed else profile.T

    def pose(self, s: float | np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Returns (x, y, heading) [m, m, rad] at an arc length.

        Args:
            s: arc length [m], a number or an array. On a closed track s may cover any number of laps, and the heading
                keeps growing with it. On an open track s is clipped to the track.
        """
        s, laps = self._within(s)
        x, y, heading = (np.interp(s, self._s_grid, row) for row in (self._x_grid, self._y_grid, self._heading_grid))
        return x, y, heading + laps * self._turn

    def curvature(self, s: float | np.ndarray) -> np.ndarray:
        """Returns the curvature [1/m] at arc length ``s`` [m], positive where the track bends to the left."""
        return np.interp(self._within(s)[0], self._s_grid, self._curvature_grid)

    def profile(self, s: float | np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Returns (height, slope, lean) at arc length ``s`` [m], each a number or an array like ``s``.

        ``height`` is above the table [m], ``slope`` the height gained per metre of the plan, ``lean`` the angle by
        which the track leans to the left [rad].
        """
        s = self._within(s)[0]
        if self.heights is None:
            level = np.zeros_like(s)
            return level, level, level
        height, slope, lean = (np.interp(s, self._s_grid, row) for row in self._profile)
        return height, slope, lean

    def nearest(self, x: float, y: float, heading: float) -> tuple[float, float]:
        """Returns (s, lateral) [m] of the place on the track nearest to a point.

        ``lateral`` is the distance of the point to the left of the track.

        Args:
            x: of the point [m].
            y: of the point [m].
            heading: direction of travel [rad]. It distinguishes the two branches of a crossing, and neighbouring
                straights.
        """
        return self.locate(x, y, math.cos(heading), math.sin(heading))[:2]

    def locate(
        self, x: float, y: float, heading_x: float, heading_y: float, near: float = math.nan
    ) -> tuple[float, float, float, float, float]:
        """As `nearest`, with everything that a rail needs. Returns (s, lateral, tangent_x, tangent_y, curvature).

        Args:
            x: of the point [m].
            y: of the point [m].
            heading_x: unit vector of the heading; zero if it does not tell branches apart.
            heading_y: the same.
            near: arc length of a place that the point passed shortly before [m]. Only the track within `WINDOW` of it
                is searched, so that other branches do not count. The whole track is searched when it is NaN, when the
                point is beyond the window, or when it is more than `LOST` beside the track.
        """
        cost = self._cost_rows.dot((x, y, heading_x, heading_y))
        cost += self._cost_constant
        if not math.isnan(near):
            middle = round(near / self._spacing)
            nearby = cost.take(middle + self._window, mode="wrap" if self.closed else "clip")
            best = middle - self._reach + int(nearby.argmin())
            best = best if self.closed else min(max(best, 0), len(cost) - 1)
            if abs(best - middle) < self._reach:
                found = self._foot(x, y, best % len(cost))
                if abs(found[1]) <= LOST:
                    return found
        return self._foot(x, y, int(cost.argmin()))

    def _foot(self, x: float, y: float, index: int) -> tuple[float, float, float, float, float]:
        """Returns what `locate` returns, from the node nearest to the point."""
        node_x, node_y, tangent_x, tangent_y, curvature = self._nodes[index]
        dx, dy = x - node_x, y - node_y
        along = dx * tangent_x + dy * tangent_y
        aside = dy * tangent_x - dx * tangent_y
        # From the node to the foot of the perpendicular, along the circle of curvature.
        arc = along / max(1.0 - curvature * aside, 0.5)
        turn = curvature * arc
        cos_turn, sin_turn = math.cos(turn), math.sin(turn)
        s = index * self._spacing + arc
        s = s % self.length if self.closed else min(max(s, 0.0), self.length)
        return (
            s,
            aside - 0.5 * curvature * along * along,
            tangent_x * cos_turn - tangent_y * sin_turn,
            tangent_x * sin_turn + tangent_y * cos_turn,
            curvature,
        )

    def reversed(self) -> Self:
        """Returns the same curve travelled in the other direction; a closed one keeps its starting point."""

        def backwards(values: np.ndarray) -> np.ndarray:
            return np.roll(values[::-1], 1, axis=0) if self.closed else values[::-1]

        heights = None if self.heights is None else backwards(self.heights)
        leans = None if self._leans is None else -backwards(self._leans)
        return type(self)(backwards(self.points), self.closed, heights, leans)

    def translated(self, offset: Sequence[float] | np.ndarray) -> Self:
        """Returns the track moved by ``offset`` (x, y) [m]."""
        return type(self)(self.points + np.asarray(offset), self.closed, self.heights, self._leans)

    def rotated(self, angle: float, about: Sequence[float] = (0.0, 0.0)) -> Self:
        """Returns the track turned by ``angle`` [rad] about the point ``about`` (x, y) [m]."""
        cos, sin = math.cos(angle), math.sin(angle)
        points = (self.points - about) @ np.array([[cos, sin], [-sin, cos]]) + about
        return type(self)(points, self.closed, self.heights, self._leans)

    def raised(self, heights: Sequence[float], bank: float) -> Self:
        """Returns the track with a profile of heights.

        Args:
            heights: above the table at places equally spaced along the track, joined by a smooth curve [m]: the first
                at its beginning, and on an open track the last at its end.
            bank: angle by which the tightest bend leans inwards [rad]; other bends lean in proportion to their
                curvature.

        Raises DrakeTrackerError when the track is too steep or too near to the table, or has heights already.
        """
        if self.heights is not None:
            raise DrakeTrackerError("the file of the track has heights already")
        from scipy.interpolate import CubicSpline  # slow to load, and only for tracks with heights

        ends = [*heights, heights[0]] if self.closed else list(heights)
        ends = ends * 2 if len(ends) == 1 else ends
        at = np.linspace(0.0, self.length, len(ends))
        kind = "periodic" if self.closed else ("clamped" if len(ends) > 2 else "natural")
        nodes = self._s_grid[: len(self.points)]
        curvature = self._curvature_grid[: len(self.points)]
        tightest = float(np.abs(curvature).max())
        leans = bank * curvature / tightest if tightest > 1e-9 else 0.0 * curvature
        raised = type(self)(self.points, self.closed, CubicSpline(at, ends, bc_type=kind)(nodes), leans)
        _check_profile(raised)
        return raised

    def min_radius(self) -> float:
        """Returns the radius of the tightest bend [m], infinite for a straight line."""
        tightest = np.abs(self._curvature_grid).max()
        return 1.0 / tightest if tightest > 1e-9 else math.inf

    def _within(self, s: float | np.ndarray) -> tuple[np.ndarray, float | np.ndarray]:
        """Returns the arc length within the track, and the number of whole laps before it."""
        if not self.closed:
            return np.clip(s, 0.0, self.length), 0.0
        laps = np.floor_divide(s, self.length)
        return s - laps * self.length, laps


def make_track(
    kind: str,
    *,
    semi_axes: Sequence[float] = (0.16, 0.22),
    radius: float = 0.12,
    straight: float = 0.20,
    length: float = 0.9,
    amplitude: float = 0.05,
    wavelength: float = 0.45,
    coefficients: Sequence[float] = (0.0, 0.15, 0.0, -0.15),
    corner_radius: float = 0.03,
    straight_range: Sequence[float] = (0.06, 0.25),
    area: Sequence[Sequence[float]] | np.ndarray = ((0.36, -0.40), (0.76, -0.40), (0.76, 0.40), (0.36, 0.40)),
    walk_seed: Sequence[int] = (0,),
    csv: str = "",
    closed: bool = True,
    centre: Sequence[float] | np.ndarray = (0.56, 0.0),
    rotation: float = 0.0,
) -> Track:
    """Returns the `Track` of one of `TRACK_KINDS`.

    Args:
        kind: one of `TRACK_KINDS`.
        semi_axes: (x, y) [m] of the ellipse ``oval``, and half the extent of ``figure_eight``.
        radius: of ``circle`` and of the ends of ``stadium`` [m].
        straight: length of the two straights of ``stadium``, which run along y [m].
        length: of ``line``, which is open and runs along +y; extent along y of ``sinusoid`` and ``polynomial``,
            which are open and run along +y too; length of ``random_walk`` [m].
        amplitude: of ``sinusoid`` along x [m].
        wavelength: of ``sinusoid`` along y [m].
        coefficients: c0, c1, c2 ... of ``polynomial``, x = c0 + c1 u + c2 u^2 + ... with u = y / (length / 2) [m].
        corner_radius: of ``random_walk`` [m].
        straight_range: shortest and longest straight of ``random_walk`` [m].
        area: corners of the convex area in W in which ``random_walk`` stays, anticlockwise, shape (n, 2) [m].
        walk_seed: seed of the random numbers of ``random_walk``.
        csv: file with the points of a track in W.
        closed: whether the track of a file is closed (see `read_track_file`).
        centre: (x, y) in W to which the centre of a track is moved [m]; not of ``csv`` and ``random_walk``.
        rotation: angle by which a track is first turned about its centre [rad]; not ``csv`` and ``random_walk``.

    Raises DrakeTrackerError when the kind is unknown, a size is not a positive number, the track bends more tightly
    than a train can follow, there is no such random walk, or the file cannot be used.
    """
    if kind not in TRACK_KINDS:
        raise DrakeTrackerError(f"track kind '{kind}' is unknown; choose one of {', '.join(TRACK_KINDS)}")
    if kind == "csv":
        curve, closed = read_track_file(csv, SAMPLES, closed)
        return _resample(curve, closed=closed, name=f"track file {csv}", error=FILE_ERROR)
    name = f"track kind '{kind}'"
    if kind == "random_walk":
        curve = random_walk(
            np.random.default_rng(list(walk_seed)),
            length=_sizes("length", [length], 1)[0],
            corner_radius=_sizes("corner_radius", [corner_radius], 1)[0],
            straight_range=_sizes("straight_range", straight_range, 2),
            area=np.asarray(area),
            samples=SAMPLES,
        )
        return _resample(curve, closed=False, name=name)

    u = np.linspace(0.0, 2 * math.pi, SAMPLES)
    if kind == "oval":
        a, b = _sizes("semi_axes", semi_axes, 2)
        curve = np.column_stack([a * np.cos(u), b * np.sin(u)])
    elif kind == "circle":
        (r,) = _sizes("radius", [radius], 1)
        curve = r * np.column_stack([np.cos(u), np.sin(u)])
    elif kind == "stadium":
        r, h = *_sizes("radius", [radius], 1), 0.5 * _sizes("straight", [straight], 1)[0]
        curve = r * np.column_stack([np.cos(u), np.sin(u)])
        curve[:, 1] += np.where(u < math.pi, h, -h)
        curve = np.vstack([curve, curve[:1]])
    elif kind == "figure_eight":
        # Bernoulli's lemniscate, whose larger extent is 2 sqrt(2) times the smaller, stretched to the two given.
        a, b = _sizes("semi_axes", semi_axes, 2)
        scale = 1.0 / (1.0 + np.cos(u) ** 2)
        curve = np.column_stack([a * math.sqrt(8) * np.sin(u) * np.cos(u) * scale, b * np.sin(u) * scale])
    else:
        (full,) = _sizes("length", [length], 1)
        y = np.linspace(-0.5 * full, 0.5 * full, SAMPLES)
        if kind == "sinusoid":
            height, wave = *_sizes("amplitude", [amplitude], 1), *_sizes("wavelength", [wavelength], 1)
            x = height * np.sin(2 * math.pi * y / wave)
        elif kind == "polynomial":
            x = np.polynomial.Polynomial(_finite("coefficients", coefficients))(2.0 * y / full)
        else:
            x = np.zeros_like(y)
        curve = np.column_stack([x, y])
    return _resample(curve, closed=kind in CLOSED_KINDS, name=name).rotated(rotation).translated(centre)


def _check_profile(track: Track, name: str = "the track") -> None:
    """Raises DrakeTrackerError, naming the place, when a track is too steep, leans too far or is too low."""
    s = np.arange(len(track.points)) * (track.length / (len(track.points) - (not track.closed)))
    height, slope, lean = track.profile(s)
    far = int(np.abs(lean).argmax())
    if abs(lean[far]) > math.radians(LARGEST_LEAN_DEG):
        x, y = track.points[far]
        raise DrakeTrackerError(
            f"{name} leans by {math.degrees(abs(lean[far])):.1f} deg at ({x:.3f}, {y:.3f}) m; "
            f"{LARGEST_LEAN_DEG:g} deg at most are allowed"
        )
    low, steep = int(height.argmin()), int(np.abs(slope).argmax())
    x, y = track.points[low]
    if height[low] < CLEARANCE - 1e-6:
        raise DrakeTrackerError(
            f"{name} comes down to {1e3 * height[low]:.1f} mm above the table at ({x:.3f}, {y:.3f}) m; a track with "
            f"heights needs {1e3 * CLEARANCE:.0f} mm, or the train touches the table"
        )
    x, y = track.points[steep]
    angle = math.degrees(math.atan(abs(slope[steep])))
    if angle > STEEPEST_DEG:
        raise DrakeTrackerError(
            f"{name} is {angle:.1f} deg steep at ({x:.3f}, {y:.3f}) m; a train climbs {STEEPEST_DEG:g} deg at most"
        )


def _sizes(name: str, values: Iterable[float], count: int) -> tuple[float, ...]:
    values = tuple(values)
    if len(values) != count or not all(math.isfinite(value) and value > 0.0 for value in values):
        shown = values[0] if count == 1 else list(values)
        raise DrakeTrackerError(f"track {name} is {shown}; it must be {'' if count == 1 else 'two '}positive metres")
    return values


def _finite(name: str, values: Iterable[float]) -> tuple[float, ...]:
    values = tuple(values)
    if not values or not all(math.isfinite(value) for value in values):
        raise DrakeTrackerError(f"track {name} is {list(values)}; it must be one or more finite numbers of metres")
    return values


def _resample(curve: np.ndarray, closed: bool, name: str, error: float = CHORD_ERROR) -> Track:
    """Returns the `Track` on a finely sampled curve, in which radii may seem too small by ``error``.

    The curve has the shape (n, 2), or more columns of `track_file.COLUMNS`.
    """
    s = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(curve[:, :2], axis=0).T))])
    if not MIN_LENGTH <= s[-1] <= MAX_LENGTH:
        raise DrakeTrackerError(f"{name} is {s[-1]:.3g} m long; {MIN_LENGTH} to {MAX_LENGTH} m are allowed")
    intervals = min(math.ceil(s[-1] / NODE_SPACING), MAX_NODES - 1)
    nodes = np.linspace(0.0, s[-1], intervals + 1)
    rows = np.column_stack([np.interp(nodes, s, column) for column in curve.T])
    rows = rows[:-1] if closed else rows
    heights, leans = (rows[:, axis] if rows.shape[1] > axis else None for axis in (2, 3))
    track = Track(np.ascontiguousarray(rows[:, :2]), closed, heights, None if leans is None else np.radians(leans))
    needed = max(MIN_RADIUS, NODES_PER_RADIUS * float(nodes[1]))
    radius, least = round(1e3 * track.min_radius(), 2), round(1e3 * (1.0 - error) * needed, 2)  # [mm] as printed
    if radius < least:
        x, y, _ = track.pose(np.abs(track.curvature(nodes)).argmax() * nodes[1])
        raise DrakeTrackerError(
            f"{name} bends with a radius of {radius:.2f} mm at x = {x:.3f}, y = {y:.3f} m;"
            f" at least {1e3 * needed:.0f} mm are needed ({least:.2f} mm with a tolerance of {100 * error:.0f} %)"
        )
    if track.heights is not None:
        _check_profile(track, name)
    return track
