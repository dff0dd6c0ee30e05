from dataclasses import replace

import cv2
import numpy as np
import pytest

from drake_tracker.vision.silhouettes.foreground import Foreground
from drake_tracker.vision.silhouettes.regions import make_regions
from drake_tracker.vision.silhouettes.silhouettes import covered_share, find_silhouettes
from drake_tracker.vision.silhouettes.split_silhouettes import divide, place_objects
from drake_tracker.vision.silhouettes.validation_gate import ValidationGate

WIDTH, HEIGHT = 200, 140
OFFSET = (30, 12)
"""Full-frame coordinates of the top left pixel."""
BIG, MIDDLE, SMALL = (36.0, 22.0), (28.0, 18.0), (11.0, 8.0)
"""Extents of objects [px]."""


def drawn(centre, extents, form="rectangle"):
    """uint8 (HEIGHT, WIDTH), 255 on an object at ``centre`` [px, full frame]."""
    u, v = np.array(centre) - OFFSET
    columns, rows = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    x, y = abs(columns - u) / (0.5 * extents[0]), abs(rows - v) / (0.5 * extents[1])
    inside = (x <= 1.0) & (y <= 1.0) if form == "rectangle" else x**2 + y**2 <= 1.0
    return np.where(inside, 255, 0).astype(np.uint8)


def foreground(*masks, hidden=None, moving=None, image=None):
    mask = np.bitwise_or.reduce([np.zeros((HEIGHT, WIDTH), np.uint8), *masks])
    if hidden is not None:
        mask = cv2.subtract(mask, hidden)
    image = np.zeros((HEIGHT, WIDTH, 3), np.uint8) if image is None else image
    return Foreground(1.0, image, mask, np.zeros_like(mask) if moving is None else moving, OFFSET, hidden)


def window(track, centre, extents, std=1.0, form="rectangle", depth=1.8, settled=True):
    """Where an object is expected; its box is seen from above, along its edges."""
    edges = np.array([[extents[0], 0.0, 0.0], [0.0, extents[1], 0.0]])
    fill = 1.0 if form == "rectangle" else np.pi / 4.0
    pixels = fill * extents[0] * extents[1]
    return ValidationGate(track, *map(float, centre), std, edges, pixels, depth, np.eye(2), settled)


def expected(windows):
    """Covariances of positions that are known as well as their windows say, in a single image."""
    return [each.std**2 * np.eye(2) for each in windows]


def find_regions(image, windows=(), min_pixels=25, colours=True):
    """The regions of a single image."""
    silhouettes = find_silhouettes(image, windows, min_pixels)
    (places,) = place_objects([silhouettes], expected(windows))
    return make_regions(silhouettes, places, colours)


def centre_of(region):
    return np.array([region.u, region.v])


def test_an_empty_image_has_no_regions():
    assert find_regions(foreground()) == []
    assert find_regions(foreground(), [window(1, (80.0, 60.0), BIG)]) == []


@pytest.mark.parametrize("form", ["rectangle", "ellipse"])
def test_a_component_is_a_region_in_full_frame_coordinates(form):
    (region,) = find_regions(foreground(drawn((90.0, 60.0), BIG, form)))
    assert centre_of(region) == pytest.approx((90.0, 60.0), abs=0.3)
    assert region.extents == pytest.approx(BIG, abs=1.5)
    area = BIG[0] * BIG[1] * (1.0 if form == "rectangle" else np.pi / 4.0)
    assert region.pixels == pytest.approx(area, rel=0.1)
    assert region.track == 0 and region.share == 1.0
    assert not (region.shared or region.apart or region.covered)


def test_regions_in_no_window_are_sorted_by_size():
    regions = find_regions(
        foreground(drawn((60.0, 40.0), SMALL), drawn((120.0, 40.0), BIG), drawn((160.0, 110.0), MIDDLE))
    )
    assert [round(region.u) for region in regions] == [120, 160, 60]


def test_regions_in_windows_are_first_and_in_their_order():
    centres = [(60.0, 40.0), (120.0, 40.0), (170.0, 110.0)]
    windows = [window(4, centres[2], SMALL), window(2, centres[0], SMALL)]
    regions = find_regions(
        foreground(*(drawn(each, size) for each, size in zip(centres, (SMALL, BIG, SMALL)))), windows
    )
    assert [region.track for region in regions] == [4, 2, 0]
    assert [round(region.u) for region in regions] == [170, 60, 120]


