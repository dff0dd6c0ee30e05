import math

import numpy as np
import pytest

from drake_tracker.estimation.point_check import (
    FARTHEST_PLACE,
    MOST_PLACES,
    NEAREST_PLACE,
    NO_TRAIL,
    SPACING,
    heading_at_rest,
    passed,
)


def walked(*corners, step=0.002, std=0.0):
    """The trail of points every ``step`` [m] along straights between corners (x, y), with noise [m] per axis."""
    random, trail = np.random.default_rng(3), NO_TRAIL
    for start, end in zip(corners, corners[1:]):
        start, end = np.array(start), np.array(end)
        for share in np.arange(0.0, 1.0, step / np.linalg.norm(end - start)):
            trail = passed(trail, *(start + share * (end - start) + std * random.standard_normal(2)))
    return trail


def apart(a, b):
    """The angle between two directions without a sign [rad]."""
    return abs(math.remainder(a - b, math.pi))


def test_places_are_spaced_and_the_oldest_are_forgotten():
    trail = walked((0.0, 0.0), (0.3, 0.0), step=0.0005)
    gaps = np.hypot(*np.diff(trail, axis=0).T)
    assert len(trail) == MOST_PLACES and gaps.min() >= SPACING
    assert trail[-1, 0] > 0.29 and not trail.flags.writeable


def test_a_filter_that_is_wrong_by_a_right_angle_is_corrected():
    """The object stops 25 mm after a corner, and the filter still states the direction before it, or beyond."""
    trail = walked((0.4, 0.0), (0.5, 0.0), (0.5, 0.025), std=0.001)
    for stated in (0.0, math.pi / 4, math.radians(170.0)):
        assert apart(heading_at_rest(trail, 0.5, 0.025, stated), math.pi / 2) < math.radians(15.0)


def test_of_the_two_directions_it_is_the_one_nearer_to_the_stated_one():
    trail = walked((0.0, 0.0), (0.1, 0.0))
    for stated, found in ((0.2, 0.0), (3.0, math.pi), (-3.0, -math.pi), (4.0 * math.pi - 0.3, 4.0 * math.pi)):
        assert heading_at_rest(trail, 0.1, 0.0, stated) == pytest.approx(found, abs=1e-6)


def test_only_the_last_approach_counts():
    """The object was at its place of rest before, going across."""
    trail = walked((0.1, -0.03), (0.1, 0.03), (0.04, 0.03), (0.04, 0.0), (0.1, 0.0))
    assert heading_at_rest(trail, 0.1, 0.0, 0.5) == pytest.approx(0.0, abs=0.02)


def test_without_a_suitable_place_the_stated_direction_stays():
    for trail in (
        NO_TRAIL,
        np.array([[0.5 - 0.5 * NEAREST_PLACE, 0.0]]),
        np.array([[0.5 - 1.5 * FARTHEST_PLACE, 0.0]]),
    ):
        assert heading_at_rest(trail, 0.5, 0.0, 1.2) == 1.2
