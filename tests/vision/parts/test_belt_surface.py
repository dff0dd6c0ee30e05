"""What stands out from a moving belt, in drawn images."""

import functools

import numpy as np
import pytest
from drawn_belt import CAMERAS, HEIGHT, MASKS, SIDES, WINDOWS, photographs, pose, shares, surfaces

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.part_kinds import PartKind
from drake_tracker.vision.parts.belt_surface import BeltSurface
from drake_tracker.vision.parts.config import BeltParts

PARTS = [pose(PartKind.BOX, 0.58, -0.2, 0.4), pose(PartKind.ELL, 0.62, 0.1, 1.0)]


@functools.cache
def pictures(poses, more):
    return photographs(list(poses), **dict(more))


def looks_after(frames):
    """The states of both cameras after images, each of which is a list of arguments of `photographs`."""
    models = surfaces()
    looks = []
    for poses, more in frames:
        images = pictures(tuple(poses), tuple(more.items()))
        looks = looks or [model.start(image) for model, image in zip(models, images)]
        looks = [model.update(look, image) for model, look, image in zip(models, looks, images)]
    return looks


def overlap(look, share):
    mask = look.mask > 0
    return (mask & (share >= 0.5)).sum() / max((mask | (share >= 0.5)).sum(), 1)


def test_the_first_image_already_shows_the_parts():
    for look, share in zip(looks_after([(PARTS, {})]), shares(PARTS)):
        assert overlap(look, share) > 0.85


def test_a_texture_that_moves_does_not_stand_out_and_parts_on_it_do():
    frames = [([], {"travelled": 0.003 * k, "seed": k}) for k in range(16)] + [(PARTS, {"travelled": 0.2, "seed": 99})]
    empty = looks_after(frames[:-1])
    assert all((look.mask > 0).sum() == 0 for look in empty)
    for look, share in zip(looks_after(frames), shares(PARTS)):
        assert overlap(look, share) > 0.9


def test_a_part_that_stands_on_a_belt_at_rest_does_not_become_belt():
    frames = [(PARTS, {"seed": k % 3}) for k in range(200)]
    for look, share in zip(looks_after(frames), shares(PARTS)):
        assert overlap(look, share) > 0.85


def test_a_change_of_the_light_does_not_stand_out():
    frames = [([], {"seed": k}) for k in range(8)] + [([], {"light": 1.2, "seed": 20})]
    assert all((look.mask > 0).sum() == 0 for look in looks_after(frames))


def test_what_is_darker_and_of_the_same_colour_is_doubtful_beside_a_part():
    model = surfaces()[0]
    image = photographs(PARTS)[0]
    look = model.update(model.start(image), image)
    share = shares(PARTS)[0]
    u = np.flatnonzero((share >= 0.5).any(axis=0)).max() + 1
    v = int(np.flatnonzero((share >= 0.5)[:, u - 2]).mean())
    shaded = image.copy()
    shaded[v - 2 : v + 3, u : u + 5] = (0.6 * shaded[v - 2 : v + 3, u : u + 5]).astype(np.uint8)
    look = model.update(look, shaded)
    assert look.doubtful[v, u + 2] == 255 and look.mask[v, u + 2] == 0


def test_the_arm_is_neither_seen_nor_learned():
    model = surfaces()[1]
    image = photographs([])[1]
    hidden = np.zeros(image.shape[:2], np.uint8)
    hidden[60:90, 100:140] = 255
    covered = image.copy()
    covered[60:90, 100:140] = 255
    look = model.start(image)
    for _ in range(20):
        look = model.update(look, covered, hidden)
    assert (look.mask > 0).sum() == 0
    assert look.mean[70:80, 110:130].max() < 80.0


def test_settings_out_of_range_are_refused():
    side = SIDES[0]
    with pytest.raises(DrakeTrackerError, match="parts: threshold is 0.0"):
        BeltSurface(CAMERAS[side], WINDOWS[side], MASKS[side], HEIGHT, BeltParts(threshold=0.0))
