"""The command ``drake-tracker lag``, and the latencies in a calibration file."""

import re
import time

import cv2
import numpy as np
import pytest
import yaml
from browsing import chromium
from films import write_calibration, write_video
from screens import Screen

from drake_tracker import cli
from drake_tracker.cameras.files.calibration_file import load_calibration
from drake_tracker.cameras.latency.camera_latency import load_latencies, save_latency
from drake_tracker.cameras.latency.code_reader import read_code
from drake_tracker.cameras.latency.page_server import CodeServer
from drake_tracker.cameras.latency.screen_code import RANGE
from drake_tracker.core.errors import DrakeTrackerError

LATENCY = 0.0812
START = 1_700_000_123.25


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_calibration(tmp_path / "stereo.yaml")
    return tmp_path


def photographs(folder, latency, rate=29.2, count=60, seed=2):
    """Writes images that are named by their stamps, in s since 1970."""
    screen, rng = Screen(), np.random.default_rng(seed)
    folder.mkdir()
    for k in range(count):
        exposed = k / rate + 0.003 * seed
        image = screen.photograph(START % (1e-3 * RANGE) + exposed, rng)
        cv2.imwrite(str(folder / f"{START + exposed + latency:.6f}.png"), image)
    return str(folder)


def one_line(capfd, *words):
    captured = capfd.readouterr().err
    lines = [line for line in captured.splitlines() if line.startswith("drake-tracker")]
    assert len(lines) == 1 and "Traceback" not in captured, captured
    assert all(word in lines[0] for word in words), lines[0]


def test_the_latency_goes_into_the_calibration_file(folder, capsys):
    before = load_calibration("stereo.yaml")
    shots = photographs(folder / "shots", LATENCY)
    assert cli.main(["lag", shots, "--calibration", "stereo.yaml", "--camera", "camera_right"]) == 0
    printed = capsys.readouterr().out
    number = float(re.search(r"camera_right\s+latency ([0-9.]+) ms", printed)[1])
    assert abs(number - 1e3 * LATENCY) < 2.0
    assert load_latencies("stereo.yaml") == {"camera_right": pytest.approx(1e-3 * number, abs=1e-4)}
    after = load_calibration("stereo.yaml")
    assert all(np.array_equal(after[name].K, before[name].K) for name in before)
    assert yaml.safe_load((folder / "stereo.yaml").read_text())["notes"]["X_WP"] == np.eye(4).tolist()


def test_two_clips_of_the_screen_give_the_offset_of_the_recordings(folder, capsys):
    """The right recording began 0.35 s later: its stamps are that much smaller."""
    screen, rate = Screen(size=(240, 180), blur=0.6), 29.2
    for name, began, seed in (("left", 7.0, 1), ("right", 7.35, 2)):
        rng = np.random.default_rng(seed)
        exposed = began + np.arange(50) / rate
        write_video(folder / f"{name}.mkv", [screen.photograph(t, rng) for t in exposed], exposed - began)
    assert cli.main(["lag", "left.mkv", "right.mkv"]) == 0
    printed = capsys.readouterr().out
    assert abs(float(re.search(r"--offset (\S+)", printed)[1]) - 0.35) < 0.004
    assert cli.main(["lag", "left.mkv", "--calibration", "stereo.yaml"]) == 2
    assert load_latencies("stereo.yaml") == {}


def test_images_without_the_code_are_refused(folder, capfd):
    write_video(folder / "grey.mkv", [np.full((120, 160), 90, np.uint8)] * 20, np.arange(20) / 30)
    assert cli.main(["lag", "grey.mkv"]) == 2
    one_line(capfd, "grey.mkv: the running code was readable in 0 of 20 images")


@pytest.mark.parametrize(
    "arguments, words",
    [
        (["--duration", "3"], "0 sources"),
        (["a", "b", "c"], "3 sources"),
        (["missing.mp4"], "missing.mp4: there is no such file"),
        (["stereo.yaml"], "stereo.yaml: this video cannot be read"),
        (["shots", "shots"], "the same images"),
        (["shots", "--calibration", "none.yaml"], "none.yaml"),
        (["shots", "--calibration", "stereo.yaml", "--camera", "wrist"], "there is no wrist"),
        (["shots", "--duration", "-1"], "--duration -1: must be above 0"),
        (["shots", "--light", "/nowhere"], "is not live"),
        (["shots", "--times", "none.csv"], "none.csv: the times of the light cannot be read"),
        (["--show", "shots"], "--show takes no source"),
        (["--show", "--port", "70000"], "--port 70000: cannot listen"),
        (["99"], "camera 99: there is no such camera"),
    ],
)
def test_wrong_calls_say_one_line(folder, capfd, arguments, words):
    (folder / "shots").mkdir()
    for k in range(12):
        cv2.imwrite(f"shots/{START + k:.3f}.png", np.zeros((48, 64), np.uint8))
    assert cli.main(["lag", *arguments]) == 2
    one_line(capfd, words)


@pytest.mark.parametrize("value", [".nan", "true", "11", "-1", "[1]", "late"])
def test_a_wrong_latency_in_a_file_is_named(folder, value):
    text = (folder / "stereo.yaml").read_text()
    (folder / "stereo.yaml").write_text(text.replace("    width", f"    latency: {value}\n    width", 1))
    with pytest.raises(DrakeTrackerError, match="stereo.yaml: cameras.camera_left.latency is"):
        load_latencies("stereo.yaml")


def test_a_file_of_another_format_has_no_latencies(folder):
    (folder / "other.yml").write_text("%YAML:1.0\n---\nM1: !!opencv-matrix\n   rows: 3\n")
    assert load_latencies("other.yml") == {} and load_latencies("missing.yaml") == {}
    with pytest.raises(DrakeTrackerError, match="there is no camera_left"):
        save_latency("other.yml", "camera_left", 0.05)


def test_the_page_shows_the_time_of_this_machine():
    with CodeServer() as server, chromium() as browser:
        page = browser.new_page(viewport={"width": 1000, "height": 700})
        problems = []
        page.on("console", lambda message: problems.append(message.text) if message.type == "error" else None)
        page.goto(server.url)
        page.get_by_text("Hz").wait_for()
        readings = []
        for _ in range(10):
            before = time.time()
            image = cv2.imdecode(np.frombuffer(page.screenshot(), np.uint8), cv2.IMREAD_GRAYSCALE)
            reading = read_code(image)
            if reading is not None:
                readings.append((1e3 * before, reading, 1e3 * time.time()))
        assert len(readings) > 5 and not problems
        for before, reading, after in readings:
            age = (after - reading.time + RANGE / 2) % RANGE - RANGE / 2
            assert -100 < age < after - before + 1500  # a browser without a screen draws when it has time
