"""The benchmark of several objects: what it counts, and that its scenarios can be loaded."""

import json

import numpy as np
import pytest
import several
from methods import several_measures as measures
from methods.several_worlds import Record, lap_time, train_lengths
from result_tables import several_tables
from shared import parts

from drake_tracker.tasks import load_scenario

LENGTHS = np.array([0.12, 0.12])


def record(points, numbers, alive=None, variances=None):
    """Two trains that stand 0.3 m apart, the second one turned by 90 deg; points (n, k, 3)."""
    points, numbers = np.asarray(points, float), np.asarray(numbers)
    n = len(points)
    p_WO = np.tile([[0.0, 0.0, 0.5], [0.3, 0.0, 0.5]], (n, 1, 1))
    return Record(
        stamps=np.arange(n) / 60.0,
        p_WO=p_WO,
        yaw=np.tile([0.0, 0.5 * np.pi], (n, 1)),
        alive=numbers if alive is None else np.asarray(alive),
        numbers=numbers,
        points=points,
        variances=np.full(points.shape, 0.005**2) if variances is None else variances,
        usable=np.ones(n, bool),
        centroids=np.zeros((n, 2, 3)),
    )


def test_each_train_needs_a_point_of_its_own():
    both = [[0.010, 0.0, 0.5], [0.3, 0.010, 0.5]]
    one = [[0.0, 0.0, 0.5], [0.0, 0.001, 0.5]]
    between = [[0.15, 0.0, 0.5], [0.0, 0.0, 0.0]]
    found = measures.separation_numbers(record([both, one, between], [[1, 2], [1, 2], [1, 0]]), LENGTHS, 0.0, 1.0)
    assert (found["images"], found["both"], found["one"]) == (3, 1, 2)
    assert (found["valid"], found["neither"]) == (5, 1)


def test_a_place_counts_if_most_of_its_images_do():
    good, bad = [[0.0, 0.0, 0.5], [0.3, 0.0, 0.5]], [[0.0, 0.0, 0.5], [0.5, 0.0, 0.5]]
    found = measures.separation_numbers(record([good, good, bad, bad, bad, good], [[1, 2]] * 6), LENGTHS, 0.0, 1.2)
    assert (found["places"], found["good_places"]) == (2, 1)


@pytest.mark.parametrize(
    "point, expected",
    [((0.069, 0.0), True), ((0.071, 0.0), False), ((0.0, 0.031), False), ((0.3, 0.069), True), ((0.331, 0.0), False)],
)
def test_an_outline_turns_with_its_train(point, expected):
    assert measures.on_trains(record([[[*point, 0.5]]], [[1]]), LENGTHS).item() == expected


def test_swaps_new_numbers_and_lost_tracks_are_counted():
    here, there = [0.0, 0.0, 0.5], [0.3, 0.0, 0.5]
    straight, crossed = [here, there], [there, here]
    same = record([straight] * 3, [[1, 2]] * 3)
    assert measures.identity_numbers(same) == {"swaps": 0, "begun_again": 0, "lost": 0}
    swapped = record([straight, crossed], [[1, 2], [1, 2]])
    assert measures.identity_numbers(swapped)["swaps"] == 2
    renewed = record([straight, straight], [[1, 2], [1, 3]])
    assert measures.identity_numbers(renewed) == {"swaps": 0, "begun_again": 1, "lost": 1}
    hidden = record([straight] * 3, [[1, 2], [1, 0], [1, 2]], alive=[[1, 2]] * 3)
    assert measures.identity_numbers(hidden) == {"swaps": 0, "begun_again": 0, "lost": 0}


def test_the_time_until_all_are_tracked_waits_for_the_last_one():
    straight = [[0.0, 0.0, 0.5], [0.3, 0.0, 0.5]]
    assert measures.time_until_all(record([straight] * 3, [[0, 0], [1, 0], [1, 2]])) == pytest.approx(2 / 60)
    assert measures.time_until_all(record([straight], [[1, 0]])) is None


def test_coverage_of_gaussian_errors_is_68_percent():
    rng = np.random.default_rng(3)
    shares = measures.coverage_numbers([rng.normal(size=(800, 3)) for _ in range(8)])
    for axis in (*"xyz", "all"):
        value, low, high = shares[axis]
        assert low <= value <= high
        assert value == pytest.approx(0.683, abs=0.02)


