import cv2
import numpy as np
import pytest

from drake_tracker.arm.arm_model import tool_down
from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.vision.hand.wrist_measurement import Expectation, FixedPoint, WristReason
from drake_tracker.vision.hand.wrist_template import FORGOTTEN, LEARNED
from drake_tracker.vision.hand.wrist_view import WristView, correlate, peak
from drake_tracker.vision.rectified_patch import plane_homography, rectified
from drake_tracker.world.config import WristCamera
from drake_tracker.world.imaging.wrist_camera import true_wrist_model

TABLE, TOP, LENGTH, WIDTH = 0.45, 0.51, 0.12, 0.04
Z = 0.5 * (TABLE + TOP)
ON_HAND = true_wrist_model(WristCamera())
SEEN = np.ones((ON_HAND.height, ON_HAND.width), np.float32)
TEXTURE = 90.0 + 10.0 * cv2.GaussianBlur(np.random.default_rng(1).normal(size=(600, 600)), (0, 0), 3.0) * 6.0
"""Grey levels of the table, 2 mm a cell, with its middle at (0.5, 0)."""
CELLS = np.array([[0.002, 0.0, -0.1], [0.0, 0.002, -0.6], [0.0, 0.0, 1.0]])
TRUE_COVARIANCE = np.diag([0.0025, 0.0025, 0.003]) ** 2


def camera_at(x, y, height, yaw=0.0):
    """The camera while the tool points down at a height [m] above the middle of the object."""
    X_TW = tool_down([x, y, Z + height], yaw).inverse().GetAsMatrix4()
    return CameraModel(ON_HAND.K, ON_HAND.distortion, ON_HAND.X_CW @ X_TW, ON_HAND.width, ON_HAND.height)


def image_of(camera, x=None, y=None, yaw=0.0, seed=0):
    """The image of the table, and of an object with two colours at (x, y) if these are given."""
    H = plane_homography(camera, np.array([0.0, 0.0, TABLE]), 0.0) @ CELLS
    image = cv2.warpPerspective(TEXTURE, H, (camera.width, camera.height), flags=cv2.INTER_LINEAR)
    if x is not None:
        place = plane_homography(camera, np.array([x, y, TOP]), yaw)
        for first, last, grey in ((-0.5, 0.1, 220.0), (0.1, 0.5, 150.0)):
            ends = [(a * LENGTH, b * WIDTH, 1.0) for a, b in ((first, -0.5), (last, -0.5), (last, 0.5), (first, 0.5))]
            corners = np.array(ends) @ place.T
            corners = np.rint(16.0 * corners[:, :2] / corners[:, 2:]).astype(np.int32)
            cv2.fillConvexPoly(image, corners, grey, lineType=cv2.LINE_AA, shift=4)
    return (image + np.random.default_rng(seed).normal(0.0, 2.0, image.shape)).astype(np.float32)


def fixed_at(x, y):
    return FixedPoint(np.array([x, y, Z]), TRUE_COVARIANCE, LENGTH)


def learn(view, images=30, noise=0.002):
    """What is known after the hand hovered over an object that runs along y at 0.15 m/s."""
    rng, appearance, measured = np.random.default_rng(4), None, None
    for k in range(images):
        x, y = 0.5, -0.1 + 0.0025 * k
        camera = camera_at(x + 0.005, y - 0.004, 0.22, np.pi / 2)
        fixed = fixed_at(*(np.array([x, y]) + rng.normal(0.0, noise, 2)))
        expected = Expectation(np.array([x + 0.003, y - 0.002, Z]), np.pi / 2)
        image = image_of(camera, x, y, np.pi / 2, seed=k)
        appearance, measured = view.measure(appearance, image, SEEN, camera, expected, fixed)
    return appearance, measured


@pytest.fixture(scope="module")
def learned():
    return learn(WristView(TABLE, WIDTH))


def test_a_rectified_patch_of_the_table_does_not_move_with_the_hand():
    middle, patches, images = np.array([0.5, 0.0, TABLE]), [], []
    for k, camera in enumerate((camera_at(0.5, -0.02, 0.22, 0.1), camera_at(0.53, 0.01, 0.17, 0.3))):
        images.append(image_of(camera, seed=k))
        patch, seen = rectified(images[-1], SEEN, camera, middle, 0.5, (0.05, 0.03))
        assert patch.shape == (31, 51) and seen.all()
        patches.append(patch)
    assert np.abs(patches[0] - patches[1]).mean() < 3.0
    assert np.abs(images[0] - images[1]).mean() > 6.0


def test_a_patch_shows_what_is_not_seen():
    seen = SEEN.copy()
    seen[:64] = 0.0
    camera, middle = camera_at(0.5, 0.0, 0.22, 0.0), np.array([0.5, 0.0, TABLE])
    _, mask = rectified(image_of(camera), seen, camera, middle, 0.0, (0.09, 0.03))
    assert 0.1 < mask.mean() < 0.9


def test_a_template_is_learned_while_the_fixed_cameras_see_the_object(learned):
    appearance, measured = learned
    assert appearance.count == 30
    assert measured.reason is WristReason.VALID and measured.correlation > 0.9
    assert measured.p_WQ == pytest.approx([0.5, -0.1 + 0.0025 * 29, Z], abs=0.002)


