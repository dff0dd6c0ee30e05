"""Tracks of one camera, from files to files: one object and several, in pixels and on a plane."""

import csv
import json

import cv2
import numpy as np
import pytest
import yaml
from films import CAMERAS, CENTRE, draw, film, on_circle, read_track, write_calibration, write_images

from drake_tracker import cli
from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.core.messages import pack_prediction
from drake_tracker.core.timing import KNOT_COUNT, KNOT_SPACING
from drake_tracker.estimation.config import AlphaBetaGamma, CoordinatedTurn
from drake_tracker.estimation.unit_free import UnitFreeEstimator
from drake_tracker.own_cameras.overlay import PATH, TrackOverlay
from drake_tracker.own_cameras.picture import draw_track_picture
from drake_tracker.own_cameras.scale import is_scaled, own_estimator
from drake_tracker.own_cameras.table import ObjectValues
from drake_tracker.scenarios.base import Custom
from drake_tracker.tasks.style import FILTERED, PREDICTED, bgr

CAMERA = CAMERAS["camera_left"]
HEIGHT = float(CENTRE[2])
TIMES = np.arange(75) / 30.0
PLANE = ("--calibration", "stereo.yaml", "--plane", "board", "--height", HEIGHT)
STARTS = np.array([[-0.12, -0.02], [0.13, 0.05]])
VELOCITIES = np.array([[0.10, 0.02], [-0.11, -0.03]])


def path(number, time):
    """p_WQ [m] of two balls that cross on a table after about 1.2 s."""
    places = STARTS[number] + np.multiply.outer(np.asarray(time), VELOCITIES[number])
    return np.concatenate([places, np.full((*places.shape[:-1], 1), HEIGHT)], axis=-1)


def pixels(number, time):
    """Places (n, 2) [px] of a ball in the image."""
    return CAMERA.project(path(number, time))


@pytest.fixture(scope="module")
def source(tmp_path_factory):
    """Images of the two balls; the first ball is in front."""
    rng, pictures = np.random.default_rng(5), []
    for time in TIMES:
        one, other = (draw(CAMERA, path(number, time)).astype(float) for number in (0, 1))
        image = np.where(one > 50.0, one, np.where(other > 50.0, 0.1 * (other - 50.0) + 10.0, 50.0))
        pictures.append(np.rint(image + rng.normal(0.0, 1.5, image.shape)).clip(0, 255).astype(np.uint8))
    return write_images(tmp_path_factory.mktemp("crossing") / "shots", pictures)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_calibration(tmp_path / "stereo.yaml")
    return tmp_path


