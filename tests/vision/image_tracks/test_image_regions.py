"""The moving regions of a mask."""

import cv2
import numpy as np
import pytest

from drake_tracker.vision.image_tracks.image_regions import find_regions


def discs(*discs, specks=()):
    """Returns a mask with discs (u, v, radius), or with rings where the radius is negative, and single pixels."""
    mask = np.zeros((120, 160), np.uint8)
    for u, v, radius in discs:
        cv2.circle(mask, (u, v), abs(radius), 255, -1 if radius > 0 else 1)
    for u, v in specks:
        mask[v, u] = 255
    return mask


@pytest.mark.parametrize("specks", [(), [(3, 4)], [(150, 110), (3, 4)]])
@pytest.mark.parametrize("radius", [9, -9])
def test_a_single_region_is_found_where_it_is_with_specks_and_without(radius, specks):
    mask = discs((40, 70, radius), specks=specks)
    (region,) = find_regions(mask, 12, 5)
    assert region[:2] == pytest.approx((40.0, 70.0), abs=1e-9)
    assert region.pixel_count == cv2.countNonZero(mask) - len(specks)
    assert (region.left, region.top, region.width, region.height) == (31, 61, 19, 19)


def test_fragments_are_one_region_up_to_the_join_distance():
    mask = discs((40, 60, 6), (60, 60, 6))  # 7 px between them
    (joined,) = find_regions(mask, 8, 5)
    assert joined[:2] == pytest.approx((50.0, 60.0))
    assert joined.width == 33
    apart = find_regions(mask, 4, 5)
    assert sorted(region.u for region in apart) == pytest.approx([40.0, 60.0])


def test_the_largest_region_comes_first_and_too_small_ones_are_left_out():
    mask = discs((30, 30, 4), (90, 60, 9), (130, 100, 2))
    assert [(region.left, region.width) for region in find_regions(mask, 3, 20)] == [(81, 19), (26, 9)]
    assert find_regions(mask, 3, 400) == []
    assert find_regions(discs(specks=[(3, 4), (80, 80)]), 3, 1) == []