def test_there_is_no_measurement_before_the_template_is_known():
    _, measured = learn(WristView(TABLE, WIDTH), images=LEARNED - 1)
    assert measured.reason is WristReason.NOT_LEARNED


@pytest.mark.parametrize("height", [0.2, 0.15, 0.1, 0.05, 0.01])
def test_the_object_is_found_at_every_height_of_the_descent(learned, height):
    appearance, _ = learned
    x, y, yaw = 0.52, 0.03, np.pi / 2 + 0.05
    camera = camera_at(x - 0.004, y + 0.006, height, yaw)
    expected = Expectation(np.array([x - 0.006, y + 0.010, Z]), yaw + 0.03)
    _, measured = WristView(TABLE, WIDTH).measure(appearance, image_of(camera, x, y, yaw), SEEN, camera, expected, None)
    assert measured.reason is WristReason.VALID
    assert measured.p_WQ == pytest.approx([x, y, Z], abs=0.003)


def test_the_covariance_follows_the_direction_of_travel(learned):
    _, measured = learned
    assert measured.covariance[1, 1] > 1.1 * measured.covariance[0, 0]  # it runs along y
    assert np.linalg.eigvalsh(measured.covariance).min() > 0.0


def attempt(appearance, image, camera, expected=(0.5, 0.0), fixed=None, seen=SEEN):
    _, measured = WristView(TABLE, WIDTH).measure(
        appearance, image, seen, camera, Expectation(np.array([*expected, Z]), np.pi / 2), fixed
    )
    return measured.reason


def test_reasons_for_no_measurement(learned):
    appearance, _ = learned
    camera = camera_at(0.5, 0.0, 0.1, np.pi / 2)
    image = image_of(camera, 0.5, 0.0, np.pi / 2)
    assert attempt(None, image, camera) is WristReason.NOT_LEARNED
    assert attempt(appearance, np.zeros_like(image), camera) is WristReason.DARK
    assert attempt(appearance, image_of(camera), camera) in (WristReason.POOR_MATCH, WristReason.AT_THE_EDGE)
    assert attempt(appearance, image, camera, expected=(0.5, 0.4)) is WristReason.OUT_OF_VIEW
    assert attempt(appearance, image, camera, seen=0.0 * SEEN) is WristReason.OUT_OF_VIEW
    assert attempt(appearance, image, camera, fixed=fixed_at(0.5, 0.05)) is WristReason.DISAGREES
    assert attempt(appearance, image, camera, fixed=fixed_at(0.5, 0.003)) is WristReason.VALID


def test_a_template_that_is_not_found_is_learned_anew_while_the_fixed_cameras_see_the_object(learned):
    view, (appearance, _) = WristView(TABLE, WIDTH), learned
    camera = camera_at(0.5, 0.0, 0.22, np.pi / 2)
    expected = Expectation(np.array([0.5, 0.0, Z]), np.pi / 2)
    image = 255.0 - image_of(camera, 0.5, 0.0, np.pi / 2)  # another light
    assert view.measure(appearance, image, SEEN, camera, expected, None)[1].reason is WristReason.POOR_MATCH
    for _ in range(FORGOTTEN):
        assert appearance is not None
        appearance, _ = view.measure(appearance, image, SEEN, camera, expected, fixed_at(0.5, 0.0))
    assert appearance is None
    for _ in range(LEARNED):
        appearance, measured = view.measure(appearance, image, SEEN, camera, expected, fixed_at(0.5, 0.0))
    assert measured.reason is WristReason.VALID


def test_cells_that_show_the_hand_do_not_count(learned):
    appearance, _ = learned
    camera = camera_at(0.5, 0.0, 0.05, np.pi / 2)
    image, seen = image_of(camera, 0.5, 0.0, np.pi / 2), SEEN.copy()
    image[80:], seen[80:] = 255.0, 0.0
    assert attempt(appearance, image, camera, seen=seen) is WristReason.VALID


def test_correlation_is_that_of_the_cells_that_count():
    rng = np.random.default_rng(2)
    patch, template = (rng.uniform(0.0, 255.0, shape).astype(np.float32) for shape in ((9, 12), (6, 7)))
    seen, weight = ((rng.uniform(size=shape) > 0.2).astype(np.float32) for shape in ((9, 12), (6, 7)))
    scores = correlate(patch, seen, template, weight)
    for row, column in ((0, 0), (2, 3), (3, 5)):
        part = np.s_[row : row + 6, column : column + 7]
        both = (seen[part] > 0.0) & (weight > 0.0)
        assert scores[row, column] == pytest.approx(np.corrcoef(patch[part][both], template[both])[0, 1], abs=1e-4)


def test_correlation_needs_enough_of_the_template():
    seen = np.zeros((9, 12), np.float32)
    seen[:2] = 1.0
    scores = correlate(np.ones((9, 12), np.float32), seen, np.ones((6, 7), np.float32), np.ones((6, 7), np.float32))
    assert (scores[2:] == -1.0).all() and (scores[0] > -1.0).all()


def test_the_peak_is_found_between_the_cells():
    rows, columns = np.mgrid[:7, :9]
    row, column, at_edge = peak(-((rows - 3.3) ** 2) - (columns - 4.8) ** 2)
    assert (row, column) == pytest.approx((3.3, 4.8)) and not at_edge
    assert peak(-((rows - 0.0) ** 2) - (columns - 4.0) ** 2)[2]
