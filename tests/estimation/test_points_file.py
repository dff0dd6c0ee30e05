"""Points from a file, and the command that predicts from them."""

import numpy as np
import pytest

from drake_tracker import cli
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.estimation.estimator import make_estimator
from drake_tracker.estimation.points_file import Points, predict_points, read_points

PERIOD = 1.0 / 60.0


def circle(count=240, gap=()):
    """Points on a circle of 0.2 m at 0.15 m/s without noise, NaN at the indices ``gap``."""
    stamps = PERIOD * np.arange(count)
    angle = 0.15 / 0.2 * stamps
    positions = np.column_stack([0.5 + 0.2 * np.cos(angle), 0.2 * np.sin(angle), np.full(count, 0.4)])
    positions[list(gap)] = np.nan
    return Points(stamps, positions, False)


def write(folder, points, header="t,x,y,z"):
    path = folder / "points.csv"
    rows = [
        f"{stamp:.6f}," + ",".join("" if np.isnan(v) else f"{v:.6f}" for v in row) for stamp, row in zip(*points[:2])
    ]
    path.write_text("\n".join([header, *rows]) + "\n")
    return path


def test_a_noise_free_circle_is_predicted_to_a_millimetre():
    found = predict_points(make_estimator("coordinated_turn"), circle(), 0.25)
    settled = found.stamps > 2.0
    measured = np.isfinite(found.errors)
    assert np.max(found.errors[settled & measured]) < 1e-3
    truth = 0.15 / 0.2 * (found.stamps[settled] + 0.25) + np.pi / 2
    assert np.max(np.abs(np.exp(1j * found.rows[settled, 3]) - np.exp(1j * truth))) < 0.02
    assert not measured[found.stamps > 239 * PERIOD - 0.25].any(), "nothing was measured after the last point"


@pytest.mark.parametrize("origin", [-50.0, 2e6, 1.7e9])
def test_the_times_of_a_file_may_have_any_origin(tmp_path, origin):
    points = circle()
    found = predict_points(make_estimator("coordinated_turn"), points, 0.25)
    file = write(tmp_path, points._replace(stamps=points.stamps + origin))
    later = predict_points(make_estimator("coordinated_turn"), read_points(str(file)), 0.25)
    np.testing.assert_allclose(later.stamps[-200:], found.stamps[-200:] + origin, rtol=0, atol=2e-6)
    np.testing.assert_allclose(later.rows[-200:], found.rows[-200:], rtol=0, atol=1e-3)


def test_no_error_is_claimed_across_a_gap():
    gap = range(150, 180)
    found = predict_points(make_estimator("coordinated_turn"), circle(gap=gap), 0.25)
    inside = (found.stamps + 0.25 > 150 * PERIOD) & (found.stamps + 0.25 < 179 * PERIOD)
    assert inside.any() and np.isnan(found.errors[inside]).all()
    assert not np.isin(found.stamps, circle().stamps[list(gap)]).any(), "a row without a point makes no prediction"


@pytest.mark.parametrize(
    "text, points",
    [
        ("stamp,y,x\n0,2,1\n0.5,4,3\n", [[1, 2, 0], [3, 4, 0]]),
        ("\ufeffT, X, Y, Z, note\n0,1,2,3,a\n1,4,5,6,b\n", [[1, 2, 3], [4, 5, 6]]),
        ("time,u,v,valid\n0,1,2,0\n1,3,4,1\n2,,,0\n", [[np.nan] * 3, [3, 4, 0], [np.nan] * 3]),
    ],
)
def test_columns_are_found_by_their_names(tmp_path, text, points):
    path = tmp_path / "points.csv"
    path.write_text(text, encoding="utf-8")
    found = read_points(str(path))
    np.testing.assert_array_equal(found.positions, points)
    assert found.in_pixels == ("u" in text)


@pytest.mark.parametrize(
    "text, words",
    [
        ("", "line 1: the header must name, separated by commas, a time"),
        ("x,y\n1,2\n", "line 1: the header must name, separated by commas, a time"),
        ("t,x\n1,2\n", "x,y or u,v, not 't,x'"),
        ("t,x,y\n0,1,2\n", "has 1 rows with a time"),
        ("t,x,y\n0,1,2\n1,one,2\n", "line 3: '1,one,2' must have numbers for t,x,y"),
        ("t,x,y\n0,1,2\n1,1\n", "line 3: '1,1' must have numbers"),
        ("t,x,y\n0,1,2\nnan,1,2\n", "line 3: 'nan,1,2' has no time"),
        ("t,x,y\n0,1,2\n,1,2\n", "line 3: ',1,2' has no time"),
        ("t,x,y\n1700000000000,1,2\n", "line 2: '1700000000000,1,2' has no time in seconds"),
        ("t,x,y\n1700000000.25,1,2\n1700000000.25,1,2\n", "the time 1700000000.25 s does not follow"),
        ("t;x;y\n0;1;2\n", "must name, separated by commas,"),
        ("t,x,y\n0,1,2\n1,inf,2\n", "a number above"),
        ("t,x,y\n1,1,2\n1,1,2\n", "line 3: the time 1 s does not follow"),
        ("t,x,y\n0,1,2\n1,\x00,2\n", "line 3"),
    ],
)
def test_a_wrong_file_is_refused_in_one_line(tmp_path, text, words):
    path = tmp_path / "points.csv"
    path.write_text(text)
    with pytest.raises(DrakeTrackerError, match="points file") as caught:
        read_points(str(path))
    assert words in str(caught.value) and "\n" not in str(caught.value)


def test_the_command_writes_what_it_predicts(tmp_path, capsys):
    path, out = write(tmp_path, circle()), tmp_path / "out.csv"
    assert cli.main(["predict", str(path), "--ahead", "0.5", "-o", str(out)]) == 0
    printed = capsys.readouterr().out
    assert "240 of 240 rows, one in 16.7 ms" in printed and "0.5 s ahead" in printed and str(out) in printed
    table = np.genfromtxt(out, delimiter=",", names=True)
    angle = 0.15 / 0.2 * (table["stamp"] + 0.5)
    settled = table["stamp"] > 2.0
    assert np.max(np.abs(table["predicted_x"] - 0.5 - 0.2 * np.cos(angle))[settled]) < 2e-3
    before = out.read_bytes()
    assert cli.main(["predict", str(path), "-o", str(out)]) == 2 and out.read_bytes() == before
    assert "this file exists" in capsys.readouterr().err


@pytest.mark.parametrize("options, words", [(["--ahead", "-1"], "--ahead -1"), (["--estimator", "Kalman"], "Kalman")])
def test_wrong_options_are_refused(tmp_path, capsys, options, words):
    assert cli.main(["predict", str(write(tmp_path, circle(10))), *options]) == 2
    assert words in capsys.readouterr().err


def test_pixels_and_metres_of_the_same_motion_give_the_same_result(tmp_path, capsys):
    points = circle()
    assert cli.main(["predict", str(write(tmp_path, points))]) == 0
    metres = capsys.readouterr().out
    pixels = points._replace(positions=1000.0 * points.positions * [1, 1, 0])
    assert cli.main(["predict", str(write(tmp_path, pixels, "t,u,v,ignored"))]) == 0
    assert [line.split()[:3] for line in metres.splitlines()[:2]] == [
        line.split()[:3] for line in capsys.readouterr().out.splitlines()[:2]
    ]
