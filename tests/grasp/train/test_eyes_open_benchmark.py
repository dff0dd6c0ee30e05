"""The benchmark of vision until contact: its scenarios can be loaded, and its lines become tables."""

import eyes_open
import numpy as np
import pytest
from methods import eyes_open_measures as measures
from result_tables.launch_tables import calibration_table, right, tenths_of
from shared import parts

from drake_tracker.core.log import Signal
from drake_tracker.grasp.train.schema import Phase
from drake_tracker.tasks import load_scenario
from drake_tracker.tasks.episode import PhaseSpan
from drake_tracker.tasks.train.setup import resolve
from drake_tracker.tasks.train.track_placement import check_track, shortest_grasp, time_within_reach

LINE = {"first_attempt_success": True, "failure_reason": None, "along_m": -0.004, "time_to_grasp_s": 6.0, "lap_s": 8.0}


def test_every_event_is_one():
    for name, pattern in eyes_open.EVENTS.items():
        for time in ("after_launch: 0.2", "at: 9.5"):
            overrides = [*eyes_open.COMMON, f"track.event={pattern % time}"]
            event = load_scenario("train:learned", overrides=overrides).track.event
            assert (event.at, event.after_launch) in ((None, 0.2), (9.5, None)), name


@pytest.mark.parametrize("part", ["event", "calm", "pass"])
def test_every_part_has_a_table_of_its_lines(part):
    measured = eyes_open.PARTS[part]
    cell = next(iter(measured.cells))
    assert "," not in cell, "--cells separates cells by commas"
    lines = [
        {"cell": cell, "seed": 1, "success": True, **LINE},
        {"cell": cell, "seed": 2, "success": False, "failure_reason": "no launch", "along_m": None},
    ]
    cells = parts.of_cells(lines, measured.summary)
    assert (cells[0]["first_attempt"], cells[0]["lifted"], cells[0]["laps"]) == (1, 1, [0.75])
    header, (row,) = measured.table(cells)
    assert len(row) == len(header) and "4 mm" in row


def test_launches_are_counted_in_tenths_of_their_probability():
    rows = [
        {"group": "guided", "shape": "oval", "probability": (k + 0.5) / 400, "lifted": k >= 200 or k % 8 == 0}
        for k in range(400)
    ]
    rows.append({"group": "guided", "shape": "random_walk", "probability": None, "lifted": False})
    guided = tenths_of(rows)
    assert [count for count, *_ in guided] == [40] * 10
    assert [lifted for *_, lifted in guided] == [5] * 5 + [40] * 5
    assert guided[0][1] == pytest.approx(0.05) and right(guided) == 1, "the mean probability of the last is 0.95"
    descents = [{"group": "conveyor", "descents": [[0.9, True]] * 9 + [[0.9, False]] * 11}] * 9
    header, table = calibration_table(rows + descents)
    assert [len(row) for row in table] == [len(header)] * 2, "a tenth of the descents from the belt has under 20"
    assert [row[0] for row in table] == ["`train:guided`", "`train:guided`, of these closed tracks"]
    assert table[0][-1] == "1 of 10" and table[0][2] == "5 / 12"
    header, table = calibration_table(rows + 10 * descents)
    assert [row[1] for row in table] == [400, 1800, 400] and table[1][2] == "90 / 45"


CAMERA_LINES = [
    {"cell": "", "seed": 1, "success": True, **LINE},
    {"cell": "", "seed": 2, "success": False, "failure_reason": "missed", "along_m": None},
]


def test_relative_errors_of_all_runs_are_pooled():
    lines = [line | {"cell": "with markers", "relative_m": 5 * [0.004 + k]} for k, line in enumerate(CAMERA_LINES)]
    lines[1]["relative_m"] = [0.006]
    (cell,) = cells = parts.of_cells(lines, eyes_open.PARTS["hand"].summary)
    assert cell["relative_m"] == pytest.approx([0.004, 0.0055]) and cell["lifted"] == 1
    header, (row,) = eyes_open.PARTS["hand"].table(cells)
    assert len(row) == len(header) and row[1:3] == [2, 1] and row[4:] == ["4.0 mm", "5.5 mm", 6]


def test_errors_of_the_position_have_two_directions():
    lines = [line | {"cell": "train:wrist", "errors_m": [[-0.003, 0.001]], "cycles": 2} for line in CAMERA_LINES]
    lines.append({"cell": "train:wrist", "seed": 3, "success": False, "failure_reason": "no launch", "along_m": None})
    cells = parts.of_cells(lines, eyes_open.PARTS["wrist"].summary)
    header, (row,) = eyes_open.PARTS["wrist"].table(cells)
    assert len(row) == len(header) and row[1:3] == [3, 1]
    assert row[4:] == ["1.0 mm", "1.0 mm", "3.0 mm", "3.0 mm", "50 %"]


