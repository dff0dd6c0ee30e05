"""The worlds of the estimation benchmark: a path, a speed law, and noise on the points, all drawn from a seed."""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from drake_tracker.world.train.speed_law import distance_at
from drake_tracker.world.train.tracks import Track, make_track

PERIOD = 1.0 / 60.0
"""Time between points [s]."""
HEIGHT = 0.485
"""Height of the points [m, W]."""
SHARP = ("rectangle", "bean")
"""Paths with bends of a radius of 5 to 6 cm."""
PATHS = ("stadium", "oval", "circle", "figure_eight", "spline", *SHARP)
NOISES = ("white", "autocorrelated", "anisotropic", "replayed")
SPEED_LAWS = ("constant", "varying", "stop_and_go")
SPEEDS = (0.10, 0.20)
"""Range from which a run's speed is drawn [m/s]."""
CORRELATION = 0.9
"""Of autocorrelated noise, from one point to the next."""
VARIATION = 0.15


@dataclass(frozen=True)
class World:
    """One run: times (n,) [s], truth rows (x, y, z, yaw) at any time by `pose`, points (n, 3) [m]."""

    track: Track
    speed: float
    law: str
    start: float
    times: np.ndarray
    points: np.ndarray

    def distance(self, times):
        """Returns how far the object has driven [m] at ``times`` [s]."""
        times = np.asarray(times, dtype=float)
        return np.array([distance_at(self.law, self.speed, VARIATION, max(t, 0.0)) for t in times.ravel()])

    def pose(self, times):
        """Returns rows x, y [m], yaw [rad], shape (n, 3)."""
        return np.column_stack(self.track.pose(self.start + self.distance(times)))


def make_path(name, rng):
    """Returns the `Track` of a path; only the spline is random, drawn from ``rng``."""
    if name == "stadium":
        return make_track("stadium", radius=0.175, straight=0.25)
    if name == "spline":
        return random_spline(rng)
    if name in SHARP:
        return _closed_track(rectangle() if name == "rectangle" else bean())
    return make_track(name)


def rectangle(size=(0.24, 0.36), radius=0.06):
    """Returns a rectangle with round corners, nodes (n, 2) [m]: its size along x and y [m], the corners' radius [m]."""
    quarter = np.linspace(0.0, 0.5 * np.pi, 4001)
    x, y = 0.5 * size[0] - radius, 0.5 * size[1] - radius
    centres = ((x, y), (-x, y), (-x, -y), (x, -y))
    angles = [quarter + k * 0.5 * np.pi for k in range(4)]
    corners = [np.add(c, radius * np.column_stack([np.cos(a), np.sin(a)])) for c, a in zip(centres, angles)]
    return np.vstack([*corners, corners[0][:1]])


def bean(semi_axes=(0.10, 0.18), bend=0.14):
    """Returns an ellipse whose longer axis is bent along an arc, nodes (n, 2) [m]: its semi-axes [m], the arc's radius
    [m]. Its tightest bend has a radius of 4.6 cm, and one of its sides is concave.
    """
    angle = np.linspace(0.0, 2.0 * np.pi, 20001)
    away, along = bend + semi_axes[0] * np.cos(angle), semi_axes[1] * np.sin(angle) / bend
    return np.column_stack([away * np.cos(along) - bend, away * np.sin(along)])


def _closed_track(curve, nodes=600):
    """Returns a `Track` of equally spaced nodes on a finely sampled closed curve (n, 2) [m], moved to the middle of the
    other tracks."""
    s = np.append(0.0, np.cumsum(np.hypot(*np.diff(curve, axis=0).T)))
    at = np.linspace(0.0, s[-1], nodes + 1)[:-1]
    return Track(np.column_stack([np.interp(at, s, curve[:, k]) for k in (0, 1)]), closed=True).translated((0.56, 0.0))


def random_spline(rng, corners=7):
    """Returns a closed track through ``corners`` points about an oval, scattered by a fifth of its radius; the draw is
    repeated until it bends no more tightly than a radius of 6 cm.
    """
    while True:
        angle = 2.0 * np.pi * (np.arange(corners) + rng.uniform(-0.2, 0.2, corners)) / corners
        radius = 0.2 * (1.0 + 0.2 * rng.uniform(-1.0, 1.0, corners))
        points = np.column_stack([0.56 + 0.8 * radius * np.cos(angle), radius * np.sin(angle)])
        closed = np.vstack([points, points[:1]])
        knots = np.append(angle, angle[0] + 2.0 * np.pi)
        spline = CubicSpline(knots, closed, bc_type="periodic")
        curve = spline(np.linspace(knots[0], knots[-1], 20001))
        s = np.append(0.0, np.cumsum(np.hypot(*np.diff(curve, axis=0).T)))
        nodes = np.linspace(0.0, s[-1], 900)[:-1]
        track = Track(np.column_stack([np.interp(nodes, s, curve[:, k]) for k in (0, 1)]), closed=True)
        if track.min_radius() >= 0.06:
            return track


def make_world(path, noise, sigma, law, seed, duration, replay=None):
    """Returns a `World`.

    Args:
      path: of `PATHS`. noise: of `NOISES`. sigma: standard deviation of a point, per axis [m] (of replayed noise: the
      recording is scaled to it). law: of `SPEED_LAWS`. seed: draws speed, direction, start, spline and noise.
      duration: [s]. replay: a `Recording` for replayed noise.
    """
    rng = np.random.default_rng([seed, PATHS.index(path), SPEED_LAWS.index(law)])
    track = make_path(path, rng)
    if rng.random() < 0.5:
        track = track.reversed()
    speed = rng.uniform(*SPEEDS)
    start = rng.uniform(0.0, track.length)
    times = PERIOD * np.arange(round(duration / PERIOD))
    world = World(track, speed, law, start, times, np.zeros((len(times), 3)))
    truth = world.pose(times)
    error = draw_noise(noise, sigma, truth[:, 2], np.random.default_rng([seed, 7]), replay)
    points = np.column_stack([truth[:, :2], np.full(len(times), HEIGHT)]) + error
    return World(track, speed, law, start, times, points)


def draw_noise(kind, sigma, yaw, rng, replay=None):
    """Returns errors of points, shape (n, 3) [m, W], for an object that heads along ``yaw`` (n,) [rad]."""
    n = len(yaw)
    if kind == "white":
        return sigma * rng.standard_normal((n, 3))
    if kind == "autocorrelated":
        white = rng.standard_normal((n, 3))
        error = np.empty((n, 3))
        error[0] = white[0]
        for k in range(1, n):
            error[k] = CORRELATION * error[k - 1] + np.sqrt(1.0 - CORRELATION**2) * white[k]
        return sigma * error
    if kind == "anisotropic":
        # Three times as much along the line of sight between the two cameras (W's x) as across it, the same on average.
        return sigma * rng.standard_normal((n, 3)) * np.sqrt(2.0) * np.array([3.0, 1.0, 1.0]) / np.sqrt(10.0)
    return replay.draw(yaw, sigma, rng)
