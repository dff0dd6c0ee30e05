"""Pairing of the objects of two cameras: tracks made by hand, of objects whose places in space are known."""

from dataclasses import replace

import numpy as np
import pytest
from films import CAMERAS
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantValueSource

from drake_tracker.core.messages import Centroid, TrackPoint
from drake_tracker.vision.image_tracks.image_objects import ImageObjects, ImageTracks
from drake_tracker.vision.image_tracks.image_regions import ImageRegion
from drake_tracker.vision.image_tracks.occlusion_by_edges import EdgeMotion, with_whole_regions
from drake_tracker.vision.image_tracks.stereo_tracks import StereoTracker
from drake_tracker.vision.image_tracks.stereo_tracks_system import (
    StereoTracksSystem,
    pack_centroid,
    pack_number,
    pack_point,
)
from drake_tracker.vision.image_tracks.track_2d import TrackState2D, start_track

PAIR = [CAMERAS["camera_left"], CAMERAS["camera_right"]]
PERIOD = 1.0 / 30.0
GREY = np.full((240, 320), 100, np.uint8)
A, B = np.array([-0.06, -0.02, 0.05]), np.array([0.05, 0.06, 0.08])


def a_track(number, uv, stamp, *, seen=True, state=TrackState2D.MOVING, size=24, hits=9, pixel_count=200):
    """A confirmed track at a pixel; one that is not seen is hidden."""
    u, v = uv
    region = ImageRegion(u, v, pixel_count, round(u - size / 2), round(v - size / 2), size, size)
    track = start_track(number, stamp if seen else stamp - PERIOD, region, GREY)
    state = state if seen else TrackState2D.HIDDEN
    return replace(track, hits=hits, stamp=stamp, state=state)


def view(side, stamp, places, **options):
    """The objects in an image; ``places``: {number of the track: point in space, or None while it is hidden}."""
    tracks = []
    for number, point in places.items():
        seen = point is not None
        uv = PAIR[side].project(point if seen else np.zeros(3))[0]
        tracks.append(a_track(number, uv, stamp, seen=seen, **options))
    return ImageObjects(tracks=tuple(tracks), targets=(next(iter(places), 0), 0))


def run(frames, objects=2, known=None, first=1, **options):
    """The state after images, each (places in the left one, places in the right one); None for a missing one."""
    pairing = StereoTracker(PAIR, objects, max_gap=0.03, stamp_tolerance=0.75 * PERIOD, **options)
    known = known or pairing.start()
    for k, places in enumerate(frames, start=first):
        views = [None if each is None else view(side, k * PERIOD, each) for side, each in enumerate(places)]
        known = pairing.update(known, [k * PERIOD] * 2, views)
    return known


def test_tracks_of_one_object_are_paired_and_measured_whatever_their_numbers_are():
    known = run([({1: A, 2: B}, {1: B, 2: A})] * 6)
    assert {pair.tracks for pair in known.pairs} == {(1, 2), (2, 1)}
    for pair in known.pairs:
        assert pair.met == known.stamp
        assert np.linalg.norm(pair.p_WQ - (A if pair.tracks == (1, 2) else B)) < 1e-6
    numbers = [{track.number for track in each.tracks} for each in known.views]
    assert numbers == [{1, 2}, {1, 2}] and known.views[0].targets == known.views[1].targets == known.places


def test_an_object_counts_only_after_it_was_seen_by_both_four_times():
    assert not run([({1: A}, {1: A})] * 3).pairs
    assert len(run([({1: A}, {1: A})] * 4).pairs) == 1
    assert not run([({1: A}, {1: None})] * 9).pairs


def test_objects_of_one_camera_alone_do_not_tear_others_apart():
    odd_left, odd_right = np.array([0.1, -0.1, 0.0]), np.array([-0.1, 0.08, 0.12])
    known = run([({1: A, 2: odd_left}, {1: A, 2: odd_right})] * 8)
    assert [pair.tracks for pair in known.pairs] == [(1, 1)]
    assert sorted(track.number for track in known.views[0].tracks) == [-2, 1]


