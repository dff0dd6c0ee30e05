"""Objects whose silhouettes are merged, for a while or from the start."""

import numpy as np
import pytest
from cuboids import CENTRE, Cuboid, Stage
from tracker_run import BLUE, NEAR, Run, during, on_line, on_oval

from drake_tracker.core.messages import TrackState
from drake_tracker.vision.silhouettes.config import SilhouetteTracker
from drake_tracker.vision.silhouettes.track_3d import GUESSED


@pytest.mark.parametrize("distance", [0.3, 0.2])
def test_two_objects_one_behind_the_other(distance):
    lap = 1.2
    follower = on_oval(start=distance / lap)
    run = Run(Stage([(Cuboid(), on_oval()), (Cuboid(colour=BLUE), follower)])).watch(6.0)
    assert run.numbers() == {1, 2}
    names = run.identities(since=1.0)
    assert all(len(each) == 1 for each in names.values()) and names[0] != names[1]
    for thing in (0, 1):
        errors, share = run.errors(*names[thing], thing, since=1.0)
        assert share > 0.9 and np.median(errors) < 0.006 and np.percentile(errors, 99) < NEAR


def crossing(gap=0.08, speed=0.15):
    """Two cuboids on parallel straight tracks, in opposite directions; they pass each other after 1.5 s."""
    return [
        (Cuboid(), on_line((CENTRE[0] - gap / 2, -1.5 * speed), (0.0, speed))),
        (Cuboid(colour=BLUE), on_line((CENTRE[0] + gap / 2, 1.5 * speed), (0.0, -speed))),
    ]


@pytest.mark.parametrize("gap", [0.10, 0.14])
def test_identities_are_kept_when_objects_pass_each_other(gap):
    run = Run(Stage(crossing(gap))).watch(3.0)
    before, after = run.identities(since=0.4, until=0.8), run.identities(since=2.6)
    assert set(before) == {0, 1} and before == after
    assert all(len(each) == 1 for each in before.values())
    assert run.numbers() == {1, 2}


def test_identities_are_kept_on_two_ovals_in_opposite_directions():
    objects = [(Cuboid(), on_oval(start=0.1)), (Cuboid(colour=BLUE), on_oval(-0.2, start=0.6, scale=0.55))]
    run = Run(Stage(objects)).watch(7.0)
    names = run.identities(since=1.0)
    assert run.numbers() == {1, 2}
    assert names[0] != names[1] and all(len(each) == 1 for each in names.values())


@pytest.mark.parametrize(("scale", "phase"), [(0.5, 0.35), (0.6, 0.1), (0.68, 0.85)])
def test_objects_of_two_colours_keep_their_numbers_although_they_merge_in_both_images(scale, phase):
    objects = [(Cuboid(), on_oval(start=0.1)), (Cuboid(colour=BLUE), on_oval(-0.2, start=phase, scale=scale))]
    run = Run(Stage(objects)).watch(4.2)
    names = run.identities(until=1.2)
    assert all(len(each) == 1 for each in names.values()) and names[0] != names[1]
    assert run.identities(since=3.8) == names


@pytest.mark.parametrize("distance", [0.125, 0.14])
def test_two_objects_that_are_merged_from_the_start(distance):
    """Trains of 0.11 m. At 0.125 m they are merged in both images, at 0.14 m in the right one only."""
    run = Run(Stage([(Cuboid(), on_oval()), (Cuboid(colour=BLUE), on_oval(start=distance / 1.2))])).watch(4.0)
    assert run.numbers() == {1, 2}
    far = [
        min(np.linalg.norm(track.measurement.p_WQ - p_WQ) for p_WQ in truth)
        for _, truth, state in run.history
        for track in state.confirmed()
        if track.measurement is not None
    ]
    between = np.array(far) > 0.5 * distance - 0.02
    assert between.mean() < 0.015 and not between[10:].any()
    late = run.identities(since=3.0)
    assert all(len(each) == 1 for each in late.values()) and late[0] != late[1]


def test_a_merged_track_has_no_point_and_is_not_seen_at_its_stamp():
    run = Run(Stage([(Cuboid(), on_oval()), (Cuboid(), on_oval(start=0.125 / 1.2))])).watch(0.4)
    merged = [track for _, _, state in run.history for track in state.confirmed() if track.state == TrackState.MERGED]
    assert merged and all(track.measurement is None and track.seen < track.stamp for track in merged)
    assert {track.heights for track in run.tracks.values()} == {GUESSED}


def test_an_object_of_the_greatest_length_is_one_object():
    run = Run(Stage([(Cuboid(), on_oval())]), SilhouetteTracker(max_length=0.13)).watch(2.0)
    assert run.numbers() == {1}
    run = Run(Stage([(Cuboid(), on_oval())]), SilhouetteTracker(max_length=0.07)).watch(2.0)
    assert run.numbers() == {1, 2}


@pytest.mark.parametrize(("gap", "speed"), [(0.06, 0.1), (0.06, 0.2), (0.08, 0.15)])
def test_two_objects_pass_each_other_closely(gap, speed):
    run = Run(Stage(crossing(gap, speed))).watch(3.0)
    assert run.identities(0.4, 0.8) == run.identities(2.6)


@pytest.mark.parametrize(("phase", "scale"), [(0.1, 0.6), (0.35, 0.68)])
def test_two_objects_pass_each_other_on_ovals(phase, scale):
    objects = [(Cuboid(), on_oval(start=0.1)), (Cuboid(colour=BLUE), on_oval(-0.2, start=phase, scale=scale))]
    run = Run(Stage(objects)).watch(6.0)
    assert all(len(each) == 1 for each in run.identities(since=1.0).values())


def test_an_object_of_which_only_a_part_was_seen_at_first():
    """The size that was learned from the part is corrected."""
    path = on_oval()
    stage = Stage([(Cuboid((0.05, 0.04, 0.05)), during(path, 0.0, 2.0)), (Cuboid(), during(path, 2.0, 20.0))])
    run = Run(stage).watch(10.0)
    assert run.numbers() == {1}
    np.testing.assert_allclose(run.tracks[1].shape.dimensions, (0.11, 0.04, 0.05), atol=0.015)
    errors, share = run.errors(1, 1, since=9.0)
    assert share == 1.0 and errors.max() < 0.012


def test_pieces_of_one_object_become_one_track():
    """At the start the two ends of a train are known only, and begin a track each."""
    ends = [during(on_line((0.45 + offset, 0.0), (0.15, 0.0)), 0.0, 0.5) for offset in (-0.04, 0.04)]
    whole = during(on_line((0.45, 0.0), (0.15, 0.0)), 0.5, 10.0)
    end = Cuboid((0.025, 0.04, 0.05))
    run = Run(Stage([(end, ends[0]), (end, ends[1]), (Cuboid(), whole)])).watch(0.4)
    assert len(run.tracks) == 2
    run.watch(0.6)
    assert set(run.tracks) == {1}
    errors, share = run.errors(1, 2, since=0.8)
    assert share == 1.0 and errors.max() < 0.012
