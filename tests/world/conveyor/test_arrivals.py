from dataclasses import replace

import cv2
import numpy as np
import pytest
from variants import variant

from drake_tracker import DrakeTrackerError
from drake_tracker.core.part_kinds import PART_SHAPES, PartKind, part_outline, placed_outline, touching_distance
from drake_tracker.world.conveyor.arrivals import PART_COLOURS, draw_arrivals
from drake_tracker.world.conveyor.belt_motion import make_belt_motion
from drake_tracker.world.conveyor.conveyor_config import ARRIVAL_PATTERNS, BELT_MOTIONS, ArrivalsConfig, BeltConfig

BELT = BeltConfig()


def drawn(arrivals=ArrivalsConfig(), belt=BELT, duration=120.0, seed=0):
    return draw_arrivals(arrivals, belt=belt, motion=make_belt_motion(belt), duration=duration, seed=seed)


def outlines(parts, belt=BELT):
    """Where the parts lie when the belt starts."""
    motion = make_belt_motion(belt)
    return [placed_outline(part.kind, part.x, -motion.distance(part.time), part.yaw) for part in parts]


def apart(a, b):
    """Distance between the outlines of two parts [m], 0 if they overlap."""

    def outside(points, outline):
        polygon = (1e4 * outline).astype(np.float32)
        return min(-1e-4 * cv2.pointPolygonTest(polygon, (1e4 * p).tolist(), True) for p in points)

    def edges(outline):
        return np.concatenate(
            [outline + share * (np.roll(outline, -1, axis=0) - outline) for share in np.linspace(0, 1, 40)]
        )

    return max(min(outside(edges(a), b), outside(edges(b), a)), 0.0)


@pytest.mark.parametrize("pattern", ARRIVAL_PATTERNS)
@pytest.mark.parametrize("motion", BELT_MOTIONS)
def test_the_mean_rate(pattern, motion):
    belt = replace(BELT, motion=motion)
    count = sum(len(drawn(ArrivalsConfig(pattern=pattern), belt, 600.0, seed)) for seed in range(25))
    assert count / (25 * 10.0) == pytest.approx(12.0, rel=0.06)


def test_bunches_come_closer_together_but_with_longer_gaps():
    gaps = [
        np.diff([part.time for part in drawn(ArrivalsConfig(pattern=pattern), duration=3600.0)])
        for pattern in ("poisson", "bunches")
    ]
    (low, high), (low_bunch, high_bunch) = (np.quantile(gap, [0.4, 0.95]) for gap in gaps)
    assert low_bunch < 0.5 * low and high_bunch > high


def test_even_arrivals_vary_by_no_more_than_they_may():
    arrivals = ArrivalsConfig(pattern="even", variation=0.2)
    parts = drawn(arrivals, duration=3600.0)
    radii = np.array([PART_SHAPES[part.kind].radius for part in parts])
    travelled = BELT.speed * np.diff([part.time for part in parts])
    spaces = travelled - radii[:-1] - radii[1:] - arrivals.gap
    mean = spaces.mean()
    assert mean > 0.3
    assert np.abs(spaces / mean - 1.0).max() < 0.22
    assert np.ptp(spaces) > 0.35 * mean


@pytest.mark.parametrize("seed", range(4))
def test_parts_keep_their_gap(seed):
    arrivals = ArrivalsConfig(rate=50.0)
    places = outlines(drawn(arrivals, seed=seed))
    assert len(places) > 60
    assert all(apart(a, b) >= arrivals.gap for a, b in zip(places, places[1:]))


def test_touching_parts_touch_and_do_not_overlap():
    places = outlines(drawn(ArrivalsConfig(rate=40.0, touching=0.5), duration=300.0))
    distances = np.array([min(apart(a, places[k]) for a in places[max(k - 3, 0) : k]) for k in range(1, len(places))])
    touching = distances < 0.0015
    assert 0.4 < touching.mean() < 0.6
    assert np.all(distances > 0.0)
    assert np.all(distances[~touching] >= 0.015)


def test_parts_and_open_jaws_stay_over_the_belt():
    parts = drawn(duration=600.0)
    outline = np.concatenate(outlines(parts))
    assert np.abs(outline[:, 0] - BELT.middle).max() < 0.5 * BELT.width
    across = np.array([part.x for part in parts]) - BELT.middle
    assert 0.045 < np.abs(across).max() <= 0.05  # half the opening and a jaw are 0.068 m
    assert {part.kind for part in parts} == set(PART_SHAPES)
    assert {part.colour for part in parts} == set(PART_COLOURS)


def test_the_seed_decides():
    assert drawn(seed=3) == drawn(seed=3) != drawn(seed=4)
    assert drawn(seed=3, duration=60.0) == drawn(seed=3)[: len(drawn(seed=3, duration=60.0))]


def test_only_the_kinds_of_the_mix_come():
    assert {part.kind for part in drawn(variant(ArrivalsConfig, mix=(0.0, 1.0, 0.0))())} == {PartKind.DISC}


def test_more_parts_than_fit_are_refused():
    with pytest.raises(DrakeTrackerError, match=r"arrivals.rate is 60 1/min.*no more than"):
        drawn(ArrivalsConfig(rate=60.0), BeltConfig(speed=0.05))


def test_an_unknown_pattern_is_refused():
    with pytest.raises(DrakeTrackerError, match="arrivals.pattern is 'regular'"):
        drawn(ArrivalsConfig(pattern="regular"))


@pytest.mark.parametrize("kind", PART_SHAPES)
def test_outlines_have_the_dimensions_of_the_shapes(kind):
    shape, outline = PART_SHAPES[kind], part_outline(kind)
    assert np.ptp(outline[:, 0]) == pytest.approx(shape.length)
    assert 0.5 * (outline[:, 0].max() + outline[:, 0].min()) == pytest.approx(shape.middle)
    assert outline[:, 1].min() == pytest.approx(-0.5 * shape.width)
    assert np.linalg.norm(outline, axis=1).max() == pytest.approx(shape.radius, abs=1e-4)


def test_touching_distance_of_two_boxes_and_of_parts_that_pass_each_other():
    box = placed_outline(PartKind.BOX, 0.0, 0.0, 0.0)
    assert touching_distance(box, box) == pytest.approx(0.030)
    assert touching_distance(box, box + [0.06, 0.0]) == -np.inf


def test_parts_that_lie_on_a_side_are_otherwise_the_same():
    belt = BeltConfig()
    drawn = [
        draw_arrivals(ArrivalsConfig(lying=lying), belt=belt, motion=make_belt_motion(belt), duration=600.0, seed=3)
        for lying in (0.0, 0.4)
    ]
    assert tuple(replace(part, lies=False) for part in drawn[1]) == drawn[0]
    share = np.mean([part.lies for part in drawn[1] if part.kind is not PartKind.DISC])
    assert share == pytest.approx(0.4, abs=0.12) and not any(part.lies for part in drawn[0])
    assert not any(part.lies for part in drawn[1] if part.kind is PartKind.DISC)
