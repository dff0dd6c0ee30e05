import cv2
import numpy as np
import pytest

from drake_tracker.vision.outline_fit import box_outline, fit_outlines

LONG = np.array([[30.0, 4.0, 0.0], [8.0, -7.0, -12.0]])
SQUARE = np.array([[14.0, 6.0, 0.0], [5.0, -8.0, -10.0]])


def silhouette(*objects):
    """The silhouette, uint8 (80, 120), of boxes at their centres (u, v)."""
    image = np.zeros((80, 120), np.uint8)
    for edges, centre in objects:
        corners = np.rint((box_outline(edges) + centre) * 16.0).astype(np.int32)
        cv2.fillConvexPoly(image, corners, 1, lineType=cv2.LINE_8, shift=4)
    return image


def test_the_outline_of_a_box():
    outline = box_outline(LONG)
    assert len(outline) == 6
    np.testing.assert_allclose(np.ptp(outline, axis=0), np.abs(LONG).sum(axis=1), rtol=1e-6)
    (a, b, c), (d, e, f) = LONG
    area = abs(a * e - b * d) + abs(a * f - c * d) + abs(b * f - c * e)
    assert cv2.contourArea(outline) == pytest.approx(area, rel=1e-5)


@pytest.mark.parametrize("apart", [(22.0, 6.0), (8.0, 18.0), (30.0, -9.0)])
def test_two_outlines_are_found_from_some_pixels_off(apart):
    centres = [np.array([45.3, 38.6]), np.array([45.3, 38.6]) + apart]
    image = silhouette((LONG, centres[0]), (SQUARE, centres[1]))
    wrong = [centre + offset for centre, offset in zip(centres, ((3.0, -2.0), (-2.0, 3.0)))]
    found = fit_outlines(image, [box_outline(LONG), box_outline(SQUARE)], wrong, [6.0, 6.0])
    for place, centre in zip(found, centres):
        assert np.abs(place - centre).max() < 1.5


def test_three_outlines():
    centres = [np.array([30.0, 40.0]), np.array([52.0, 45.0]), np.array([76.0, 40.0])]
    image = silhouette(*((SQUARE, centre) for centre in centres))
    found = fit_outlines(image, [box_outline(SQUARE)] * 3, [centre + (2.0, 1.0) for centre in centres], [4.0] * 3)
    for place, centre in zip(found, centres):
        assert np.abs(place - centre).max() < 1.0


def test_where_the_silhouette_does_not_tell_the_expectation_does():
    """A small box in front of a large one leaves no trace in the silhouette."""
    image = silhouette((4.0 * SQUARE, (60.0, 40.0)))
    expected = np.array([66.0, 43.0])
    found = fit_outlines(
        image, [box_outline(4.0 * SQUARE), box_outline(SQUARE)], [np.array([60.0, 40.0]), expected], [1, 1]
    )
    np.testing.assert_allclose(found[1], expected, atol=0.6)


def test_an_outline_at_the_edge_of_the_image():
    image = silhouette((LONG, (10.0, 40.0)), (SQUARE, (34.0, 44.0)))
    found = fit_outlines(
        image, [box_outline(LONG), box_outline(SQUARE)], [np.array([5.0, 41.0]), np.array([34.0, 44.0])], [5.0, 5.0]
    )
    assert np.abs(found[0] - (10.0, 40.0)).max() < 2.0