@pytest.mark.parametrize("part", ["hand", "wrist"])
def test_the_scenarios_of_the_cameras_can_be_loaded(part, monkeypatch):
    scenarios = []
    monkeypatch.setattr(eyes_open, "line", lambda scenario, measures: scenarios.append(scenario) or {"success": True})
    monkeypatch.setattr(eyes_open, "launch_time", lambda scenario: 3.5)
    measured = eyes_open.PARTS[part]
    for cell in measured.cells:
        assert "," not in cell
        assert measured.job(cell, measured.first_seed, False)["success"]
    faults = [[type(fault).__name__ for fault in scenario.faults] for scenario in scenarios]
    expected = {"hand": 2 * [["CalibrationWrong"]], "wrist": [[], ["CameraDark"], ["CameraDark"], []]}
    assert faults == expected[part]


def signal(names, rows):
    rows = np.array(rows, float)
    return Signal(rows[:, 0], rows, names.split())


def test_errors_are_measured_from_a_height_until_contact():
    """A hand above a train at the origin goes down by 1 mm per image; vision sees both 30 mm to one side."""
    times = np.arange(300) / 60
    state = [[t, 1, 0, 0, 0, 0, 0, 0] for t in times]
    log = {
        "truth_train_state": signal("time qw qx qy qz x y z", state),
        "truth_verdict": signal("time left_contact right_contact", [[t, t > 4.5, 0] for t in times]),
        "tool": signal("time x y z yaw", [[t, 0, 0, 0.3005 - k / 1000, 0] for k, t in enumerate(times)]),
        "point": signal("stamp x y z valid", [[t, 0.033, 0.004, 0, 1] for t in times]),
    }
    spans = [PhaseSpan(Phase.TRACK, 0.0, 5.0)]
    errors = measures.relative_errors(log, spans, 0.17)
    assert errors == pytest.approx(140 * [np.hypot(0.033, 0.004)], abs=1e-9)
    log["hand_point"] = signal("stamp x y z valid", [[t, 0.03, 0, 0.3005 - k / 1000, 1] for k, t in enumerate(times)])
    assert measures.relative_errors(log, spans, 0.17) == pytest.approx(140 * [0.005], abs=1e-9)
    along_across, cycles = measures.place_errors(log, spans, 0.17)
    assert cycles == 140 and along_across == [pytest.approx([0.033, 0.004])] * 140
    assert not measures.relative_errors(log, [PhaseSpan(Phase.RETREAT, 0.0, 5.0)], 0.17)


def test_every_open_track_is_one():
    for settings, speeds in eyes_open.OPEN_TRACKS.values():
        for speed in speeds:
            scenario = load_scenario("train:guided", overrides=[*settings, f"track.speed={speed}", "track.start=0"])
            assert scenario.track.length <= 2.0 and scenario.track.speed == speed


@pytest.mark.parametrize("seed", [1, 2])
def test_the_fastest_line_is_within_reach_for_long_enough(seed):
    settings, speeds = eyes_open.OPEN_TRACKS["line"]
    overrides = [*settings, f"track.speed={max(speeds)}", "track.start=0"]
    scenario = load_scenario("train:guided", seed=seed, overrides=overrides)
    reach = resolve(scenario).reach
    track, start = resolve(scenario).placement
    check_track(scenario, track, start, reach)
    assert time_within_reach(scenario, track, start, reach) >= shortest_grasp(scenario)


def test_trains_that_were_lifted_where_they_stood_are_told_apart():
    lines = [
        {"cell": "c", "seed": k, "success": k < 3, **LINE, "launch_speed": v}
        for k, v in enumerate((0.3, 0.0, None, 0.3))
    ]
    (cell,) = parts.of_cells(lines, eyes_open.PARTS["pass"].summary)
    assert (cell["lifted"], cell["lifted_moving"]) == (3, 1)


def test_a_train_that_is_too_fast_is_a_line_of_the_results(monkeypatch):
    monkeypatch.setitem(eyes_open.PASS, "line 1.0 m/s", ("line", 1.0, []))
    row = eyes_open.pass_job("line 1.0 m/s", 1, True)
    assert not row["success"] and row["cause"] == "refused" and "a grasp takes" in row["failure_reason"]
