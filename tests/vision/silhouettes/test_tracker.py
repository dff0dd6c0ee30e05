from dataclasses import replace

import numpy as np
import pytest
from cuboids import CAMERAS, HEIGHT, PERIOD, Cuboid, Stage, oval
from tracker_run import BLUE, GOLD, NEAR, RED, Run, during, on_line, on_oval, standing

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.messages import TRACK_SLOTS, TrackState
from drake_tracker.vision.silhouettes.config import SilhouetteTracker
from drake_tracker.vision.silhouettes.stereo_geometry import projection_jacobian
from drake_tracker.vision.silhouettes.tracker import Expected, Tracker


def test_an_empty_scene_has_no_tracks():
    run = Run(Stage([])).watch(0.2)
    assert run.state.tracks == () and run.state.usable and run.state.overflow == 0
    assert run.state.stamp == pytest.approx(11 * PERIOD)


def test_one_object_on_an_oval():
    run = Run(Stage([(Cuboid(), on_oval())])).watch(4.0)
    assert run.numbers() == {1}
    errors, share = run.errors(1, 0, since=1.0)
    assert share == 1.0
    assert np.median(errors) < 0.005 and errors.max() < 0.012
    track = run.tracks[1]
    _, velocity = oval(run.state.stamp)
    np.testing.assert_allclose(track.mean[3:], velocity, atol=0.05)
    np.testing.assert_allclose(track.shape.dimensions, (0.11, 0.04, 0.05), atol=0.015)
    assert track.colour == pytest.approx(GOLD, abs=15)
    assert track.state == TrackState.MOVING and track.seen == run.state.stamp


def test_the_covariance_covers_the_error():
    run = Run(Stage([(Cuboid(), on_oval())])).watch(3.0)
    distances = []
    for time, truth, state in run.history:
        for track in state.confirmed():
            if time > 1.0 and track.measurement is not None:
                error = track.measurement.p_WQ - truth[0]
                distances.append(error @ np.linalg.solve(track.measurement.covariance, error))
    assert np.mean(np.array(distances) < 7.8) > 0.9  # 95 % of a chi-square of three dimensions


def test_a_track_is_confirmed_after_the_given_number_of_pairs():
    for after in (1, 5, 20):
        run = Run(Stage([(Cuboid(), on_oval())]), SilhouetteTracker(confirm_after=after)).watch(1.0)
        first = next(k for k, (_, _, state) in enumerate(run.history) if state.confirmed())
        # In the first image nothing is known to move.
        assert first == after
        assert run.tracks[1].number == 1


def test_an_object_that_stops_is_measured_on():
    def path(time):
        state = oval(min(time, 1.5))
        return state if time < 1.5 else (state[0], np.zeros(3))

    run = Run(Stage([(Cuboid(), path)])).watch(5.0)
    assert run.numbers() == {1}
    assert run.tracks[1].state == TrackState.STANDING
    errors, share = run.errors(1, 0, since=1.0)
    assert share == 1.0 and errors.max() < 0.012
    assert run.tracks[1].speed < 0.01


def test_an_object_that_never_moved_is_no_track():
    run = Run(Stage([(Cuboid(), standing(0.56, 0.1))])).watch(1.0)
    assert run.state.tracks == ()
    assert len(run.state.regions[0]) == 1, "it is seen nevertheless"


def test_an_object_that_stands_and_starts():
    def path(time):
        return standing(0.56, -0.1)(0.0) if time < 1.0 else on_line((0.56, -0.25), (0.0, 0.15))(time)

    run = Run(Stage([(Cuboid(), path)])).watch(2.0)
    assert run.numbers() == {1} and run.tracks[1].state == TrackState.MOVING


def all_hidden(first, last):
    """The arm hides both images for some time."""
    hidden = np.full((256, 256), 255, np.uint8)
    return lambda time, side: hidden if first <= time < last else None


def test_a_track_coasts_through_an_occlusion():
    run = Run(Stage([(Cuboid(), on_line((0.56, -0.2), (0.0, 0.15)))], all_hidden(1.2, 1.8))).watch(2.5)
    assert run.numbers() == {1}
    states = {round(time, 2): state.confirmed()[0].state for time, _, state in run.history if time > 0.5}
    assert states[1.0] == TrackState.MOVING and states[1.5] == TrackState.OCCLUDED
    assert run.tracks[1].measurement is not None
    errors, _ = run.errors(1, 0, since=1.9)
    assert len(errors) > 30 and errors.max() < NEAR


