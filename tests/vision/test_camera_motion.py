"""Motion of the camera: what is found, what is compensated, and what must not be mistaken for it."""

import cv2
import numpy as np
import pytest
from variants import variant

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.faults.camera_faults import turned
from drake_tracker.vision.camera_motion import CameraMotionDetector, UnusableReason, Verdict, align, edge_tolerance
from drake_tracker.vision.config import CameraMotion

WIDTH, HEIGHT, MARGIN, FOCUS = 256, 110, 60, 480.0
SIZE = (WIDTH + 2 * MARGIN, HEIGHT + 2 * MARGIN)
"""The scene reaches beyond the image, so that a camera that moves sees what is there."""
K = np.array([[FOCUS, 0.0, SIZE[0] / 2], [0.0, FOCUS, SIZE[1] / 2], [0.0, 0.0, 1.0]])
CROP = np.array([[1.0, 0.0, -MARGIN], [0.0, 1.0, -MARGIN], [0.0, 0.0, 1.0]])
GRID = np.stack(np.meshgrid(np.arange(8, WIDTH, 16), np.arange(8, HEIGHT, 12)), axis=-1).reshape(1, -1, 2).astype(float)


def texture(size, mean, contrast, blur, seed):
    pattern = cv2.GaussianBlur(np.random.default_rng(seed).normal(size=size[::-1]), (0, 0), blur)
    return np.clip(mean + contrast * pattern / pattern.std(), 5.0, 250.0)


TABLE = texture(SIZE, 60.0, 9.0, 1.3, seed=1)
BODY = texture((200, 90), 150.0, 25.0, 2.0, seed=2)


def shoot(rng, shift=(0.0, 0.0), body=None, width=30, noise=2.0, scene=TABLE):
    """Returns (image, true transform to the image at rest) of a camera turned by ``shift`` [px] to the right and down.

    The left edge of a textured body of ``width`` px is at the column ``body``, in the image at rest.
    """
    scene = scene.copy()
    if body is not None:
        scene[MARGIN : MARGIN + 90, MARGIN + body : MARGIN + body + width] = BODY[:, :width]
    H = turned(K, np.array(shift) / FOCUS)
    image = cv2.warpPerspective(scene, H, SIZE, flags=cv2.INTER_CUBIC)[MARGIN:-MARGIN, MARGIN:-MARGIN]
    image = np.clip(np.rint(image + noise * rng.standard_normal(image.shape)), 0, 255).astype(np.uint8)
    return image, CROP @ np.linalg.inv(H) @ np.linalg.inv(CROP)


def error(transform, truth):
    """Returns the root mean square error of a transform over the image [px]."""
    found, true = (cv2.perspectiveTransform(GRID, matrix) for matrix in (transform, truth))
    return np.sqrt(np.mean(np.sum((found - true) ** 2, axis=2)))


class Camera:
    """A detector with its reference, and the state from image to image."""

    def __init__(self, reference=None, settings=CameraMotion()):
        self.detector = CameraMotionDetector(settings)
        self.rest = reference if reference is not None else shoot(np.random.default_rng(0), noise=0.5)[0]
        self.reference, self.state = self.detector.reference(self.rest), self.detector.initial_state()

    def see(self, image, mask=None):
        seen, self.state = self.detector.observe(self.state, image, self.reference, mask)
        return seen


def watch(shots, camera=None):
    """Returns (verdicts, errors [px]) of shots (image, true transform), seen one after the other."""
    camera = camera or Camera()
    seen = [camera.see(image) for image, _ in shots]
    errors = [error(item.transform, truth) for item, (_, truth) in zip(seen, shots) if item.transform is not None]
    return [item.verdict for item in seen], np.array(errors)


@pytest.mark.parametrize("noise", [2.0, 10.0, 25.0])
def test_a_still_camera_is_never_compensated_however_the_noise(noise):
    rng = np.random.default_rng(3)
    shots = [shoot(rng, body=k, noise=noise) for k in range(200)]
    assert watch(shots)[0] == [Verdict.STILL] * 200


def test_the_image_of_a_still_camera_is_used_untouched():
    image, _ = shoot(np.random.default_rng(0))
    seen = Camera().see(image)
    assert seen.image is image and seen.missing is None
    assert (seen.transform == np.eye(3)).all() and seen.std < 0.05


@pytest.mark.parametrize("body, width", [(60, 30), (60, 85)])
def test_a_shaking_camera_is_compensated_while_an_object_moves(body, width):
    rng = np.random.default_rng(4)
    shots = [shoot(rng, rng.normal(0.0, 1.0, 2), body=body + k, width=width) for k in range(80)]
    verdicts, errors = watch(shots)
    assert set(verdicts) <= {Verdict.STILL, Verdict.COMPENSATED} and verdicts.count(Verdict.COMPENSATED) >= 76
    assert np.median(errors) < 0.1 and errors.max() < 0.4


@pytest.mark.parametrize("step", [1, 3, 8])
def test_an_object_that_covers_a_third_of_the_image_is_not_motion_of_the_camera(step):
    rng = np.random.default_rng(5)
    shots = [shoot(rng, body=(step * k) % 160, width=90) for k in range(60)]
    assert watch(shots)[0] == [Verdict.STILL] * 60


