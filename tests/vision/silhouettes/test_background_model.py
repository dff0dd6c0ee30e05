import copy

import cv2
import numpy as np
import pytest

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.vision.silhouettes import background_model
from drake_tracker.vision.silhouettes.background_model import BackgroundModel
from drake_tracker.vision.silhouettes.config import Silhouettes

WIDTH, HEIGHT = 160, 110
RATE = 60
"""Images per second."""
LENGTH, BREADTH = 28, 16
"""Of the object [px]."""
GOLD, BLUE, WHITE = (208, 176, 64), (50, 70, 150), (245, 245, 240)


def textured(seed=0, base=(126, 112, 96), contrast=14.0, grey=False):
    """A still scene with texture: float (HEIGHT, WIDTH, 3)."""
    rng = np.random.default_rng(seed)
    fine = cv2.GaussianBlur(rng.normal(0.0, 1.0, (HEIGHT, WIDTH)), (0, 0), 1.5)
    coarse = cv2.GaussianBlur(rng.normal(0.0, 1.0, (HEIGHT, WIDTH)), (0, 0), 8.0)
    pattern = contrast * (0.4 * fine / fine.std() + 0.6 * coarse / coarse.std())
    if grey:
        base = (base[1],) * 3
    return np.asarray(base, float) + pattern[..., None]


class Scene:
    """Images of a still scene in which one rectangle is drawn."""

    def __init__(self, background=None, colour=GOLD, noise=1.0, seed=1):
        self.background = textured() if background is None else background
        self.colour, self.noise = np.asarray(colour, float), noise
        self._rng = np.random.default_rng(seed)

    def truth(self, u, v=50.0):
        """Covered share of each pixel of the rectangle with its centre at (u, v) [px], (HEIGHT, WIDTH)."""
        columns, rows = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
        across = np.clip(0.5 * LENGTH + 0.5 - abs(columns - u), 0.0, 1.0)
        return across * np.clip(0.5 * BREADTH + 0.5 - abs(rows - v), 0.0, 1.0)

    def image(self, u=None, v=50.0, gain=1.0, shadow=None):
        """An image, uint8, the object at (u, v), None: without it; ``shadow`` scales the brightness of the scene."""
        scene = self.background if shadow is None else self.background * shadow[..., None]
        if u is not None:
            covered = self.truth(u, v)[..., None]
            scene = scene * (1.0 - covered) + self.colour * covered
        scene = gain * scene + self._rng.normal(0.0, self.noise, scene.shape)
        return np.clip(np.rint(scene), 0, 255).astype(np.uint8)


class Viewer:
    """A background model that is shown one image after another."""

    def __init__(self, model=None):
        self.model = model or BackgroundModel()
        self.state, self.usable = None, True

    def see(self, image, hidden=None):
        smoothed = self.model.smooth(image)
        if self.state is None:
            self.state = self.model.start(smoothed)
        else:
            self.state, self.usable = self.model.update(self.state, smoothed, hidden)
        return self.state.mask > 0


def path(time, speed=40.0):
    """Column of an object that runs to and fro [px], from the first image on."""
    low, high = 28.0, WIDTH - 28.0
    phase = (speed * time) % (2 * (high - low))
    return low + min(phase, 2 * (high - low) - phase)


def run_to_and_fro(scene, viewer, seconds, first=0):
    """Shows images of a moving object; returns the column in the last one."""
    for number in range(first, first + round(seconds * RATE)):
        u = path(number / RATE)
        viewer.see(scene.image(u))
    return u


def deviation(mask, truth):
    """Largest distance [px] of a pixel in one silhouette from the other: how far the two outlines are apart."""
    truth = truth >= 0.5
    far = 0.0
    for one, other in ((mask, truth), (truth, mask)):
        if not one.any():
            continue
        distances = cv2.distanceTransform((~other).astype(np.uint8), cv2.DIST_L2, 5)
        far = max(far, float(distances[one].max()) if other.any() else np.inf)
    return far


def learned(scene, seconds=0.7, model=None):
    """A viewer that has seen the empty scene."""
    viewer = Viewer(model)
    for _ in range(round(seconds * RATE)):
        viewer.see(scene.image())
    return viewer


