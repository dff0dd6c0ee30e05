import functools
import itertools
from xml.etree import ElementTree

import numpy as np
import pytest

from drake_tracker import DrakeTrackerError, load_scenario
from drake_tracker.core.models_path import models_path
from drake_tracker.tasks.train import track_placement
from drake_tracker.tasks.train.reach import Reach
from drake_tracker.tasks.train.setup import resolve
from drake_tracker.tasks.train.track_placement import (
    check_track,
    last_place,
    place_other_track,
    place_outside,
    place_track,
    time_within_reach,
)
from drake_tracker.vision.region_of_interest import is_within
from drake_tracker.world.train.plant import CUBE_WHEELS, TABLE_TOP, WHEELS

OUT_OF_REACH = 110
"""A seed whose first figure-eight inside the work volume is too close to the base of the arm."""


@functools.cache
def reach():
    """The reach of the arm, which no override in these tests changes."""
    return resolve(load_scenario("train:learned")).reach


def drawn(*overrides, seed=3):
    return place_track(load_scenario("train:learned", seed=seed, overrides=overrides), reach())


def turning(track):
    """Total turn of the heading in one lap [rad], positive when it runs anticlockwise."""
    return track.pose(track.length * 1.0)[2] - track.pose(0.0)[2]


def test_the_same_seed_draws_the_same_track():
    (a, start_a), (b, start_b) = drawn(), drawn()
    assert np.array_equal(a.points, b.points) and start_a == start_b


@pytest.fixture
def everything_within_reach(monkeypatch):
    """An arm that reaches every place, for tests of where many tracks are placed: the check of the reach is slow."""
    monkeypatch.setattr(Reach, "missed", lambda self, track: None)
    monkeypatch.setattr(Reach, "reached", lambda self, track, s: np.ones(len(s), dtype=bool))


@pytest.mark.usefixtures("everything_within_reach")
def test_seeds_draw_place_rotation_direction_and_start_within_their_ranges():
    tracks = [drawn(seed=seed) for seed in range(60)]
    centres = np.array([track.points.mean(axis=0) for track, _ in tracks]) - [0.56, 0.0]
    assert np.all(np.abs(centres) <= 0.030 + 1e-9)
    assert np.all(np.ptp(centres, axis=0) > 0.045)
    rotations = []
    for track, _ in tracks:
        _, axes = np.linalg.eigh(np.cov(track.points.T))
        long_axis = axes[:, 1] * np.sign(axes[1, 1])
        rotations.append(np.rad2deg(np.arctan2(-long_axis[0], long_axis[1])))
    assert np.max(np.abs(rotations)) <= 15.01 and np.ptp(rotations) > 22.0
    forward = sum(turning(track) > 0 for track, _ in tracks)
    assert 18 <= forward <= 42
    fractions = np.array([start / track.length for track, start in tracks])
    assert fractions.min() < 0.1 and fractions.max() > 0.9 and np.all((fractions >= 0) & (fractions < 1))


def test_values_that_the_scenario_sets_are_not_drawn():
    settled = ["track.centre_range=0", "track.rotation_range_deg=0", "track.direction=forward", "track.start=0.25"]
    tracks = [drawn(*settled, seed=seed) for seed in range(4)]
    for track, start in tracks:
        assert np.array_equal(track.points, tracks[0][0].points)
        assert start == pytest.approx(0.25 * track.length)
    back, _ = drawn(*settled[:2], "track.direction=backward")
    assert turning(back) == pytest.approx(-turning(tracks[0][0])) == pytest.approx(-2 * np.pi)


def test_rotation_is_in_degrees_about_the_centre():
    settled = ["track.centre_range=0", "track.rotation_range_deg=0", "track.rotation_deg=90"]
    track, _ = drawn(*settled)
    assert np.ptp(track.points, axis=0) == pytest.approx([0.44, 0.32], abs=1e-3)
    assert track.points.mean(axis=0) == pytest.approx([0.56, 0.0], abs=1e-3)


def test_a_csv_is_used_unchanged(tmp_path):
    angle = np.linspace(0.0, 2 * np.pi, 40, endpoint=False)
    points = np.column_stack([0.55 + 0.13 * np.cos(angle), 0.02 + 0.18 * np.sin(angle)])
    file = tmp_path / "mine.csv"
    file.write_text("x,y\n" + "\n".join(f"{x:.6f},{y:.6f}" for x, y in points))
    for seed in range(3):
        track, _ = drawn("track.kind=csv", f"track.csv={file}", "track.direction=forward", seed=seed)
        for x, y in points[::7]:
            assert np.min(np.hypot(*(track.points - [x, y]).T)) < 2e-3
        assert track.points.mean(axis=0) == pytest.approx([0.55, 0.02], abs=2e-3)