def test_a_mask_excludes_an_object_that_covers_more_than_half():
    rng = np.random.default_rng(6)
    camera, wide = Camera(), 140
    for k in range(20):
        mask = np.zeros((HEIGHT, WIDTH), np.uint8)
        mask[:, 2 * k : 2 * k + wide] = 255
        image, truth = shoot(rng, (2.0, 1.0), body=2 * k, width=wide)
        seen = camera.see(image, mask)
        assert seen.verdict is Verdict.COMPENSATED and error(seen.transform, truth) < 0.5


@pytest.mark.parametrize("direction", [(1.0, 0.0), (0.0, -1.0), (-0.7, 0.7)])
def test_a_pan_is_followed(direction):
    rng, camera, errors = np.random.default_rng(7), Camera(), []
    for k in range(60):
        image, truth = shoot(rng, 0.5 * k * np.array(direction), body=80)
        seen = camera.see(image)
        assert seen.verdict in (Verdict.STILL, Verdict.COMPENSATED)
        errors.append(error(seen.transform, truth))
    assert np.median(errors) < 0.2 and errors[-1] < 1.0


def test_a_long_pan_ends_in_unusable_images():
    rng, camera = np.random.default_rng(8), Camera()
    for k in range(140):
        seen = camera.see(shoot(rng, (0.0, 0.5 * k))[0])
    assert seen.verdict is Verdict.UNUSABLE and seen.transform is None
    assert seen.reason in (UnusableReason.OVERLAP, UnusableReason.MISMATCH) and camera.state.unusable > 1


@pytest.mark.parametrize("knock", [(3.0, 0.0), (-1.2, 0.9), (20.0, -11.0)])
def test_a_knocked_camera_is_compensated_at_once_and_displaced_after_a_while(knock):
    rng = np.random.default_rng(9)
    shots = [shoot(rng, knock if k >= 10 else (0.0, 0.0), body=20 + k) for k in range(60)]
    verdicts, errors = watch(shots, Camera(settings=variant(CameraMotion, steady_images=30)()))
    assert verdicts == 10 * [Verdict.STILL] + 30 * [Verdict.COMPENSATED] + 20 * [Verdict.DISPLACED]
    assert errors.max() < 0.2


def test_a_camera_that_returns_is_still_again():
    rng, camera = np.random.default_rng(10), Camera()
    verdicts = [camera.see(shoot(rng, (4.0 * (k % 3 == 1), 0.0))[0]).verdict for k in range(9)]
    assert verdicts == 3 * [Verdict.STILL, Verdict.COMPENSATED, Verdict.STILL]
    assert camera.state == camera.detector.initial_state()


class TestLight:
    @pytest.mark.parametrize("gain", [0.75, 1.3])
    def test_a_moderate_change_is_not_motion(self, gain):
        rng, camera = np.random.default_rng(11), Camera()
        for _ in range(30):
            image = cv2.convertScaleAbs(shoot(rng, body=40)[0], alpha=gain)
            assert camera.see(image).verdict is Verdict.STILL

    def test_motion_is_found_in_another_light(self):
        rng, camera = np.random.default_rng(12), Camera()
        for _ in range(20):
            image, truth = shoot(rng, (1.5, -1.0))
            seen = camera.see(cv2.convertScaleAbs(image, alpha=0.8, beta=10))
            assert seen.verdict is Verdict.COMPENSATED and error(seen.transform, truth) < 0.2

    @pytest.mark.parametrize("gain", [0.0, 0.4, 2.0])
    def test_a_sudden_large_change_makes_the_image_unusable(self, gain):
        camera = Camera()
        image = cv2.convertScaleAbs(shoot(np.random.default_rng(13), body=40)[0], alpha=gain)
        seen = camera.see(image)
        assert (seen.verdict, seen.reason) == (Verdict.UNUSABLE, UnusableReason.LIGHT)
        assert camera.see(camera.rest).verdict is Verdict.STILL


def test_a_blurred_image_is_unusable():
    image = cv2.GaussianBlur(shoot(np.random.default_rng(14))[0], (0, 0), 3.0)
    seen = Camera().see(image)
    assert (seen.verdict, seen.reason) == (Verdict.UNUSABLE, UnusableReason.MISMATCH)


@pytest.mark.parametrize("grain", [1.3, 4.0])
def test_another_scene_is_unusable(grain):
    rng, camera = np.random.default_rng(15), Camera()
    seen = [camera.see(shoot(rng, scene=texture(SIZE, 60.0, 9.0, grain, seed=20 + k))[0]) for k in range(12)]
    assert {item.verdict for item in seen} == {Verdict.UNUSABLE}


class TestNoTexture:
    BLANK = np.full_like(TABLE, 70.0)

    def test_images_are_used_as_nothing_can_move_in_them(self):
        rng = np.random.default_rng(16)
        camera = Camera(shoot(rng, noise=0.3, scene=self.BLANK)[0])
        for k in range(20):
            seen = camera.see(shoot(rng, (0.5 * k, 0.0), body=2 * k, scene=self.BLANK)[0])
            assert seen.verdict is Verdict.STILL and np.isinf(seen.std)

    def test_a_change_of_the_light_is_still_found(self):
        camera = Camera(np.full((HEIGHT, WIDTH), 70, np.uint8))
        assert camera.see(np.full((HEIGHT, WIDTH), 150, np.uint8)).reason is UnusableReason.LIGHT