SCENES = {
    "gold": {},
    "blue": {"colour": BLUE},
    "white": {"colour": WHITE},
    "dark on bright": {"colour": (60, 58, 64), "background": textured(base=(220, 218, 214), contrast=6.0)},
    "bright on dark": {"colour": (150, 152, 148), "background": textured(base=(40, 42, 44), contrast=6.0)},
    "grey images": {"colour": (190, 190, 190), "background": textured(grey=True)},
    "noise of 12 grey levels": {"noise": 12.0, "colour": WHITE},
}


@pytest.mark.parametrize("name", SCENES)
def test_the_scene_is_learned_although_an_object_moves_from_the_first_image_on(name):
    """Then the silhouette is the object, and the empty scene shows nothing."""
    scene, viewer = Scene(**SCENES[name]), Viewer()
    run_to_and_fro(scene, viewer, 5.0)
    assert (viewer.state.known > 0).all()
    learned_scene = viewer.model.smooth(np.clip(scene.background, 0, 255).astype(np.uint8)).astype(float)
    error = np.abs(viewer.state.mean - learned_scene).max(axis=2)
    assert np.percentile(error, 99) < 4.0 + 1.5 * scene.noise
    for number in range(5 * RATE, 6 * RATE):
        u = path(number / RATE)
        mask = viewer.see(scene.image(u))
        assert viewer.usable
        if number % 10 == 0:
            assert deviation(mask, scene.truth(u)) <= 1.5  # within a pixel, diagonally
            rows, columns = np.nonzero(mask)
            assert (columns.mean(), rows.mean()) == pytest.approx((u, 50.0), abs=0.6)
    assert not viewer.see(scene.image()).any()


def test_a_moving_object_is_found_before_the_scene_is_known():
    scene, viewer = Scene(), Viewer()
    for number in range(12):
        u = path(number / RATE, speed=60.0)
        mask = viewer.see(scene.image(u))
    assert mask.any()
    assert mask[scene.truth(u) > 0.5].mean() > 0.5
    assert not mask[cv2.dilate((scene.truth(u) > 0).astype(np.uint8), np.ones((41, 41))) == 0].any()


def test_a_slow_start():
    """An object that stands at first is taken for a part of the scene. Its ghost goes away after it has left."""
    scene, viewer = Scene(), Viewer()
    for _ in range(2 * RATE):
        mask = viewer.see(scene.image(40.0))
    assert not mask.any(), "nothing has moved"
    for number in range(round(0.9 * RATE)):
        viewer.see(scene.image(40.0 + 60.0 * number / RATE))
    left = scene.truth(40.0) > 0.5
    for number in range(RATE):
        u = 94.0 - 20.0 * number / RATE + 20.0
        mask = viewer.see(scene.image(u))
    assert not mask[left].any(), "the place that it has left"
    assert deviation(mask, scene.truth(u)) <= 1.5


def test_an_object_that_stops_stays_in_the_silhouette_for_a_minute():
    scene, viewer = Scene(), learned(Scene())
    for number in range(RATE):
        mask = viewer.see(scene.image(30.0 + 40.0 * number / RATE))
    for number in range(60 * RATE):
        mask = viewer.see(scene.image(70.0))
        if number % RATE == 0:
            assert deviation(mask, scene.truth(70.0)) <= 1.5, f"after {number / RATE:.0f} s"
    for number in range(RATE):
        u = 70.0 + 40.0 * number / RATE
        mask = viewer.see(scene.image(u))
    assert deviation(mask, scene.truth(u)) <= 1.5, "no ghost where it stood"


def shadow_beside(scene, u, v=50.0, depth=0.6):
    """Brightness (HEIGHT, WIDTH) of a scene in which the object at (u, v) casts a shadow to its lower right."""
    cast = np.clip(scene.truth(u + 9.0, v + 7.0), 0.0, 1.0)
    return 1.0 - (1.0 - depth) * cv2.GaussianBlur(cast, (3, 3), 0.8)


