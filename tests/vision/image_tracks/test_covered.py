"""Objects of which the robot's arm covers a part."""

import cv2
import numpy as np
import pytest
from cuboids import CAMERAS, Cuboid, Stage
from tracker_run import Run, on_line, on_oval

from drake_tracker.core.messages import TrackState


def bar(path, since, ahead, width=12.0):
    """An arm that follows a path from a time on, ``ahead`` [m] of it along y, as a strip of each image [px]."""

    def cover(time, side):
        if time < since:
            return None
        (u, v), mask = CAMERAS[side].project([path(time)[0] + (0.0, ahead, 0.0)])[0], np.zeros((256, 256), np.uint8)
        cv2.rectangle(mask, (round(u - 0.5 * width), 0), (round(u + 0.5 * width), round(v) + 12), 255, -1)
        return mask

    return cover


def errors(run, since):
    """Errors of the measured points [m], and the share of the images with one."""
    states = [(truth[0], state.confirmed()[0]) for time, truth, state in run.history if time >= since]
    found = [np.linalg.norm(t.measurement.p_WQ - p) for p, t in states if t.measurement is not None]
    return np.array(found), len(found) / len(states)


@pytest.mark.parametrize("ahead", [0.0, 0.03, -0.03], ids=["across its middle", "over its front", "over its back"])
def test_an_object_under_the_arm_is_measured(ahead):
    path = on_line((0.56, -0.25), (0.0, 0.15))
    run = Run(Stage([(Cuboid(), path)], bar(path, 1.5, ahead))).watch(2.8)
    free, _ = errors(run, 1.0)
    covered, share = errors(run, 1.6)
    assert any(region.covered for regions in run.state.regions for region in regions)
    assert share == 1.0 and run.numbers() == {1}
    assert np.median(covered) < np.median(free) + 0.003 and covered.max() < 0.012


def test_an_object_that_stops_under_the_arm_is_measured_where_it_stands():
    def path(time):
        return (
            on_line((0.56, -0.25), (0.0, 0.15))(min(time, 2.0))
            if time < 2.0
            else (np.array([0.56, 0.05, 0.475]), np.zeros(3))
        )

    run = Run(Stage([(Cuboid(), path)], bar(path, 1.5, 0.03))).watch(3.0)
    assert run.history[-1][1][0] == pytest.approx((0.56, 0.05, 0.475))
    late, share = errors(run, 2.2)
    assert share == 1.0 and late.max() < 0.012
    (track,) = run.state.confirmed()
    assert track.state == TrackState.STANDING


def test_the_size_is_not_learned_from_what_remains_visible():
    path = on_oval()
    free = Run(Stage([(Cuboid(), path)])).watch(1.5).state.confirmed()[0]
    covered = Run(Stage([(Cuboid(), path)], bar(path, 1.5, 0.02))).watch(2.5).state.confirmed()[0]
    np.testing.assert_allclose(covered.shape.dimensions, free.shape.dimensions, atol=0.002)


def test_an_object_of_unknown_size_is_not_measured_under_the_arm():
    path = on_line((0.56, -0.25), (0.0, 0.15))
    run = Run(Stage([(Cuboid(), path)], bar(path, 0.5, 0.0, 24.0))).watch(1.2)
    states = {track.state for time, _, state in run.history if time > 0.6 for track in state.confirmed()}
    assert states == {TrackState.OCCLUDED}
