"""Tracks of live cameras: their page, their recordings, and a camera that is unplugged."""

import json
import re
import signal
import subprocess
import sys
import urllib.request
from dataclasses import replace

import av
import numpy as np
import pytest
from browsing import PATIENCE, chromium, until
from films import film, on_circle, read_track, write_calibration, write_video
from played import play_at_once

from drake_tracker import cli
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.own_cameras.live_view import IN_STRIPS, TrackStrips, TrackView, _list_objects
from drake_tracker.own_cameras.overlay import TrackOverlay
from drake_tracker.own_cameras.table import TrackTable
from drake_tracker.vision.image_tracks.image_objects import ImageObjects
from drake_tracker.vision.image_tracks.image_regions import ImageRegion
from drake_tracker.vision.image_tracks.image_tracker import CONFIRM_AFTER
from drake_tracker.vision.image_tracks.track_2d import start_track

TIMES = np.arange(60) / 30.0
STEREO = ["play:left.mkv", "play:right.mkv", "--calibration", "stereo.yaml"]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_calibration(tmp_path / "stereo.yaml")
    for side in ("left", "right"):
        write_video(tmp_path / f"{side}.mkv", film(side, TIMES), TIMES)
    return tmp_path


def track(*arguments):
    return cli.main(["track", *arguments])


def test_a_live_session_is_replayed_with_the_same_result(folder, monkeypatch, capfd):
    play_at_once(monkeypatch)
    assert track(*STEREO, "--record", "--no-overlay", "--duration", "1.9", "--out", "live") == 0
    assert track("live", "--calibration", "stereo.yaml", "--no-overlay", "--duration", "1.9", "--out", "again") == 0
    assert (folder / "live" / "track.csv").read_text() == (folder / "again" / "track.csv").read_text()
    data = read_track(folder / "live")
    off = np.column_stack([data[name] for name in "xyz"]) - on_circle(data["stamp"])
    assert data["valid"].sum() > 45 and np.nanmax(np.linalg.norm(off, axis=1)) < 0.004
    assert track("left.mkv", "--record", "--out", "file") == 2
    assert "--record: left.mkv is not a live camera" in capfd.readouterr().err


def test_a_played_recording_ends_by_itself(folder, monkeypatch):
    play_at_once(monkeypatch)
    assert track("play:left.mkv", "--no-overlay", "--out", "out") == 0
    assert len(read_track(folder / "out")["stamp"]) >= 57


def test_a_computer_that_is_too_slow_for_its_cameras_says_so(folder, monkeypatch, capfd):
    clock = play_at_once(monkeypatch)
    add = TrackTable.add

    def slow_add(*arguments):
        clock.sleep(0.05)
        return add(*arguments)

    monkeypatch.setattr(TrackTable, "add", slow_add)
    assert track("play:left.mkv", "--no-overlay", "--live", "--out", "out") == 1
    printed = capfd.readouterr()
    assert re.search(r"drake-tracker: \d+ of \d+ images of a camera were dropped, .* 320 x 240 px at 30 ", printed.err)
    assert "No motion was found" not in printed.out
    monkeypatch.setattr(TrackTable, "add", add)
    assert track("play:left.mkv", "--no-overlay", "--out", "again") == 0
    assert "dropped" not in capfd.readouterr().err