def test_a_displaced_camera_whose_view_is_masked_is_not_called_still():
    rng, camera, everything = np.random.default_rng(21), Camera(), np.full((HEIGHT, WIDTH), 255, np.uint8)
    shots = [shoot(rng, (3.0, 0.0))[0] for _ in range(4)]
    verdicts = [camera.see(image, mask).verdict for image, mask in zip(shots, [None, everything, everything, None])]
    assert verdicts == [Verdict.COMPENSATED, Verdict.UNUSABLE, Verdict.UNUSABLE, Verdict.COMPENSATED]


def test_large_images_are_compared_at_lower_resolution_and_aligned_at_their_own():
    rng, factor = np.random.default_rng(17), 4
    large = cv2.resize(TABLE, None, fx=factor, fy=factor, interpolation=cv2.INTER_CUBIC)

    def view(du, dv):
        u, v = factor * MARGIN + du, factor * MARGIN + dv
        crop = large[v : v + factor * HEIGHT, u : u + factor * WIDTH]
        return np.clip(np.rint(crop + 2.0 * rng.standard_normal(crop.shape)), 0, 255).astype(np.uint8)

    camera = Camera(view(0, 0))
    assert camera.reference.factor == 3 and camera.see(view(0, 0)).verdict is Verdict.STILL
    seen = camera.see(view(7, -5))
    truth = np.array([[1.0, 0.0, 7.0], [0.0, 1.0, -5.0], [0.0, 0.0, 1.0]])
    assert seen.verdict is Verdict.COMPENSATED and error(seen.transform, truth) < 0.4
    inner = np.s_[20:-20, 20:-20]
    assert np.abs(seen.image[inner].astype(float) - camera.rest[inner]).mean() < 2.5


def test_alignment_marks_what_the_camera_did_not_see_and_a_tolerance_covers_the_rest():
    rng, camera = np.random.default_rng(18), Camera()
    wrong = []
    for _ in range(20):
        seen = camera.see(shoot(rng, rng.uniform(1.0, 4.0, 2))[0])
        assert 0.01 < np.mean(seen.missing == 255) < 0.1
        difference = cv2.absdiff(seen.image, camera.rest).astype(float)[seen.missing == 0]
        tolerance = edge_tolerance(camera.rest, 0.25)[seen.missing == 0]
        wrong.append([np.mean(difference > 8.0), np.mean(difference > 8.0 + tolerance)])
    moved = np.mean(cv2.absdiff(shoot(rng, (3.0, 2.0))[0], camera.rest) > 8)
    assert moved > 0.3 and np.mean(wrong, axis=0)[1] < 1e-3


def test_alignment_by_whole_pixels_is_exact():
    image = shoot(np.random.default_rng(19))[0]
    aligned, missing = align(image, np.array([[1.0, 0.0, 5.0], [0.0, 1.0, -2.0], [0.0, 0.0, 1.0]]))
    assert (aligned[:-2, 5:] == image[2:, :-5]).all()
    assert (missing[:-2, 5:] == 0).all() and (missing[-2:] == 255).all() and (missing[:, :5] == 255).all()


def test_the_tolerance_is_the_shift_times_the_step_to_the_neighbours():
    line = np.full((9, 9), 50, np.uint8)
    line[:, 4] = 90
    assert edge_tolerance(line, 0.5)[4].tolist() == [0.0, 0.0, 0.0, 20.0, 20.0, 20.0, 0.0, 0.0, 0.0]


def test_a_state_can_be_used_again():
    camera, rng = Camera(), np.random.default_rng(20)
    camera.see(shoot(rng, (2.0, 0.0))[0])
    state, image = camera.state, shoot(rng, (-1.0, 1.0))[0]
    first, second = (camera.detector.observe(state, image, camera.reference)[0] for _ in range(2))
    assert np.array_equal(first.transform, second.transform) and np.array_equal(first.image, second.image)
    with pytest.raises(ValueError, match="read-only"):
        state.warp[0, 0] = 2.0


@pytest.mark.parametrize(
    "image, message",
    [
        (np.zeros((HEIGHT, WIDTH)), r"the image is an array \(110, 256\) of float64; it must be uint8"),
        (np.zeros((HEIGHT, WIDTH, 3), np.uint8), r"the image is an array \(110, 256, 3\) of uint8"),
        (np.zeros((HEIGHT, 90), np.uint8), "the image has 90 x 110 px, the reference has 256 x 110 px"),
    ],
)
def test_images_that_do_not_fit_are_refused(image, message):
    with pytest.raises(DrakeTrackerError, match=message):
        Camera().see(image)


def test_settings_outside_their_range_are_refused():
    with pytest.raises(DrakeTrackerError, match="camera motion: still is 0"):
        CameraMotionDetector(CameraMotion(still=0.0))
