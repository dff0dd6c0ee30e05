"""Tracks for the train: smooth planar curves stored as dense polylines by arc length."""

import csv
import math
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from drake_tracker.core.errors import DrakeTrackerError

TRACK_KINDS = ("oval", "stadium", "circle", "figure_eight", "line", "csv")

NODE_SPACING = 2e-3  # [m] a chord this long leaves a bend of 0.1 m radius by 5 um
MAX_NODES = 1000  # bounds the cost of `Track.locate`, which visits every node
SAMPLES = 20001  # of the exact curve, from which the nodes are taken
HEADING_WEIGHT = 0.05  # [m] a piece of track at right angles counts as this much farther away
MIN_RADIUS = 0.03  # [m] a train .12 m long cannot take a tighter bend
MIN_LENGTH, MAX_LENGTH = 0.3, 10.0  # [m] outside of these the file's unit is not the metre


class Track:
    """A planar curve in W, by arc length s [m], travelled in the direction of growing s.

    ``points`` has shape (n, 2) [m], equally spaced along the curve; a closed track does not repeat its first point.
    Headings are angles of the tangent about W's z axis [rad], continuous along the track (they are not wrapped).
    """

    def __init__(self, points, closed):
        points = np.array(points, dtype=float)
        self.closed = bool(closed)
        self.points = points
        chords = np.diff(points, axis=0, append=points[:1])
        steps = np.hypot(*chords.T)
        if not self.closed:
            steps = steps[:-1]
        self.length = float(steps.sum())
        self._spacing = self.length / len(steps)

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

    def pose(self, s):
        """Returns (x, y, heading) [m, m, rad] at arc length ``s`` [m], a number or an array of them.

        On a closed track s may run over any number of laps, and the heading goes on turning with it. On an open one
        s is held within the track.
        """
        s, laps = self._within(s)
        x, y, heading = (np.interp(s, self._s_grid, row) for row in (self._x_grid, self._y_grid, self._heading_grid))
        return x, y, heading + laps * self._turn

    def curvature(self, s):
        """Returns the curvature [1/m] at arc length ``s`` [m], positive where the track bends to the left."""
        return np.interp(self._within(s)[0], self._s_grid, self._curvature_grid)

    def nearest(self, x, y, heading):
        """Returns (s, lateral) [m] of the place on the track nearest to (x, y) [m] that runs along ``heading`` [rad].

        ``lateral`` is the distance of the point to the left of the track. The heading tells the two branches of a
        crossing, or of two neighbouring straights, from each other.
        """
        return self.locate(x, y, math.cos(heading), math.sin(heading))[:2]

    def locate(self, x, y, heading_x, heading_y):
        """As `nearest`, from a unit vector of the heading, with all that a rail needs to know of the place.

        Returns (s, lateral, tangent_x, tangent_y, curvature).
        """
        cost = self._cost_rows.dot((x, y, heading_x, heading_y))
        cost += self._cost_constant
        index = int(cost.argmin())
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

    def reversed(self):
        """Returns the same curve travelled the other way; a closed one keeps its starting point."""
        points = self.points[::-1]
        return Track(np.roll(points, 1, axis=0) if self.closed else points, self.closed)

    def translated(self, offset):
        """Returns the track moved by ``offset`` (x, y) [m]."""
        return Track(self.points + np.asarray(offset), self.closed)

    def rotated(self, angle, about=(0.0, 0.0)):
        """Returns the track turned by ``angle`` [rad] about the point ``about`` (x, y) [m]."""
        cos, sin = math.cos(angle), math.sin(angle)
        return Track((self.points - about) @ np.array([[cos, sin], [-sin, cos]]) + about, self.closed)

    def min_radius(self):
        """Returns the radius of the tightest bend [m], infinity for a straight line."""
        tightest = np.abs(self._curvature_grid).max()
        return 1.0 / tightest if tightest > 1e-9 else math.inf

    def _within(self, s):
        if not self.closed:
            return np.clip(s, 0.0, self.length), 0.0
        laps = np.floor_divide(s, self.length)
        return s - laps * self.length, laps


