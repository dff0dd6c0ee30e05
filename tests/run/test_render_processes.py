"""Runs with processes that render: the same results, and one line when something happens to a process."""

import os
import signal

import cv2
import numpy as np
import pytest

from drake_tracker import load_scenario, make_diagram, simulate
from drake_tracker.core.errors import MachineError
from drake_tracker.core.log import load_log
from drake_tracker.run.options import RunOptions

DISTURBED = (
    "lighting.flicker=0.05",
    "faults=[!ImageNoise {camera: left, at: 0.2, for: 0.2, std: 20}, !FrozenImage {camera: right, at: 0.35, for: 1.0}]",
)


def record(folder, processes, overrides=(), duration=0.7):
    scenario = load_scenario("train:learned", seed=5, duration=duration, overrides=[*overrides, "cameras.noise=3"])
    scenario = scenario.with_settings({"cameras.render_processes": processes})
    summary = simulate(scenario, folder, RunOptions(images=True))
    return summary, load_log(folder)


def frames(path):
    video = cv2.VideoCapture(str(path))
    found = []
    while (read := video.read())[0]:
        found.append(read[1])
    return np.array(found)


def test_log_images_and_video_are_the_same_with_processes(tmp_path):
    _, expected = record(tmp_path / "without", "0", DISTURBED)
    summary, log = record(tmp_path / "with", "2", DISTURBED)
    assert set(log) == set(expected)
    for name, signal_ in expected.items():
        np.testing.assert_array_equal(log[name].times, signal_.times)
        np.testing.assert_array_equal(log[name].data, signal_.data, err_msg=name)
    assert log["point"]["valid"].any() and summary["simulated_s"] == pytest.approx(0.7)
    for name in ("cameras.mp4", "images/camera_left.mkv", "images/camera_right.mkv"):
        first, second = (frames(tmp_path / folder / name) for folder in ("without", "with"))
        assert 0 <= len(first) - len(second) <= 1, "an image captured at the very end is missing"
        np.testing.assert_array_equal(first[: len(second)], second)


def test_the_processes_end_with_the_run(tmp_path):
    scenario = load_scenario("train:learned", duration=0.1, overrides=["cameras.render_processes=2"])
    hand_eye, numbers = make_diagram(scenario), []
    cameras = hand_eye.world.cameras["camera_left"].sensor

    def progress(now, phase):
        numbers[:] = cameras.processes

    simulate(scenario, None, diagram=hand_eye, progress=progress)
    assert len(numbers) == 2 and cameras.processes == []
    for number in numbers:
        with pytest.raises(ProcessLookupError):
            os.kill(number, 0)


def test_a_killed_process_ends_the_run_with_one_line_and_the_record_is_kept(tmp_path):
    scenario = load_scenario("train:learned", duration=3.0, overrides=["cameras.render_processes=1"])
    hand_eye = make_diagram(scenario)
    cameras = hand_eye.world.cameras["camera_left"].sensor

    def progress(now, phase):
        if now > 0.5:
            for number in cameras.processes:
                os.kill(number, signal.SIGKILL)

    with pytest.raises(MachineError, match="^a render process was ended by signal 9; [^\n]*$"):
        simulate(scenario, tmp_path, RunOptions(record=True), diagram=hand_eye, progress=progress)
    assert load_log(tmp_path)["point"].times[-1] == pytest.approx(0.6, abs=0.15)
    assert len(frames(tmp_path / "cameras.mp4")) >= 10
    assert cameras.processes == []
