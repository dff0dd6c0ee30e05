import cv2
import numpy as np
import pytest
from scipy import ndimage

from drake_tracker.vision.centroid.config import NormalFlow
from drake_tracker.vision.centroid.normal_flow import NormalFlowDetector
from drake_tracker.vision.region_centroid import brightness_gate, hull_centroid, mean_centroid

SIZE = 200
LENGTH, WIDTH = 40, 16
JOIN = 40
"""Bridges the longest gap [px] that a plain body leaves between its front and rear edges."""
HEADINGS = np.radians(np.arange(0.0, 360.0, 24.0))


def body_texture(kind):
    """Brightness and coverage of a body seen from above, its front to the right."""
    length, width = np.meshgrid(np.arange(LENGTH) - (LENGTH - 1) / 2, np.arange(WIDTH) - (WIDTH - 1) / 2)
    brightness = np.full(length.shape, 165.0)
    coverage = np.ones(length.shape)
    if kind == "striped":
        brightness[:, (np.arange(LENGTH) // 5) % 2 == 0] = 90.0
    elif kind == "cab":  # All detail in the rear third.
        brightness[:, 3:6] = brightness[:, 9:12] = 80.0
    elif kind == "round":
        coverage = (np.hypot(length, width * LENGTH / WIDTH) < LENGTH / 2).astype(float)
    return brightness, coverage


def draw(kind, centre, heading, shadow=None, seed=0):
    """The body at ``centre`` [px] with its front toward ``heading`` [rad], its shadow displaced by ``shadow`` [px]."""
    brightness, coverage = body_texture(kind)
    rng = np.random.default_rng([7, seed])
    table = 50.0 + 14.0 * ndimage.gaussian_filter(np.random.default_rng(1).normal(size=(SIZE, SIZE)), 1.5)
    c, s = np.cos(heading), np.sin(heading)
    R = np.array([[c, -s], [s, c]])

    def place(picture, at):
        offset = at - R @ [(LENGTH - 1) / 2, (WIDTH - 1) / 2]
        return cv2.warpAffine(picture, np.column_stack([R, offset]), (SIZE, SIZE), flags=cv2.INTER_LINEAR)

    if shadow is not None:
        table = table * (1.0 - 0.7 * cv2.GaussianBlur(place(coverage, centre + shadow), (0, 0), 0.8))
    alpha = place(coverage, centre)
    image = (1.0 - alpha) * table + place(brightness * coverage, centre)
    return np.clip(np.rint(image + rng.normal(scale=2.0, size=image.shape)), 0, 255).astype(np.uint8)


def errors(kind, shadow=None, **overrides):
    """Centroid minus centre, turned into the body's frame (front, side) [px], for every heading; shape (n, 2)."""
    flow = NormalFlowDetector(NormalFlow(**overrides))
    found = []
    for k, heading in enumerate(HEADINGS):
        direction = np.array([np.cos(heading), np.sin(heading)])
        centre = np.array([100.3, 99.8])
        images = [
            flow.smooth(draw(kind, centre + 0.85 * cycle * direction, heading, shadow, seed=10 * k + cycle + 2))
            for cycle in (-2, 0, 2)
        ]
        region = flow.centroid(flow.mask(*images))
        assert region is not None
        offset = np.array([region.u, region.v]) - centre
        found.append([offset @ direction, offset @ [-direction[1], direction[0]]])
    return np.array(found)


def rms(values):
    return np.sqrt(np.mean(np.square(values)))


def test_mean_is_the_mean_of_the_moving_pixels():
    mask = np.where(np.random.default_rng(0).random((33, 47)) < 0.1, 255, 0).astype(np.uint8)
    rows, columns = np.nonzero(mask)
    region = mean_centroid(mask)
    assert region == (pytest.approx(columns.mean()), pytest.approx(rows.mean()), rows.size)
    assert mean_centroid(np.zeros((5, 5), np.uint8)) is None
    assert hull_centroid(np.zeros((5, 5), np.uint8), 10) is None


def test_hull_is_the_area_within_the_outermost_edges():
    mask = np.zeros((80, 100), np.uint8)
    mask[20:51, 30:33] = 255  # Rear edge, strong.
    mask[20:51, 60] = 255  # Front edge, weak.
    assert mean_centroid(mask).u < 40.0
    region = hull_centroid(mask, join_distance=30)
    assert (region.u, region.v, region.pixel_count) == (pytest.approx(45.0), pytest.approx(35.0), 4 * 31)


def test_hull_of_pixels_on_one_line_is_their_mean():
    mask = np.zeros((40, 40), np.uint8)
    mask[7, 10:21] = 255
    assert hull_centroid(mask, 10) == (pytest.approx(15.0), pytest.approx(7.0), 11)


def test_hull_leaves_stray_pixels_and_other_regions_out():
    mask = np.zeros((200, 200), np.uint8)
    mask[60:80, 50:53] = 255
    mask[60:80, 85:88] = 255
    clean = hull_centroid(mask, 40)
    mask[20:22, 60] = mask[90, 100] = mask[120, 70] = 255  # Strays, within reach of the region.
    mask[150:160, 180:184] = 255  # A smaller region, out of reach.
    assert hull_centroid(mask, 40) == clean
    assert mean_centroid(mask).v > clean.v + 5.0


@pytest.mark.parametrize("kind", ["plain", "striped", "round"])
def test_hull_finds_every_body(kind):
    assert rms(errors(kind, centroid="hull", join_distance=JOIN)) < 1.0


def test_short_join_distance_keeps_one_end_of_a_plain_body():
    found = errors("plain", centroid="hull", join_distance=16)
    assert np.abs(found[:, 0]).max() > LENGTH / 3


def test_hull_halves_the_lean_of_an_uneven_body():
    lean = errors("cab", centroid="mean")[:, 0].mean()
    assert lean < -4.0
    assert abs(errors("cab", centroid="hull", join_distance=JOIN)[:, 0].mean()) < abs(lean) / 2


def test_brightness_gate_removes_the_shadow():
    shadow = np.array([9.0, 14.0])
    without_gate = rms(errors("striped", shadow, centroid="hull", join_distance=JOIN))
    assert without_gate > 3.0
    assert rms(errors("striped", shadow, centroid="hull", join_distance=JOIN, brightness_gate=True)) < 1.2
    assert rms(errors("plain", shadow, centroid="mean", brightness_gate=True)) < rms(errors("plain", shadow)) / 2


def test_brightness_gate_keeps_the_bright_side():
    mask = np.full((4, 4), 255, np.uint8)
    mask[0] = 0
    image = np.array([[200.0] * 4, [20.0] * 4, [60.0] * 4, [150.0] * 4])
    images = (image, image, image)
    assert (brightness_gate(mask, images, background=50.0)[:, 0] == [0, 0, 0, 255]).all()
    empty = np.zeros((4, 4), np.uint8)
    assert not brightness_gate(empty, images, background=50.0).any()


def test_brightness_gate_keeps_the_outline():
    """A pixel that the object uncovers shows the table in the newest image, and belongs to the object all the same."""
    mask = np.array([[255, 255, 0]], np.uint8)
    before, after = np.array([[150.0, 150.0, 50.0]]), np.array([[150.0, 50.0, 50.0]])
    assert (brightness_gate(mask, (before, after, after), background=50.0) == [[255, 255, 0]]).all()
