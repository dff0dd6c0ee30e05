"""The comparison of two revisions: translated names, compared files, and cases that the package can run."""

import json
from pathlib import Path

import numpy as np
import pytest
from golden_parts.cases import make_cases, needs_inputs
from golden_parts.files import (
    compare_array,
    compare_arrays,
    compare_folders,
    compare_tables,
    is_volatile,
    leaves,
    read_table,
)
from golden_parts.names import KINDS, RENAMES, Names, Rename, applicable

from drake_tracker.tasks import list_scenarios

TIMES = np.array([0.0, 0.5, 1.0])
SAME = Names([])


def log(**signals):
    """The arrays of a log, its signals given as {column: samples}."""
    arrays = {}
    for name, columns in signals.items():
        arrays[name] = np.column_stack(list(columns.values()))
        arrays[f"{name}.time"] = TIMES
        arrays[f"{name}.names"] = np.array(list(columns))
    return arrays


def test_names_of_one_commit_are_exchanged_simultaneously():
    names = Names([Rename("1", "scenario", "train", "train:paper"), Rename("1", "scenario", "train:guided", "train")])
    assert names.before("scenario", "train") == "train:paper"
    assert names.before("scenario", "train:guided") == "train"
    assert names.before("scenario", "train:wrist") == "train:wrist"
    assert names.before("setting", "train") == "train"


def test_a_name_that_several_commits_changed_is_traced_back():
    names = Names([Rename("2", "field", "third", "second"), Rename("1", "field", "second", "first")])
    assert names.before("field", "third") == "first"


def test_a_row_holds_for_what_belongs_to_the_name_unless_it_has_its_own():
    names = Names([Rename("1", "setting", "path", "track"), Rename("1", "setting", "path.speed", "track.velocity")])
    assert names.before("setting", "path.kind") == "track.kind"
    assert names.before("setting", "path.speed") == "track.velocity"
    assert names.before("setting", "pathway") == "pathway"


def test_what_was_added_has_no_earlier_name_and_what_was_removed_is_not_kept():
    names = Names(
        [Rename("2", "field", None, "old"), Rename("2", "field", "new", None), Rename("1", "field", "old", "a")]
    )
    assert names.before("field", "new.x") is None
    assert names.kept("field", "a") is None
    assert names.kept("field", "old") == "old"


def test_rows_apply_only_before_their_commit():
    assert {row.commit for row in applicable(RENAMES, lambda commit: commit == RENAMES[0].commit)} == {
        row.commit for row in RENAMES
    } - {RENAMES[0].commit}


def test_rows_of_the_table_are_well_formed():
    for row in RENAMES:
        assert row.kind in KINDS and len(row.commit) == 40 and (row.now or row.before)
    commits = [row.commit for row in RENAMES]
    assert commits == sorted(commits, key=commits.index), "the rows of a commit must follow each other"


def test_commands_are_translated():
    names = Names([Rename("1", "scenario", "train", "train:paper"), Rename("1", "setting", "path", "track")])
    command = ("run", "train", "--set", "path.speed=0.2", "--out", "path")
    assert names.command(command) == ("run", "train:paper", "--set", "track.speed=0.2", "--out", "path")
    assert Names([Rename("1", "setting", "path", None)]).command(command) is None


def test_arrays_are_equal_bit_for_bit_and_nan_equals_nan():
    one = np.array([1.0, np.nan, 0.0])
    assert compare_array(one, one.copy()) is None
    assert compare_array(one, np.array([1.0, np.nan, -0.0]))[0] == ", row 2"
    assert compare_array(one, np.nextafter(one, 2.0))[1:3] == ("1.0", "1.0000000000000002")
    assert compare_array(one, one.astype(np.float32))[0] == " has another type"
    assert compare_array(one[:, None], one[None])[0] == " has another shape"
    assert compare_array(np.array(["a"]), np.array(["a"], dtype="<U9")) is None
    assert compare_array(np.array(1.0), np.array(2.0))[1:3] == ("1.0", "2.0")


def test_the_first_difference_names_column_row_and_time():
    now, base = (log(point={"x": [0.0, 1.0, 2.0], "y": [0.0, 1.0, y]}) for y in (2.0, 3.0))
    (found,) = compare_arrays("run/log.npz", now, base, SAME)
    assert found.place == "run/log.npz: point, column y, row 2 at 1 s"
    assert (found.now, found.base, found.time) == ("2.0", "3.0", 1.0)


