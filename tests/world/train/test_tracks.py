import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import ellipe

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.world.config import OPEN_KINDS, TRACK_KINDS
from drake_tracker.world.train.tracks import MAX_NODES, NODE_SPACING, make_track

KINDS = [kind for kind in TRACK_KINDS if kind != "csv"]


def write(folder, text):
    path = folder / "track.csv"
    path.write_text(text)
    return str(path)


def csv_of(points):
    return "x,y\n" + "".join(f"{x:.6f},{y:.6f}\n" for x, y in points)


def circle_points(count, radius=0.15, centre=(0.5, 0.1)):
    u = 2 * math.pi * np.arange(count) / count
    return np.column_stack([np.cos(u), np.sin(u)]) * radius + centre


def test_lengths_are_those_of_the_textbook():
    a, b = 0.16, 0.22
    assert make_track("oval").length == pytest.approx(4 * b * ellipe(1 - (a / b) ** 2), rel=1e-4)
    assert make_track("circle").length == pytest.approx(2 * math.pi * 0.12, rel=1e-4)
    assert make_track("stadium").length == pytest.approx(2 * math.pi * 0.12 + 0.4, rel=1e-4)
    assert make_track("line").length == pytest.approx(0.9)


@pytest.mark.parametrize(
    "kind, x_extent, y_extent",
    [
        ("oval", 0.16, 0.22),
        ("figure_eight", 0.16, 0.22),
        ("circle", 0.12, 0.12),
        ("stadium", 0.12, 0.22),
        ("line", 0.0, 0.45),
        ("sinusoid", 0.05, 0.45),
        ("polynomial", 0.15 * 2 / math.sqrt(27), 0.45),
    ],
)
def test_the_long_axis_lies_along_y_about_the_centre(kind, x_extent, y_extent):
    x, y, _ = make_track(kind, centre=(0.5, 0.1)).pose(np.linspace(0.0, 2.0, 4001))
    assert (x.max() - 0.5, 0.5 - x.min()) == pytest.approx((x_extent, x_extent), abs=1e-5)
    assert (y.max() - 0.1, 0.1 - y.min()) == pytest.approx((y_extent, y_extent), abs=1e-5)


@pytest.mark.parametrize("kind", KINDS)
def test_arc_length_heading_and_curvature_agree(kind):
    track = make_track(kind, rotation=0.3)
    assert len(track.points) <= MAX_NODES
    s = np.linspace(0.0, track.length, 7001)
    x, y, heading = track.pose(s)
    ds = s[1] - s[0]
    np.testing.assert_allclose(np.hypot(np.diff(x), np.diff(y)), ds, rtol=2e-2)  # chords across a node are shorter
    middle = 0.5 * (heading[:-1] + heading[1:])
    turn = max(0.025, 0.8 * NODE_SPACING / track.min_radius())  # of the tangent along half a chord
    np.testing.assert_allclose(np.diff(x) / ds, np.cos(middle), atol=turn)
    np.testing.assert_allclose(np.diff(y) / ds, np.sin(middle), atol=turn)
    turned = np.concatenate([[0.0], np.cumsum(0.5 * (track.curvature(s)[1:] + track.curvature(s)[:-1]) * ds)])
    np.testing.assert_allclose(heading - heading[0], turned, atol=0.2 * turn)


def test_the_length_of_a_sinusoid_is_the_integral():
    slope = 2 * math.pi * 0.04 / 0.3
    length, _ = quad(lambda y: math.hypot(1.0, slope * math.cos(2 * math.pi * y / 0.3)), -0.3, 0.3)
    track = make_track("sinusoid", length=0.6, amplitude=0.04, wavelength=0.3)
    assert track.length == pytest.approx(length, rel=1e-4)
    assert track.min_radius() == pytest.approx(0.3**2 / (4 * math.pi**2 * 0.04), rel=5e-3)
    x, y, _ = track.pose(np.linspace(0.0, track.length, 301))
    np.testing.assert_allclose(x - 0.56, 0.04 * np.sin(2 * math.pi * y / 0.3), atol=2e-5)


