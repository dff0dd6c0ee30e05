"""Tests of the comparison of the moments that two cameras show."""

import json

import numpy as np
import pytest
from films import CAMERAS, CENTRE, film, on_circle, write_calibration, write_video

from drake_tracker import cli
from drake_tracker.own_cameras.moment_check import Moments, compare_moments, describe_moments

PERIOD = 1.0 / 30.0


def rows(offset, path=on_circle, count=110, noise=0.3, seed=0):
    """Columns of the track of two recordings, of which the second begins ``offset`` [s] later than assumed."""
    rng, stamps, data = np.random.default_rng(seed), PERIOD * np.arange(count), {}
    for side, times in (("left", stamps), ("right", stamps + offset)):
        uv = CAMERAS[f"camera_{side}"].project(path(times)) + rng.normal(0.0, noise, (count, 2))
        data |= {f"{side}_u": uv[:, 0], f"{side}_v": uv[:, 1]}
    return data | {"stamp": stamps}


def line(direction, speed):
    return lambda times: CENTRE + np.outer(np.asarray(times) - 1.8, np.array(direction) * speed)


@pytest.mark.parametrize("path", [on_circle, line([0, 1, 0], 0.1), line([0, 0.3, 1], 0.1)])
@pytest.mark.parametrize("offset", [-1.1, -0.2, 0.05, 0.2, 0.7])
def test_the_offset_is_found(path, offset):
    found = compare_moments(rows(offset, path), list(CAMERAS.values()), PERIOD)
    assert found.offset == pytest.approx(offset, abs=0.01) and found.gap < 0.5


@pytest.mark.parametrize("seed", range(5))
def test_recordings_that_begin_together_are_not_suspected(seed):
    found = compare_moments(rows(0.0, seed=seed), list(CAMERAS.values()), PERIOD)
    assert found.offset == 0.0 and describe_moments(found, 0.0, live=False, shared=False) is None


@pytest.mark.parametrize("path", [line([1, 0, 0], 0.1), line([0, 1, 0], 0.0)])
def test_a_motion_that_cannot_show_the_offset_says_so(path):
    """Along the line between the cameras, or at rest, the rays meet at any offset."""
    found = compare_moments(rows(0.2, path), list(CAMERAS.values()), PERIOD)
    assert found.offset is None
    assert "cannot be judged" in describe_moments(found, 0.0, live=False, shared=False)
    assert describe_moments(found, 0.0, live=False, shared=True) is None


def test_lost_images_and_strangers_do_not_matter():
    data = rows(0.2)
    for side, lost in (("left", slice(20, 35)), ("right", slice(70, 80))):
        data[f"{side}_u"][lost] = np.nan
    data["right_v"][::9] += 60.0
    assert compare_moments(data, list(CAMERAS.values()), PERIOD).offset == pytest.approx(0.2, abs=0.01)


def test_too_few_rows_are_not_judged():
    assert compare_moments(rows(0.2, count=19), list(CAMERAS.values()), PERIOD) is None


def test_a_camera_that_was_moved_is_named():
    data = rows(0.0)
    data["right_v"] += 12.0
    found = compare_moments(data, list(CAMERAS.values()), PERIOD)
    assert found.gap > 5.0 and "was a camera moved" in describe_moments(found, 0.0, live=False, shared=True)


def test_lines_for_the_user():
    assert describe_moments(Moments(0.2, 0.3), 0.1, live=False, shared=False) == (
        "The second recording seems to begin 0.200 s later than assumed: --offset 0.300"
    )
    assert "0.150 s earlier" in describe_moments(Moments(-0.15, 0.3), 0.0, live=True, shared=True)
    assert describe_moments(None, 0.0, live=False, shared=False) is None


def test_two_videos_that_do_not_begin_together(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    times = np.arange(110) / 30.0
    write_video("left.mkv", film("left", times), times)
    write_video("right.mkv", film("right", times + 0.2), times)
    write_calibration(tmp_path / "stereo.yaml")
    command = ["track", "left.mkv", "right.mkv", "--calibration", "stereo.yaml", "--no-overlay"]
    cli.main([*command, "--out", "out"])
    said = capsys.readouterr().out
    found = json.loads((tmp_path / "out" / "summary.json").read_text())["offset_found"]
    assert found == pytest.approx(0.2, abs=0.005)
    assert f"The second recording seems to begin {found:.3f} s later than assumed: --offset {found:.3f}" in said
    assert cli.main([*command, "--out", "again", "--offset", f"{found:.3f}"]) == 0
    assert "seems to begin" not in capsys.readouterr().out
