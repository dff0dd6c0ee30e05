import numpy as np
import pytest

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.vision.centroid.search_window import SearchWindow
from drake_tracker.vision.region_centroid import RegionCentroid

FOLLOW = SearchWindow(radius=10.0, forget=0.2)
TRACK = ((1.0, 20.0, 30.0), (1.1, 25.0, 38.0))


def test_constant_speed_leads_to_the_centre_and_only_the_disc_is_looked_at():
    assert FOLLOW.centre(TRACK, 1.2) == pytest.approx((30.0, 46.0))
    everything = np.full((80, 90), 255, np.uint8)
    seen = FOLLOW.apply(everything, TRACK, 1.2)
    v, u = np.nonzero(seen)
    assert seen.sum() / 255 == pytest.approx(np.pi * 100, rel=0.05)
    assert np.hypot(u - 30, v - 46).max() <= 10.5


@pytest.mark.parametrize(("track", "stamp"), [((), 1.2), (TRACK[:1], 1.05), (TRACK, 1.31)])
def test_without_two_recent_centroids_everything_is_looked_at(track, stamp):
    everything = np.full((80, 90), 255, np.uint8)
    assert FOLLOW.apply(everything, track, stamp) is everything


def test_the_last_two_centroids_are_remembered_until_they_are_old():
    third = RegionCentroid(30.0, 46.0, 20)
    assert FOLLOW.remember(TRACK, 1.2, third) == (TRACK[1], (1.2, 30.0, 46.0))
    assert FOLLOW.remember((), 1.2, third) == ((1.2, 30.0, 46.0),)
    assert FOLLOW.remember(TRACK, 1.2, None) == TRACK
    assert FOLLOW.remember(TRACK, 1.4, None) == ()


def test_settings_out_of_range_are_refused():
    with pytest.raises(DrakeTrackerError, match="radius is 0"):
        SearchWindow(radius=0.0)
