"""A campaign from its plan to its directory: it goes on where it was stopped, and never loses what it has."""

import csv
import json
import os
import resource
import signal
import sys
from contextlib import suppress

import pytest
from campaign_trials import Stops, die_of_seed_1, here, lose_seed_1, quick

from drake_tracker.campaign.directory import PLAN, TRIALS, Record, read_lines
from drake_tracker.campaign.plan import Lost, make_plan, run_trial
from drake_tracker.campaign.pool import pool
from drake_tracker.campaign.run import carry_out, make_runner, run_campaign
from drake_tracker.campaign.table import require_parquet
from drake_tracker.core.errors import DrakeTrackerError, MachineError, load_extra

VARY = {"track.speed": ["0.1", "0.3"]}


def plan(trials=3, vary=VARY, **options):
    return make_plan("train:learned", trials, vary, **options)


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_a_campaign_writes_its_record_tables_and_plot(tmp_path):
    told = []
    campaign = carry_out(plan(), here, tmp_path / "c", progress=lambda *now: told.append(now), work=quick)
    assert [(rate.successes, rate.trials) for rate in campaign.rates] == [(3, 3), (1, 3)]
    assert [(row["settings"]["track.speed"], row["seed"]) for row in campaign.rows] == [
        (speed, seed) for speed in ("0.1", "0.3") for seed in (0, 1, 2)
    ]
    assert told == [(0, 6, 0), (1, 6, 1), (2, 6, 1), (3, 6, 2), (4, 6, 3), (5, 6, 4), (6, 6, 4)]
    assert set(contents(tmp_path / "c")) == {PLAN, TRIALS, "trials.csv", "rates.csv", "success.png"}
    with (tmp_path / "c" / "trials.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 6 and list(rows[0])[:4] == ["track.speed", "seed", "success", "failure_reason"]
    assert [row["success"] for row in rows] == ["true", "true", "true", "false", "true", "false"]
    assert "all" in campaign.lines()[-1]


def test_without_a_directory_nothing_is_written(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert len(carry_out(plan(), here, work=quick).rows) == 6
    assert contents(tmp_path) == {}


def test_an_interrupted_campaign_can_be_continued(tmp_path):
    first = Stops(4)
    stopped = carry_out(plan(), first, tmp_path / "a", work=quick)
    assert stopped.interrupted and len(stopped.rows) == 4
    kept = (tmp_path / "a" / TRIALS).read_bytes()
    second = Stops(99)
    told = []
    campaign = carry_out(plan(), second, tmp_path / "a", progress=lambda *now: told.append(now), work=quick)
    assert not campaign.interrupted and told[0] == (4, 6, 3)
    assert len(second.run) == 2 and not set(first.run) & set(second.run)
    assert (tmp_path / "a" / TRIALS).read_bytes().startswith(kept)
    carry_out(plan(), here, tmp_path / "b", work=quick)
    for name in ("trials.csv", "rates.csv"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()
    assert carry_out(plan(), Stops(0, AssertionError("nothing is left to run")), tmp_path / "a", work=quick).rows


def test_a_campaign_can_be_extended(tmp_path):
    carry_out(plan(2), here, tmp_path, work=quick)
    runner = Stops(99)
    assert len(carry_out(plan(3), runner, tmp_path, work=quick).rows) == 6 and len(runner.run) == 2


def test_a_lost_trial_has_no_line_and_is_run_again(tmp_path):
    campaign = carry_out(plan(vary={}), here, tmp_path, work=lose_seed_1)
    assert [row["seed"] for row in campaign.rows] == [0, 2]
    assert campaign.rates[0].trials == 2
    assert campaign.lines()[-1] == "lost: seed 1: MachineError: no renderer; the same command runs it again"
    assert [row["seed"] for row in carry_out(plan(vary={}), here, tmp_path, work=quick).rows] == [0, 1, 2]


def test_a_worker_that_dies_costs_only_its_own_trial(tmp_path):
    campaign = carry_out(plan(4, vary={}), pool(2), tmp_path, work=die_of_seed_1)
    assert [row["seed"] for row in campaign.rows] == [0, 2, 3]
    ((trial, reason),) = campaign.lost
    assert trial.scenario.seed == 1 and reason == "its worker died (exit code -9)"


@pytest.mark.parametrize(
    "change, said",
    [
        (lambda: make_plan("train:line", 3, VARY), "its scenario is train:learned, not train:line"),
        (lambda: plan(2), "it has 3 trials, not 2; the number can only grow"),
        (lambda: plan(first_seed=5), "its first seed is 0, not 5"),
        (lambda: plan(vary={"track.speed": ["0.1", "0.2"]}), 'its vary is {"track.speed": ["0.1", "0.3"]}, not'),
        (lambda: plan(overrides=["duration=9"]), 'its overrides is [], not ["duration=9"]'),
    ],
)
def test_campaigns_are_never_mixed(tmp_path, change, said):
    carry_out(plan(), here, tmp_path, work=quick)
    before = contents(tmp_path)
    with pytest.raises(DrakeTrackerError) as caught:
        carry_out(change(), here, tmp_path, work=quick)
    assert said in str(caught.value) and "\n" not in str(caught.value)
    assert contents(tmp_path) == before


@pytest.mark.parametrize(
    "key, value, said",
    [
        ("drake_tracker", "0.0.9", "it was made by drake_tracker 0.0.9, and this is"),
        ("settings_sha256", "0", "the settings of its scenario have changed since"),
    ],
)
def test_a_campaign_of_another_version_or_scenario_file_is_refused(tmp_path, key, value, said):
    carry_out(plan(), here, tmp_path, work=quick)
    found = json.loads((tmp_path / PLAN).read_text())
    (tmp_path / PLAN).write_text(json.dumps({**found, key: value}))
    before = contents(tmp_path)
    with pytest.raises(DrakeTrackerError, match=said):
        carry_out(plan(), here, tmp_path, work=quick)
    assert contents(tmp_path) == before


@pytest.mark.parametrize(
    "name, text, said",
    [
        (PLAN, '{"scenario": "tr', "campaign.json: damaged"),
        (PLAN, None, "holds no campaign"),
        (TRIALS, '{"seed": 0}\nrubbish\n{"seed": 1}\n', "trials.jsonl line 2: not a result"),
        (TRIALS, "[" * 9999 + "\n", "trials.jsonl line 1: not a result"),
        (TRIALS, '{"seed": 0, "settings": {}}\n', "trials.jsonl: result 1 is not the result of a trial"),
        (TRIALS, '{"seed": 0, "settings": {"a": []}, "success": true}\n', "result 1 is not the result of a trial"),
        (TRIALS, '{"seed": true, "settings": {}, "success": true}\n', "result 1 is not the result of a trial"),
        (TRIALS, '{"seed": 0, "settings": {}, "success": "no"}\n', "result 1 is not the result of a trial"),
        (PLAN, "[" * 9999, "campaign.json: damaged"),
    ],
)
def test_a_damaged_directory_is_refused_and_unchanged(tmp_path, name, text, said):
    carry_out(plan(), here, tmp_path, work=quick)
    (tmp_path / name).unlink()
    if text is not None:
        (tmp_path / name).write_text(text)
    before = contents(tmp_path)
    with pytest.raises(DrakeTrackerError, match=said):
        carry_out(plan(), here, tmp_path, work=quick)
    assert contents(tmp_path) == before


def test_only_an_incomplete_last_line_is_dropped(tmp_path):
    carry_out(plan(), here, tmp_path, work=quick)
    whole = (tmp_path / TRIALS).read_bytes()
    (tmp_path / TRIALS).write_bytes(whole[:-20])
    runner = Stops(99)
    campaign = carry_out(plan(), runner, tmp_path, work=quick)
    assert len(runner.run) == 1 and (tmp_path / TRIALS).read_bytes() == whole
    assert campaign.notes == (
        f"{tmp_path / TRIALS}: the last line is incomplete and was dropped; its trial is run again",
    )


def test_a_repeated_line_counts_once(tmp_path):
    before = carry_out(plan(), here, tmp_path, work=quick)
    lines = (tmp_path / TRIALS).read_bytes().splitlines(keepends=True)
    (tmp_path / TRIALS).write_bytes(b"".join([*lines, lines[0], lines[-1].replace(b"true", b"false")]))
    told = []
    after = carry_out(plan(), Stops(0), tmp_path, progress=lambda *now: told.append(now), work=quick)
    assert after.rows == before.rows and after.rates == before.rates and told[0] == (6, 6, 4)
    assert after.notes == (f"{tmp_path / TRIALS}: results of a trial that is there already: 2; its first one counts",)


def test_ctrl_c_while_a_line_is_written_takes_effect_afterwards(tmp_path, monkeypatch):
    fsync = os.fsync

    def interrupted(file):
        if os.path.sameopenfile(file, os.open(tmp_path / TRIALS, os.O_RDONLY)):
            signal.raise_signal(signal.SIGINT)
        fsync(file)

    monkeypatch.setattr("os.fsync", interrupted)
    stopped = carry_out(plan(), here, tmp_path, work=quick)
    assert stopped.interrupted and len(stopped.rows) == len(read_lines(tmp_path / TRIALS)) == 1


def test_a_complete_last_line_without_newline_is_kept(tmp_path):
    (tmp_path / "r.jsonl").write_text('{"a":1}\n{"a":2}')
    with Record(tmp_path / "r.jsonl") as record:
        record.append({"a": 3})
    assert read_lines(tmp_path / "r.jsonl") == [{"a": 1}, {"a": 2}, {"a": 3}]


def test_a_full_disk_is_one_line_and_whole_lines_are_kept(tmp_path):
    carry_out(plan(), Stops(2), tmp_path, work=quick)
    size = (tmp_path / TRIALS).stat().st_size
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size + size // 2 + 30, hard))  # space for one line and part of another
    try:
        with pytest.raises(DrakeTrackerError) as caught:
            carry_out(plan(), here, tmp_path, work=quick)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert "trials.jsonl: File too large; 3 of 6 trials are kept, continue with --out" in str(caught.value)
    assert len(read_lines(tmp_path / TRIALS)) == 3
    assert len(carry_out(plan(), here, tmp_path, work=quick).rows) == 6


@pytest.mark.parametrize("name", [PLAN, TRIALS])
def test_a_pipe_in_place_of_a_file_does_not_block(tmp_path, name):
    carry_out(plan(), here, tmp_path, work=quick)
    (tmp_path / name).unlink()
    os.mkfifo(tmp_path / name)
    with pytest.raises(DrakeTrackerError, match=f"{name}: "):
        carry_out(plan(), here, tmp_path, work=quick)


@pytest.mark.parametrize("name", [PLAN, TRIALS, "trials.csv", "rates.csv"])
def test_a_link_in_place_of_a_file_is_not_followed(tmp_path, name):
    out, outside = tmp_path / "out", tmp_path / "outside"
    carry_out(plan(), here, out, work=quick)
    outside.write_text("precious")
    (out / name).unlink()
    (out / name).symlink_to(outside)
    with suppress(DrakeTrackerError):
        carry_out(plan(), here, out, work=quick)
    assert outside.read_text() == "precious"


def test_two_campaigns_do_not_share_a_directory(tmp_path):
    carry_out(plan(), Stops(1), tmp_path, work=quick)
    with Record(tmp_path / TRIALS), pytest.raises(DrakeTrackerError, match="another process is writing to it"):
        carry_out(plan(), here, tmp_path, work=quick)
    assert len(read_lines(tmp_path / TRIALS)) == 1


def test_a_campaign_that_cannot_start_leaves_no_directory(tmp_path):
    with pytest.raises(DrakeTrackerError, match="^no scheduler$"):
        carry_out(plan(), Stops(0, DrakeTrackerError("no scheduler")), tmp_path / "c", work=quick)
    assert contents(tmp_path) == {}


@pytest.mark.parametrize(
    "options, said",
    [({"workers": 0}, "--workers 0"), ({"workers": 2, "scheduler": "tcp://h:1"}, "--workers 2: is for this machine")],
)
def test_bad_runners_are_one_line(options, said, monkeypatch):
    monkeypatch.setattr("drake_tracker.campaign.cluster.load_extra", lambda *_: None)
    with pytest.raises(DrakeTrackerError, match=said):
        make_runner(**options)


@pytest.mark.parametrize(
    "package, call",
    [
        ("pyarrow", require_parquet),
        ("distributed", lambda: make_runner(scheduler="tcp://localhost:1")),
    ],
)
def test_a_missing_optional_package_is_one_line(package, call, monkeypatch):
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(DrakeTrackerError, match=r"pip install 'drake-tracker\[(cluster|parquet)\]'"):
        call()


def test_an_optional_package_that_does_not_load_is_one_line(tmp_path, monkeypatch):
    (tmp_path / "unbuilt.py").write_text("raise AttributeError('built for\\nanother numpy')")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(DrakeTrackerError, match=r"--parquet: unbuilt .* \(built for another numpy\); pip"):
        load_extra("unbuilt", "parquet", "--parquet")


@pytest.fixture
def simulated(monkeypatch):
    def simulate(scenario):
        if isinstance(simulate.effect, BaseException):
            raise simulate.effect
        return simulate.effect

    monkeypatch.setattr("drake_tracker.run.simulation.simulate", simulate)
    return simulate


def test_a_trial_is_a_line_with_the_summary_of_its_run(simulated):
    simulated.effect = {"scenario": "train", "seed": 7, "success": True, "failure_reason": None}
    (job,) = plan(1, vary={"track.speed": [0.2]}, first_seed=7).jobs()
    line = run_trial(job)
    assert line.pop("wall_s") >= 0.0
    assert line == {"settings": {"track.speed": "0.2"}, **simulated.effect}


def test_an_exception_is_a_failed_run_and_a_machine_error_a_lost_trial(simulated):
    (job,) = plan(1, vary={}).jobs()
    for kind in (RuntimeError, SystemExit):  # Drake raises SystemExit for numbers that are not finite
        simulated.effect = kind("no\nsolution")
        line = run_trial(job)
        assert not line["success"] and line["failure_reason"] == f"{kind.__name__}: no solution"
    for error in (MachineError("no renderer"), MemoryError(), OSError(28, "No space left on device")):
        simulated.effect = error
        assert isinstance(run_trial(job), Lost)


def test_a_missing_renderer_is_reported_before_the_first_trial(monkeypatch, tmp_path):
    def refuse():
        raise MachineError("the renderer does not work")

    monkeypatch.setattr("drake_tracker.core.system_check.require_renderer", refuse)
    with pytest.raises(MachineError):
        run_campaign("train:learned", 1, workers=1, out=tmp_path / "c")
    assert contents(tmp_path) == {}


def test_a_worker_runs_a_real_simulation(tmp_path):
    overrides = ["track.kind=circle", "track.speed=0.3", "duration=0.5"]
    campaign = run_campaign("train:learned", 1, overrides=overrides, vision="measured", workers=1, out=tmp_path)
    (row,) = campaign.rows
    assert row["scenario"] == "train:learned" and row["simulated_s"] == 0.5 and row["failure_reason"]
    assert (campaign.table["success"], campaign.table["seed"]) == ([False], [0])


def test_a_custom_part_that_cannot_be_made_is_reported_before_the_first_trial(tmp_path):
    overrides = ["vision=!Measured {}", "estimator=!Custom {call: no_such_module.Estimator}"]
    with pytest.raises(DrakeTrackerError, match="there is no module no_such_module"):
        run_campaign("train:learned", 1, overrides=overrides, workers=1, out=tmp_path / "c")
    assert contents(tmp_path) == {}