def test_the_curvature_of_a_polynomial():
    c, half = (0.02, 0.05, 0.06, -0.1), 0.4
    track = make_track("polynomial", length=2 * half, coefficients=c, centre=(0.0, 0.0))
    for s in np.linspace(0.05, track.length - 0.05, 9):
        x, y, heading = (float(value) for value in track.pose(s))
        u = y / half
        assert x == pytest.approx(c[0] + c[1] * u + c[2] * u**2 + c[3] * u**3, abs=2e-5)
        first = (c[1] + 2 * c[2] * u + 3 * c[3] * u**2) / half
        second = (2 * c[2] + 6 * c[3] * u) / half**2
        assert heading == pytest.approx(math.atan2(1.0, first), abs=2e-4)
        assert track.curvature(s) == pytest.approx(-second / (1 + first**2) ** 1.5, abs=0.02)


def test_curvature_of_the_ellipse():
    a, b = 0.16, 0.22
    track = make_track("oval")
    assert track.curvature(0.0) == pytest.approx(a / b**2, rel=1e-3)  # at the end of the short axis
    assert track.curvature(track.length / 4) == pytest.approx(b / a**2, rel=1e-3)
    assert track.min_radius() == pytest.approx(a**2 / b, rel=1e-3)


def test_heading_goes_on_turning_lap_after_lap():
    track = make_track("oval")
    s = np.linspace(-2.5, 5.5, 16001) * track.length
    x, y, heading = track.pose(s)
    assert np.abs(np.diff(heading)).max() < 0.01
    assert heading[-1] - heading[0] == pytest.approx(8 * 2 * math.pi, abs=1e-9)
    np.testing.assert_allclose(track.pose(s[0] + track.length)[:2], [x[0], y[0]], atol=1e-9)
    eight = make_track("figure_eight")
    assert eight.pose(eight.length)[2] == pytest.approx(eight.pose(0.0)[2], abs=1e-9)


@pytest.mark.parametrize("kind", OPEN_KINDS)
def test_an_open_track_stands_still_beyond_its_ends(kind):
    track = make_track(kind)
    assert not track.closed
    np.testing.assert_allclose(track.pose(track.length + 1.0)[:2], track.points[-1], atol=1e-9)
    np.testing.assert_allclose(track.pose(-1.0)[:2], track.points[0], atol=1e-9)


def test_an_open_track_ends():
    track = make_track("line")
    assert track.pose(5.0)[1] == pytest.approx(0.45) and track.pose(-1.0)[1] == pytest.approx(-0.45)
    assert track.nearest(0.57, 0.6, math.pi / 2) == pytest.approx((0.9, -0.01))
    assert make_track("oval").closed


@pytest.mark.parametrize("direction", ["forward", "backward"])
@pytest.mark.parametrize("kind", KINDS)
def test_nearest_undoes_pose(kind, direction):
    track = make_track(kind, rotation=-0.2)
    track = track.reversed() if direction == "backward" else track
    rng = np.random.default_rng([7])
    for s in rng.uniform(0.05, track.length - 0.05, 200):
        x, y, heading = track.pose(s)
        aside, yaw = rng.uniform(-0.005, 0.005), rng.uniform(-0.1, 0.1)
        found, lateral = track.nearest(x - aside * math.sin(heading), y + aside * math.cos(heading), heading + yaw)
        assert found == pytest.approx(s, abs=1e-4)
        assert lateral == pytest.approx(aside, abs=3e-5)


def test_locate_gives_the_tangent_at_the_foot():
    track = make_track("oval")
    for s in np.linspace(0.0, track.length, 97):
        x, y, heading = track.pose(s)
        _, _, tangent_x, tangent_y, curvature = track.locate(x, y, math.cos(heading), math.sin(heading))
        assert (tangent_x, tangent_y) == pytest.approx((math.cos(heading), math.sin(heading)), abs=2e-4)
        assert curvature == pytest.approx(track.curvature(s), abs=0.05)


def test_the_heading_chooses_the_branch_of_a_crossing():
    track = make_track("figure_eight")
    for s in (0.0, 0.5 * track.length):
        for ahead in (-0.01, 0.0, 0.01):
            x, y, heading = track.pose(s + ahead)
            for yaw in (-0.3, 0.0, 0.3):
                found, _ = track.nearest(x, y, heading + yaw)
                assert abs(math.remainder(found - s - ahead, track.length)) < 0.005
    assert track.pose(0.0)[:2] == pytest.approx(track.pose(0.5 * track.length)[:2], abs=1e-4)


