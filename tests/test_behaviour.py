"""The records of behaviour: what counts as a difference, and which results rest on another behaviour."""

import gzip
import importlib
import itertools
import json
import subprocess
import sys
from copy import deepcopy
from pathlib import Path

import behaviour
import pytest
from shared import behaviour_rows, parts, stored
from shared.stored import read_lines, result_files

from drake_tracker.scenarios.reader import describe_settings
from drake_tracker.tasks import list_scenarios, load_scenario

REPOSITORY = Path(__file__).parents[1]
RECORDS = json.loads((REPOSITORY / "benchmarks" / "behaviour.json").read_text(encoding="utf-8"))
ENTRIES = [name for name, _ in list_scenarios()]
all_results = importlib.import_module("all")
"""`benchmarks/all.py`, whose name is that of a function."""


def changed(entry, change):
    """The record of an entry, changed by a function of it."""
    record = deepcopy(RECORDS[entry])
    change(record)
    return record


def test_every_packaged_entry_has_a_run_and_a_record():
    assert list(behaviour.PLANS) == ENTRIES == list(RECORDS)
    assert all(record["number"] == len(record["reasons"]) for record in RECORDS.values())


@pytest.mark.parametrize("entry", ENTRIES)
def test_records_have_the_settings_of_today(entry):
    """A changed default is noticed at once; the runs of `benchmarks/behaviour.py` notice all else."""
    now = {key: value for key, value, *_ in describe_settings(load_scenario(entry)) if key not in behaviour.IGNORED}
    assert RECORDS[entry]["settings"] == now, f'python benchmarks/behaviour.py --update {entry} "reason"'


@pytest.mark.parametrize("entry", ENTRIES)
def test_a_record_equals_itself_and_has_something_to_compare(entry):
    assert behaviour.differences(RECORDS[entry], deepcopy(RECORDS[entry])) == []
    assert len(RECORDS[entry]["means"]) > 30


def test_rounding_is_no_difference():
    def shift(record):
        record["means"]["point.x"][0] += 1e-9
        record["means"]["centroid_right.pixel_count"][1] += 0.01
        record["phases"][2][1] += 0.03

    assert behaviour.differences(RECORDS["train"], changed("train", shift)) == []


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("point.x", lambda record: record["means"]["point.x"].__setitem__(0, record["means"]["point.x"][0] + 1e-4)),
        ("centroid_left.pixel_count", lambda record: record["means"]["centroid_left.pixel_count"].__setitem__(1, 1.0)),
        ("ahead.std", lambda record: record["means"]["ahead.std"].__setitem__(3, 0.1)),
        ("start of INTERCEPT", lambda record: record["phases"][2].__setitem__(1, record["phases"][2][1] + 0.1)),
        ("phases were", lambda record: record["phases"].pop()),
        ("share of verdict 6", lambda record: record["gate"].__setitem__("6", 0.5)),
        ("offset at the touch", lambda record: record["touch"].__setitem__("offset", [0.005, 0.0])),
        ("outcome was", lambda record: record["outcome"].__setitem__("success", False)),
        ("grasp.settle_time was", lambda record: record["settings"].__setitem__("grasp.settle_time", "1")),
        ("point.z", lambda record: record["means"].__setitem__("point.z", [float("nan")] * 5)),
    ],
)
def test_a_difference_is_named(name, change):
    found = behaviour.differences(RECORDS["train"], changed("train", change))
    assert len(found) >= 1
    assert all(name in line for line in found)


def test_every_result_carries_numbers_of_known_entries():
    for path in result_files():
        for result in behaviour_rows.results_of(path):
            numbers = result.get("made_by", result)["behaviour"]
            assert set(numbers) <= set(ENTRIES), path.name
            assert all(number is None or 1 <= number <= RECORDS[name]["number"] for name, number in numbers.items())


def test_each_benchmark_names_what_its_results_rest_on():
    stems = {path.stem for path in result_files()} - {"tracking_arc_length"}
    assert stems <= set(behaviour_rows.RESTS_ON)
    assert behaviour_rows.rests_on("train_grasp", {"scenario": "train:guided", "estimator": "closed_path"}) == (
        "train:guided",
    )
    assert behaviour_rows.rests_on("several", {"part": "cost"}) == ("train:guided", "train:two")
    assert behaviour_rows.behaviour_of("pytest", {}) == {}


def test_a_result_of_another_number_is_not_current(monkeypatch):
    row = {"behaviour": {"train": RECORDS["train"]["number"]}}
    assert behaviour_rows.is_current(row)
    assert behaviour_rows.is_current({"made_by": row})
    assert behaviour_rows.other_behaviours({"behaviour": {"train": None, "ball": 1}}) == ["train"]
    raised = {**RECORDS, "train": {**RECORDS["train"], "number": RECORDS["train"]["number"] + 1}}
    monkeypatch.setattr(behaviour_rows, "behaviour_records", lambda: raised)
    assert not behaviour_rows.is_current(row)


def marked(text, rows):
    """What docs/tables makes of a block, in a process of its own: benchmarks/estimation also has a module "tables"."""
    code = (
        "import json, sys; sys.path[:0] = ['docs', 'benchmarks']\n"
        "from tables.marks import marked\n"
        f"print(marked({text!r}, json.loads({json.dumps(rows)!r})), end='')"
    )
    run = subprocess.run([sys.executable, "-c", code], cwd=REPOSITORY, capture_output=True, text=True, check=True)
    return run.stdout