def test_what_the_estimator_expects_leads_through_a_bend():
    """Without it, the track leaves the bend along a straight line."""
    stage = [(Cuboid(), on_oval(start=0.16))], all_hidden(2.0, 3.5)
    alone = Run(Stage(*stage)).watch(3.45)
    led = Run(Stage(*stage)).watch(
        3.45, expected=lambda time: {1: Expected(*oval(time, start=0.16), 0.004)} if time > 2.0 else {}
    )
    misses = [
        np.linalg.norm(run.tracks[1].position - run.history[-1][1][0]) if 1 in run.tracks else np.inf
        for run in (alone, led)
    ]
    assert misses[1] < 0.005 < 0.04 < misses[0]
    led.watch(0.5, expected=lambda time: {1: Expected(*oval(time, start=0.16), 0.004)} if time < 3.5 else {})
    assert led.numbers() == {1} and led.tracks[1].measurement is not None


def test_on_a_hill_an_expectation_does_not_reset_the_uncertainty():
    """The estimator knows the height only from points of the track, which may be wrong."""
    stds = []
    for heights in ((HEIGHT, HEIGHT), (HEIGHT - 0.02, HEIGHT + 0.02)):
        run = Run(Stage([(Cuboid(), on_oval(start=0.16))], all_hidden(2.0, 3.5))).watch(1.95)
        run.state = replace(run.state, tracks=(replace(run.tracks[1], heights=heights),))
        run.watch(1.0, expected=lambda time: {1: Expected(*oval(time, start=0.16), 0.004)})
        stds.append(np.sqrt(run.tracks[1].covariance[2, 2]))
    assert stds[0] < 0.006 < 0.05 < stds[1]


def test_an_expectation_does_not_move_an_object_that_is_seen():
    wrong = {1: Expected(np.array([0.7, 0.2, HEIGHT]), np.array([0.1, 0.0, 0.0]), 0.001)}
    plain, led = (Run(Stage([(Cuboid(), on_oval())])) for _ in range(2))
    plain.watch(1.5)
    led.watch(1.5, expected=lambda time: wrong)
    np.testing.assert_array_equal(plain.tracks[1].mean, led.tracks[1].mean)


def turned_away(left, right=lambda time: 0):
    """What cameras do not show that turned away: the columns before those that functions of the time give."""

    def missing(time, side):
        columns = (left, right)[side](time)
        mask = np.zeros((256, 256), np.uint8)
        mask[:, :columns] = 255
        return mask if columns else None

    return missing


def test_a_camera_that_turned_away_does_not_stop_the_other_one():
    """The left image shows a part of the object only: its centroid would be wrong, and is not used."""
    path = on_line((0.56, -0.1), (0.0, 0.1))
    cut = turned_away(lambda time: round(CAMERAS[0].project([path(time)[0]])[0, 0]) if 1.0 <= time < 2.0 else 0)
    run = Run(Stage([(Cuboid(), path)], missing=cut)).watch(2.5)
    errors, share = run.errors(1, 0, since=1.0)
    assert share == 1.0 and errors.max() < NEAR
    for time, _, state in run.history:
        if time >= 0.9:
            (track,) = state.confirmed()
            assert (track.places[0] >= 0) != (1.0 <= time < 2.0) and track.places[1] >= 0
            assert all(region.cut for region in state.regions[0]) == (1.0 <= time < 2.0)


def test_an_object_comes_back_into_view_with_another_heading():
    """Its silhouette is longer than it would be with the old heading, but shows no second object."""
    path = on_oval(start=0.4)
    away = turned_away(lambda time: 256 if time > 2.0 else 0, lambda time: 256 if 2.0 < time < 3.5 else 0)
    run = Run(Stage([(Cuboid(), path)], missing=away))

    def expected(time):
        p_WQ, v_WQ = path(time)
        return {1: Expected(p_WQ + [0.0, 0.03, 0.0], v_WQ, 0.03)} if time > 2.0 else {}

    run.watch(4.0, expected=expected)
    states = {round(time, 2): state.confirmed()[0].state for time, _, state in run.history if time > 0.5}
    assert states[1.9] == TrackState.MOVING and states[3.0] == TrackState.OUT_OF_VIEW
    errors, share = run.errors(1, 0, since=3.52)
    assert share == 1.0 and errors.max() < 0.5 * NEAR