def test_a_csv_may_cross_and_touch_itself(tmp_path):
    """Two laps, 2 mm apart, which cross at a small angle, and a loop that crosses them at right angles."""
    angle = np.linspace(0.0, 4 * np.pi, 200, endpoint=False)
    radius = 0.14 + 0.001 * np.cos(0.5 * angle)
    laps = np.column_stack([0.56 + radius * np.cos(angle), radius * np.sin(angle)])
    eight = np.column_stack([0.56 + 0.1 * np.sin(angle), 0.16 * np.sin(0.5 * angle)])
    for name, points in (("laps", laps), ("eight", eight)):
        file = tmp_path / f"{name}.csv"
        file.write_text("x,y\n" + "\n".join(f"{x:.6f},{y:.6f}" for x, y in points))
        assert check("track.kind=csv", f"track.csv={file}").closed


def line(*overrides, seed=3):
    return load_scenario("train:line", seed=seed, overrides=overrides)


@pytest.mark.parametrize("kind", ["line", "sinusoid", "polynomial", "random_walk"])
def test_an_open_track_starts_at_its_beginning(kind):
    track, start = place_track(line(f"track.kind={kind}", seed=5), reach())
    assert not track.closed and start == 0.0


def test_an_open_csv_is_used_unchanged(tmp_path):
    file = tmp_path / "mine.csv"
    file.write_text("x,y\n0.5,-0.3\n0.58,0.0\n0.5,0.3\n")
    settings = ["track.kind=csv", f"track.csv={file}", "track.closed=false"]
    for direction, ends in (("forward", (-0.3, 0.3)), ("backward", (0.3, -0.3))):
        track = check(*settings, f"track.direction={direction}")
        assert not track.closed and (track.points[0, 1], track.points[-1, 1]) == pytest.approx(ends)
    with pytest.raises(DrakeTrackerError, match="track.csv = .*mine.csv: the train is in the work volume and within"):
        check(*settings, "track.speed=0.5")


@pytest.mark.parametrize("kind", ["sinusoid", "polynomial"])
def test_a_sinusoid_and_a_polynomial_are_placed_as_a_line_is(kind, monkeypatch):
    monkeypatch.setattr(track_placement, "MOST_MISSED", 3)
    settings = ["track.direction=forward", "track.length=0.6"]
    straight, _ = drawn("track.kind=line", *settings, seed=4)
    middle = straight.pose(0.5 * straight.length)
    track, _ = drawn(f"track.kind={kind}", *settings, seed=4)
    assert track.pose(0.5 * track.length)[:2] == pytest.approx(middle[:2], abs=2e-3)
    with pytest.raises(DrakeTrackerError, match=f"track.kind = {kind}: rails or train would be beyond the table at"):
        check(f"track.kind={kind}", "track.length=1.2")
    with pytest.raises(DrakeTrackerError, match=f"track.kind = {kind}: the train is in the work volume and within"):
        check(f"track.kind={kind}", "track.speed=0.6")


WALK = ("track.kind=random_walk", "track.corner_radius=0.01")


def test_a_random_walk_stays_in_the_work_volume_on_the_table_and_within_reach():
    for seed in range(4):
        scenario = load_scenario("train:learned", seed=seed, overrides=WALK)
        track, start = place_track(scenario, reach())
        check_track(scenario, track, start, reach())
        assert start == 0.0 and track.length == pytest.approx(0.9, rel=2e-3)
        assert is_within(scenario.vision.work_volume, "ellipse", track.points).all()
    on_table = line(*WALK, "vision.work_volume=[[0.0, -0.9, 0.45], [1.2, 0.9, 0.51]]")
    track, _ = place_track(on_table, reach())
    assert np.all((track.points > np.add(TABLE_TOP[0], 0.045)) & (track.points < np.subtract(TABLE_TOP[1], 0.045)))


def test_the_seed_draws_the_random_walk_and_nothing_else_changes():
    (a, _), (b, _), (c, _) = (drawn(*WALK, seed=seed) for seed in (3, 3, 4))
    assert np.array_equal(a.points, b.points) and not np.array_equal(a.points, c.points)
    forward, backward = (drawn(*WALK, f"track.direction={way}")[0] for way in ("forward", "backward"))
    assert np.array_equal(forward.points, backward.points[::-1])
    scenario = load_scenario("train:learned", seed=3, overrides=WALK)
    other, _ = place_other_track(scenario, 0)
    assert not np.array_equal(other.points, a.points)


def test_a_random_walk_out_of_reach_is_drawn_again(monkeypatch):
    tracks = []
    missed = iter([(0.5, 0.0, 0.1)] * 2)
    monkeypatch.setattr(Reach, "missed", lambda self, track: tracks.append(track) or next(missed, None))
    track, _ = drawn(*WALK)
    assert len(tracks) == 3 and track is tracks[2]
    assert not np.array_equal(tracks[0].points, tracks[1].points)


