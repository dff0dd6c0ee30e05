"""A tracker that watches cuboids, and paths for them."""

import numpy as np
from cuboids import CAMERAS, CENTRE, HEIGHT, PERIOD, WORK_VOLUME, oval

from drake_tracker.vision.silhouettes.config import SilhouetteTracker
from drake_tracker.vision.silhouettes.tracker import Tracker, TrackerState

GOLD, BLUE, RED = (200, 170, 60), (50, 80, 190), (190, 50, 40)
NEAR = 0.02
"""A track lies on an object when it is nearer than this [m]."""


def on_oval(speed=0.15, start=0.0, scale=1.0, centre=CENTRE):
    return lambda time: oval(time, speed, start, scale, centre)


def standing(x, y):
    return lambda time: (np.array([x, y, HEIGHT]), np.zeros(3))


def on_line(start, velocity):
    """A straight path in the plane of the track, from ``start`` (x, y) [m] at time 0, ``velocity`` (2,) [m/s]."""
    return lambda time: (np.array([*(np.array(start) + time * np.array(velocity)), HEIGHT]), np.array([*velocity, 0.0]))


def during(path, first, last):
    """The path from ``first`` [s] until ``last`` [s]; the object is absent otherwise."""
    return lambda time: path(time) if first <= time < last else None


class Run:
    """A tracker that watches a stage, a pair of images each cycle.

    Attributes:
        history: [(time, truth, state)].
    """

    def __init__(self, stage, settings=SilhouetteTracker(), tracker=None):
        self.stage = stage
        self.tracker = tracker or Tracker(CAMERAS, settings, work_volume=WORK_VOLUME)
        self.state, self.history, self.cycle = TrackerState(), [], 0

    def watch(self, seconds, usable=None, expected=None):
        """Returns itself after some time; ``usable`` and ``expected`` are functions of the time."""
        for _ in range(round(seconds / PERIOD)):
            time = self.cycle * PERIOD
            foregrounds = self.stage.foregrounds(time, usable is None or usable(time))
            arguments = () if expected is None else (expected(time),)
            self.state = self.tracker.update(self.state, foregrounds, *arguments)
            self.history.append((time, self.stage.truth(time), self.state))
            self.cycle += 1
        return self

    @property
    def tracks(self):
        return {track.number: track for track in self.state.confirmed()}

    def numbers(self, since=0.0):
        """All numbers of tracks that appeared from a time on."""
        return {track.number for time, _, state in self.history if time >= since for track in state.confirmed()}

    def errors(self, number, thing, since=0.0):
        """Distances [m] of the measurements of a track from an object, and the share of images with one."""
        found, count = [], 0
        for time, truth, state in self.history:
            if time < since:
                continue
            count += 1
            for track in state.confirmed():
                if track.number == number and track.measurement is not None and truth[thing] is not None:
                    found.append(np.linalg.norm(track.measurement.p_WQ - truth[thing]))
        return np.array(found), len(found) / count

    def identities(self, since=0.0, until=np.inf):
        """{number of an object: numbers of the tracks that were nearest to it and on it}."""
        found = {}
        for time, truth, state in self.history:
            if not since <= time <= until:
                continue
            for thing, p_WQ in enumerate(truth):
                tracks = state.confirmed()
                if p_WQ is None or not tracks:
                    continue
                nearest = min(tracks, key=lambda track: np.linalg.norm(track.position - p_WQ))
                if np.linalg.norm(nearest.position - p_WQ) < 2 * NEAR:
                    found.setdefault(thing, set()).add(nearest.number)
        return found