def test_small_components_are_noise_unless_they_belong_to_an_object():
    image = foreground(drawn((60.0, 40.0), (4.0, 4.0)), drawn((120.0, 60.0), MIDDLE))
    assert len(find_regions(image, min_pixels=40)) == 1
    assert len(find_regions(image, min_pixels=9)) == 2
    speck = foreground(drawn((60.0, 40.0), (1.0, 1.0)))
    assert find_regions(speck, [window(1, (60.0, 40.0), SMALL)], min_pixels=1) == []


def test_more_than_sixteen_regions_are_all_found():
    places = [(45.0 + 22.0 * (k % 8), 30.0 + 30.0 * (k // 8)) for k in range(24)]
    regions = find_regions(foreground(*(drawn(place, SMALL) for place in places)))
    assert len(regions) == 24
    found = sorted((round(region.v), round(region.u)) for region in regions)
    assert found == sorted((round(v), round(u)) for u, v in places)


def test_the_fragments_of_an_object_are_one_region():
    whole = drawn((90.0, 60.0), BIG)
    whole[:, 72:75] = 0  # A narrow post hides a part of it.
    (region,) = find_regions(foreground(whole), [window(1, (90.0, 60.0), BIG)])
    assert region.track == 1 and not region.shared
    assert centre_of(region) == pytest.approx((90.0, 60.0), abs=1.5), "of the hull"


def test_a_region_outside_of_the_gate_is_not_claimed():
    image = foreground(drawn((150.0, 60.0), MIDDLE))
    (far,) = find_regions(image, [window(1, (80.0, 60.0), MIDDLE)])
    assert far.track == 0
    (near,) = find_regions(image, [window(1, (146.0, 60.0), MIDDLE)])
    assert near.track == 1


def test_colour_and_motion_of_a_region():
    mask = drawn((90.0, 60.0), BIG)
    image = np.full((HEIGHT, WIDTH, 3), 30, np.uint8)
    image[mask > 0] = (200, 150, 50)
    moving = mask.copy()
    moving[:, 60:] = 0  # Its left half.
    (region,) = find_regions(foreground(mask, moving=moving, image=image))
    assert region.colour == pytest.approx((200.0, 150.0, 50.0))
    assert region.moving == pytest.approx(0.5, abs=0.05)
    (plain,) = find_regions(foreground(mask, image=image), colours=False)
    assert plain.colour == (0.0, 0.0, 0.0) and plain.moving == 0.0


PAIRS = {
    "side by side": (MIDDLE, (80.0, 60.0), MIDDLE, (107.0, 60.0)),
    "partly overlapping": (MIDDLE, (80.0, 60.0), MIDDLE, (100.0, 62.0)),
    "one below the other": (MIDDLE, (80.0, 50.0), MIDDLE, (82.0, 66.0)),
    "diagonal": (MIDDLE, (80.0, 50.0), MIDDLE, (98.0, 60.0)),
    "of different size": (BIG, (80.0, 60.0), MIDDLE, (108.0, 60.0)),
    "small beside large": (BIG, (80.0, 60.0), SMALL, (102.0, 60.0)),
}


@pytest.mark.parametrize("form", ["rectangle", "ellipse"])
@pytest.mark.parametrize("name", PAIRS)
@pytest.mark.parametrize("error", [(0.0, 0.0), (1.5, -1.0)], ids=["expected exactly", "expected roughly"])
def test_two_objects_whose_silhouettes_are_merged(name, form, error):
    one, at, other, beside = PAIRS[name]
    image = foreground(drawn(at, one, form), drawn(beside, other, form))
    windows = [
        window(1, np.add(at, error), one, form=form),
        window(2, np.subtract(beside, error), other, form=form, depth=1.7),
    ]
    assert len(find_regions(image)) == 1, "they are merged"
    regions = {region.track: region for region in find_regions(image, windows)}
    assert set(regions) == {1, 2}
    limit = 2.0 if form == "rectangle" and name != "diagonal" else 3.0
    for number, truth in ((1, at), (2, beside)):
        miss = centre_of(regions[number]) - truth
        assert regions[number].shared
        # The tracker relies on the variances.
        assert np.all(np.abs(miss) < 3.0 * np.sqrt([regions[number].var_u, regions[number].var_v]))
        if (name, form) != ("diagonal", "ellipse"):  # Its extent along the line between them is not that of a box.
            assert np.linalg.norm(miss) < limit


def test_the_order_of_the_windows_does_not_matter():
    image = foreground(drawn((80.0, 60.0), MIDDLE), drawn((100.0, 62.0), MIDDLE))
    windows = [window(1, (80.0, 60.0), MIDDLE), window(2, (100.0, 62.0), MIDDLE)]
    one, two = ({each.track: each for each in find_regions(image, order)} for order in (windows, windows[::-1]))
    for number in (1, 2):
        assert centre_of(one[number]) == pytest.approx(centre_of(two[number]), abs=0.1)


def test_three_merged_objects():
    places = [(70.0, 60.0), (94.0, 60.0), (118.0, 60.0)]
    image = foreground(*(drawn(place, (26.0, 20.0)) for place in places))
    windows = [window(number + 1, place, (26.0, 20.0)) for number, place in enumerate(places)]
    regions = find_regions(image, windows)
    assert sorted(region.track for region in regions) == [1, 2, 3]
    for region in regions:
        assert region.shared
        assert np.linalg.norm(centre_of(region) - places[region.track - 1]) < 2.0


def test_an_object_behind_another_is_not_measured():
    image = foreground(drawn((80.0, 60.0), BIG))
    windows = [window(1, (80.0, 60.0), BIG, depth=1.5), window(2, (82.0, 61.0), MIDDLE, depth=1.8)]
    (region,) = find_regions(image, windows)
    assert region.track == 1
    assert centre_of(region) == pytest.approx((80.0, 60.0), abs=1.0)


def test_two_objects_that_have_come_apart_are_not_shared():
    image = foreground(drawn((80.0, 60.0), MIDDLE), drawn((116.0, 60.0), MIDDLE))
    windows = [window(1, (80.0, 60.0), MIDDLE), window(2, (116.0, 60.0), MIDDLE)]
    regions = find_regions(image, windows)
    assert [region.shared for region in regions] == [False, False]
    assert [round(region.u) for region in regions] == [80, 116]


def test_a_silhouette_that_is_far_too_large_shows_another_object_too():
    """A new object touches one that is known: the known one keeps the pixels near where it is expected."""
    image = foreground(drawn((80.0, 60.0), MIDDLE), drawn((115.0, 60.0), (44.0, 18.0)))
    (merged,) = find_regions(image)
    (mine, *_) = find_regions(image, [window(1, (80.0, 60.0), MIDDLE)])
    assert mine.track == 1
    assert abs(mine.u - 80.0) < 0.4 * abs(merged.u - 80.0)
    assert mine.pixels < 0.75 * merged.pixels
    (whole, *_) = find_regions(image, [window(1, (95.0, 60.0), MIDDLE, std=8.0, settled=False)])
    assert whole.pixels == merged.pixels, "its size is not known yet"


def test_a_second_large_fragment_in_a_window_is_another_object():
    image = foreground(drawn((78.0, 60.0), (16.0, 20.0)), drawn((98.0, 60.0), (16.0, 20.0)))
    regions = find_regions(image, [window(1, (80.0, 60.0), BIG)])
    assert [region.track for region in regions] == [1, 0]
    assert regions[0].apart and regions[0].u == pytest.approx(78.0, abs=0.5)
    assert regions[1].u == pytest.approx(98.0, abs=0.5)


def arm_from(column):
    hidden = np.zeros((HEIGHT, WIDTH), np.uint8)
    hidden[:, column - OFFSET[0] :] = 255
    return hidden


def test_a_region_that_the_arm_covers_in_part_says_so():
    mask, place = drawn((90.0, 60.0), BIG), (90.0, 60.0)
    for column, covered in ((92, True), (100, True), (150, False)):
        (region,) = find_regions(foreground(mask, hidden=arm_from(column)), [window(1, place, BIG)])
        assert region.covered == covered, f"arm from column {column}"
    # Beside the arm, an object of unknown size may be covered.
    other = drawn((160.0, 100.0), SMALL)
    hidden = cv2.subtract(arm_from(100), cv2.dilate(other, np.ones((9, 9))))
    unknown, _ = find_regions(foreground(mask, other, hidden=hidden))
    assert unknown.covered
    (free,) = find_regions(foreground(mask, hidden=arm_from(150)))
    assert not free.covered


def test_a_region_at_the_edge_of_what_the_camera_sees_is_cut():
    mask, place = drawn((90.0, 60.0), BIG), (90.0, 60.0)
    for column, cut in ((92, True), (100, True), (150, False)):
        missing = arm_from(column)
        seen = replace(foreground(cv2.subtract(mask, missing)), missing=missing)
        for windows in ([window(1, place, BIG)], []):
            (region,) = find_regions(seen, windows)
            assert region.cut == cut and not region.covered, f"nothing from column {column}"


def test_the_share_that_the_arm_covers():
    place = window(1, (90.0, 60.0), (20.0, 20.0))
    assert covered_share(arm_from(90), np.array(OFFSET), place) == pytest.approx(0.5, abs=0.05)
    assert covered_share(arm_from(110), np.array(OFFSET), place) == 0.0
    assert covered_share(arm_from(60), np.array(OFFSET), place) == 1.0
    outside = window(1, (1000.0, 60.0), (20.0, 20.0))
    assert covered_share(arm_from(60), np.array(OFFSET), outside) == 0.0


def test_what_is_hidden_makes_the_centroid_uncertain():
    expected = [window(1, (90.0, 60.0), BIG)]
    variances, shares = [], []
    for kept in (BIG[0], 0.7 * BIG[0], 0.4 * BIG[0]):
        mask = drawn((90.0, 60.0), BIG)
        mask[:, round(72.0 + kept) - OFFSET[0] :] = 0
        (region,) = find_regions(foreground(mask), expected)
        variances.append(region.var_u)
        shares.append(region.share)
    assert variances[0] < variances[1] < variances[2]
    assert shares[0] > 0.95 and shares[0] > shares[1] > shares[2]
    assert abs(90.0 - region.u) < 3.0 * np.sqrt(region.var_u)


def test_merging_makes_the_centroid_uncertain():
    alone = drawn((80.0, 60.0), MIDDLE)
    windows = [window(1, (80.0, 60.0), MIDDLE), window(2, (104.0, 60.0), MIDDLE)]
    (before,) = find_regions(foreground(alone), windows[:1])
    merged = next(
        region for region in find_regions(foreground(alone, drawn((104.0, 60.0), MIDDLE)), windows) if region.track == 1
    )
    assert merged.var_u > 2.0 * before.var_u and merged.var_v > 2.0 * before.var_v


def test_the_parts_of_a_silhouette_are_within_it():
    whole = (drawn((80.0, 60.0), MIDDLE) | drawn((100.0, 62.0), MIDDLE)) // 255
    windows = [window(1, (80.0, 60.0), MIDDLE), window(2, (100.0, 62.0), MIDDLE)]
    image = find_silhouettes(foreground(255 * whole), windows)
    (silhouette,), (places,) = image.expected, place_objects([image], expected(windows))
    whole = silhouette.pixels
    numbers, parts = zip(*divide(image, silhouette, places))
    assert numbers == (0, 1)
    for part in parts:
        assert part.shared and part.pixels.dtype == np.uint8
        assert not np.any((part.pixels > 0) & (whole == 0))
    assert np.array_equal((parts[0].pixels | parts[1].pixels) > 0, whole > 0)


def test_a_window_far_away_does_no_harm():
    image = foreground(drawn((80.0, 60.0), MIDDLE))
    (region,) = find_regions(image, [window(1, (-1e6, -1e6), MIDDLE, std=0.0)])
    assert region.track == 0


def test_a_thin_line_has_a_centre():
    line = np.zeros((HEIGHT, WIDTH), np.uint8)
    line[50, 20:60] = 255
    (region,) = find_regions(foreground(line))
    assert centre_of(region) == pytest.approx((39.5 + OFFSET[0], 50.0 + OFFSET[1]))


def test_a_new_region_that_ends_at_the_arm_is_covered():
    (region,) = find_regions(foreground(drawn((90.0, 60.0), BIG), hidden=arm_from(100)))
    assert region.covered


@pytest.mark.parametrize("form", ["rectangle", "ellipse"])
def test_objects_that_touch_along_a_diagonal(form):
    at, beside = (80.0, 50.0), (98.0, 60.0)
    image = foreground(drawn(at, MIDDLE, form), drawn(beside, MIDDLE, form))
    regions = find_regions(image, [window(1, at, MIDDLE, form=form), window(2, beside, MIDDLE, form=form)])
    for region, truth in zip(regions, (at, beside)):
        assert np.linalg.norm(centre_of(region) - truth) < 2.0


def test_two_windows_at_one_place():
    """Two tracks at exactly the same place: one of them gets the silhouette, and nothing fails."""
    image = foreground(drawn((80.0, 50.0), MIDDLE))
    for numbers in ((1, 2), (2, 1), (-1, -1)):
        regions = find_regions(image, [window(number, (80.0, 50.0), MIDDLE) for number in numbers])
        assert 1 <= len(regions) <= 2
        for region in regions:
            assert np.linalg.norm(centre_of(region) - (80.0, 50.0)) < 1.0