def test_tables_mark_the_rows_of_another_behaviour():
    text = "| cell | lifted |\n|---|---|\n| oval | 3 |\n| circle | 4 |\n\n*Seeds.*"
    number = RECORDS["train"]["number"]
    good, old = {"cell": "oval", "behaviour": {"train": number}}, {"cell": "circle", "behaviour": {"train": None}}
    assert marked(text, [good]) == text
    made = marked(text, [good, old]).split("\n")
    assert made[2:4] == ["| oval | 3 |", "| circle † | 4 |"]
    assert made[-1].startswith("*† ")
    assert "`train`" in made[-1]
    assert marked(text, [{"behaviour": {"train": None}}]).count("†") == 3, "a part without rows of its own: all"


@pytest.mark.parametrize("page", ["README.md", "docs/results/index.md", "docs/explanation/papers.md"])
def test_no_result_of_another_behaviour_stands_on_a_front_page(page):
    assert "†" not in (REPOSITORY / page).read_text(encoding="utf-8"), "measure it again, or take it off the page"


def test_every_listed_result_exists_and_its_commands_are_scripts():
    names = {path.name for path in result_files()}
    assert set(all_results.COMMANDS) <= names
    for command in itertools.chain(*all_results.COMMANDS.values()):
        assert (all_results.HERE / command.split()[0]).is_file(), command
    overview = all_results.overview()
    assert {path.name for path, *_ in overview} == names
    assert overview[0][0].name == "train_grasp.jsonl"
    assert all(all_results.cost(results, len(results)) > 0.0 for _, results, *_ in overview)
    absent = {path.name: count for path, _, _, count in overview}
    assert absent["ball.jsonl"] == absent["rivals.jsonl"] == 0, "published with all runs of their commands"


def test_runs_that_a_command_has_not_made_are_missing(monkeypatch, tmp_path):
    path = tmp_path / "ball.jsonl"
    command = f"ball.py --cells puma,seven_joint --first-seed 7 --seeds 3 --results {path}"
    monkeypatch.setattr(all_results, "COMMANDS", {"ball.jsonl": (command,), "other.json": ("fuzz.py",)})
    assert all_results.missing(path) == 6
    path.write_text(json.dumps({"cell": "puma", "seed": 8}) + "\n")
    assert all_results.missing(path) == 5
    assert all_results.missing(tmp_path / "other.json") == all_results.missing(tmp_path / "unlisted.jsonl") == 0
    assert len(read_lines(path)) == 1, "nothing was run"


def test_only_stale_lines_are_moved_away(tmp_path):
    today, path = RECORDS["train:hill"]["number"], tmp_path / "runs.jsonl"
    rows = [{"seed": seed, "behaviour": {"train:hill": number}} for seed, number in enumerate([1, None, today, today])]
    path.write_text("".join(json.dumps(row) + "\n" for row in rows))
    all_results.move_stale(path, tmp_path / "stale")
    assert not path.exists() and read_lines(path) == rows[2:]
    assert read_lines(tmp_path / "stale" / "runs.jsonl") == rows[:2]
    all_results.move_stale(path, tmp_path / "stale")
    assert read_lines(path) == rows[2:] and read_lines(tmp_path / "stale" / "runs.jsonl") == rows[:2]


def test_a_command_that_fails_or_outlasts_the_time_is_told_apart(monkeypatch, tmp_path):
    monkeypatch.setattr(all_results, "HERE", tmp_path)
    (tmp_path / "bad.py").write_text("raise SystemExit(3)")
    (tmp_path / "long.py").write_text("import time; time.sleep(60)")
    assert all_results.run("bad.py", 30.0) == 3
    assert all_results.run("long.py", 0.2) is None


def test_trials_of_parts_name_their_behaviour_and_count_until_it_changes(tmp_path):
    def trial(cell, seed, quick):
        return {"success": True}

    row = parts.run_one(("wrist", trial, "left", 1, False, "a" * 40))
    row |= behaviour_rows.behaviour_of("eyes_open", row)
    assert set(row["behaviour"]) == {"train:wrist", "train:guided"}
    stale = {**row, "seed": 2, "behaviour": {**row["behaviour"], "train:wrist": 0}}
    unknown = {**row, "seed": 3, "behaviour": {}}
    path = tmp_path / "wrist.jsonl"
    path.write_text("".join(json.dumps(each) + "\n" for each in (row, stale, unknown)))
    part = parts.Part(trial, {"left": 0}, 1, None, None)
    assert parts.measure("wrist", part, path, [], None, False, 1, "b" * 40) == [row]
    assert parts.measure("wrist", part, path, [], None, False, 1, "a" * 40) == [row, stale, unknown]


def test_a_benchmark_that_adds_nothing_leaves_its_compressed_result_as_it_is(monkeypatch, tmp_path):
    monkeypatch.setattr(stored, "RESULTS", tmp_path.resolve())
    lines, packed = tmp_path / "runs.jsonl", tmp_path / "runs.jsonl.gz"
    packed.write_bytes(gzip.compress(b'{"seed":1}\n', compresslevel=1, mtime=5))  # as another zlib packs it
    before = packed.read_bytes()
    with stored.record(lines):
        pass
    assert packed.read_bytes() == before
    with stored.record(lines) as opened:
        opened.append({"seed": 2})
    assert read_lines(lines) == [{"seed": 1}, {"seed": 2}]
    assert list(tmp_path.iterdir()) == [packed]