def test_what_is_slow_to_load_is_loaded_before_a_live_camera_is_opened(folder):
    code = """if True:
        import sys
        from drake_tracker.own_cameras import preparation
        opened = preparation.open_footage
        def open_footage(*arguments):
            loaded.append(set(sys.modules))
            return opened(*arguments)
        loaded, preparation.open_footage = [], open_footage
        from drake_tracker.own_cameras.track import make_track
        from pathlib import Path
        track = preparation.prepare_track(["play:left.mkv"], objects=2)
        Path("out").mkdir()
        make_track(track, Path("out"))
        late = [name for name in set(sys.modules) - loaded[0] if name.startswith(("scipy", "drake_tracker"))]
        assert not late, late
    """
    done = subprocess.run([sys.executable, "-c", code], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_a_cycle_without_an_image_of_a_live_camera_is_not_drawn_and_keeps_its_time(tmp_path):
    video = TrackOverlay(tmp_path / "overlay.mp4", 1 / 30, [(320, 240)], 0.0, live=True)
    for k in range(12):
        image = np.full((240, 320, 3), 20 * k, np.uint8)
        video.add([(image, np.array([k / 30, float(k % 5 == 0)]))], [None], [None], [])
    video.close()
    with av.open(str(tmp_path / "overlay.mp4")) as container:
        times = [frame.time for frame in container.decode(video=0)]
    assert times == pytest.approx([0.0, 5 / 30, 10 / 30], abs=0.002)


def test_what_was_tracked_and_recorded_before_a_camera_was_unplugged_is_kept(folder, monkeypatch, capfd):
    play_at_once(monkeypatch, most=40)
    assert track(*STEREO, "--record", "--live", "--mcap", "--out", "out") == 2
    printed = capfd.readouterr()
    said = [line for line in printed.err.splitlines() if line.startswith("drake-tracker: ")]
    assert len(said) == 1 and "Traceback" not in printed.err
    assert re.search(
        r"play:left.mkv: it delivers no more images; the track of 3\d images before is kept in out", said[0]
    )
    assert len(read_track(folder / "out")["stamp"]) > 35
    summary = json.loads((folder / "out" / "summary.json").read_text())
    assert summary["described"] > 35 and summary["interrupted"] is False
    assert {"track.csv", "track.png", "overlay.mp4", "track.mcap", "summary.json", "recording"} == {
        path.name for path in (folder / "out").iterdir()
    }
    assert track("out", "--calibration", "stereo.yaml", "--no-overlay", "--out", "again") == 0
    first, again = read_track(folder / "out"), read_track(folder / "again")
    common = len(first["stamp"])
    assert all(np.array_equal(first[name], again[name][:common], equal_nan=True) for name in ("stamp", "x", "y", "z"))


@pytest.mark.parametrize(
    "arguments, words",
    [
        (["left.mkv", "--port", "8080"], "--port 8080 is the port of the live view: add --live"),
        (["left.mkv", "--live", "--port", "70000"], "--port 70000: cannot listen there"),
        (["play:99"], "camera 99: there is no such camera"),
        (["play:", "--live"], "there is no such file"),
        (["play:left.mkv", "right.mkv", "--calibration", "stereo.yaml"], "one is live and the other is not"),
    ],
)
def test_wrong_calls_say_one_line(folder, capfd, arguments, words):
    assert track(*arguments, "--out", "out") == 2
    printed = capfd.readouterr().err
    said = [line for line in printed.splitlines() if line.startswith("drake-tracker: ")]
    assert len(said) == 1 and words in said[0] and "Traceback" not in printed
    assert not (folder / "out").exists()


def rows(count=40, period=1 / 30):
    """Rows of a table whose object moves along x with 0.3 m/s, with predictions that are 4 mm too far."""
    table = TrackTable("rows.csv", ("left", "right"), True)
    values = []
    for k in range(count):
        stamp = (k + 1) * period
        row = dict.fromkeys(table.columns, 0.0)
        row |= {"stamp": stamp, "x": 0.3 * stamp, "filtered_x": 0.3 * stamp, "gap": 0.002, "valid": 1.0}
        row |= {"predicted_x": 0.3 * (stamp + 0.25) + 0.004}
        values.append(list(row.values()))
    table.close()
    return table.columns, values


def test_the_strips_show_speed_gap_and_prediction_error(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    columns, values = rows()
    strips = TrackStrips(columns, 1 / 30, (320, 240))
    assert [strip.title for strip in strips.strips] == ["Speed", "Gap", "Prediction error"]
    shown = [strips.values(row) for row in values]
    assert shown[0] == [None, 2.0, None]
    speed, gap, error = shown[-1]
    assert speed == pytest.approx(0.3, abs=1e-3) and gap == 2.0
    assert error == pytest.approx(4.0, abs=0.3 * 1e3 / 60)  # the prediction is for an instant between two images


def test_the_strips_of_an_uncalibrated_camera_are_in_pixels(tmp_path):
    table = TrackTable(tmp_path / "rows.csv", ("left",), False)
    table.close()
    strips = TrackStrips(table.columns, 0.125, (640, 480))
    assert [(strip.title, strip.unit) for strip in strips.strips] == [
        ("Speed", "px/s"), ("Prediction error", "px"), ("u", "px"), ("v", "px"),
    ]  # fmt: skip

    def values(stamp, u, v, filtered=(np.nan,) * 2, predicted=(np.nan,) * 2):
        row = dict(stamp=stamp, u=u, v=v, pixel_count=9.0, valid=1.0, id=1.0, state=1.0)
        row |= dict(zip(("filtered_u", "filtered_v"), filtered)) | dict(zip(("predicted_u", "predicted_v"), predicted))
        return strips.values([row[name] for name in table.columns])

    assert values(0.125, 100.0, 50.0) == [None, None, 100.0, 50.0]
    values(0.25, 102.0, 50.0, (102.0, 50.0), (106.0, 50.0))
    assert values(0.375, 103.0, 54.0, (105.0, 54.0)) == [40.0, None, 103.0, 54.0]
    assert values(0.5, 106.0, 53.0, (105.0, 54.0)) == [0.0, 3.0, 106.0, 53.0]
    assert values(0.625, np.nan, np.nan) == [None, None, None, None]


def test_the_strips_begin_again_with_another_object(tmp_path, monkeypatch):
    """Two objects 1 m apart: neither speed nor prediction error is measured from one to the other."""
    monkeypatch.chdir(tmp_path)
    columns, values = rows()
    number, x = columns.index("id"), [columns.index(name) for name in ("x", "filtered_x", "predicted_x")]
    for k, row in enumerate(values):
        row[number] = 1.0 if k < 20 else 2.0
        for column in x:
            row[column] += 0.0 if k < 20 else 1.0
    strips = TrackStrips(columns, 1 / 30, (320, 240))
    shown = [strips.values(row) for row in values]
    assert shown[20] == [None, 2.0, None]
    assert all(speed == pytest.approx(0.3, abs=1e-3) for speed, _, _ in shown[21:])
    assert all(error is None or error < 15.0 for _, _, error in shown)
    assert shown[-1][2] is not None


def test_the_table_says_which_of_several_objects_the_strips_describe():
    image, region = np.zeros((240, 320), np.uint8), ImageRegion(100.0, 80.0, 300, 90, 70, 20, 20)
    started = [start_track(number, 0.1, region, image) for number in (1, 2, 3)]
    tracks = tuple(replace(track, hits=CONFIRM_AFTER) for track in started)

    def words(*targets):
        return [each["words"] for each in _list_objects([ImageObjects(tracks=tracks, targets=targets)])]

    assert words(2, 1) == [None, IN_STRIPS, None]
    assert words(0, 1) == words(2) == [None] * 3


def test_a_live_camera_cannot_be_paused():
    with TrackView(0, print) as view:
        view._live = True
        for action in ("pause", "operator", "select", "mark"):
            request = urllib.request.Request(
                f"{view.url}control", json.dumps({"action": action}).encode(), {"Origin": view.url.rstrip("/")}
            )
            with pytest.raises(urllib.error.HTTPError, match="400"):
                urllib.request.urlopen(request)
        with pytest.raises(ValueError, match="no such action"):
            view._act("resume", {})


def test_the_page_shows_images_objects_and_strips(folder):
    times = np.arange(660) / 30.0
    for side in ("left", "right"):  # one lap, again and again
        lap = film(side, np.arange(120) / 30.0)
        write_video(folder / f"{side}.mkv", [lap[k % 120] for k in range(len(times))], times)
    command = [sys.executable, "-m", "drake_tracker", "track", *STEREO, "--live", "--no-overlay", "--out", "out"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=folder)
    try:
        url = re.search(r"http://127.0.0.1:\d+/", process.stdout.readline())[0]
        with chromium() as browser:
            page = browser.new_page(viewport={"width": 1280, "height": 800})
            problems = []
            page.on("console", lambda message: problems.append(message.text) if message.type == "error" else None)
            page.on("pageerror", lambda error: problems.append(str(error)))
            page.goto(url)
            until(lambda: float(page.locator("#time").inner_text()) > 1.5)
            until(lambda: page.locator("#cameras").get_attribute("data-frame") is not None)
            until(lambda: page.locator("#track-rows tr.target").count() == 1)
            assert page.locator("#views canvas").count() == 2 and not page.locator("#pause").is_visible()
            assert not page.locator("#scene").is_visible() and page.locator("#clock").inner_text() == "s tracked"
            until(lambda: "px/s" in page.locator("#track-rows").inner_text())  # rows are replaced while one reads
            process.send_signal(signal.SIGINT)
            page.locator("#outcome-title").get_by_text("The track was ended").wait_for(timeout=1e3 * PATIENCE)
            assert not problems
    except BaseException:
        process.kill()
        raise
    finally:
        _, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130 and "Traceback" not in err
    assert not (folder / "out" / "overlay.mp4").exists()
    assert len(read_track(folder / "out")["stamp"]) > 20


def test_a_recording_of_anything_but_a_camera_is_refused(folder):
    from drake_tracker.own_cameras.preparation import prepare_track

    with pytest.raises(DrakeTrackerError, match="--record"):
        prepare_track(["left.mkv"], record=True)
