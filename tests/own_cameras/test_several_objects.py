"""Tracks of several objects with two cameras, from files to files: balls on known circles in space."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from films import CAMERAS, draw, on_circle, write_calibration, write_images

from drake_tracker import cli

TIMES = np.arange(50) / 30.0
SIDES = ("left", "right")


def ball(k):
    """The path of ball ``k``: three at equal distances on one circle."""
    return lambda time: on_circle(np.asarray(time) + 4.0 / 3.0 * k)


def film(side, balls, times=TIMES, hidden=()):
    """Images of balls; ``hidden``: numbers of the images from which the last ball is missing."""
    rng = np.random.default_rng(len(side))
    films = []
    for number, time in enumerate(times):
        shown = balls[:-1] if number in hidden else balls
        views = [draw(CAMERAS[f"camera_{side}"], ball(k)(time)) for k in shown]
        image = np.max(views, axis=0) + rng.normal(0.0, 1.5, views[0].shape)
        films.append(np.rint(image.clip(0, 255)).astype(np.uint8))
    return films


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_calibration(tmp_path / "stereo.yaml")
    return tmp_path


def track(left, right, *more, objects=2):
    """Tracks two films; returns (exit code, rows of the table, summary)."""
    for side, pictures in zip(SIDES, (left, right)):
        numbers = [k for k, picture in enumerate(pictures) if picture is not None]
        write_images(Path(side), [pictures[k] for k in numbers], numbers)
    arguments = ["left", "right", "--fps", "30", "--calibration", "stereo.yaml", "--objects", objects, *more]
    code = cli.main(["track", *map(str, arguments), "--out", "out"])
    with open("out/track.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    with open("out/summary.json") as file:
        return code, rows, json.load(file)


def points(rows, number):
    """(stamps, points) of the valid rows of an object."""
    own = [row for row in rows if row["id"] == str(number) and row["valid"] == "1"]
    return np.array([float(row["stamp"]) for row in own]), np.array([[float(row[c]) for c in "xyz"] for row in own])


def errors(rows, number, balls):
    """(which ball an object is, distance of its points from that ball [m])."""
    stamps, places = points(rows, number)
    off = [np.linalg.norm(places - ball(k)(stamps), axis=1) for k in balls]
    best = int(np.argmin([np.median(each) for each in off]))
    return balls[best], off[best]


def test_two_objects_have_their_points_estimators_and_rows(folder, capsys):
    code, rows, summary = track(film("left", [0, 1]), film("right", [0, 1]), "--mcap")
    assert code == 0
    assert list(rows[0])[-6:] == ["left_u", "left_v", "right_u", "right_v", "id", "state"]
    assert {row["id"] for row in rows} == {"", "1", "2"} and summary["objects_seen"] == 2
    found = [errors(rows, number, [0, 1]) for number in (1, 2)]
    assert {which for which, _ in found} == {0, 1}
    for number, (which, off) in zip((1, 2), found):
        assert len(off) > 35 and off.max() < 0.003
        late = [row for row in rows if row["id"] == str(number) and row["predicted_x"]]
        assert len(late) > 15
        for row in late[-5:]:
            predicted = [float(row[f"predicted_{axis}"]) for axis in "xyz"]
            assert np.linalg.norm(predicted - ball(which)(float(row["stamp"]) + 0.25)) < 0.03
    described = {each["id"]: each for each in summary["by_object"]}
    assert summary["swapped"] is False
    assert described[1]["points"] == len(found[0][1]) and described[2]["prediction_rms_m"] < 0.03
    assert summary["results"] == len({row["stamp"] for row in rows if row["valid"] == "1"})
    printed = capsys.readouterr().out
    assert "object 1 " in printed and "object 2 " in printed
    assert {path.name for path in (folder / "out").iterdir()} == {
        "track.csv", "track.png", "overlay.mp4", "summary.json", "track.mcap",
    }  # fmt: skip


def test_an_object_that_one_camera_does_not_see_for_a_while_is_hidden_and_keeps_its_number(folder):
    hidden = range(24, 36)
    code, rows, summary = track(film("left", [0, 1], hidden=hidden), film("right", [0, 1]), "--no-overlay")
    assert code == 0 and summary["objects_seen"] == 2
    which = {number: errors(rows, number, [0, 1]) for number in (1, 2)}
    assert all(off.max() < 0.004 for _, off in which.values())
    number = next(number for number, (ball_of, _) in which.items() if ball_of == 1)
    stamps, _ = points(rows, number)
    assert not ((stamps > 24.5 / 30.0) & (stamps < 34.5 / 30.0)).any()
    assert (stamps < 0.8).any() and (stamps > 1.4).any()
    middle = [row for row in rows if row["id"] == str(number) and 27 / 30 < float(row["stamp"]) < 33 / 30]
    assert middle and {row["state"] for row in middle} == {"hidden"}
    assert all(row["right_u"] and not row["left_u"] for row in middle)


def test_an_object_that_passes_behind_a_post_gives_no_point_from_a_part_of_it(folder):
    times = np.arange(75) / 30.0
    left = film("left", [0, 1], times)
    u = round(CAMERAS["camera_left"].project(ball(1)(1.2))[0][0])
    for image in left:
        image[:, u - 12 : u + 12] = 70
    code, rows, summary = track(left, film("right", [0, 1], times), "--no-overlay")
    assert code == 0
    which = {each["id"]: errors(rows, each["id"], [0, 1]) for each in summary["by_object"]}
    assert sorted(ball_of for ball_of, _ in which.values()) == [0, 1]
    assert max(off.max() for _, off in which.values()) < 0.006  # the centroid of the part beside the post: 19 mm
    assert sum(row["state"] == "hidden" for row in rows) > 10


def test_an_object_of_one_camera_alone_gives_no_point_and_no_row(folder):
    code, rows, summary = track(film("left", [0, 1]), film("right", [0]), "--no-overlay", objects=3)
    assert code == 0 and summary["objects_seen"] == 1
    assert {row["id"] for row in rows} == {"", "1"}
    which, off = errors(rows, 1, [0, 1])
    assert which == 0 and len(off) > 35 and off.max() < 0.003


def test_of_more_objects_than_wanted_the_others_have_no_row_and_are_named(folder, capsys):
    code, rows, _ = track(film("left", [0, 1, 2]), film("right", [0, 1, 2]), "--no-overlay")
    assert code == 0
    stamps = [row["stamp"] for row in rows]
    assert max(stamps.count(stamp) for stamp in stamps) == 2
    for number in {row["id"] for row in rows} - {""}:
        assert errors(rows, number, [0, 1, 2])[1].max() < 0.004
    assert "another moving object was about as large" in capsys.readouterr().out


def test_a_dropped_image_and_cameras_that_are_not_synchronised(folder):
    left, right = film("left", [0, 1]), film("right", [0, 1], TIMES + 0.4 / 30.0)
    right[30] = None
    code, rows, summary = track(left, right, "--no-overlay", "--offset", 0.4 / 30.0)
    assert code == 0 and summary["dropped"] == [0, 1] and summary["objects_seen"] == 2
    for number in (1, 2):
        stamps, _ = points(rows, number)
        assert not (np.abs(stamps - 30.2 / 30.0) < 0.01).any() and (stamps > 1.2).any()
        assert errors(rows, number, [0, 1])[1].max() < 0.01
    assert len({row["stamp"] for row in rows}) == summary["described"]


@pytest.mark.parametrize("balls", [[0, 1], [0, 1, 2]])
def test_swapped_cameras_are_suspected(folder, capsys, balls):
    _, _, summary = track(film("right", balls), film("left", balls), "--no-overlay", objects=len(balls))
    assert summary["swapped"] is True and "The cameras are swapped" in capsys.readouterr().out


def test_cameras_that_see_different_objects_are_not_swapped(folder, capsys):
    _, _, summary = track(film("left", [0, 1]), film("right", [2]), "--no-overlay")
    assert summary["swapped"] is False and "swapped" not in capsys.readouterr().out


def test_the_object_to_follow_comes_first(folder):
    pixels = [CAMERAS[f"camera_{side}"].project(ball(1)(0.0))[0] for side in SIDES]
    follow = [part for u, v in pixels for part in ("--follow", f"{u:.0f},{v:.0f}")]
    _, rows, _ = track(film("left", [0, 1]), film("right", [0, 1]), "--no-overlay", *follow)
    first = {}
    for row in rows:
        first.setdefault(row["stamp"], row["id"])
    (number,) = set(first.values()) - {""}
    assert errors(rows, number, [0, 1])[0] == 1