def test_an_object_that_is_hidden_in_one_image_has_no_point_and_keeps_its_number():
    before = run([({1: A, 2: B}, {1: A, 2: B})] * 6)
    number = next(pair.number for pair in before.pairs if pair.tracks == (2, 2))
    hidden = run([({1: A, 2: None}, {1: A, 2: B})] * 4, known=before, first=7)
    pair = next(pair for pair in hidden.pairs if pair.number == number)
    assert pair.met < hidden.stamp and number in hidden.places
    gone = run([({1: A}, {1: A, 2: B})] * 4, known=hidden, first=11)  # lost in the left image
    again = run([({1: A, 7: B}, {1: A, 2: B})] * 5, known=gone, first=15)  # with another number there
    pair = next(pair for pair in again.pairs if pair.number == number)
    assert pair.tracks == (7, 2) and pair.met == again.stamp and again.next_number == before.next_number


@pytest.mark.parametrize("side", [0, 1])
def test_numbers_follow_the_objects_when_their_tracks_are_exchanged_in_one_image(side):
    before = run([({1: A, 2: B}, {1: A, 2: B})] * 8)
    owner = {pair.number: A if pair.tracks == (1, 1) else B for pair in before.pairs}
    places = [{1: A, 2: B}, {1: A, 2: B}]
    places[side] = {1: B, 2: A}
    hidden = [{1: None, 2: None} if k == side else each for k, each in enumerate(places)]
    known = run([tuple(hidden)] * 9 + [tuple(places)] * 6, known=before, first=9)
    assert {pair.number for pair in known.pairs} == set(owner)
    for pair in known.pairs:
        assert pair.met == known.stamp and np.linalg.norm(pair.p_WQ - owner[pair.number]) < 1e-6


def moving(k):
    """Places of two objects that pass each other, at image ``k``."""
    return A + (k - 30) * np.array([0.002, 0.0005, 0.0]), A + (k - 30) * np.array([-0.002, 0.001, 0.0])


def test_an_object_seen_by_one_camera_keeps_its_number_when_a_track_of_the_other_goes_on_with_it():
    """In the left image, one object disappears, and its track is lost; the track of the other goes on with it.

    It turns meanwhile, and comes to where the other was expected, which turns too.
    """
    frames = []
    for k in range(1, 61):
        a, b = moving(k)
        a = a + max(k - 10, 0) * np.array([-0.0015, 0.0002, 0.0])
        b = b + max(k - 25, 0) * np.array([-0.001, -0.002, 0.0])
        if k <= 10:
            left, right = {1: a, 2: b}, {1: a, 2: b}
        elif k <= 24:
            left, right = {1: None, 2: b}, {1: a, 2: b}
        elif k <= 36:
            left, right = {2: None}, {1: a, 2: None}
        elif k <= 50:
            left, right = {2: a}, {1: a, 2: None}
        else:
            left, right = {2: a, 3: b}, {1: a, 2: b}
        frames.append((left, right))
    before = run(frames[:10])
    owner = {pair.tracks: pair.number for pair in before.pairs}
    known = run(frames[10:], known=before, first=11)
    after = {pair.tracks: pair for pair in known.pairs}
    assert {tracks: pair.number for tracks, pair in after.items()} == {(2, 1): owner[1, 1], (3, 2): owner[2, 2]}
    for pair, place in zip((after[2, 1], after[3, 2]), (a, b)):
        assert pair.met == known.stamp and np.linalg.norm(pair.p_WQ - place) < 1e-6


def test_a_track_that_was_lost_from_sight_has_less_of_a_claim():
    """In the left image, the track of one object goes on with the other, which the right image shows all the time."""
    frames = []
    for k in range(1, 61):
        a, b = moving(k)
        if k <= 20:
            left, right = {1: a, 2: b}, {1: a, 2: b}
        elif k <= 36:
            left, right = {1: None, 2: None}, {1: a, 2: None}
        elif k <= 42:
            left, right = {2: a}, {1: None, 2: None}
        else:
            left, right = {2: a}, {1: a, 2: b}
        frames.append((left, right))
    before = run(frames[:20])
    owner = {pair.tracks: pair.number for pair in before.pairs}
    known = run(frames[20:], known=before, first=21)
    assert {pair.number: pair.tracks for pair in known.pairs} == {owner[1, 1]: (2, 1), owner[2, 2]: (0, 2)}