@pytest.mark.parametrize("depth", [0.45, 0.6, 0.8])
def test_a_cast_shadow_is_not_part_of_the_object(depth):
    scene = Scene()
    viewer = learned(scene)
    for number in range(RATE):
        u = 40.0 + 40.0 * number / RATE
        mask = viewer.see(scene.image(u, shadow=shadow_beside(scene, u, depth=depth)))
        if number % 6 == 5:
            truth = scene.truth(u)
            assert mask[truth > 0.5].mean() > 0.95
            # Where the edge of the shadow meets that of the object, a few pixels are neither.
            around = cv2.dilate((truth > 0.5).astype(np.uint8), np.ones((5, 5))) > 0
            assert np.count_nonzero(mask & ~around) <= 4


def test_a_dark_object_is_not_a_shadow():
    """It is the scene's colour, but darker, as a shadow; yet nothing else is in its region."""
    background = textured(base=(200, 200, 200), contrast=4.0, grey=True)
    scene = Scene(background=background, colour=(90, 90, 90))
    viewer = learned(scene)
    for number in range(RATE):
        u = 40.0 + 40.0 * number / RATE
        mask = viewer.see(scene.image(u))
    assert deviation(mask, scene.truth(u)) <= 1.5


def test_lamps_that_flicker_by_a_tenth_move_nothing():
    scene = Scene()
    viewer = learned(scene, 1.0)
    for number in range(2 * RATE):
        gain = 1.0 + 0.1 * np.sin(2.0 * np.pi * 9.0 * number / RATE)
        u = 40.0 + 30.0 * number / RATE
        mask = viewer.see(scene.image(u, gain=gain))
        assert viewer.usable
        if number % 7 == 0:
            assert deviation(mask, scene.truth(u)) <= 2.0
    for number in range(10):
        assert not viewer.see(scene.image(gain=0.9 + 0.02 * number)).any()


def test_flicker_from_the_first_image_on_does_not_hinder_learning():
    scene, viewer = Scene(), Viewer()
    for number in range(6 * RATE):
        gain = 1.0 + 0.1 * np.sin(2.0 * np.pi * 7.3 * number / RATE)
        u = path(number / RATE)
        mask = viewer.see(scene.image(u, gain=gain))
    assert (viewer.state.known > 0).mean() > 0.99
    assert deviation(mask, scene.truth(u)) <= 2.0


def test_noise_alone_is_no_object():
    scene, viewer = Scene(noise=12.0), Viewer()
    for number in range(3 * RATE):
        mask = viewer.see(scene.image())
        if number > 20:
            count, _, statistics, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=8)
            assert (statistics[1:count, cv2.CC_STAT_AREA] < 6).all(), f"image {number}"


def test_light_that_is_switched_off_and_on():
    scene = Scene()
    viewer = learned(scene)
    for _ in range(RATE):
        assert not viewer.see(scene.image(60.0, gain=0.15)).any()
        assert not viewer.usable
    for number in range(RATE):
        u = 60.0 + 30.0 * number / RATE
        mask = viewer.see(scene.image(u))
        assert viewer.usable
    assert deviation(mask, scene.truth(u)) <= 1.5


def test_what_the_arm_hides_is_not_foreground_and_not_learned():
    scene = Scene()
    hidden = np.zeros((HEIGHT, WIDTH), np.uint8)
    hidden[20:90, 90:130] = 255
    arm = Scene(background=np.where(hidden[..., None] > 0, 30.0, scene.background))
    viewer = learned(scene)
    before = viewer.state.mean.copy()
    for number in range(RATE):
        u = 30.0 + 30.0 * number / RATE
        mask = viewer.see(arm.image(u), hidden)
        assert not mask[hidden > 0].any()
    assert mask[scene.truth(u) > 0.5].all()
    np.testing.assert_array_equal(viewer.state.mean[hidden > 0], before[hidden > 0])
    for _ in range(20):
        mask = viewer.see(scene.image())
    assert not mask[hidden > 0].any(), "where the arm was, the scene is as before"


def test_what_is_hidden_from_the_first_image_on_is_learned_once_it_is_free():
    scene = Scene()
    hidden = np.zeros((HEIGHT, WIDTH), np.uint8)
    hidden[20:90, 90:130] = 255
    viewer = Viewer()
    for _ in range(RATE):
        viewer.see(np.where(hidden[..., None] > 0, np.uint8(30), scene.image()), hidden)
    assert not viewer.state.known[hidden > 0].any()
    for _ in range(RATE):
        viewer.see(scene.image())
    assert viewer.state.known.all()
    assert np.abs(viewer.state.mean - scene.background)[hidden > 0].mean() < 4.0


