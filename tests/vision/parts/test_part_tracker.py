"""The search for new parts and their tracks, on drawn masks."""

import numpy as np
import pytest
from drawn_belt import (
    BELT,
    CAMERAS,
    HEIGHT,
    MASKS,
    SIDES,
    SILHOUETTES,
    WINDOWS,
    make_search,
    make_tracker,
    part_images,
    pose,
)

from drake_tracker.core.messages import PART_FIELDS, REGION_FIELDS, TRACK_FIELDS, PartTracks, message_rows
from drake_tracker.core.part_kinds import PartKind
from drake_tracker.vision.parts.part_tracker import PartTrackerState
from drake_tracker.vision.parts.part_vision_diagram import belt_window
from drake_tracker.vision.parts.part_vision_system import pack_part_regions, pack_part_tracks, pack_parts, reported

PERIOD, SPEED = 1.0 / 60.0, 0.15


def moved(parts, time):
    return [pose(part.kind, part.x, part.y + SPEED * time, part.yaw) for part in parts]


def hide(y0, y1):
    """Masks that hide the belt between two places along it in both images."""
    piece = np.array([[BELT[0, 0], y0], [BELT[1, 0], y1]])
    return [belt_window(CAMERAS[side], piece, HEIGHT).mask(WINDOWS[side]) for side in SIDES]


def track(parts, cycles, state=PartTrackerState(), start=0, visible=lambda k: None, tracker=None, there=lambda k: True):
    """The state after images of parts that move with the belt."""
    tracker = tracker or make_tracker()
    for k in range(start, start + cycles):
        images = part_images(moved(parts, k * PERIOD) if there(k) else [], visible(k))
        state = tracker.update(state, k * PERIOD, images)
    return state


PARTS = [pose(PartKind.BOX, 0.58, -0.30, 0.4), pose(PartKind.DISC, 0.62, -0.20), pose(PartKind.ELL, 0.60, -0.08, 2.0)]


def test_the_search_finds_whole_parts_and_their_kinds():
    images = part_images(PARTS)
    found = make_search().candidates([image.mask for image in images], [image.unseen for image in images])
    assert sorted(each.kind for each in found) == [PartKind.BOX, PartKind.DISC, PartKind.ELL]
    for each in found:
        true = next(part for part in PARTS if part.kind is each.kind)
        assert np.hypot(each.poses[each.kind].x - true.x, each.poses[each.kind].y - true.y) < 0.008
    assert make_search().candidates([np.zeros_like(image.mask) for image in images], [i.unseen for i in images]) == []


def test_a_part_beside_what_is_not_seen_is_not_new():
    images = part_images(PARTS[1:2], hide(-0.19, 0.0))
    assert make_search().candidates([image.mask for image in images], [image.unseen for image in images]) == []


def test_parts_are_tracked_with_the_speed_of_the_belt():
    cycles = 60
    state = track(PARTS, cycles)
    assert [part.number for part in state.tracks] and len(state.tracks) == 3
    assert state.speed == pytest.approx(SPEED, abs=0.02)
    for true in moved(PARTS, (cycles - 1) * PERIOD):
        found = [part for part in state.tracks if part.pose.kind is true.kind]
        assert len(found) == 1 and found[0].clear and found[0].number > 0
        assert np.hypot(found[0].pose.x - true.x, found[0].pose.y - true.y) < 0.0015


def test_a_part_keeps_its_number_while_the_arm_hides_it():
    tracker = make_tracker()
    before = track(PARTS[:2], 40, tracker=tracker)
    numbers = {part.pose.kind: part.number for part in before.tracks}
    hidden = hide(-0.35, 0.1)
    during = track(PARTS[:2], 40, before, 40, lambda k: hidden, tracker)
    assert all(part.seen < during.stamp for part in during.tracks) and len(during.tracks) == 2
    after = track(PARTS[:2], 20, during, 80, tracker=tracker)
    assert {part.pose.kind: part.number for part in after.tracks} == numbers
    assert all(part.seen == after.stamp for part in after.tracks)


def test_a_part_that_was_taken_away_is_forgotten():
    state = track(PARTS[:1], 40)
    gone = track(PARTS[:1], 30, state, 40, there=lambda k: False)
    assert gone.tracks == () and gone.last == 1


def test_parts_that_touch_are_told_apart():
    touching = [pose(PartKind.BOX, 0.6, -0.2, 0.0), pose(PartKind.DISC, 0.6, -0.1645)]
    state = track(touching, 40)
    assert sorted(part.pose.kind for part in state.tracks) == [PartKind.BOX, PartKind.DISC]
    assert all(part.clear for part in state.tracks)


def test_what_is_no_part_is_reported_as_something_that_nobody_can_pick():
    heap = [pose(PartKind.BOX, 0.6 + 0.012 * i, -0.2 + 0.012 * j, 0.4 * i + j) for i in range(4) for j in range(4)]
    state = track(heap, 30)
    assert state.tracks and not any(part.clear for part in state.tracks)
    tracks = reported(state, -0.45, 0.5)
    assert tracks and all(np.diag(part.fit.covariance)[:2].min() >= 1.0 for part in tracks)


def test_the_messages_hold_what_the_tracker_found():
    state = track(PARTS, 40)
    tracks = reported(state, -0.45, 0.5)
    assert [part.pose.y for part in tracks] == sorted((part.pose.y for part in tracks), reverse=True)
    message = pack_parts(state.stamp, tracks, HEIGHT)
    assert PartTracks(message).stamp == state.stamp and PartTracks(message).valid == 1.0
    rows = message_rows(message, PART_FIELDS)
    assert rows[:3, 1].tolist() == [PartKind.ELL, PartKind.DISC, PartKind.BOX] and not rows[3:].any()
    assert rows[0, 4] == pytest.approx(HEIGHT + 0.0125) and (rows[:3, 9] == state.stamp).all()
    assert reported(state, 0.4, 0.5) == []
    shown = message_rows(pack_part_tracks(state.stamp, tracks, HEIGHT, state.speed), TRACK_FIELDS)
    assert shown[0, TRACK_FIELDS.index("vy")] == state.speed and (shown[:3, 0] > 0).all()
    side = SIDES[0]
    regions = message_rows(pack_part_regions(state.stamp, tracks, SILHOUETTES[0], WINDOWS[side][:2]), REGION_FIELDS)
    mask = part_images(moved(PARTS, state.stamp)[2:])[0].mask
    v, u = np.nonzero(mask)
    assert regions[0, 0] == pytest.approx(0.5 * (u.min() + u.max()) + WINDOWS[side][0], abs=1.0)
    assert regions[0, 1] == pytest.approx(0.5 * (v.min() + v.max()) + WINDOWS[side][1], abs=1.0)


def test_the_mask_of_the_belt_is_what_the_cameras_see():
    assert all((mask > 0).sum() > 5000 for mask in MASKS.values())
