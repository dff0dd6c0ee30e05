"""The expected place of an object: rays of two cameras, or of one, to an object with a known path."""

import numpy as np
import pytest
from films import CAMERAS

from drake_tracker.vision.image_tracks.object_motion import ObjectRay, predict_motion, start_motion, surprise, with_rays

PAIR = [CAMERAS["camera_left"], CAMERAS["camera_right"]]
SIZE, STD, PERIOD = 0.05, 0.001, 1.0 / 30.0
START, V = np.array([0.02, -0.03, 0.05]), np.array([0.1, 0.05, -0.02])


def ray(side, p_WQ):
    """The exact ray from a camera to a point."""
    return ObjectRay(*PAIR[side].ray(*PAIR[side].project(p_WQ)[0]), STD)


def followed(sides, first, last, motion=None):
    """The motion after images of an object with a constant velocity, seen by some cameras."""
    motion = motion or start_motion(START, SIZE, 0.0)
    for k in range(first, last):
        place = START + k * PERIOD * V
        motion = predict_motion(motion, k * PERIOD)
        motion = with_rays(motion, [ray(side, place) for side in sides])
    return motion


def test_rays_of_two_cameras_give_place_and_velocity():
    motion = followed((0, 1), 1, 40)
    assert motion.mean[:3] == pytest.approx(START + 39 * PERIOD * V, abs=1e-4)
    assert motion.mean[3:] == pytest.approx(V, abs=0.005)
    assert np.linalg.eigvalsh(motion.covariance).min() > 0.0
    assert np.array_equal(motion.covariance, motion.covariance.T)


def test_the_ray_of_one_camera_fixes_the_place_across_it_only():
    motion = followed((1,), 40, 80, followed((0, 1), 1, 40))
    alone = predict_motion(followed((0, 1), 1, 40), 79 * PERIOD)
    along = ray(1, START + 79 * PERIOD * V).direction
    variances = [along @ each.covariance[:3, :3] @ along for each in (motion, alone)]
    across = [np.trace(each.covariance[:3, :3]) - variance for each, variance in zip((motion, alone), variances)]
    assert np.sqrt(across[0]) < 2.0 * STD and across[1] > 1000.0 * across[0]
    assert variances[0] > 100.0 * across[0]


def test_an_object_is_less_surprising_where_it_is_expected_and_the_more_so_the_better_it_is_known():
    known = followed((0, 1), 1, 40)
    place = START + 39 * PERIOD * V
    here, there = ([ray(side, each) for side in range(2)] for each in (place, place + [0.03, 0.0, 0.0]))
    assert surprise(known, here)[0] == pytest.approx(0.0, abs=0.01)
    assert surprise(known, there)[0] > 100.0
    later = predict_motion(known, known.stamp + 1.0)
    assert surprise(later, there)[0] < surprise(known, there)[0]
    assert surprise(later, here)[1] > surprise(known, here)[1] > 0.0


def test_surprise_is_that_of_a_normal_distribution():
    motion = start_motion(np.zeros(3), 0.1, 0.0)
    beside = ObjectRay(np.array([0.2, 0.0, -1.0]), np.array([0.0, 0.0, 1.0]), 0.05)
    distance, uncertain = surprise(motion, [beside])
    assert distance == pytest.approx(0.2**2 / (0.1**2 + 0.05**2))
    assert uncertain == pytest.approx(2.0 * np.log((0.1**2 + 0.05**2) / 0.05**2))


def test_an_image_from_before_changes_nothing():
    motion = followed((0, 1), 1, 5)
    assert np.array_equal(predict_motion(motion, motion.stamp - 0.01).covariance, motion.covariance)
