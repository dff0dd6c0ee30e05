"""Tests of the displacement of the hand in the images of one camera."""

import numpy as np
import pytest

from drake_tracker.vision.hand.hand_markers import NEWEST, FoundMarkers, HandDisplacement, with_image

KEPT = 5


def found(right, down):
    return FoundMarkers(np.array([100.0 + right, 80.0 + down]), np.array([100.0, 80.0]), 100.0, 2)


def after(images, state=HandDisplacement()):
    for image in images:
        state = with_image(state, image, KEPT)
    return state


def test_it_is_not_known_before_there_are_enough_images():
    assert not after([found(6.0, -2.0)] * (NEWEST - 1)).median.any()
    assert after([found(6.0, -2.0)] * NEWEST).median == pytest.approx([6.0, -2.0])


def test_it_is_the_median_of_the_newest_images():
    state = after([found(6.0, -2.0)] * NEWEST + [found(-30.0, 30.0)] * (NEWEST // 2))
    assert state.median == pytest.approx([6.0, -2.0])
    assert after([found(7.0, -1.0)] * NEWEST, state).median == pytest.approx([7.0, -1.0])


def test_it_is_kept_for_a_while_without_markers():
    state = after([found(6.0, -2.0)] * NEWEST + [None] * KEPT)
    assert state.median == pytest.approx([6.0, -2.0])
    assert after([found(8.0, -2.0)] * NEWEST, state).median == pytest.approx([8.0, -2.0])
    assert not after([None], state).median.any()