def test_an_object_that_is_cut_off_is_no_new_track():
    cut = turned_away(lambda time: round(CAMERAS[0].project([[0.6, 0.0, HEIGHT]])[0, 0]))
    path = on_line((0.6, -0.02), (0.0, 0.02))
    assert not Run(Stage([(Cuboid(), path)], missing=cut)).watch(0.5).state.tracks


def bordered(point, sides):
    """Borders for a `Stage`: nothing is looked at on the far side (+y) of a point, in the images of some sides."""
    borders = [None, None]
    for side in sides:
        camera = CAMERAS[side]
        here, there = camera.project([point, point + [0.0, 0.1, 0.0]])[:, 0]
        columns = np.arange(camera.width)
        beyond = columns > here - 3 if there > here else columns < here + 3
        borders[side] = np.where(np.tile(beyond, (camera.height, 1)), np.uint8(255), np.uint8(0))
    return borders


def test_an_object_that_enters_the_view_begins_a_track_when_all_of_it_is_seen():
    edge = np.array([0.56, 0.05, HEIGHT])
    path = on_line((0.56, 0.12), (0.0, -0.1))
    run = Run(Stage([(Cuboid(), path)], borders=bordered(edge, (0, 1)))).watch(2.0)
    begun = [(time, path(time)[0]) for time, _, state in run.history if state.confirmed()]
    assert begun, "it is found"
    errors, _ = run.errors(1, 0, since=begun[0][0])
    assert errors.max() < NEAR
    assert np.linalg.norm(begun[0][1] - edge) > 0.4 * Cuboid().dimensions[0], "not before"


@pytest.mark.parametrize("sides", [(0,), (0, 1)])
def test_an_object_that_stops_at_the_border_is_located_by_the_part_that_is_seen(sides):
    """By the other image where that shows the whole object, otherwise by the size that it had before."""
    edge = np.array([0.56, 0.10, HEIGHT])
    line = on_line((0.56, -0.1), (0.0, 0.1))

    def path(time):
        return line(time) if time < 1.9 else (line(1.9)[0], np.zeros(3))

    run = Run(Stage([(Cuboid(), path)], borders=bordered(edge, sides))).watch(3.0)
    errors, share = run.errors(1, 0, since=1.5)
    assert share == 1.0 and errors.max() < 1.5 * NEAR
    (region,) = run.history[-1][2].regions[0]
    assert region.beyond and region.covered and not region.cut


def test_a_track_that_is_not_seen_is_deleted_and_its_number_is_not_used_again():
    settings = SilhouetteTracker(coast_time=0.5)
    path = on_oval()
    run = Run(Stage([(Cuboid(), lambda time: path(time) if time < 1.0 or time >= 2.0 else None)]), settings)
    run.watch(1.4)
    assert run.tracks[1].state == TrackState.NOT_OBSERVED
    run.watch(0.5)
    assert run.tracks == {} and run.state.next_number == 2
    run.watch(1.0)
    assert set(run.tracks) == {2} and run.state.next_number == 3


def test_what_is_covered_is_kept_longer_than_what_has_vanished():
    def seconds(stage):
        run = Run(stage, SilhouetteTracker(coast_time=0.4)).watch(4.0)
        last = max(time for time, _, state in run.history if state.confirmed())
        return last - 1.0

    line = on_line((0.56, -0.2), (0.0, 0.05))
    vanished = seconds(Stage([(Cuboid(), during(line, 0.0, 1.0))]))
    covered = seconds(Stage([(Cuboid(), line)], all_hidden(1.0, 9.0)))
    assert vanished == pytest.approx(0.4, abs=0.05) and covered > 2.0 * vanished