@pytest.mark.parametrize(
    "overrides, said",
    [
        (["track.length=2", "vision.work_volume=[[0.5,-0.1,0.45],[0.6,0.1,0.51]]"], "no walk of 2 m was found"),
        (["vision.work_volume=[[1.5,-0.1,0.45],[1.6,0.1,0.51]]"], "is not above the table"),
    ],
)
def test_a_random_walk_without_room_is_rejected(overrides, said):
    with pytest.raises(DrakeTrackerError, match=said) as error:
        drawn(*WALK, *overrides)
    assert "random_walk" in str(error.value) and "\n" not in str(error.value)


@pytest.mark.parametrize(
    "overrides, said",
    [
        (["track.closed=false"], "track.closed must be true: the kind oval is always closed; choose line, sinusoid"),
        (["track.kind=random_walk", "track.length=2.5"], "track.length must be at most 2 m when track.kind is random"),
        (["track.kind=random_walk", "track.straight_range=[0.2, 0.1]"], "track.straight_range must give the shortest"),
        (["track.kind=random_walk", "track.corner_radius=0.009"], "track.corner_radius must be a number from 0.01"),
        (["track.coefficients=0.1"], "track.coefficients must be a list of numbers from -2 to 2 m, not 0.1"),
        (["objects=[!Train {track: {kind: circle, closed: false}}]"], "objects[0].track.closed must be true"),
    ],
)
def test_settings_that_contradict_the_kind_are_one_line(overrides, said):
    with pytest.raises(DrakeTrackerError) as error:
        load_scenario("train:learned", overrides=overrides)
    assert said in str(error.value) and "\n" not in str(error.value)


@pytest.mark.parametrize("kind", ["line", "sinusoid", "polynomial", "random_walk"])
def test_closed_does_not_apply_to_kinds_that_are_open(kind):
    for closed in ("true", "false"):
        load_scenario("train:learned", overrides=[f"track.kind={kind}", f"track.closed={closed}"])


@pytest.mark.usefixtures("everything_within_reach")
@pytest.mark.parametrize("direction", ["forward", "backward"])
def test_a_line_lies_on_the_table_with_the_train_at_its_start_and_where_it_stops(direction):
    low, high = TABLE_TOP
    offsets = []
    for seed in range(20):
        track, start = place_track(line(f"track.direction={direction}", seed=seed), reach())
        for s in (start, last_place(track)):
            x, y, heading = track.pose(s)
            cos, sin = np.cos(heading), np.sin(heading)
            for along, across in itertools.product((-0.045, 0.045), (-0.015, 0.015)):
                wheel = (x + along * cos - across * sin, y + along * sin + across * cos)
                assert np.all(np.greater_equal(wheel, low) & np.less_equal(wheel, high)), (seed, wheel)
        assert np.all((track.points > low) & (track.points < high))
        offsets.append(track.points.mean(axis=0) - [0.56, 0.0])
    assert np.max(np.abs(offsets)) <= 0.03 + 1e-9 and np.ptp(offsets, axis=0)[0] > 0.04


def test_a_line_that_fits_where_it_was_drawn_first_stays_there():
    scenario = line(seed=2)
    offset, turn = np.split(np.random.default_rng([2, 1]).uniform(-1.0, 1.0, 3), [2])
    track, _ = place_track(scenario, reach())
    assert track.points.mean(axis=0) == pytest.approx(scenario.track.centre + 0.03 * offset)
    assert track.pose(0.0)[2] == pytest.approx(np.pi / 2 + np.radians(5.0) * turn[0])


def test_the_extents_of_table_and_wheels_are_those_of_the_models():
    def numbers(element, path):
        return np.array(element.find(path).text.split(), dtype=float)

    top = ElementTree.parse(models_path() / "table" / "table.sdf").find(".//collision[@name='top']")
    middle, half = numbers(top, "pose")[:2], numbers(top, "geometry/box/size")[:2] / 2
    assert np.array(TABLE_TOP) == pytest.approx(np.array([middle - half, middle + half]))
    for model in sorted((models_path() / "train").glob("train_*.sdf")):
        wheels = [c for c in ElementTree.parse(model).iter("collision") if c.get("name").startswith("wheel")]
        assert len(wheels) == 4
        for wheel in wheels:
            extents = CUBE_WHEELS if model.stem == "train_cube" else WHEELS
            assert np.abs(numbers(wheel, "pose")[:2]) == pytest.approx(np.array(extents))


def check(*overrides, seed=3):
    scenario = load_scenario("train:learned", seed=seed, overrides=overrides)
    arm = resolve(scenario).reach
    track, start = place_track(scenario, arm)
    check_track(scenario, track, start, arm)
    return track


