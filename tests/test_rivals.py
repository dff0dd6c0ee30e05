"""The motions of other people's benchmarks have the described speeds, straights, areas and corners."""

import math

import numpy as np
import pytest
from methods.rival_motions import AREA, BEND_LENGTH, FAMILIES, RADII, SHORTEST, TABLE, length_of
from result_tables.rival_tables import RIVALS, describe, published_rate, rivals_table
from rivals import LAGS, all_jobs

from drake_tracker.world.train.plant import TABLE_TOP
from drake_tracker.world.train.tracks import MIN_RADIUS, make_track

CENTRE = np.array([0.56, 0.0])
SEEDS = range(76900, 76904)
MOTIONS = [(family, name) for family, motions in FAMILIES.items() for name in motions]


def paths(family, name):
    """The paths of some seeds of development."""
    motion = FAMILIES[family][name]
    return [motion.draw(seed, motion.speeds[0])[0] for seed in SEEDS]


def turns_of(points):
    """The turn from each step to the next [rad]."""
    return np.diff(np.unwrap(np.arctan2(*np.diff(points, axis=0).T[::-1])))


def corners_of(points):
    """The turns of the corners of a walk [deg], and the lengths of the straights between them [m]."""
    turns, steps = turns_of(points), np.hypot(*np.diff(points, axis=0).T)
    bent = np.abs(turns) > 1e-6
    edges = np.flatnonzero(np.diff(np.concatenate([[False], bent, [False]]).astype(int)))
    begins, ends = edges[::2], edges[1::2]
    corners = [math.degrees(abs(turns[begin:end].sum())) for begin, end in zip(begins, ends, strict=True)]
    straights = [steps[end : begin + 1].sum() for end, begin in zip(ends[:-1], begins[1:], strict=True)]
    return corners, straights


@pytest.mark.parametrize(("family", "name"), MOTIONS)
def test_paths_are_tracks_on_the_table(family, name, tmp_path):
    for points in paths(family, name):
        assert (points > TABLE_TOP[0]).all()
        assert (points < TABLE_TOP[1]).all()
        assert length_of(points) >= SHORTEST
        assert np.hypot(*np.diff(points, axis=0).T).max() < 0.0025
    np.savetxt(tmp_path / "path.csv", points, "%.5f", ",", header="x,y", comments="")
    track = make_track("csv", csv=str(tmp_path / "path.csv"), closed=False)
    assert track.length == pytest.approx(length_of(points), rel=0.01)
    assert track.min_radius() > 0.9 * MIN_RADIUS


@pytest.mark.parametrize(
    ("family", "extent", "turns", "straights"),
    [
        ("dgbench", (0.28, 0.28), (45.0, 180.0), (0.05, 0.05)),
        ("dgbench_140", (0.14, 0.14), (30.0, 150.0), (0.05, 0.05)),
        ("domino", AREA, (45.0, 180.0), (0.05, 0.15)),
    ],
)
def test_walks_have_their_area_corners_and_straights(family, extent, turns, straights):
    for points in paths(family, list(FAMILIES[family])[-1]):
        assert (np.abs(points - CENTRE) < 0.5 * np.array(extent)).all()
        assert 2.0 <= length_of(points) + 0.02 <= 2.3
        corners, between = corners_of(points)
        assert len(corners) > 8
        step = math.degrees(0.002 / 0.01)  # the chords of a corner begin and end half a step within it
        assert turns[0] - step <= min(corners) <= max(corners) <= turns[1] + step
        assert straights[0] - 0.003 <= min(between) <= max(between) <= straights[1] + 0.003
        bends, steps = np.abs(turns_of(points)), np.hypot(*np.diff(points, axis=0).T)[1:]
        assert (steps[bends > 0.1] / bends[bends > 0.1]).min() == pytest.approx(0.01, rel=0.1)


@pytest.mark.parametrize(
    ("family", "name"), [("domino", "1, constant velocity"), ("dom", "straight pass"), ("columbia", "linear")]
)
def test_passes_are_straight(family, name):
    for points in paths(family, name):
        assert np.hypot(*(points[-1] - points[0])) == pytest.approx(length_of(points))


def test_polynomial_is_a_cubic_in_the_area():
    for points in paths("domino", "2, polynomial"):
        assert (np.abs(points - CENTRE) <= 0.5 * np.array(AREA) + 1e-9).all()
        assert length_of(points) < 4.0 * BEND_LENGTH
        assert misfit(points, 3) < 0.2 * misfit(points, 1)


def misfit(points, degree):
    """The largest distance of a path from a polynomial fitted across its chord [m]."""
    chord = points[-1] - points[0]
    along, aside = chord / np.hypot(*chord), np.array([-chord[1], chord[0]]) / np.hypot(*chord)
    u, v = (points - points[0]) @ along, (points - points[0]) @ aside
    return np.abs(np.polynomial.Polynomial.fit(u, v, degree)(u) - v).max()


def test_arcs_keep_their_distance_from_the_arm():
    for points in paths("columbia", "circular"):
        radii = np.hypot(*points.T)
        assert RADII[0] <= radii.min() <= radii.max() <= RADII[1]
        assert np.ptp(radii) < 1e-5


def test_an_object_of_dom_leaves_over_the_edge_of_the_table():
    for points in paths("dom", "straight pass"):
        assert np.abs(np.abs(points[-1] - CENTRE) - (np.array(TABLE[1]) - CENTRE)).min() < 0.005


def test_speeds_are_as_described_and_do_not_change_the_path():
    motion = FAMILIES["dgbench"]["walk, 280 mm"]
    (slow, low), (fast, high) = motion.draw(76900, "0.1"), motion.draw(76900, "0.2")
    assert (low, high) == (0.1, 0.2)
    assert np.array_equal(slow, fast)
    drawn = [FAMILIES["domino"]["3, chaotic"].draw(seed, "0.1 to 0.5")[1] for seed in SEEDS]
    assert 0.1 <= min(drawn) < max(drawn) <= 0.5


def test_every_motion_has_a_published_rate_and_every_cell_a_row():
    jobs = all_jobs(FAMILIES, LAGS, SEEDS[:2], False)
    keys = ("rival", "motion", "speeds", "lag", "seed", "rendered")
    rows = [{**dict(zip(keys, job, strict=True)), "speed": 0.1, "success": True, "out_of_reach": False} for job in jobs]
    assert len(set(jobs)) == len(jobs)
    assert set(RIVALS) == set(FAMILIES)
    assert all(published_rate(row) for row in rows)
    for row in rows[::2]:
        reason = "the train is in the work volume and within the arm's reach for 1.4 s only, and a grasp takes 2.2 s"
        row |= {"success": False, "out_of_reach": True, "failure_reason": reason}
    header, lines = rivals_table(rows)
    assert 2 * len(lines) == len(jobs)
    assert {len(line) for line in lines} == {len(header)}
    assert "out of reach: the train is" in describe(rows[0])
