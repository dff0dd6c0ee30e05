"""Where a train was on its track, according to the log of its true states."""

from types import SimpleNamespace

import numpy as np
import pytest

from drake_tracker.core.log import Signal
from drake_tracker.tasks.train.episode import train_places
from drake_tracker.tasks.train.task import TASK
from drake_tracker.world.train.tracks import Track

NAMES = tuple(TASK.signals()["truth_train_state"][1])
HEIGHT = 0.485


@pytest.fixture
def setup():
    """Two laps side by side, at most 4 mm apart, which cross; the train starts in the second lap."""
    u = np.linspace(0.0, 4.0 * np.pi, 900, endpoint=False)
    radius = 0.15 + 0.002 * np.cos(0.5 * u)
    track = Track(np.column_stack([radius * np.cos(u), radius * np.sin(u)]), closed=True)
    scenario = SimpleNamespace(table_height=0.45, track=SimpleNamespace(turns=True))
    return SimpleNamespace(placement=(track, 0.5 * track.length), scenario=scenario)


def states(angles, lift=0.0):
    """Log of a train on the circle in the middle of both laps."""
    rows = np.zeros((len(angles), 13))
    yaw = angles + 0.5 * np.pi
    rows[:, [0, 3]] = np.column_stack([np.cos(0.5 * yaw), np.sin(0.5 * yaw)])
    rows[:, 4:7] = np.column_stack([0.15 * np.cos(angles), 0.15 * np.sin(angles), HEIGHT + lift + 0.0 * angles])
    return {"truth_train_state": Signal(np.arange(len(angles)) / 60.0, rows, NAMES)}


def test_the_train_stays_on_its_lap(setup):
    track, start = setup.placement
    places = train_places(setup, states(np.linspace(0.0, 4.0 * np.pi, 700)), 1e9)
    way = np.unwrap(places[:, 0], period=track.length)
    assert way[0] == pytest.approx(start, abs=1e-3) and np.diff(way).min() > 0.0 and np.diff(way).max() < 0.006
    assert way[-1] - way[0] == pytest.approx(track.length, abs=1e-3)
    assert np.abs(places[:, 1]).max() < 0.0025


def test_it_is_followed_up_to_a_time(setup):
    log = states(np.linspace(0.0, 1.0, 61))
    assert len(train_places(setup, log, 0.5)) == 31
    assert train_places(setup, log, -1.0).shape == (0, 2)


def test_a_lifted_train_may_be_anywhere(setup):
    track, _ = setup.placement
    places = train_places(setup, states(np.full(5, np.pi / 3), lift=0.01), 1.0)
    x, y = 0.15 * np.cos(np.pi / 3), 0.15 * np.sin(np.pi / 3)
    np.testing.assert_allclose(places[:, 0], track.nearest(x, y, np.pi / 3 + np.pi / 2)[0])