@pytest.mark.parametrize("kind", ["oval", "circle", "stadium", "figure_eight"])
def test_tracks_of_every_kind_are_within_reach(kind):
    check(f"track.kind={kind}")


@pytest.mark.parametrize("seed", range(100, 106))
def test_every_seed_of_the_default_is_within_reach(seed):
    check(seed=seed)


def test_a_placement_out_of_reach_is_drawn_again(monkeypatch):
    track = check("track.kind=figure_eight", seed=OUT_OF_REACH)
    monkeypatch.setattr(Reach, "missed", lambda self, track: None)
    first, _ = drawn("track.kind=figure_eight", seed=OUT_OF_REACH)
    assert not np.array_equal(first.points, track.points)


@pytest.mark.usefixtures("everything_within_reach")
@pytest.mark.parametrize("kind", ["figure_eight", "stadium"])
def test_a_placement_outside_the_work_volume_is_drawn_again(kind):
    for seed in range(60):
        scenario = load_scenario("train:learned", seed=seed, overrides=[f"track.kind={kind}"])
        track, _ = place_track(scenario, reach())
        assert place_outside(scenario, track) is None
        centre = track.points.mean(axis=0) - scenario.track.centre
        assert np.all(np.abs(centre) <= scenario.track.centre_range + 1e-3)


def test_a_track_outside_the_work_volume_is_rejected():
    with pytest.raises(DrakeTrackerError) as error:
        check("track.semi_axes=[0.20,0.40]")
    (line,) = str(error.value).split("\n")
    assert "track.kind" in line and "outside the ellipse of x 0.33 to 0.79" in line and "vision.work_volume" in line


def test_a_track_out_of_reach_is_rejected():
    wide = "vision.work_volume=[[0.2,-0.6,0.45],[1.2,0.6,0.505]]"
    with pytest.raises(DrakeTrackerError) as error:
        check(wide, "track.centre=[0.72,0.2]", "track.rotation_range_deg=0", "track.centre_range=0")
    (line,) = str(error.value).split("\n")
    assert "out of the arm's reach at (" in line and "track.kind (default) = oval" in line


def test_the_message_names_the_override():
    with pytest.raises(DrakeTrackerError, match="^--set track.kind=circle: track.kind = circle"):
        check("track.kind=circle", "track.radius=0.4")


def test_a_track_beyond_the_table_is_rejected(tmp_path):
    wide = "vision.work_volume=[[0.2,-0.6,0.45],[1.2,0.6,0.505]]"
    angle = np.linspace(0.0, 2 * np.pi, 40, endpoint=False)
    file = tmp_path / "mine.csv"
    rows = (f"{0.55 + 0.12 * np.cos(a):.4f},{0.40 + 0.12 * np.sin(a):.4f}" for a in angle)
    file.write_text("x,y\n" + "\n".join(rows))
    for overrides in ([wide, "track.kind=csv", f"track.csv={file}"], ["track.kind=line", "track.length=1.2"]):
        with pytest.raises(DrakeTrackerError) as error:
            check(*overrides)
        (text,) = str(error.value).split("\n")
        assert "beyond the table at (" in text and "covers x 0.21 to 0.91, y -0.5 to 0.5 m" in text


def test_a_train_that_starts_at_the_end_of_a_line_is_rejected():
    with pytest.raises(DrakeTrackerError, match=r"for 0\.0 s only"):
        check("track.kind=line", "track.start=1.0", "track.direction=forward")


@pytest.mark.parametrize(
    "overrides",
    [
        ["track.speed=0.5"],
        ["track.start=0.8"],
        ["vision.work_volume=[[0.44, -0.10, 0.45], [0.68, 0.10, 0.51]]"],
        ["track.speed=0.15", "track.centre=[0.84, 0.0]", "vision.work_volume=[[0.3, -0.50, 0.45], [0.9, 0.50, 0.51]]"],
    ],
)
def test_a_line_that_leaves_no_time_for_a_grasp_is_rejected(overrides):
    scenario = line(*overrides)
    arm = resolve(scenario).reach
    with pytest.raises(DrakeTrackerError) as error:
        check_track(scenario, *place_track(scenario, arm), arm)
    (text,) = str(error.value).split("\n")
    assert "track.kind = line: the train is in the work volume and within the arm's reach for" in text
    assert "a grasp takes 2.4 s" in text


def test_the_time_within_reach_counts_the_rests_of_a_speed_law():
    times = []
    for law in ("constant", "stop_and_go"):
        scenario = line(f"track.speed_law={law}")
        times.append(time_within_reach(scenario, *place_track(scenario, reach()), reach()))
    assert times[0] == pytest.approx(8.4, abs=0.1) and times[1] == pytest.approx(10.4, abs=0.1)