def test_a_shorter_log_differs_where_it_ends():
    where, now, base, time = compare_array(np.zeros((3, 1)), np.zeros((2, 1)), TIMES)
    assert (where, now, base, time) == (", row 2 at 1 s: the shorter one ends", "3 rows", "2 rows", 1.0)


def test_signals_and_columns_are_compared_under_their_earlier_names():
    now = log(path={"x": [0.0, 1.0, 2.0], "z": [5.0] * 3}, extra={"a": [0.0] * 3})
    base = log(prediction={"u": [0.0, 1.0, 2.0]})
    rows = [
        Rename("1", "signal", "path", "prediction"),
        Rename("1", "column", "path.x", "prediction.u"),
        Rename("1", "column", "path.z", None),
        Rename("1", "signal", "extra", None),
    ]
    assert not compare_arrays("log.npz", now, base, Names(rows))
    missing = {difference.place for difference in compare_arrays("log.npz", now, base, Names(rows[:3]))}
    assert missing == {f"log.npz: array extra{part}" for part in ("", ".names", ".time")}


def test_fields_are_compared_except_volatile_and_added_ones():
    now = [{"lag.min": 0.25, "new": 1, "wall_time_s.build": 3.0}]
    base = [{"lag.min": 0.25, "wall_time_s.build": 2.0}]
    assert not compare_tables("summary.json", now, base, Names([Rename("1", "field", "new", None)]), "field")
    (found,) = compare_tables("summary.json", now, base, SAME, "field")
    assert found == ("summary.json: new", "1", "missing", np.inf)


@pytest.mark.parametrize("pair", [(1, 1.0), (True, 1), (0.0, -0.0), (None, "")])
def test_fields_of_another_type_differ(pair):
    assert compare_tables("a.json", *([{"a": value}] for value in pair), SAME, "field")


def test_a_table_names_the_first_row_of_each_column():
    now, base = ([{"stamp": "0.1", "x": "1"}, {"stamp": "0.2", "x": x}, {"stamp": "0.3", "x": x}] for x in "23")
    (found,) = compare_tables("track.csv", now, base, SAME, "field")
    assert (found.place, found.time) == ("track.csv: row 2, x", 0.2)


def test_volatile_fields_are_whole_names():
    assert is_volatile("package_versions.drake") and is_volatile("wall_s")
    assert not is_volatile("target_name") and not is_volatile("lag_s.min")


def test_leaves_keep_what_is_empty():
    assert dict(leaves({"a": {}, "b": [1, {"c": None}]})) == {"a": {}, "b.0": 1, "b.1.c": None}


def test_tags_of_a_scenario_are_compared(tmp_path):
    file = tmp_path / "scenario.yaml"
    file.write_text("scenario:\n  arm: !UR5e {}\n  vision: !Measured\n    lag_cycles: 15\n")
    assert read_table(file) == [{"arm.!": "UR5e", "vision.!": "Measured", "vision.lag_cycles": 15}]


def test_folders_are_compared_file_by_file_and_sorted_by_time(tmp_path):
    sides = tmp_path / "now", tmp_path / "base"
    for number, side in enumerate(sides):
        (side / "run").mkdir(parents=True)
        np.savez(side / "run" / "log.npz", **log(late={"x": [0.0, 0.0, number]}, early={"x": [0.0, number, 0.0]}))
        (side / "run" / "summary.json").write_text(json.dumps({"run": str(side / "run"), "attempts": number}))
    (sides[1] / "more.yaml").write_text("{}")
    found = compare_folders(*sides, SAME, [sides[0]], [sides[1]])
    assert [difference.place for difference in found] == [
        "more.yaml",
        "run/log.npz: early, column x, row 1 at 0.5 s",
        "run/log.npz: late, column x, row 2 at 1 s",
        "run/summary.json: attempts",
    ]


def test_every_scenario_of_the_package_is_a_case():
    cases = {case.name: case for case in make_cases(Path("inputs"))}
    for name, _ in list_scenarios():
        assert cases[name].commands[0][:2] == ("run", name)
    assert {name for name, case in cases.items() if needs_inputs(case, Path("inputs"))} == {
        *("track:one-camera", "track:two-cameras", "track:several", "calibrate:photographs")
    }