@pytest.mark.parametrize("s, ahead", [(0.0, 0.01), (0.0, -0.01), (0.6, 0.01), (0.6, 0.3)])
def test_the_track_is_searched_near_a_place_at_first(s, ahead):
    """Across the seam too; and everywhere when the point is far from the place."""
    track = make_track("oval")
    x, y, heading = track.pose(s + ahead)
    found = track.locate(x, y, math.cos(heading), math.sin(heading), s)
    assert math.remainder(found[0] - s - ahead, track.length) == pytest.approx(0.0, abs=1e-4)
    assert found == track.locate(x, y, math.cos(heading), math.sin(heading))


def test_near_the_ends_of_an_open_track():
    line = make_track("line", centre=(0.0, 0.0))
    for near, y in ((0.0, -0.45), (0.002, -0.46), (0.9, 0.45), (0.895, 0.46)):
        s, lateral = line.locate(0.001, y, 0.0, 1.0, near)[:2]
        assert s == pytest.approx(0.0 if y < 0.0 else 0.9, abs=1e-3) and lateral == pytest.approx(-0.001)


def test_the_place_chooses_between_two_laps_in_the_same_direction(tmp_path):
    u = np.linspace(0.0, 4 * math.pi, 400, endpoint=False)
    radius = 0.15 + 0.002 * np.cos(0.5 * u)
    track = make_track("csv", csv=write(tmp_path, csv_of(np.column_stack([radius * np.cos(u), radius * np.sin(u)]))))
    for lap in (0.0, 0.5):
        s = (0.1 + lap) * track.length
        x, y, heading = track.pose(s)
        x, y = 0.15 * np.array([x, y]) / math.hypot(x, y)  # half-way between the laps
        assert track.locate(x, y, math.cos(heading), math.sin(heading), s)[0] == pytest.approx(s, abs=1e-3)


def corners(radius, step):
    """Points of an open track every ``step`` with corners of 60 to 180 deg, rounded to 10 um."""
    place, heading, pieces = np.array([0.5, -0.1]), 0.3, []
    for turn in np.radians([0.0, 70.0, -90.0, 120.0, -180.0, 90.0, 0.0]):
        u = np.linspace(0.0, turn, max(int(abs(turn) * 1000), 1))[1:]
        arc = np.column_stack([np.sin(heading + u) - math.sin(heading), math.cos(heading) - np.cos(heading + u)])
        pieces += [place + radius * np.sign(turn) * arc] if turn else []
        place, heading = pieces[-1][-1] if turn else place, heading + turn
        pieces.append(place + np.linspace(0.0, 0.06, 2000)[1:, None] * [math.cos(heading), math.sin(heading)])
        place = pieces[-1][-1]
    fine = np.concatenate(pieces)
    s = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(fine, axis=0).T))])
    return np.column_stack([np.interp(np.arange(0.0, s[-1], step), s, row) for row in fine.T]).round(5)


@pytest.mark.parametrize("step", [0.001, 0.002, 0.003, 0.004, 0.005])
def test_rounded_points_of_corners(tmp_path, step):
    file = write(tmp_path, csv_of(corners(0.010, step)))
    assert make_track("csv", csv=file, closed=False).min_radius() > 0.0091
    file = write(tmp_path, csv_of(corners(0.009, step)))
    with pytest.raises(
        DrakeTrackerError, match=r"radius of 8\.\d\d mm .* 10 mm are needed \(9\.10 mm with a tolerance of 9 %"
    ):
        make_track("csv", csv=file, closed=False)


def test_a_point_far_away_is_still_placed_on_the_track():
    track = make_track("circle")
    for x, y in ((0.56, 0.0), (5.0, 3.0), (-2.0, 0.1)):
        s, _ = track.nearest(x, y, 0.0)
        assert 0.0 <= s < track.length


def test_reversed_is_the_same_curve_the_other_way():
    track = make_track("stadium")
    back = track.reversed()
    s = np.linspace(0.0, track.length, 50)
    x, y, heading = track.pose(s)
    x_back, y_back, heading_back = back.pose(track.length - s)
    np.testing.assert_allclose([x_back, y_back], [x, y], atol=1e-4)
    np.testing.assert_allclose(np.cos(heading_back - heading), -1.0, atol=1e-4)
    assert back.pose(0.0)[:2] == pytest.approx(track.pose(0.0)[:2], abs=1e-9)
    line = make_track("line").reversed()
    assert line.pose(0.0)[1] == pytest.approx(0.45)