def track(*arguments):
    """Tracks; returns (exit code, columns of the table, summary)."""
    code = cli.main(["track", *map(str, arguments), "--fps", "30", "--out", "out"])
    with open("out/track.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    data = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    data |= {name: np.array([float(x or "nan") for x in column]) for name, column in data.items() if name != "state"}
    with open("out/summary.json") as file:
        return code, data, json.load(file)


def of(data, number):
    """The rows of an object."""
    return {name: column[data["id"] == number] for name, column in data.items()}


def place(data, axes, prefix=""):
    return np.column_stack([data[f"{prefix}{axis}"] for axis in axes])


def distance(data, axes, truth, prefix="", ahead=0.0):
    """Distances of the rows from the truth, without those that have no value."""
    off = np.linalg.norm(place(data, axes, prefix) - truth(data["stamp"] + ahead), axis=1)
    return off[np.isfinite(off)]


def rms(errors):
    return float(np.sqrt(np.mean(np.square(errors))))


def owner(rows, axes, truths):
    """(which ball an object is, distances from it)."""
    off = [distance(rows, axes, truth) for truth in truths]
    best = int(np.argmin([np.median(each) for each in off]))
    return best, off[best]


def test_a_track_in_pixels_is_filtered_and_predicted(folder, capsys):
    shots = write_images(folder / "shots", film("left", TIMES))
    code, data, summary = track(shots, "--no-overlay")
    assert code == 0

    def truth(time):
        return CAMERA.project(on_circle(time))

    late = {name: column[data["stamp"] > 1.0] for name, column in data.items()}
    filtered = distance(late, "uv", truth, "filtered_")
    assert len(filtered) == len(late["stamp"]) and filtered.max() < 2.5 and rms(filtered) < 1.6
    ahead = distance(late, "uv", truth, "predicted_", 0.25)
    still = distance(late, "uv", truth, "", 0.25)
    assert rms(ahead) < 0.4 * rms(still)
    speed = np.linalg.norm(truth(TIMES[1:]) - truth(TIMES[:-1]), axis=1) * 30.0
    assert summary["median_speed_px_s"] == pytest.approx(np.median(speed), rel=0.1)
    assert summary["prediction_rms_px"] < 0.4 * rms(still) and summary["prediction_horizon_s"] == 0.25
    assert summary["filtered"] == {"points": 73, "filtered": 65, "start": 8, "after_a_gap": 0, "after_a_jump": 0}
    assert not any(name.endswith(("_m", "_m_s")) for name in summary) and summary["estimator"]["scaled_to_data"]
    printed = capsys.readouterr().out
    assert f"prediction rms    {summary['prediction_rms_px']:.2f} px\n" in printed
    assert f"median speed      {summary['median_speed_px_s']:.2f} px/s\n" in printed
    assert "points filtered   65 of 73; not filtered: 8 at the start\n" in printed


def test_two_objects_on_a_plane_keep_their_numbers_when_they_cross(folder, source, capsys):
    code, data, summary = track(source, *PLANE, "--objects", 2)
    assert code == 0 and set(data["id"][np.isfinite(data["id"])]) == {1.0, 2.0}
    truths = [lambda time, number=number: path(number, time) for number in (0, 1)]
    owners = set()
    for number in (1, 2):
        rows = of(data, number)
        which, off = owner(rows, "xyz", truths)
        owners.add(which)
        assert len(off) > 50 and off.max() < 0.006 and np.median(off) < 0.001
        for side in (rows["stamp"] < 0.7, rows["stamp"] > 1.8):  # before and after they cross
            part = {name: column[side] for name, column in rows.items()}
            assert distance(part, "xyz", truths[which]).max() < 0.003 and (part["valid"] == 1).sum() > 15
        end = {name: column[-10:] for name, column in rows.items()}
        assert distance(end, "xyz", truths[which], "predicted_", 0.25).max() < 0.008
        assert len(distance(end, "xyz", truths[which], "filtered_")) == 10
        hidden = rows["state"] == "hidden"
        assert not rows["valid"][hidden].any() and np.isnan(place(rows, "xyz")[hidden]).all()
    assert owners == {0, 1}
    described = {each["id"]: each for each in summary["by_object"]}
    assert set(described) == {1, 2} and all(each["prediction_rms_m"] < 0.01 for each in described.values())
    assert summary["off_plane"] == 0 and "the plane" not in capsys.readouterr().out


def test_two_objects_in_pixels_have_an_estimator_each(folder, source, capsys):
    """The object to follow is the ball that passes behind."""
    u, v = np.rint(pixels(1, 0.0)[0])
    code, data, summary = track(source, "--objects", 2, "--follow", f"{u:.0f},{v:.0f}", "--mcap", "--no-overlay")
    assert code == 0
    truths = [lambda time, number=number: pixels(number, time) for number in (0, 1)]
    stamps, firsts = np.unique(data["stamp"], return_index=True)
    (first,) = set(data["id"][firsts][np.isfinite(data["id"][firsts])])
    assert owner(of(data, first), "uv", truths)[0] == 1 and len(stamps) == 73
    assert {owner(of(data, number), "uv", truths)[0] for number in (1, 2)} == {0, 1}
    for number in (1, 2):
        rows = of(data, number)
        which, off = owner(rows, "uv", truths)
        late = {name: column[rows["stamp"] > 1.9] for name, column in rows.items()}
        assert np.median(off) < 0.5 and distance(late, "uv", truths[which], "filtered_").max() < 1.5
        assert rms(distance(late, "uv", truths[which], "predicted_", 0.25)) < 2.0
    assert [each["prediction_rms_px"] < 3.0 for each in summary["by_object"]] == [True, True]
    assert "gap_rms_m" not in summary["by_object"][0]
    assert "px/s, prediction rms" in capsys.readouterr().out


def discs(count, *paths, size=(240, 320), radius=14):
    """Images of discs on a texture; each path gives (u, v) of the disc in an image [px], or None."""
    rows, columns = np.mgrid[: size[0], : size[1]]
    texture = 90.0 + 20.0 * np.sin(0.4 * columns) * np.cos(0.5 * rows)
    pictures = []
    for k in range(count):
        image = texture.copy()
        for each, grey in zip(paths, (230.0, 20.0, 200.0)):
            at = each(k)
            if at is not None:
                image[np.hypot(columns - at[0], rows - at[1]) < radius] = grey
        pictures.append(image.astype(np.uint8))
    return pictures


def test_the_estimator_of_a_place_starts_again_with_another_object(folder):
    """The third object takes the place of the first one, and nothing of its path, however long a gap may be."""
    pictures = discs(
        110,
        lambda k: (30 + 4 * k, 60) if k < 40 else None,
        lambda k: (290 - 2 * k, 180),
        lambda k: (290 - 3 * (k - 75), 60) if k >= 75 else None,
    )
    shots, patient = write_images(folder / "shots", pictures), "!CoordinatedTurn {restart_after: 10.0}"
    code, data, summary = track(shots, "--objects", 2, "--no-overlay", "--estimator", patient)
    assert code == 0 and summary["objects_seen"] == 3 and summary["object_changes"] == 1
    newest = of(data, max(data["id"][np.isfinite(data["id"])]))
    assert newest["stamp"][0] > 2.5 and np.abs(newest["v"][newest["valid"] == 1] - 60.0).max() < 2.0
    known = np.isfinite(newest["filtered_u"])
    assert not known[:6].any() and known[10:].all()
    expected = 290.0 - 90.0 * (newest["stamp"][known] + 0.25 - 2.5)
    assert np.abs(newest["predicted_u"][known] - expected).max() < 4.0
    assert {each["id"] for each in summary["by_object"]} == set(data["id"][np.isfinite(data["id"])])


def test_an_object_above_the_horizon_of_the_plane_has_no_point_and_is_named(folder, capsys):
    X_WP = np.eye(4)
    X_WP[2, 3] = 0.449  # just below the camera
    (folder / "plane.yaml").write_text(yaml.safe_dump({"X_WP": X_WP.tolist()}))
    X_CW = CAMERA.X_CW.copy()
    X_CW[:3, :3] = cv2.Rodrigues(np.array([-0.7, 0.0, 0.0]))[0] @ X_CW[:3, :3]
    X_CW[:3, 3] = -X_CW[:3, :3] @ CAMERA.X_WC[:3, 3]
    write_calibration(folder / "tilted.yaml", {"camera_left": CameraModel(CAMERA.K, CAMERA.distortion, X_CW, 320, 240)})
    shots = write_images(folder / "shots", discs(40, lambda k: (40 + 5 * k, 40), lambda k: (280 - 5 * k, 210)))
    plane = ("--calibration", "tilted.yaml", "--plane", "plane.yaml")
    code, data, summary = track(shots, *plane, "--objects", 2, "--no-overlay")
    assert code == 0
    above = data["left_v"] < 100.0
    assert above.sum() > 30 and not data["valid"][above].any() and np.isnan(data["filtered_x"][above]).all()
    assert data["valid"][data["left_v"] > 150.0].all() and np.isfinite(data["predicted_x"]).sum() > 20
    assert summary["off_plane"] == above.sum()
    assert f"seen in {above.sum()} rows where the camera does not see the plane" in capsys.readouterr().out
    assert read_track(folder / "out")["left_u"].size == len(data["stamp"])


def test_only_the_objects_in_the_region_of_interest_have_rows(folder):
    shots = write_images(folder / "shots", discs(40, lambda k: (40 + 5 * k, 60), lambda k: (280 - 5 * k, 180)))
    code, data, summary = track(shots, "--objects", 2, "--roi", "0,0,320,120", "--no-overlay")
    assert code == 0 and summary["objects_seen"] == 1
    assert np.nanmax(np.abs(data["v"] - 60.0)) < 2.0 and len(np.unique(data["stamp"])) == len(data["stamp"])


class Sink:
    """Keeps the frames of a video."""

    wanted = True

    def __init__(self):
        self.frames = []

    def write(self, page, _):
        self.frames.append(page.copy())


@pytest.mark.parametrize("scale", [1, 2])
def test_the_predicted_path_is_drawn_into_the_image(scale):
    """Of an image that is wider than a panel, path and image are reduced alike."""
    size, sink = (640 * scale, 480 * scale), Sink()
    video = TrackOverlay(None, 1 / 30, [size], 0.0, onlooker=sink)
    knots = np.zeros((KNOT_COUNT, 5))
    knots[:, 0] = scale * (100.0 + 200.0 * KNOT_SPACING * np.arange(KNOT_COUNT))
    knots[:, 1] = scale * 300.0
    point = np.array([1.0, knots[0, 0], knots[0, 1], 0.0, 0.0, 1.0])
    values = ObjectValues(
        [np.array([1.0, *knots[0, :2], 9.0, 1.0])], point, np.zeros(7), pack_prediction(1.0, 1, knots)
    )
    image = np.zeros((*size[::-1], 3), np.uint8)
    for stamp in (1.0, 1.1):
        video.add([(image, np.array([stamp, 1.0]))], [None], [None], [values])
    video.close()
    assert video.size == (640, 516)
    blue = (sink.frames[0][:480] == bgr(PATH)).all(axis=2)
    rows, columns = np.nonzero(blue)
    assert columns.max() == pytest.approx(300, abs=2) and np.abs(rows - 300).max() <= 1
    assert blue[300, 120:298].all()  # one second of the path


def test_the_picture_shows_what_was_filtered_and_predicted_in_pixels(tmp_path):
    stamps = np.arange(60) / 30.0
    data = {"stamp": stamps, "u": 100.0 + 50.0 * stamps, "v": 80.0 + 20.0 * stamps, "valid": np.ones(60)}
    data |= {"filtered_u": data["u"] + 8.0, "filtered_v": data["v"]}
    data |= {"predicted_u": data["u"] + 30.0, "predicted_v": data["v"] + 5.0}
    draw_track_picture(data, tmp_path / "track.png", period=1 / 30)
    picture = cv2.imread(str(tmp_path / "track.png"))
    for colour in (FILTERED, PREDICTED):
        shown = (picture[260:] == bgr(colour)).all(axis=2)  # below the names
        assert shown[:, :1150].sum() > 1000 and shown[:, 1250:].sum() > 1000


def test_settings_of_an_estimator_suit_pixels(folder, source):
    """The constants of its filter are in metres: without a change of scale no point would be filtered."""
    options = ("--no-overlay", "--estimator", "!CoordinatedTurn {ready_after: 0.5}")
    _, _, summary = track(source, *options)
    assert summary["filtered"]["start"] < 20 and summary["filtered"]["filtered"] > 40
    assert summary["estimator"]["scaled_to_data"] is True and summary["estimator"]["ready_after"] == 0.5


@pytest.mark.parametrize(
    ("settings", "in_pixels", "scaled"),
    [
        (CoordinatedTurn(), False, True),
        (CoordinatedTurn(ready_after=0.5), False, False),
        (AlphaBetaGamma(tracking_index=0.01), True, True),
        (Custom("anything.Anything"), True, False),
    ],
)
def test_which_estimators_find_the_unit_of_length(settings, in_pixels, scaled):
    assert is_scaled(settings, in_pixels) is scaled
    if not isinstance(settings, Custom):
        assert isinstance(own_estimator(settings, 1 / 30, in_pixels), UnitFreeEstimator) is scaled
