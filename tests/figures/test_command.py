"""The command `drake-tracker figures`: its figures and numbers, and its answers to bad input."""

import json
from functools import partial

import cv2
import pytest

from drake_tracker import cli
from drake_tracker.figures import command, horizon, loop_runs
from drake_tracker.figures.command import OWN, read_bounds

NAMES = [f"figure_{number:02}" for number in (7, 8, 9, 10, 12, 13, 14, 15)]
NAMES += ["kaiser_response", "error_against_horizon"]
CURVE = {"name": "no one can do better", "stage": "both", "horizon_s": [0.0, 1.5], "rms_m": [0.0003, 0.002]}


def test_every_figure_is_drawn_with_its_numbers(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(loop_runs, "QUICK_DURATION", 1.9)
    monkeypatch.setattr(horizon, "LAPS", 0.6)
    monkeypatch.setattr(horizon, "CLOSED_FROM", 0.4)
    monkeypatch.setattr(command, "render_frames", partial(command.render_frames, width=80))
    bounds = tmp_path / "bounds.json"
    bounds.write_text(json.dumps([CURVE]))
    out = tmp_path / "figures"
    assert cli.main(["figures", "--quick", "--seed", "3", "--out", str(out), "--bounds", str(bounds)]) == 0
    assert sorted(path.stem for path in out.glob("*.png")) == sorted(NAMES)
    for name in NAMES:
        image = cv2.imread(str(out / f"{name}.png"))
        assert image.shape[0] > 600 and image.shape[1] > 1000
        assert (image < 250).any(axis=2).mean() > 0.02, f"{name} is almost empty"
    numbers = json.loads((out / "figures.json").read_text())
    assert set(NAMES) <= set(numbers) and numbers["seed"] == 3
    assert 0.0 < numbers["figure_07"]["kolmogorov_smirnov"] < 1.0
    found = numbers["figure_07"]["jitter_correlation"]
    assert found["low"] < found["coefficient"] < found["high"]
    assert set(numbers["error_against_horizon"]["estimators"]) >= set(horizon.KINDS)
    assert numbers["error_against_horizon"]["bounds"] == [CURVE]
    assert "error_against_horizon.png" in capsys.readouterr().out


@pytest.mark.parametrize(
    "content, said",
    [
        (None, "cannot be read"),
        ("{", "not valid JSON"),
        ("{}", "must hold a list"),
        ('[{"name": "x"}]', "curve 1: a key is missing"),
        (json.dumps([CURVE, {**CURVE, "stage": "later"}]), "curve 2: stage is 'later'"),
        (json.dumps([{**CURVE, "rms_m": [1.0]}]), "the same length"),
        (json.dumps([{**CURVE, "rms_m": ["1", 2]}]), "rms_m is not a list of numbers up to 1e+06"),
        (json.dumps([{**CURVE, "rms_m": [10**400, 2]}]), "rms_m is not a list of numbers up to 1e+06"),
        ("[" * 100_000, "not valid JSON"),
    ],
)
def test_bad_bounds_are_one_line_and_leave_nothing(tmp_path, capsys, content, said):
    path = tmp_path / "bounds.json"
    if content is not None:
        path.write_text(content)
    assert cli.main(["figures", "--out", str(tmp_path / "new"), "--bounds", str(path)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("drake-tracker: --bounds") and said in line
    assert not (tmp_path / "new").exists()


def test_the_package_contains_bounds_for_its_own_drives():
    curves = {curve["stage"]: curve for curve in read_bounds(OWN)}
    assert set(curves) == {"first_lap", "after_closure", "both"}
    at_grasp = {stage: dict(zip(curve["horizon_s"], curve["rms_m"]))[0.75] for stage, curve in curves.items()}
    assert at_grasp["after_closure"] < 0.001 < at_grasp["both"] < at_grasp["first_lap"]


def test_bounds_are_read_unchanged(tmp_path):
    path = tmp_path / "bounds.json"
    path.write_text(json.dumps([CURVE]))
    assert read_bounds(path) == [CURVE]


@pytest.mark.parametrize("arguments, said", [(["--seed", "-1"], "seed must be"), ([], "is not empty")])
def test_nothing_is_overwritten_and_a_bad_seed_is_one_line(tmp_path, capsys, arguments, said):
    (tmp_path / "note.txt").write_text("mine")
    assert cli.main(["figures", "--out", str(tmp_path), *arguments]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert said in line
    assert [path.name for path in tmp_path.iterdir()] == ["note.txt"]