def test_moving_and_turning():
    track = make_track("oval", centre=(0.0, 0.0))
    moved = track.translated((0.1, -0.2)).rotated(math.pi / 2, about=(0.1, -0.2))
    x, y, heading = track.pose(0.2)
    assert moved.pose(0.2) == pytest.approx((0.1 - y, -0.2 + x, heading + math.pi / 2), abs=1e-9)
    same = make_track("oval", centre=(0.1, -0.2), rotation=math.pi / 2)
    np.testing.assert_allclose(same.points, moved.points, atol=1e-12)


def test_csv_passes_through_its_points_with_a_continuous_heading(tmp_path):
    points = circle_points(9)
    track = make_track("csv", csv=write(tmp_path, csv_of(points)), centre=(9.0, 9.0), rotation=1.0)
    assert track.closed and track.length == pytest.approx(2 * math.pi * 0.15, rel=1e-3)
    for x, y in points:
        assert np.hypot(*(track.points - (x, y)).T).min() < 1.5e-3
    heading = track.pose(np.linspace(0.0, 2 * track.length, 8001))[2]
    assert np.abs(np.diff(heading)).max() < 0.01
    assert track.min_radius() == pytest.approx(0.15, rel=0.05)


@pytest.mark.parametrize("count", [2, 3, 4, 9])
def test_an_open_csv_passes_through_its_points_and_ends_at_the_last_one(tmp_path, count):
    y = np.linspace(-0.2, 0.2, count) + 0.02 * np.sin(np.arange(count)) * (np.arange(count) % (count - 1) > 0)
    points = np.column_stack([0.5 + 0.5 * y**2, y])
    track = make_track("csv", csv=write(tmp_path, csv_of(points)), closed=False, centre=(9.0, 9.0))
    assert not track.closed
    np.testing.assert_allclose(track.points[[0, -1]], points[[0, -1]], atol=1e-6)
    for x, y in points:
        s, lateral = track.nearest(x, y, math.pi / 2)
        assert abs(lateral) < 1e-4 and 0.0 <= s <= track.length
    if count > 3:  # through unequally spaced points of a parabola, the spline is close to the parabola
        np.testing.assert_allclose(track.points[:, 0], 0.5 + 0.5 * track.points[:, 1] ** 2, atol=3e-4)


def test_a_csv_that_repeats_its_first_point_is_closed(tmp_path):
    points = circle_points(12)
    file = write(tmp_path, csv_of([*points, points[0]]))
    assert make_track("csv", csv=file, closed=False).closed
    file = write(tmp_path, csv_of(points))
    around, cut = make_track("csv", csv=file), make_track("csv", csv=file, closed=False)
    assert around.closed and not cut.closed and cut.length == pytest.approx(11 / 12 * around.length, rel=1e-3)


def test_an_open_csv_needs_two_points(tmp_path):
    with pytest.raises(DrakeTrackerError, match="has 1 point; an open track needs at least 2"):
        make_track("csv", csv=write(tmp_path, "x,y\n0.5,0.1\n"), closed=False)


@pytest.mark.parametrize("text", ["x,y\n", "\ufeffx,y\n", " X , Y \r\n"])
def test_csv_allows_what_editors_write(tmp_path, text):
    points = circle_points(12)
    body = csv_of([*points, points[0]]).split("\n", 1)[1] + "\n\n"  # closed by hand, blank lines at the end
    assert make_track("csv", csv=write(tmp_path, text + body)).length == pytest.approx(0.942, abs=2e-3)


