"""Tracks in the images of one camera: regions, motion of the whole image, crossings, objects that stop or vanish."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment

from drake_tracker.vision.centroid.config import NormalFlow
from drake_tracker.vision.centroid.normal_flow import NormalFlowDetector
from drake_tracker.vision.image_tracks.global_image_motion import (
    TILE_SHARE,
    TILES,
    align_to,
    find_shifts,
    shift_estimate,
    suggests_shift,
)
from drake_tracker.vision.image_tracks.image_patch import Scene
from drake_tracker.vision.image_tracks.image_regions import ImageRegion, find_regions, join_fast
from drake_tracker.vision.image_tracks.image_tracker import ImageTracker, assign
from drake_tracker.vision.image_tracks.reidentification import without_doubles
from drake_tracker.vision.image_tracks.track_2d import TrackState2D, predict_track, start_track, with_region
from drake_tracker.vision.region_centroid import hull_centroid

PERIOD = 1.0 / 30.0
DETECTOR = NormalFlowDetector(NormalFlow(stride=1), period=PERIOD)


def scene(seed=0, width=420, height=340):
    rng = np.random.default_rng(seed)
    fine, coarse = (cv2.resize(rng.normal(size=(height // s, width // s)), (width, height)) for s in (3, 20))
    return (110.0 + 18.0 * fine + 25.0 * coarse).astype(np.float32)


def disc(image, u, v, radius, grey):
    rows, columns = np.mgrid[: image.shape[0], : image.shape[1]]
    cover = np.clip(radius + 0.5 - np.hypot(columns - u, rows - v), 0.0, 1.0)
    return image + cover * (grey + 10.0 * np.sin(0.7 * (columns - u)) - image)


def run(pictures, tracker):
    """Yields (number of the image, objects, centroid) of each image that is described."""
    objects, smoothed = tracker.start(), []
    for k, picture in enumerate(pictures):
        smoothed = [*smoothed, DETECTOR.smooth(np.clip(picture, 0, 255).astype(np.uint8))][-3:]
        if len(smoothed) == 3:
            objects, _, centroid = tracker.update(objects, (k - 1) * PERIOD, DETECTOR, smoothed)
            yield k - 1, objects, centroid


def test_regions_are_those_of_the_centroid_and_more():
    mask = np.zeros((100, 200), np.uint8)
    cv2.circle(mask, (40, 50), 15, 255, 3)
    cv2.circle(mask, (150, 40), 8, 255, -1)
    regions = find_regions(mask, 12, 5)
    largest = hull_centroid(mask, 12)
    assert len(regions) == 2 and regions[0][:3] == pytest.approx(largest)
    assert (regions[1].u, regions[1].v) == pytest.approx((150, 40), abs=0.1)
    assert find_regions(np.zeros_like(mask), 12, 5) == []


@pytest.mark.parametrize("height", [340, 1400])
def test_the_motion_of_the_whole_image_is_found(height):
    picture = scene(1, height * 6 // 5, height)
    angle, shift = 0.004, (2.3, -1.6)
    M = np.array([[np.cos(angle), -np.sin(angle), shift[0]], [np.sin(angle), np.cos(angle), shift[1]]])
    moved = cv2.warpAffine(picture, M, picture.shape[::-1], borderMode=cv2.BORDER_REFLECT)
    before, after = (np.clip(np.rint(each), 0, 255).astype(np.uint8) for each in (picture, moved))
    (found,) = find_shifts(before, [after])
    corner = np.array([[0.0, 0.0, 1.0], [*picture.shape[::-1], 1.0]])
    assert np.abs(corner @ found.transform.T - corner @ M.T).max() < 0.25
    inner = np.s_[20:-20, 20:-20]
    assert np.abs(align_to(after, found)[inner].astype(float) - before[inner]).mean() < 3.0
    assert find_shifts(np.full((100, 100), 90, np.uint8), [np.full((100, 100), 90, np.uint8)]) is None


def test_a_camera_that_shakes_and_pans_does_not_disturb_the_track():
    background, rng = scene(2, 520, 440), np.random.default_rng(2)
    camera = np.cumsum(np.full((40, 2), 0.5), axis=0) + rng.normal(0.0, 1.0, (40, 2))
    truth = np.column_stack([60.0 + 4.0 * np.arange(40), np.full(40, 150.0)]) - camera
    pictures = [
        disc(
            cv2.warpAffine(background, np.float32([[1, 0, -60 - du], [0, 1, -60 - dv]]), (400, 320)),
            *truth[k], 16.0, 235.0,
        )
        for k, (du, dv) in enumerate(camera)
    ]  # fmt: skip
    off, moved = [], 0
    for k, objects, centroid in run(pictures, ImageTracker()):
        off.append(np.hypot(centroid.u - truth[k, 0], centroid.v - truth[k, 1]) if centroid else np.inf)
        moved += objects.displacement > 0.0
    assert np.median(off) < 1.5 and np.max(off) < 6.0 and moved > 30


def test_two_objects_that_cross_keep_their_numbers():
    background, seen = scene(3), []
    pictures = [
        disc(disc(background, 60.0 + 5.0 * k, 160.0, 18.0, 30.0), 350.0 - 5.0 * k, 175.0, 16.0, 230.0)
        for k in range(58)
    ]
    for _, objects, _ in run(pictures, ImageTracker(2)):
        places = [objects.target(place) for place in range(2)]
        if all(track is not None and track.state == TrackState2D.MOVING for track in places):
            seen.append(tuple(track.number for track in sorted(places, key=lambda track: track.mean[1])))
    assert len(seen) > 30 and len(set(seen)) == 1


def test_three_objects_that_meet_at_one_place_for_more_than_a_second_keep_their_numbers():
    """The one behind is hidden for 1.3 s, in the region of the others."""
    background = scene(3)
    pictures = []
    for k in range(130):
        way = 1.4 * (k - 65)
        picture = disc(background, 200.0 + 0.2 * way, 165.0 - way, 13.0, 60.0)
        picture = disc(picture, 200.0 - way, 150.0 + 0.3 * way, 20.0, 230.0)
        pictures.append(disc(picture, 205.0 + way, 180.0 + 0.2 * way, 20.0, 30.0))
    seen, hidden = [], 0.0
    for k, objects, _ in run(pictures, ImageTracker(3)):
        places = [objects.target(place) for place in range(3)]
        hidden = max([hidden, *(track.stamp - track.seen for track in places if track is not None)])
        if k in (25, 120):
            seen.append(min(places, key=lambda track: track.area).number)
            assert {track.state for track in places} == {TrackState2D.MOVING}
    assert hidden > 1.1 and seen[0] == seen[1]


def test_an_object_that_stops_stands_and_one_that_vanishes_is_lost():
    background, states = scene(4), {}
    for k, objects, _ in run(
        [
            disc(background, 60.0 + 4.0 * min(k, 25), 150.0, 15.0, 230.0) if k < 50 else background.copy()
            for k in range(100)
        ],
        ImageTracker(follow=(60.0, 150.0)),
    ):
        track = objects.target()
        states[k] = TrackState2D.LOST if track is None else track.state
        if 30 <= k < 48:
            assert np.hypot(track.mean[0] - 160.0, track.mean[1] - 150.0) < 2.0
    assert states[20] == TrackState2D.MOVING
    assert {states[k] for k in range(32, 48)} == {TrackState2D.STANDING}
    assert {states[k] for k in range(55, 75)} == {TrackState2D.HIDDEN}
    assert states[98] == TrackState2D.LOST


@pytest.mark.parametrize("speed", [12.0, 25.0, 38.0])
def test_a_fast_ball_is_found_where_it_is(speed):
    """Between two images it moves by more than its size, so that their difference shows it twice."""
    background, off = scene(5), []
    pictures = [disc(background, 30.0 + speed * k, 150.0, 8.0, 230.0) for k in range(int(360 / speed))]
    for k, _, centroid in run(pictures, ImageTracker()):
        off.append(np.hypot(centroid.u - (30.0 + speed * k), centroid.v - 150.0) if centroid else np.inf)
    assert np.median(off) < 0.5 and np.mean(np.array(off) > 2.0) < 0.2


@pytest.mark.parametrize("speed", [9.0, 23.0, 34.0])
def test_a_ball_that_is_thrown_back_is_not_lost(speed):
    """Where it turns back, the images before and after show it on the same side, and their difference shows neither."""
    background, off = scene(6), []
    path = 30.0 + 320.0 - np.abs((speed * np.arange(60)) % 640.0 - 320.0)
    pictures = [disc(background, u, 150.0 + 0.4 * k, 13.0, 230.0) for k, u in enumerate(path)]
    numbers = set()
    for k, objects, centroid in run(pictures, ImageTracker(period=PERIOD)):
        off.append(np.hypot(centroid.u - path[k], centroid.v - 150.0 - 0.4 * k) if centroid else np.inf)
        numbers.add(objects.targets[0])
    assert np.median(off) < 0.5 and np.mean(np.array(off[8:]) > 10.0) < 0.03 and numbers - {0} == {1}


@pytest.mark.parametrize("start", [(372.0, 90.0), (300.0, 40.0), (60.0, 300.0)])
def test_a_fast_ball_keeps_its_size_and_its_track_between_bounces(start):
    """Its size was that of the region of all its places: after a bounce nothing was like it, and it was hidden."""
    span = np.array([420.0, 340.0]) - 30.0
    steps = np.array(start) - 15.0 + [[-18.7 * k, -26.1 * k] for k in range(70)]
    path = 15.0 + span - np.abs(steps % (2.0 * span) - span)
    pictures = [disc(scene(8), u, v, 13.5, 230.0) for u, v in path]
    off, sizes = [], []
    for k, objects, centroid in run(pictures, ImageTracker(period=PERIOD)):
        off.append(np.hypot(*(np.array(centroid[:2]) - path[k])) if centroid else np.inf)
        sizes += [track.size for track in objects.tracks if track.number in objects.targets and k > 15]
    assert np.median(off) < 0.5 and max(off[8:]) < 10.0
    assert 22.0 < np.median(sizes) < 33.0


@pytest.mark.parametrize("turn", [1.3, 1.9, 2.4, 2.6, 3.0])
def test_a_fast_ball_that_turns_back_while_it_is_new_is_followed(turn):
    """The track went on with the background where the images before and after showed the ball, and stood there."""
    picture, numbers = scene(4), np.arange(24)
    places = np.column_stack([100.0 + 6.0 * numbers, 310.0 - 14.5 * np.abs(numbers - turn)])
    pictures = [disc(disc(picture, 330.0 - 1.5 * k, 70.0, 40, 25.0), *places[k], 6.0, 235.0) for k in numbers]
    tracked = list(run(pictures, ImageTracker(follow=tuple(places[0]), period=PERIOD)))
    off = np.array([np.inf if each is None else np.hypot(*(each[:2] - places[k])) for k, _, each in tracked])
    assert np.mean(off < 6.0) > 0.85 and off[-5:].max() < 1.0


def test_a_region_of_the_places_before_and_after_a_turn_is_no_object():
    ball = ImageRegion(100.0, 200.0, 150, 94, 194, 13, 13)
    both = ImageRegion(100.0, 186.0, 310, 88, 180, 26, 13)
    slow = ImageRegion(200.0, 60.0, 320, 180, 40, 40, 40)
    assert join_fast([slow, both], [ball]) == [slow, ball._replace(exact=True)]
    large = both._replace(pixel_count=900)
    assert join_fast([large], [ball]) == [large, ball._replace(exact=True)]


def test_an_object_that_leaps_keeps_its_number_and_the_leap_is_counted():
    background = scene(7)
    pictures = [
        disc(background, (60.0 if k < 25 else 230.0) + 3.0 * k, 90.0 if k < 25 else 250.0, 15.0, 230.0)
        for k in range(50)
    ]
    *_, (k, objects, centroid) = run(pictures, ImageTracker(period=PERIOD))
    assert objects.leaps == 1 and objects.switches == 0 and objects.targets == (1,)
    assert objects.leapt < 33 * PERIOD
    assert np.hypot(centroid.u - (230.0 + 3.0 * k), centroid.v - 250.0) < 1.0


def behind_a_pillar(picture, left, right, seed=11):
    """The picture with a textured pillar in front."""
    picture = picture.copy()
    picture[:, left:right] = scene(seed, right - left, picture.shape[0]) - 25.0
    return picture


@pytest.mark.parametrize(("seed", "grey", "width"), [(8, 230.0, 60), (9, 30.0, 60), (10, 30.0, 45)])
def test_an_object_that_passes_behind_a_pillar_is_hidden_and_then_the_same_again(seed, grey, width):
    """What hides it grows in its patch, and must not be taken for an object that stands."""
    background, states, off = scene(seed), {}, []
    path = 40.0 + 3.0 * np.arange(110)
    pictures = [behind_a_pillar(disc(background, u, 150.0, 20.0, grey), 170, 170 + width) for u in path]
    for k, objects, centroid in run(pictures, ImageTracker(period=PERIOD)):
        states[k] = objects.target().state if objects.target() else TrackState2D.LOST
        if path[k] - 20.0 > 170.0 and path[k] + 20.0 < 170.0 + width:
            assert centroid is None
        if path[k] - 20.0 > 170.0 + width + 15.0:
            off.append(np.hypot(centroid.u - path[k], centroid.v - 150.0) if centroid else np.inf)
    assert TrackState2D.STANDING not in states.values() and TrackState2D.HIDDEN in states.values()
    assert np.median(off) < 0.5 and np.max(off) < 10.0 and len(off) > 10
    assert objects.targets == (1,) and objects.rivals == 0


@pytest.mark.parametrize(("start", "velocity"), [((110.0, 220.0), (4.0, -29.0)), ((180.0, 215.0), (-18.5, -14.0))])
def test_a_fast_ball_that_passes_a_slow_mover_before_it_is_confirmed_is_followed(start, velocity):
    """Its first patch shows where it was, so that it is known again by its size, not by that of all its places."""
    background, off = scene(12), []
    span = np.array([420.0, 340.0]) - 20.0
    steps = np.array(start) - 10.0 + np.arange(60)[:, None] * np.array(velocity)
    path = 10.0 + span - np.abs(steps % (2.0 * span) - span)
    pictures = [
        disc(disc(background, 100.0 + 0.6 * k, 90.0, 50.0, 225.0), *place, 7.0, 20.0) for k, place in enumerate(path)
    ]
    for k, _, centroid in run(pictures, ImageTracker(follow=tuple(path[0]), period=PERIOD)):
        off.append(np.hypot(centroid.u - path[k, 0], centroid.v - path[k, 1]) if centroid else np.inf)
    assert np.median(off) < 1.0 and np.mean(np.array(off[20:]) > 10.0) < 0.3


def test_a_patch_that_was_cut_beside_its_object_is_replaced():
    """As when the object was partly hidden: the patch is found 6 px beside the region of the whole object."""
    background, off, tracker = scene(13), [], ImageTracker(period=PERIOD)
    images = [
        DETECTOR.smooth(np.clip(disc(background, 60.0 + 3.0 * k, 150.0, 20.0, 230.0), 0, 255).astype(np.uint8))
        for k in range(60)
    ]
    objects = tracker.start()
    for k in range(1, 59):
        if k == 20:
            track = objects.target()
            beside = np.array([6.0, 0.0])
            track = replace(track, centre=track.centre + beside, mean=track.mean + np.concatenate([beside, [0.0, 0.0]]))
            objects = replace(objects, tracks=(track,))
        objects, _, centroid = tracker.update(objects, k * PERIOD, DETECTOR, images[k - 1 : k + 2])
        off.append(abs(centroid.u - 60.0 - 3.0 * k))
    assert max(off[:19]) < 1.0 < max(off[19:]) and max(off[40:]) < 1.0


def test_of_two_tracks_that_move_together_one_stays():
    picture = np.zeros((100, 100), np.uint8)
    one = replace(start_track(1, 0.0, ImageRegion(50.0, 40.0, 100, 40, 30, 20, 20), picture), hits=9)
    twin, other = (replace(one, number=number, mean=one.mean + np.array(off)) for number, off in (
        (2, [1.0, 1.0, 3.0, 0.0]), (3, [1.0, 1.0, 90.0, 0.0])
    ))  # fmt: skip
    tracks = [one, twin, other]
    assert [track.number for track in without_doubles(tracks, tracks, ())] == [1, 3]
    assert [track.number for track in without_doubles(tracks, tracks, (2,))] == [2, 3]
    assert [track.number for track in without_doubles(tracks, tracks, (1, 2))] == [1, 2, 3]


@pytest.mark.parametrize("shift", [(0.0, 0.0), (0.3, 0.0), (0.0, -0.5), (0.4, 0.4)])
def test_the_estimate_of_a_small_shift_of_the_whole_image_is_its_length(shift):
    scene = cv2.GaussianBlur(np.random.default_rng(5).normal(120.0, 90.0, (240, 320)), (0, 0), 2.5)
    M = np.float32([[1.0, 0.0, shift[0]], [0.0, 1.0, shift[1]]])
    moved = cv2.warpAffine(scene, M, (320, 240), borderMode=cv2.BORDER_REPLICATE)
    moved[60:100, 60:100] += 80.0  # an object does not count
    before, after = (np.rint(32.0 * image).astype(np.int16) for image in (scene, moved))
    assert shift_estimate(before, after) == pytest.approx(np.hypot(*shift), abs=0.04)


@pytest.mark.parametrize("shape", [(480, 640), (481, 633)])
def test_motion_in_a_small_part_of_the_image_suggests_no_shift_as_in_all_of_it(shape):
    rng = np.random.default_rng(6)
    for size in rng.integers(1, 470, 20).tolist():
        mask = np.zeros(shape, np.uint8)
        v, u = (int(rng.integers(0, side - size + 1)) for side in shape)
        mask[v : v + size, u : u + size] = 255 * (rng.random((size, size)) < 0.1)
        tiles = cv2.countNonZero(cv2.resize(mask, TILES, interpolation=cv2.INTER_AREA))
        assert suggests_shift(mask) == (tiles > TILE_SHARE * TILES[0] * TILES[1])
    assert not suggests_shift(np.zeros(shape, np.uint8))


def test_regions_do_not_depend_on_stray_pixels_elsewhere():
    mask = np.zeros((200, 300), np.uint8)
    cv2.circle(mask, (120, 90), 12, 255, 2)
    mask[95:99, 150:156] = 255  # 18 px beside it
    cv2.rectangle(mask, (220, 30), (250, 60), 255, 1)
    expected = find_regions(mask, 24, 4)
    assert [region.pixel_count for region in expected] == [cv2.countNonZero(mask[:, :200]), 120]
    mask[[0, 199, 3], [0, 299, 280]] = 255
    assert find_regions(mask, 24, 4) == expected


def test_one_track_or_one_region_gets_the_cheapest_partner():
    cost = np.random.default_rng(7).random((3, 4))
    for part in (cost, cost[:1], cost[:, 2:3], cost[1:2, 3:]):
        found, expected = assign(part), linear_sum_assignment(part)
        assert [list(each) for each in found] == [each.tolist() for each in expected]


def test_a_patch_of_the_background_does_not_pull_an_object_back():
    """The patch of an object that hardly stands out is mostly background, and is found where the background is."""
    background = np.clip(scene(5), 0, 255).astype(np.uint8)
    behind, here = (
        ImageRegion(u, 150.0, 900, round(u) - 18, 132, 36, 36, exact=False) for u in (200.0, 216.0)
    )  # it was behind, and moves on
    track = replace(start_track(1, 0.0, behind, background), hits=20, mean=np.array([200.0, 150.0, 120.0, 0.0]))
    late = predict_track(track, PERIOD)
    assert with_region(late, here, background).place[0] < 205.0
    known = replace(late, scenes=(Scene(background, 100.0, 150.0),))
    assert tuple(with_region(known, here, background).place) == (216.0, 150.0)
