"""What cannot be replayed is one clear line, and nothing is left behind."""

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


@pytest.fixture
def run(measured_run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copytree(measured_run, tmp_path / "run")
    return tmp_path / "run"


def made(folder):
    """All files in a folder but the empty one in which replays are kept."""
    return sorted(path for path in folder.rglob("*") if path.name != "runs")


def refused(capsys, tmp_path, *arguments, run="run"):
    """The one line with which ``replay`` refuses; nothing was made."""
    before = made(tmp_path)
    assert cli.main(["replay", str(run), *arguments]) == 2
    captured = capsys.readouterr()
    lines = captured.err.splitlines()
    assert captured.out == "" and made(tmp_path) == before
    assert len(lines) == 1 and lines[0].startswith("drake-tracker: "), lines
    return lines[0]


@pytest.mark.parametrize(
    "damage, said",
    [
        (shutil.rmtree, "there is no run directory"),
        (lambda run: (run / "scenario.yaml").unlink(), "no scenario.yaml; this is not the directory of a run"),
        (lambda run: (run / "log.npz").unlink(), "no log.npz; a run writes it at its end, and this one was stopped"),
        (lambda run: cut(run / "log.npz"), "damaged or incomplete"),
        (lambda run: cut(run / "log.npz", 0.0), "damaged or incomplete"),
        (lambda run: (run / "log.npz").write_bytes(b"PK\x05\x06" + bytes(18)), "the signal command is missing"),
        (lambda run: (run / "scenario.yaml").write_text("a: [1"), "not valid YAML"),
        (lambda run: change_log(run, rename_a_field), "the signal point has other fields than in this version"),
        (lambda run: change_log(run, lambda arrays: arrays.pop("command")), "the signal command is missing"),
        (lambda run: change_log(run, keep_one_sample), "too few samples"),
    ],
)
def test_a_directory_that_is_not_whole(run, capsys, tmp_path, damage, said):
    damage(run)
    assert said in refused(capsys, tmp_path)


@pytest.mark.parametrize(
    "arguments, said",
    [
        (["--set", "track.speed=0.2"], "track.speed has no effect in a replay from points; what can be changed is"),
        (["--set", "cameras.calibration=other.yaml"], "cameras.calibration has no effect in a replay from points"),
        (["--set", "vision=!Rendered {}"], "vision has no effect"),
        (["--set", "estimator.sistematic_std=1"], "did you mean estimator.systematic_std?"),
        (["--from", "centroids"], "there are no centroids in its log"),
        (["--from", "images"], "there are no images; drake-tracker run --record-images keeps them"),
    ],
)
def test_what_cannot_be_changed_or_begun_with(run, capsys, tmp_path, arguments, said):
    assert said in refused(capsys, tmp_path, *arguments)


def test_in_a_replay_from_centroids_cameras_and_detector_have_no_effect(rendered_run, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for change in ("cameras.noise=0", "vision.detector.centroid=mean"):
        line = refused(capsys, tmp_path, "--set", change, run=rendered_run)
        assert f"--set {change}: {change.split('=')[0]} has no effect in a replay from centroids" in line
        assert line.endswith("estimator, link, servo, vision.work_volume, cameras.calibration")


def test_images_that_are_missing_or_incomplete(rendered_run, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copytree(rendered_run, tmp_path / "run")
    file = image_file(tmp_path / "run", "camera_right")
    cut(file)
    assert "of 150 images; it is incomplete" in refused(capsys, tmp_path, "--from", "images")
    file.unlink()
    assert "the images of this camera are missing" in refused(capsys, tmp_path, "--from", "images")


def test_a_ball_without_its_boards_poses(ball_run, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copytree(ball_run, tmp_path / "run")
    cut(tmp_path / "run" / "board.npz")
    assert "board.npz: the board's poses cannot be read" in refused(capsys, tmp_path)
    (tmp_path / "run" / "board.npz").unlink()
    assert "there is no board.npz" in refused(capsys, tmp_path)


def test_other_versions_are_told_of_and_do_not_matter(run):
    assert open_recording(run).warnings == ()
    summary = json.loads((run / "summary.json").read_text())
    summary["package_versions"]["numpy"] = "1.0"
    (run / "summary.json").write_text(json.dumps(summary))
    (line,) = open_recording(run).warnings
    assert "made with numpy 1.0 (now " in line and "commit" not in line
    (run / "summary.json").unlink()
    (line,) = open_recording(run).warnings
    assert "no summary.json" in line