def make_track(
    kind,
    *,
    semi_axes=(0.16, 0.22),
    radius=0.12,
    straight=0.20,
    length=0.9,
    csv="",
    centre=(0.56, 0.0),
    rotation=0.0,
):
    """Returns the `Track` of one of `TRACK_KINDS`.

    ``semi_axes`` (x, y) [m]: of the ellipse ``oval``, and half the extent of ``figure_eight``. ``radius`` [m]: of
    ``circle`` and of the ends of ``stadium``, whose two straights of ``straight`` [m] run along y. ``length`` [m]: of
    ``line``, which is open and runs along +y. All are then turned by ``rotation`` [rad] and set down at ``centre``
    (x, y) [m] in W. ``csv``: a file with the user's own closed polyline in W, which is neither turned nor moved.

    Raises DrakeTrackerError when the kind is unknown, a size is not a positive number, the track bends more tightly
    than a train can follow, or the file cannot be used.
    """
    if kind not in TRACK_KINDS:
        raise DrakeTrackerError(f"track kind '{kind}' is unknown; choose one of {', '.join(TRACK_KINDS)}")
    if kind == "csv":
        return _resample(_read_csv(csv), closed=True, name=f"track file {csv}")

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
        # Bernoulli's lemniscate, whose larger extent is 2 sqrt(2) times the smaller, stretched to the two asked for.
        a, b = _sizes("semi_axes", semi_axes, 2)
        scale = 1.0 / (1.0 + np.cos(u) ** 2)
        curve = np.column_stack([a * math.sqrt(8) * np.sin(u) * np.cos(u) * scale, b * np.sin(u) * scale])
    else:
        (full,) = _sizes("length", [length], 1)
        y = np.linspace(-0.5 * full, 0.5 * full, SAMPLES)
        curve = np.column_stack([np.zeros_like(y), y])
    name = f"track kind '{kind}'"
    return _resample(curve, closed=kind != "line", name=name).rotated(rotation).translated(centre)


def _sizes(name, values, count):
    values = tuple(values)
    if len(values) != count or not all(math.isfinite(value) and value > 0.0 for value in values):
        shown = values[0] if count == 1 else list(values)
        raise DrakeTrackerError(f"track {name} is {shown}; it must be {'' if count == 1 else 'two '}positive metres")
    return values


def _resample(curve, closed, name):
    """Returns the `Track` with equally spaced nodes on a finely sampled curve of shape (n, 2)."""
    s = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(curve, axis=0).T))])
    if not MIN_LENGTH <= s[-1] <= MAX_LENGTH:
        raise DrakeTrackerError(f"{name} is {s[-1]:.3g} m long; {MIN_LENGTH} to {MAX_LENGTH} m are allowed")
    intervals = min(math.ceil(s[-1] / NODE_SPACING), MAX_NODES - 1)
    nodes = np.linspace(0.0, s[-1], intervals + 1)
    points = np.column_stack([np.interp(nodes, s, curve[:, axis]) for axis in (0, 1)])
    track = Track(points[:-1] if closed else points, closed)
    if track.min_radius() < MIN_RADIUS:
        x, y, _ = track.pose(np.abs(track.curvature(nodes)).argmax() * nodes[1])
        raise DrakeTrackerError(
            f"{name} bends with a radius of {1e3 * track.min_radius():.0f} mm at x = {x:.3f}, y = {y:.3f} m;"
            f" at least {1e3 * MIN_RADIUS:.0f} mm are needed"
        )
    return track


def _read_csv(path):
    """Returns a fine closed curve, shape (SAMPLES, 2) [m], through the points of a file with the header x,y.

    A periodic cubic spline makes position, heading and curvature continuous; its centripetal parameter (the root of
    the chord) keeps it from overshooting between points at unequal distances.
    """
    if not path:
        raise DrakeTrackerError("track kind 'csv' needs the name of a file with the header x,y in track.csv")
    points, lines = [], []
    try:
        with Path(path).open(newline="", encoding="utf-8-sig") as file:
            reader = csv.reader(file)
            header = [name.strip().lower() for name in next(reader, [])]
            if header != ["x", "y"]:
                raise DrakeTrackerError(f"track file {path}, line 1: the header must be x,y, not '{','.join(header)}'")
            for row in reader:
                if any(cell.strip() for cell in row):
                    points.append(_read_row(row, f"track file {path}, line {reader.line_num}"))
                    lines.append(reader.line_num)
    except OSError as error:
        raise DrakeTrackerError(f"track file '{path}' cannot be read: {error.strerror}") from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise DrakeTrackerError(f"track file {path} is not a text file of comma-separated values") from error
    if len(points) > 1 and points[0] == points[-1]:
        points.pop()
    if len(points) < 3:
        raise DrakeTrackerError(f"track file {path} has {len(points)} points; a closed track needs at least 3")

    closed = np.array(points + points[:1])
    chord = np.hypot(*np.diff(closed, axis=0).T)
    if chord.min() == 0.0:
        line = lines[int(chord.argmin()) + 1]
        raise DrakeTrackerError(f"track file {path}, line {line}: the point is the same as the one before it")
    parameter = np.concatenate([[0.0], np.cumsum(np.sqrt(chord))])
    spline = CubicSpline(parameter, closed, bc_type="periodic")
    return spline(np.linspace(0.0, parameter[-1], SAMPLES))


def _read_row(row, place):
    try:
        x, y = (float(cell) for cell in row)
    except ValueError:
        raise DrakeTrackerError(f"{place}: '{','.join(row)}' is not two numbers x,y in metres") from None
    if not (math.isfinite(x) and math.isfinite(y)):
        raise DrakeTrackerError(f"{place}: '{','.join(row)}' is not finite")
    return x, y