def test_a_flash_in_a_single_image_is_no_track():
    flash = during(standing(0.56, 0.1), 0.5 - 0.001, 0.5 + PERIOD / 2)
    run = Run(Stage([(Cuboid(), flash)])).watch(1.0)
    assert run.numbers() == set() and run.state.next_number == 1 and run.state.tracks == ()


def test_flashes_beside_an_object_do_not_disturb_it():
    rng = np.random.default_rng(3)
    places = rng.uniform((0.4, -0.25), (0.75, 0.25), (180, 2))

    def flash(time):
        number = round(time / PERIOD)
        place = places[min(number, 179)]
        far = np.hypot(*(oval(time)[0][:2] - place)) > 0.2
        return standing(*place)(time) if number % 4 == 0 and far else None

    run = Run(Stage([(Cuboid(), on_oval()), (Cuboid((0.04, 0.04, 0.04), RED), flash)])).watch(3.0)
    assert run.numbers() == {1}
    errors, share = run.errors(1, 0, since=1.0)
    assert share > 0.95 and errors.max() < NEAR


class CrossedStage(Stage):
    """One object that only the left camera sees, and one that only the right camera sees."""

    def foregrounds(self, time, usable=True):
        left = Stage([self.objects[0]]).foregrounds(time)[0]
        right = Stage([self.objects[1]]).foregrounds(time)[1]
        return [replace(left, moving=left.mask), replace(right, moving=right.mask)]


def test_regions_whose_rays_do_not_meet_are_no_object():
    objects = [(Cuboid(), standing(0.45, -0.1)), (Cuboid(), standing(0.70, 0.15))]
    run = Run(CrossedStage(objects)).watch(0.5)
    assert len(run.state.regions[0]) == len(run.state.regions[1]) == 1
    assert run.state.tracks == ()


def test_the_right_pairs_are_chosen_where_wrong_ones_also_meet():
    """Three objects begin at once, with six ways to pair their regions."""
    cube = (0.04, 0.04, 0.04)
    objects = [
        (Cuboid(cube), on_line((0.50, -0.15), (0.1, 0.1))),
        (Cuboid(cube, BLUE), on_line((0.62, 0.02), (0.1, 0.1))),
        (Cuboid(cube, RED), on_line((0.56, 0.20), (0.1, -0.1))),
    ]
    run = Run(Stage(objects)).watch(0.6)
    assert len(run.tracks) == 3
    for truth in run.history[-1][1]:
        nearest = min(np.linalg.norm(track.position - truth) for track in run.tracks.values())
        assert nearest < NEAR


def test_what_is_outside_of_the_work_volume_is_no_object():
    high = lambda time: (on_oval()(time)[0] + [0.0, 0.0, 0.2], on_oval()(time)[1])  # noqa: E731
    run = Run(Stage([(Cuboid(), high)])).watch(0.5)
    assert run.state.regions[0] and run.state.tracks == ()
    anywhere = Run(Stage([(Cuboid(), high)]), tracker=Tracker(CAMERAS)).watch(0.5)
    assert len(anywhere.tracks) == 1


def test_images_that_cannot_be_used():
    run = Run(Stage([(Cuboid(), on_oval())])).watch(1.5, usable=lambda time: not 1.0 <= time < 1.3)
    dark = [(time, state) for time, _, state in run.history if 1.0 <= time < 1.3]
    for time, state in dark:
        assert not state.usable and state.regions == ((), ())
        assert state.stamp == pytest.approx(time)
        (track,) = state.confirmed()
        assert track.measurement is None and track.places == (-1, -1)
        assert track.seen < 1.0
    assert run.numbers() == {1} and run.tracks[1].measurement is not None and run.state.usable


def test_images_that_cannot_be_used_for_long_end_the_tracks():
    run = Run(Stage([(Cuboid(), on_oval())]), SilhouetteTracker(coast_time=0.5)).watch(
        2.0, usable=lambda time: time < 1.0
    )
    assert run.tracks == {}


def test_the_places_are_the_regions_of_the_tracks():
    run = Run(Stage([(Cuboid(), on_oval()), (Cuboid(colour=BLUE), on_oval(start=0.4))])).watch(1.5)
    for thing, truth in enumerate(run.history[-1][1]):
        (number,) = run.identities(since=1.0)[thing]
        track = run.tracks[number]
        for camera, regions, place in zip(CAMERAS, run.state.regions, track.places):
            region = regions[place]
            assert region.track == number
            assert np.hypot(*(camera.project(truth)[0] - (region.u, region.v))) < 3.0


