import math

import numpy as np
import pytest

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.world.train.random_walk import CLEARANCE, TURNS, random_walk
from drake_tracker.world.train.tracks import MAX_NODES, make_track

AREA = np.array([[0.36, -0.40], [0.76, -0.40], [0.76, 0.40], [0.36, 0.40]])


def walk(seed=0, length=1.0, radius=0.01, straights=(0.05, 0.2), area=AREA, samples=20001):
    rng = np.random.default_rng([seed])
    return random_walk(rng, length=length, corner_radius=radius, straight_range=straights, area=area, samples=samples)


def pieces(points):
    """Lengths [m] and curvatures [1/m] of the pieces of a walk, from the turn of its chords."""
    chords = np.diff(points, axis=0)
    step = np.hypot(*chords.T).mean()
    curvature = np.diff(np.unwrap(np.arctan2(chords[:, 1], chords[:, 0]))) / step
    levels = np.round(curvature, 0)
    cuts = np.flatnonzero(np.abs(np.diff(levels)) > 1.0)
    parts = [part for part in np.split(curvature, cuts + 1) if len(part) > 20]  # a few chords lie across a joint
    return [(len(part) * step, np.median(part)) for part in parts]


@pytest.mark.parametrize("radius", [0.01, 0.03])
def test_straights_and_rounded_corners_follow_each_other(radius):
    for seed in range(4):
        points = walk(seed, radius=radius)
        steps = np.hypot(*np.diff(points, axis=0).T)
        assert steps.sum() == pytest.approx(1.0, abs=1e-4) and np.ptp(steps) < 1e-6
        found = pieces(points)
        assert len(found) >= 5
        for number, (length, curvature) in enumerate(found):
            last = number == len(found) - 1
            if number % 2 == 0:
                assert curvature == pytest.approx(0.0, abs=1e-6)
                assert length < 0.2 + 1e-3 and (last or length > 0.05 - 1e-3)
            else:
                assert abs(curvature) == pytest.approx(1.0 / radius, rel=1e-3)
                assert length < radius * TURNS[1] + 1e-3 and (last or length > radius * TURNS[0] - 1e-3)


def test_the_heading_never_jumps():
    chords = np.diff(walk(3), axis=0)
    heading = np.unwrap(np.arctan2(chords[:, 1], chords[:, 0]))
    assert np.abs(np.diff(heading)).max() < 1.001 * 1.0 / 20000 / 0.01


@pytest.mark.parametrize("length", [0.9, 1.5])
def test_it_stays_inside_and_away_from_itself(length):
    angle = np.linspace(0.0, 2 * math.pi, 48, endpoint=False)
    ellipse = np.column_stack([0.56 + 0.23 * np.cos(angle), 0.30 * np.sin(angle)])
    for seed in range(4):
        points = walk(seed, length=length, area=ellipse, samples=601)
        assert np.all(((points[:, 0] - 0.56) / 0.23) ** 2 + (points[:, 1] / 0.30) ** 2 <= 1.0)
        s = np.linspace(0.0, length, 601)
        gaps = np.hypot(*(points[:, None] - points[None]).transpose(2, 0, 1))
        assert gaps[np.abs(s[:, None] - s) > 2.0 * CLEARANCE + 1e-9].min() >= CLEARANCE


def test_the_same_seed_gives_the_same_walk_and_another_seed_another_one():
    assert np.array_equal(walk(5), walk(5))
    assert not np.array_equal(walk(5), walk(6))
    a, b = (make_track("random_walk", walk_seed=(7, number)) for number in (0, 1))
    assert np.abs(a.points - b.points).max() > 0.05


def test_a_walk_that_finds_no_room_is_refused():
    square = np.array([[0.5, 0.0], [0.6, 0.0], [0.6, 0.1], [0.5, 0.1]])
    with pytest.raises(DrakeTrackerError, match=r"no walk of 2 m was found .* 50 mm from itself; lower track.length"):
        walk(length=2.0, area=square)


def test_a_track_of_two_metres_resolves_corners_of_ten_millimetres():
    track = make_track("random_walk", length=2.0, corner_radius=0.01, straight_range=(0.05, 0.2))
    assert len(track.points) <= MAX_NODES and track.length == pytest.approx(2.0, rel=2e-3)
    assert track.min_radius() == pytest.approx(0.01, rel=0.01)
    heading = track.pose(np.linspace(0.0, track.length, 4001))[2]
    assert np.abs(np.diff(heading)).max() < 1.05 * 2.0 / 4000 / 0.01
