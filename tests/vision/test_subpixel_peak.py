import numpy as np
import pytest

from drake_tracker.vision.subpixel_peak import peak_offset


@pytest.mark.parametrize("place", [1.6, 2.0, 2.4])
def test_the_maximum_of_a_parabola_is_found_exactly(place):
    values = 5.0 - (np.arange(5) - place) ** 2
    assert 2 + peak_offset(values, 2) == pytest.approx(place, abs=1e-12)


def test_without_a_maximum_the_sample_itself_counts():
    assert peak_offset(np.array([3.0, 2.0, 1.0]), 0) == 0.0
    assert peak_offset(np.array([1.0, 2.0, 3.0]), 2) == 0.0
    assert peak_offset(np.ones(3), 1) == 0.0


def test_the_offset_is_limited():
    values = np.array([0.0, 1.0, 1.9])
    assert peak_offset(values, 1) > 0.5 and peak_offset(values, 1, 0.5) == 0.5
