import cv2
import numpy as np
import pytest

from drake_tracker.vision.silhouettes.outline_fit import ImageView, box_outline, fit_outlines

LONG = np.array([[30.0, 4.0, 0.0], [8.0, -7.0, -12.0]])
SQUARE = np.array([[14.0, 6.0, 0.0], [5.0, -8.0, -10.0]])


def silhouette(*objects):
    """The silhouette, uint8 (80, 120), of boxes at their centres (u, v)."""
    image = np.zeros((80, 120), np.uint8)
    for edges, centre in objects:
        corners = np.rint((box_outline(edges) + centre) * 16.0).astype(np.int32)
        cv2.fillConvexPoly(image, corners, 1, lineType=cv2.LINE_8, shift=4)
    return image


def placed(image, boxes, expected, std):
    """Where boxes stand in a single image, shape (n, 2)."""
    count = len(boxes)
    view = ImageView(
        image, None, [box_outline(each) for each in boxes], np.array(expected), np.array([np.eye(2)] * count)
    )
    return view.centres + fit_outlines([view], np.array([std**2 * np.eye(2)] * count))


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
    found = placed(image, [LONG, SQUARE], wrong, 6.0)
    for place, centre in zip(found, centres):
        assert np.abs(place - centre).max() < 1.5


def test_three_outlines():
    centres = [np.array([30.0, 40.0]), np.array([52.0, 45.0]), np.array([76.0, 40.0])]
    image = silhouette(*((SQUARE, centre) for centre in centres))
    found = placed(image, [SQUARE] * 3, [centre + (2.0, 1.0) for centre in centres], 4.0)
    for place, centre in zip(found, centres):
        assert np.abs(place - centre).max() < 1.0


def test_where_the_silhouette_does_not_tell_the_expectation_does():
    """A small box in front of a large one leaves no trace in the silhouette."""
    image = silhouette((4.0 * SQUARE, (60.0, 40.0)))
    expected = np.array([66.0, 43.0])
    found = placed(image, [4.0 * SQUARE, SQUARE], [np.array([60.0, 40.0]), expected], 1.0)
    np.testing.assert_allclose(found[1], expected, atol=0.6)


def test_an_outline_at_the_edge_of_the_image():
    image = silhouette((LONG, (10.0, 40.0)), (SQUARE, (34.0, 44.0)))
    found = placed(image, [LONG, SQUARE], [(5.0, 41.0), (34.0, 44.0)], 5.0)
    assert np.abs(found[0] - (10.0, 40.0)).max() < 2.0


def test_an_image_that_shows_both_apart_decides_for_one_that_does_not():
    """One image looks along the line between two boxes, so that the nearer one hides the other."""
    along, across = np.array([[1.0, 20.0, 0.0], [9.0, -1.0, 0.0]]), np.array([[20.0, -3.0, 0.0], [4.0, 8.0, 0.0]])
    jacobians = [np.array([[0.1, 2.0], [0.2, -0.1]]), np.array([[2.0, -0.3], [0.4, 0.8]])]
    true, expected = np.array([[40.0, 0.0], [8.0, 0.0]]), np.array([[37.0, 1.0], [11.0, -1.0]])
    views = []
    for edges, jacobian, origin in zip((along, across), jacobians, ((45.0, 20.0), (20.0, 25.0))):
        centres = [jacobian @ p + origin for p in true]
        views.append(
            ImageView(
                silhouette(*((edges, centre) for centre in centres)),
                None,
                [box_outline(edges)] * 2,
                np.array([jacobian @ p + origin for p in expected]),
                np.array([jacobian] * 2),
            )
        )
    miss = [
        np.abs(expected + fit_outlines(chosen, np.array([9.0 * np.eye(2)] * 2)) - true).max()
        for chosen in (views, views[:1])
    ]
    assert miss[0] < 0.7 < 2.0 < miss[1]


def test_an_object_close_before_a_camera_has_a_bounded_outline():
    """One image sees two merged boxes; for the other one they are close before its lens, or behind it."""
    centres = [np.array([45.0, 38.0]), np.array([67.0, 44.0])]
    boxes, image = [LONG, SQUARE], silhouette((LONG, centres[0]), (SQUARE, centres[1]))
    jacobians, covariances = np.array([np.eye(2)] * 2), np.array([16.0 * np.eye(2)] * 2)
    seen = ImageView(image, None, [box_outline(each) for each in boxes], np.array(centres) + 2.0, jacobians)
    for scale, centre in ((1e7, -1e6), (0.0, -1e6)):
        outlines = [box_outline(scale * each) for each in boxes]
        unseen = ImageView(np.zeros((1, 1), np.uint8), None, outlines, np.full((2, 2), centre), 0.0 * jacobians)
        found = seen.centres + fit_outlines([seen, unseen], covariances)
        assert np.abs(found - centres).max() < 1.5