@pytest.mark.parametrize(
    "text, said",
    [
        ("", "line 1: the header must be x,y"),
        ("u,v\n1,2\n", "line 1: the header must be x,y or x,y,z or x,y,z,bank, not 'u,v'"),
        ("0.1,0.2\n0.2,0.2\n", "line 1"),
        ("x,y\n0.5,0.1\n0.6,nan\n", "line 3: '0.6,nan' is not within 1000 m of the origin"),
        ("x,y\n0.5,0.1\n1e308,0.1\n-1e308,0.2\n", "line 3: '1e308,0.1' is not within 1000 m of the origin"),
        ("x,y\n0.5,0.1\n0.6,0.1\n0.6000000001,0.1\n0.4,0.3\n", "line 4: the point is the same"),
        (f"x,y\n0.5,{'1' * 5000}\n", "is not within 1000 m"),
        ("x,y\n" + "0.5,0.1\n" * 600_000, "it has more than 4096 KiB"),
        ("x,y\n0.5,0.1\n0.6,left\n", "line 3: '0.6,left' is not two numbers"),
        ("x,y\n0.5,0.1\n0.6\n", "line 3: '0.6' is not two numbers"),
        ("x,y,z\n0.5,0.1,0.02\n0.6,0.1\n", "line 3: '0.6,0.1' is not three numbers"),
        ("x,y,bank\n0.5,0.1,1\n", "the header must be x,y or x,y,z or x,y,z,bank"),
        ("x,y\n0.5,0.1\n0.6,0.2,0.3\n", "line 3"),
        ("x,y\n0.5,0.1\n0.6,0.2\n", "has 2 points"),
        ("x,y\n0.5,0.1\n0.5,0.1\n0.6,0.2\n0.4,0.3\n", "line 3: the point is the same"),
        (csv_of(circle_points(12, radius=0.02)), "0.126 m long"),
        (csv_of(1000 * circle_points(12)), "942 m long"),
    ],
)
def test_csv_that_cannot_be_used(tmp_path, text, said):
    with pytest.raises(DrakeTrackerError, match="track.csv") as raised:
        make_track("csv", csv=write(tmp_path, text))
    assert said in str(raised.value) and "\n" not in str(raised.value)


def test_csv_that_cannot_be_read(tmp_path):
    with pytest.raises(DrakeTrackerError, match="nowhere.csv.*cannot be read: No such file"):
        make_track("csv", csv=str(tmp_path / "nowhere.csv"))
    with pytest.raises(DrakeTrackerError, match="track.csv"):
        make_track("csv")
    (tmp_path / "image.csv").write_bytes(b"\x89PNG\xff\xfe\x00")
    with pytest.raises(DrakeTrackerError, match="image.csv.*not a text file"):
        make_track("csv", csv=str(tmp_path / "image.csv"))


def test_csv_with_a_corner_is_refused(tmp_path):
    side = np.linspace(0.0, 0.3, 31)[:-1]
    zero = np.zeros_like(side)
    edges = ((side, zero), (zero + 0.3, side), (0.3 - side, zero + 0.3), (zero, 0.3 - side))
    square = np.concatenate([np.column_stack(edge) for edge in edges])
    with pytest.raises(DrakeTrackerError, match="bends with a radius of .* at least 10 mm"):
        make_track("csv", csv=write(tmp_path, csv_of(square)))


@pytest.mark.parametrize(
    "arguments, said",
    [
        ({"kind": "spiral"}, "'spiral' is unknown; choose one of oval"),
        ({"kind": "oval", "semi_axes": (0.16, -0.2)}, "semi_axes"),
        ({"kind": "oval", "semi_axes": (0.16,)}, "semi_axes"),
        ({"kind": "oval", "semi_axes": (0.04, 0.3)}, "radius of 5\\.\\d\\d mm .* at least 10 mm are needed"),
        ({"kind": "oval", "semi_axes": (0.2, 2.2)}, "radius of \\d\\d\\.\\d\\d mm .* at least 27 mm are needed"),
        (
            {"kind": "sinusoid", "amplitude": 0.1, "wavelength": 0.1},
            "'sinusoid' bends with a radius of \\d\\.\\d\\d mm",
        ),
        ({"kind": "sinusoid", "amplitude": -0.1}, "amplitude is -0.1"),
        ({"kind": "polynomial", "coefficients": ()}, "coefficients is"),
        ({"kind": "polynomial", "coefficients": (0.0, float("inf"))}, "coefficients is"),
        ({"kind": "random_walk", "corner_radius": 0.008}, "radius of \\d\\.\\d\\d mm"),
        ({"kind": "random_walk", "straight_range": (0.1,)}, "straight_range"),
        ({"kind": "circle", "radius": float("nan")}, "radius is nan"),
        ({"kind": "stadium", "straight": 0.0}, "straight is 0"),
        ({"kind": "line", "length": 30.0}, "30 m long"),
    ],
)
def test_sizes_that_cannot_be(arguments, said):
    with pytest.raises(DrakeTrackerError, match=said):
        make_track(**arguments)