def test_an_object_that_one_camera_sees_is_expected_along_its_ray():
    before = run([({1: moving(k)[0]}, {1: moving(k)[0]}) for k in range(1, 16)])
    turned = [moving(15)[0] + k * np.array([0.001, -0.001, 0.001]) for k in range(1, 31)]
    known = run([({1: None}, {1: place}) for place in turned[:20]], known=before, first=16)
    known = run([({}, {1: place}) for place in turned[20:]], known=known, first=36)
    (pair,) = known.pairs
    off = PAIR[1].project(pair.motion.mean[:3])[0] - PAIR[1].project(turned[-1])[0]
    assert pair.tracks == (0, 1) and np.hypot(*off) < 1.0
    assert np.linalg.norm(pair.p_WQ - turned[-1]) > 0.03  # its newest point, from before


def test_after_a_while_a_point_of_a_single_image_does_not_count():
    before = run([({1: A}, {1: A})] * 6)
    hidden = run([({1: None}, {1: A})] * 9, known=before, first=7)
    again = [({1: A}, {1: A})] * 8
    mets = [run(again[:k], known=hidden, first=16).pairs[0].met for k in range(1, 9)]
    first = next(k for k, met in enumerate(mets) if met > before.stamp)
    assert first == 4 and mets[5] > mets[4]  # the fourth image in which both see it, see CONFIRM_AFTER, and one more
    short = run([({1: None}, {1: A})] * 3, known=before, first=7)
    known = run([({1: A}, {1: A})], known=short, first=10)
    assert known.pairs[0].met == known.stamp


def test_a_gap_that_is_unusual_gives_no_point():
    before = run([({1: A}, {1: A})] * 8)
    up = A + [0.0, 0.0, 0.015]
    known = run([({1: A}, {1: up})], known=before, first=9)
    assert known.pairs[0].met < known.stamp and 0.005 < known.pairs[0].gap < 0.03


def test_a_missing_image_leaves_the_pairs_as_they_are():
    before = run([({1: A, 2: B}, {1: A, 2: B})] * 6)
    known = run([({1: A, 2: B}, None)] * 2, known=before, first=7)
    assert [pair.tracks for pair in known.pairs] == [pair.tracks for pair in before.pairs]
    assert known.views[1] is None and all(pair.met < known.stamp for pair in known.pairs)


def test_images_of_different_instants_give_no_point():
    pairing = StereoTracker(PAIR, 2, max_gap=0.03, stamp_tolerance=0.75 * PERIOD)
    known = run([({1: A}, {1: A})] * 6)
    stamps = [7 * PERIOD, 7.8 * PERIOD]
    known = pairing.update(known, stamps, [view(side, stamp, {1: A}) for side, stamp in enumerate(stamps)])
    assert known.stamp == stamps[1] and known.pairs[0].met < known.stamp


def test_a_place_is_given_up_only_for_an_object_that_both_cameras_see():
    before = run([({1: A}, {1: A})] * 6, objects=1)
    one_sided = run([({1: A}, {})] * 40, objects=1, known=before, first=7)
    assert one_sided.places == before.places and one_sided.pair(0) is not None
    known = run([({1: A, 2: B}, {2: B})] * 6, objects=1, known=one_sided, first=47)
    assert known.pair(0).tracks == (2, 2) and known.switches == 1


def test_the_object_to_follow_has_the_first_place():
    frames = [({2: B, 1: A}, {2: B, 1: A})] * 6
    assert run(frames, follow=True).pair(0).tracks == (2, 2)
    lost = [({9: np.zeros(3), 1: A}, {8: np.zeros(3), 1: A})] * 3
    assert run(lost, follow=True).pair(0) is None


def after(motion, left, right, number, u=None):
    """The edges after an image; ``u``: column of the object, in the middle of its region unless given."""
    region = ImageRegion(0.5 * (left + right), 50.0, 100, left, 40, right - left, 20)
    track = start_track(1, number * PERIOD, region, GREY)
    return motion.after(track if u is None else replace(track, place=np.array([u, 50.0])))


def test_an_edge_that_stands_still_shows_that_a_part_is_hidden_until_the_object_moves_freely():
    motion = EdgeMotion()
    for k in range(6):
        motion = after(motion, 50 + 3 * k, 90 + 3 * k, k)
    assert not motion.part
    for k in range(6, 10):
        motion = after(motion, 50 + 3 * k, 105, k)
    assert motion.part
    hidden = a_track(1, (100, 50), 1.0, seen=False)
    assert motion.after(hidden) is motion
    for k in range(20, 24):
        motion = after(motion, 50 + 3 * k, 90 + 3 * k, k)
    assert not motion.part


