"""Tests of recordings that cannot be replayed: one clear line, and no files are left."""

import json
import shutil

import numpy as np
import pytest

from drake_tracker import cli
from drake_tracker.replay.recording import open_recording
from drake_tracker.run.camera_images import image_file


def cut(path, part=0.5):
    path.write_bytes(path.read_bytes()[: int(part * path.stat().st_size)])


def change_log(run, change):
    with np.load(run / "log.npz") as arrays:
        arrays = dict(arrays)
    change(arrays)
    np.savez_compressed(run / "log.npz", **arrays)


def rename_a_field(arrays):
    arrays["point.names"] = np.array(["stamp", "x", "y", "z", "width", "valid"])


def keep_one_sample(arrays):
    arrays["point"], arrays["point.time"] = arrays["point"][:1], arrays["point.time"][:1]


def end_after_an_hour(arrays):
    arrays["point.time"] = arrays["point.time"].copy()
    arrays["point.time"][-1] = 3600.0


def drop_a_sample(arrays):
    arrays["target"], arrays["target.time"] = (np.delete(arrays[name], 5, axis=0) for name in ("target", "target.time"))


@pytest.fixture
def run(measured_run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copytree(measured_run, tmp_path / "run")
    return tmp_path / "run"


def made(folder):
    """Returns all files in a folder, except the empty folder of replays."""
    return sorted(path for path in folder.rglob("*") if path.name != "runs")


def error_of(capsys, tmp_path, *arguments, run="run"):
    """Returns the line with which ``replay`` rejects a run, and checks that no files were written."""
    before = made(tmp_path)
    assert cli.main(["replay", str(run), *arguments]) == 2
    captured = capsys.readouterr()
    lines = captured.err.splitlines()
    assert captured.out == "" and made(tmp_path) == before
    assert len(lines) == 1 and lines[0].startswith("drake-tracker: "), lines
    return lines[0]


@pytest.mark.parametrize(
    "damage, message",
    [
        (shutil.rmtree, "there is no run directory"),
        (lambda run: (run / "scenario.yaml").unlink(), "no scenario.yaml; this is not a run directory"),
        (lambda run: (run / "log.npz").unlink(), "no log.npz; a run writes it at its end, but this one was stopped"),
        (lambda run: cut(run / "log.npz"), "damaged or incomplete"),
        (lambda run: cut(run / "log.npz", 0.0), "damaged or incomplete"),
        (lambda run: (run / "log.npz").write_bytes(b"PK\x05\x06" + bytes(18)), "the signal command is missing"),
        (lambda run: (run / "scenario.yaml").write_text("a: [1"), "not valid YAML"),
        (lambda run: change_log(run, rename_a_field), "the signal point has fields that differ from this version"),
        (lambda run: change_log(run, lambda arrays: arrays.pop("command")), "the signal command is missing"),
        (lambda run: change_log(run, keep_one_sample), "too few samples"),
        (lambda run: change_log(run, end_after_an_hour), "the samples of the signal point are not one period apart"),
        (lambda run: change_log(run, drop_a_sample), "the samples of the signal target are not one period apart"),
    ],
)
def test_an_incomplete_run_directory(run, capsys, tmp_path, damage, message):
    damage(run)
    assert message in error_of(capsys, tmp_path)


@pytest.mark.parametrize(
    "arguments, message",
    [
        (["--set", "track.speed=0.2"], "track.speed has no effect in a replay from points; these settings have"),
        (["--set", "cameras.calibration=other.yaml"], "cameras.calibration has no effect in a replay from points"),
        (["--set", "vision=!Rendered {}"], "vision has no effect"),
        (["--set", "estimator.sistematic_std=1"], "did you mean estimator.systematic_std?"),
        (["--from", "centroids"], "the log has no centroids"),
        (["--from", "images"], "there are no images; record them with drake-tracker run --record-images"),
    ],
)
def test_wrong_changes_and_starts(run, capsys, tmp_path, arguments, message):
    assert message in error_of(capsys, tmp_path, *arguments)


def test_cameras_and_detector_have_no_effect_in_a_replay_from_centroids(rendered_run, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for change in ("cameras.noise=0", "vision.method.detector.centroid=mean"):
        line = error_of(capsys, tmp_path, "--set", change, run=rendered_run)
        assert f"--set {change}: {change.split('=')[0]} has no effect in a replay from centroids" in line
        assert line.endswith("estimator, link, guard, servo, vision.work_volume, cameras.calibration")


@pytest.mark.parametrize(
    "arguments, message",
    [
        (
            ["--from", "centroids"],
            "cannot be replayed from centroids, which belong to the target only; use --from points",
        ),
        (["--set", "vision.method.target=!Largest {}"], "vision.method.target has no effect in a replay from points"),
        (
            ["--from", "images", "--set", "vision.method.detector.centroid=mean"],
            "there is no setting vision.method.detector",
        ),
    ],
)
def test_what_cannot_be_replayed_with_several_objects(several_run, capsys, tmp_path, monkeypatch, arguments, message):
    monkeypatch.chdir(tmp_path)
    assert message in error_of(capsys, tmp_path, *arguments, run=several_run)


def test_grey_images_cannot_show_several_objects(rendered_run, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    arguments = ("--from", "images", "--set", "vision.method=!SilhouetteTracker {}")
    assert "vision.method has no effect" in error_of(capsys, tmp_path, *arguments, run=rendered_run)


def test_images_that_are_missing_or_incomplete(rendered_run, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copytree(rendered_run, tmp_path / "run")
    file = image_file(tmp_path / "run", "camera_right")
    cut(file)
    assert "of 150 images; it is incomplete" in error_of(capsys, tmp_path, "--from", "images")
    file.unlink()
    assert "the images of this camera are missing" in error_of(capsys, tmp_path, "--from", "images")


def test_a_run_of_the_ball_without_the_poses_of_the_board(ball_run, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copytree(ball_run, tmp_path / "run")
    cut(tmp_path / "run" / "board.npz")
    assert "board.npz: the board's poses cannot be read" in error_of(capsys, tmp_path)
    (tmp_path / "run" / "board.npz").unlink()
    assert "there is no board.npz" in error_of(capsys, tmp_path)


def test_other_versions_give_a_warning_only(run):
    assert open_recording(run).warnings == ()
    summary = json.loads((run / "summary.json").read_text())
    summary["package_versions"]["numpy"] = "1.0"
    (run / "summary.json").write_text(json.dumps(summary))
    (line,) = open_recording(run).warnings
    assert "made with numpy 1.0 (now " in line and "commit" not in line
    (run / "summary.json").unlink()
    (line,) = open_recording(run).warnings
    assert "no readable summary.json" in line