def test_no_more_tracks_than_a_message_holds():
    places = [(0.40 + 0.085 * (k % 4), -0.22 + 0.2 * (k // 4)) for k in range(12)]
    objects = [(Cuboid((0.03, 0.03, 0.03)), on_line(place, (0.0, 0.1))) for place in places]
    run = Run(Stage(objects)).watch(0.6)
    assert len(run.state.tracks) == TRACK_SLOTS
    assert run.numbers() == set(range(1, TRACK_SLOTS + 1))


def test_numbers_are_never_used_twice():
    """Objects come and go; a number that has gone does not return."""
    objects = [
        (Cuboid(), during(on_line((0.45 + 0.05 * k, -0.2), (0.02, 0.15)), 0.6 * k, 0.6 * k + 0.5)) for k in range(5)
    ]
    run = Run(Stage(objects), SilhouetteTracker(coast_time=0.05)).watch(3.2)
    alive, ended = set(), set()
    for _, _, state in run.history:
        now = {track.number for track in state.confirmed()}
        assert not now & ended
        ended |= alive - now
        alive = now
    assert len(ended | alive) >= 5


def test_an_update_can_be_repeated_and_changes_nothing():
    run = Run(Stage([(Cuboid(), on_oval())])).watch(1.0)
    state = run.state
    mean = state.tracks[0].mean.copy()
    foregrounds = run.stage.foregrounds(1.0)
    first, again = (run.tracker.update(state, foregrounds) for _ in range(2))
    np.testing.assert_array_equal(first.tracks[0].mean, again.tracks[0].mean)
    np.testing.assert_array_equal(state.tracks[0].mean, mean)
    for array in (first.tracks[0].mean, first.tracks[0].covariance, first.tracks[0].shape.matrix):
        assert not array.flags.writeable


def test_a_work_volume_that_is_no_box_is_refused():
    with pytest.raises(DrakeTrackerError, match="work volume"):
        Tracker(CAMERAS, work_volume=[[0.0, 0.0, 0.0], [1.0, -1.0, 1.0]])


def test_the_jacobian_is_that_of_the_projection():
    p_WQ = np.array([0.6, 0.1, HEIGHT])
    for camera in CAMERAS:
        J = projection_jacobian(camera, p_WQ)
        step = 1e-5
        numeric = np.column_stack(
            [(camera.project(p_WQ + step * e)[0] - camera.project(p_WQ - step * e)[0]) / (2 * step) for e in np.eye(3)]
        )
        np.testing.assert_allclose(J, numeric, rtol=1e-3, atol=0.2)


def test_an_object_is_not_observed_while_images_cannot_be_used():
    run = Run(Stage([(Cuboid(), on_oval())])).watch(1.5, usable=lambda time: time < 1.0)
    assert run.tracks[1].state == TrackState.NOT_OBSERVED


def test_tracks_that_find_no_slot_are_counted():
    places = [(0.40 + 0.085 * (k % 4), -0.22 + 0.2 * (k // 4)) for k in range(12)]
    run = Run(Stage([(Cuboid((0.03, 0.03, 0.03)), on_line(place, (0.0, 0.1))) for place in places])).watch(0.6)
    assert len(run.tracks) == 8
    assert run.state.overflow == 4


def test_a_wrong_height_is_corrected():
    """A track that fits the left image only, because its height was found from a merged silhouette, is not kept."""
    run = Run(Stage([(Cuboid(), on_oval())])).watch(1.0)
    track = run.tracks[1]
    ray = track.position - CAMERAS[0].X_WC[:3, 3]
    wrong = track.position - 0.05 / ray[2] * -ray
    moved = replace(track.placed(wrong, 0.003), height=float(wrong[2]), stereo=0)
    run.state = replace(run.state, tracks=(moved,))
    run.watch(1.0)
    errors, share = run.errors(max(run.tracks), 0, since=1.7)
    assert share > 0.9 and errors.max() < 0.012