def test_errors_are_in_standard_deviations_and_strays_are_counted():
    points = [[[0.005, 0.0, 0.51], [0.8, 0.0, 0.5]]]
    shares, errors, strays = measures.errors_in_std(record(points, [[1, 2]]), 2)
    np.testing.assert_allclose(shares, [[1.0, 0.0, 2.0]])
    np.testing.assert_allclose(errors, [[0.005, 0.0, 0.01]], atol=1e-12)
    assert strays == 1


@pytest.mark.parametrize("cell", several.SEPARATIONS)
def test_trains_have_room_at_every_separation(cell):
    seen = {}

    def watched(scenario, seconds):
        seen["scenario"], seen["seconds"] = scenario, seconds
        return {}

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(several, "watch", watched)
        several.separation_job(cell, 3900, False)
    assert cell > train_lengths(seen["scenario"])[0]
    assert seen["seconds"] == pytest.approx(several.START_UP + 3.0 * lap_time(seen["scenario"]))


def test_every_cell_can_be_loaded():
    cells = [
        *several.COVERAGE.values(),
        *several.LIFT.values(),
        *(("train:guided", each) for each in several.CAMERAS.values()),
    ]
    for name, overrides, *_ in cells:
        load_scenario(name, seed=3900, overrides=[several.IN_PROCESS, *overrides])
    for faults in several.SHAKE.values():
        load_scenario("train:learned", seed=3900, overrides=[f"faults={faults}"])


def test_seeds_of_the_parts_do_not_overlap():
    used = [several.PARTS["cost"].seed] + [
        seed
        for part in several.PARTS.values()
        if isinstance(part, parts.Part)
        for seed in range(part.first_seed, part.first_seed + max(part.cells.values()))
    ]
    assert len(used) == len(set(used))
    assert min(used) >= 2500 and max(used) < parts.QUICK_SEED


def test_a_part_replaces_only_itself_in_the_results(tmp_path):
    path = tmp_path / "results" / "several.json"
    for part, value in (("lift", 1), ("separation", 2), ("lift", 3)):
        parts.merge(path, {"part": part, "cells": value}, several.PARTS)
    assert json.loads(path.read_text(encoding="utf-8")) == [
        {"part": "separation", "cells": 2},
        {"part": "lift", "cells": 3},
    ]


def test_a_run_that_lifts_nothing_has_a_row():
    lines = [
        {"cell": "two", "seed": 1, "success": False, "failure_reason": "the gate never opened"},
        {"cell": "two", "seed": 2, "success": True, "first_attempt_success": True, "time_to_grasp_s": 12.0},
    ]
    (cell,) = parts.of_cells(lines, several.lift_summary)
    assert (cell["runs"], cell["lifted"], cell["first_attempt"]) == (2, 1, 1)
    header, (row,) = several_tables.lift_table([cell])
    assert len(row) == len(header)
    assert row[-1] == "1 times: the gate never opened"


NUMBERS = {"images": 10, "both": 8, "one": 9, "places": 4, "good_places": 3, "valid": 18, "neither": 1}
IDENTITIES = {"swaps": 0, "begun_again": 1, "lost": 1}
CENTROIDS = {"unusable": 0.0, "invalid": 0.5, "median_px": 2.0, "wrong": 0.1}
LAPS = {"first_lap": NUMBERS, "later": NUMBERS}
LINES = {
    "separation": {"several": {**LAPS, **IDENTITIES, "time_until_both_s": None}, "single": LAPS},
    "passing": {**IDENTITIES, "images": 10, "both": 9},
    "coverage": {"body": "plain", "strays": 2, "shares": [[0.5, 2.0, 0.9]], "errors_mm": [[1.0, -2.0, 3.0]]},
    "shake": {"several": CENTROIDS, "single": {**CENTROIDS, "median_px": None}},
}


@pytest.mark.parametrize("part", LINES)
def test_every_part_has_a_table_of_its_lines(part):
    cell = next(iter(several.PARTS[part].cells))
    lines = [{"cell": cell, "seed": seed, **LINES[part]} for seed in (1, 2)]
    cells = parts.of_cells(lines, several.PARTS[part].summary)
    header, (row,) = several_tables.TABLES[part](cells)
    assert len(row) == len(header)
    assert json.loads(json.dumps(cells))[0]["runs"] == 2
    expected = {"separation": "80 %", "passing": "90 %", "coverage": "67 %", "shake": "2.0 px"}
    assert expected[part] in row