@pytest.mark.parametrize("right", [83, 105])
def test_an_object_of_which_one_edge_shows_motion_while_it_stops_or_starts_is_not_hidden(right):
    motion = EdgeMotion()
    for k, left in enumerate((50, 55, 59, 62, 64, 65, 65)):
        motion = after(motion, left, left + 40, k)
    motion = after(motion, right - 18, right, 7, u=85.5)  # one of its edges alone: its patch shows where it is
    assert not motion.part
    for k, left in enumerate((65, 64, 62, 58, 53), start=40):  # back
        motion = after(motion, left, left + 40, k)
        assert not motion.part


def test_a_region_that_moves_freely_shows_the_place_of_its_object():
    """The track finds its object by the patch of a part, beside its region."""
    known = run([({1: A + [0.002 * k, 0.0, 0.0]}, {1: A + [0.002 * k, 0.0, 0.0]}) for k in range(12)])
    stamp, place = 13 * PERIOD, A + [0.002 * 12, 0.0, 0.0]
    views = [view(side, stamp, {1: place}) for side in range(2)]
    beside = replace(views[0].tracks[0], place=views[0].tracks[0].place + [9.0, 0.0])
    views[0] = replace(views[0], tracks=(beside,))
    pairing = StereoTracker(PAIR, 2, max_gap=0.03, stamp_tolerance=0.75 * PERIOD)
    after = pairing.update(known, [stamp] * 2, views)
    assert known.edges[0][1].free and after.pairs[0].met == stamp
    assert np.linalg.norm(after.pairs[0].p_WQ - place) < 1e-6
    assert pack_centroid(after, 0, 0)[1:3] == pytest.approx(PAIR[0].project(place)[0])
    assert EdgeMotion().shows_part(beside)
    unknown = with_whole_regions(views[0], {1: EdgeMotion()})
    assert unknown.tracks[0].place == pytest.approx(beside.place)


def test_an_object_that_stands_in_one_image_and_moves_in_the_other_is_hidden_there():
    before = run([({1: A}, {1: A})] * 6)
    pairing = StereoTracker(PAIR, 2, max_gap=0.03, stamp_tolerance=0.75 * PERIOD)
    stamp = 7 * PERIOD
    views = [view(0, stamp, {1: A}, state=TrackState2D.STANDING), view(1, stamp, {1: A})]
    known = pairing.update(before, [stamp] * 2, views)
    assert known.pairs[0].hidden == (True, False) and known.pairs[0].met < stamp
    assert known.views[0].tracks[0].state == TrackState2D.HIDDEN


def test_the_system_has_ports_for_each_object_which_are_zeros_before_the_first_images():
    pairing = StereoTracker(PAIR, 2, max_gap=0.03, stamp_tolerance=0.75 * PERIOD)
    builder = DiagramBuilder()
    system = builder.AddSystem(StereoTracksSystem(pairing, period=PERIOD))
    for side, name in enumerate(("left", "right")):
        tracks = ImageTracks(0.1, view(side, 0.1, {1: A}))
        source = builder.AddSystem(ConstantValueSource(AbstractValue.Make(tracks)))
        builder.Connect(source.get_output_port(), system.GetInputPort(f"tracks_{name}"))
    simulator = Simulator(builder.Build())
    context = system.GetMyContextFromRoot(simulator.get_context())
    for k in (1, 2):
        for name in ("point", "number", "centroid_left", "centroid_right"):
            assert not system.GetOutputPort(f"{name}_{k}").Eval(context).any()
    simulator.AdvanceTo(0.5 * PERIOD)
    assert system.GetOutputPort("objects").Eval(context).stamp == pytest.approx(0.1)
    assert system.GetOutputPort("point_1").Eval(context) == pytest.approx([0.1, 0, 0, 0, 0, 0])
    known = run([({1: A}, {1: A})] * 6)
    point = TrackPoint(pack_point(known, 0))
    assert (point.stamp, point.valid) == (known.stamp, 1.0) and np.allclose([point.x, point.y, point.z], A)
    assert (pack_number(known, 0), pack_number(known, 1)) == (1.0, 0.0)
    centroid = Centroid(pack_centroid(known, 0, 1))
    assert centroid.valid and np.allclose([centroid.u, centroid.v], PAIR[1].project(A)[0])
    assert not TrackPoint(pack_point(known, 1)).valid and not Centroid(pack_centroid(known, 1, 0)).valid