def test_what_is_outside_of_the_window_is_ignored():
    window = np.zeros((HEIGHT, WIDTH), np.uint8)
    window[:, :80] = 1
    scene = Scene()
    viewer = learned(scene, model=BackgroundModel(window=window))
    assert viewer.see(scene.image(40.0)).any()
    assert not viewer.see(scene.image(120.0)).any()


def test_two_colours_at_once_are_two_silhouettes():
    scene, other = Scene(), Scene(colour=BLUE)
    viewer = learned(scene)
    covered = other.truth(110.0, 70.0)[..., None]
    for number in range(30):
        image = scene.image(40.0 + number) * (1.0 - covered) + other.colour * covered
        mask = viewer.see(np.rint(image).astype(np.uint8))
    truth = np.maximum(scene.truth(69.0), other.truth(110.0, 70.0))
    assert deviation(mask, truth) <= 1.5


def test_the_state_is_read_only_and_a_step_from_it_can_be_repeated():
    scene = Scene()
    viewer = learned(scene)
    state = viewer.state
    image = viewer.model.smooth(scene.image(60.0))
    kept = copy.deepcopy(vars(state))
    first, again = (viewer.model.update(state, image)[0] for _ in range(2))
    for name, value in vars(first).items():
        np.testing.assert_equal(value, getattr(again, name), err_msg=name)
        np.testing.assert_equal(getattr(state, name), kept[name], err_msg=name)
        if isinstance(value, np.ndarray):
            assert not value.flags.writeable, name


def test_bad_settings_are_refused():
    with pytest.raises(DrakeTrackerError, match="silhouettes: threshold is 0"):
        BackgroundModel(Silhouettes(threshold=0.0))
    with pytest.raises(DrakeTrackerError, match="silhouettes: the window of interest is empty"):
        BackgroundModel(window=np.zeros((HEIGHT, WIDTH), np.uint8))


@pytest.mark.parametrize("count", [1, 2, 101, 102])
def test_the_median_is_that_of_numpy(count):
    values = np.random.default_rng(count).integers(0, 255, count).astype(np.uint8)
    expected = float(np.median(values))
    assert background_model._median(values) == expected


def test_motion_at_the_border_does_not_spread_to_it():
    """OpenCV's own closing takes what lies beyond the image for unknown, and fills the strip along its border."""
    mask = np.zeros((HEIGHT, WIDTH), np.uint8)
    mask[40:60, 100:150] = 255
    np.testing.assert_array_equal(background_model._closed(mask, 25), mask)
    mask[40:60, 108:130] = 0
    closed = background_model._closed(mask, 25)
    assert (closed[40:60, 100:150] == 255).all() and closed.sum() == 255 * 20 * 50


@pytest.mark.parametrize("speed", [0.5, 2.0, 5.0])
def test_an_object_that_has_just_begun_to_move_is_not_lengthened_by_its_trail(speed):
    """Nothing is known of the background in front of which it stood. ``speed`` in px an image."""
    viewer, scene = Viewer(), Scene(colour=BLUE)
    late = []
    for number in range(20):
        u = 40.0 + speed * number
        viewer.see(scene.image(u))
        if number >= 13:
            columns = np.flatnonzero(viewer.state.mask.any(axis=0))
            late.append(u - 0.5 * (columns[0] + columns[-1]))
    assert 0.0 <= np.mean(late) < 1.0 + 1.2 * speed


def test_the_border_surrounds_the_window_and_the_image():
    window = np.zeros((HEIGHT, WIDTH), np.uint8)
    window[20:90, 30:] = 255
    border = BackgroundModel(window=window).start(np.zeros((HEIGHT, WIDTH, 3), np.uint8)).border
    inside = np.zeros((HEIGHT, WIDTH), bool)
    inside[23:87, 33 : WIDTH - 3] = True
    np.testing.assert_array_equal(border == 0, inside)
