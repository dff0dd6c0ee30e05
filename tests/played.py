"""Recordings that are played as cameras by a clock of the test, which no test has to wait for."""

from functools import partial

from drake_tracker.footage import sources
from drake_tracker.footage.played_camera import open_played


class Clock:
    """A clock that goes on only while somebody sleeps."""

    def __init__(self, now=1000.0):
        self.now = now

    def __call__(self):
        return self.now

    def sleep(self, time):
        self.now += time


def play_at_once(monkeypatch, **options):
    """Makes ``play:`` use such a clock, which is returned."""
    clock = Clock()
    quick = partial(open_played, clock=clock, sleep=clock.sleep, **options)
    monkeypatch.setattr(sources, "open_played", quick)
    return clock
