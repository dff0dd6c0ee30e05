import cv2
import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.sensors import ImageRgba8U

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.messages import FrameInfo, message_size
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.vision.camera_motion import Verdict
from drake_tracker.vision.silhouettes import image_alignment
from drake_tracker.vision.silhouettes.background_model import BackgroundModel
from drake_tracker.vision.silhouettes.background_subtraction_system import BackgroundSubtractionSystem
from drake_tracker.vision.silhouettes.foreground import Foreground

WIDTH, HEIGHT, OFFSET = 96, 64, (20, 7)
DROPPED = 14
"""Number of the image that is dropped."""


def pattern():
    rng = np.random.default_rng(0)
    return np.repeat(np.repeat(rng.integers(90, 130, (HEIGHT // 8, WIDTH // 8, 3)), 8, axis=0), 8, axis=1)


SCENE = pattern()


def picture(number):
    """Image of a cycle, uint8 RGB: a bright rectangle runs over a pattern."""
    image = SCENE.copy()
    if number >= 0:
        left = 10 + number % 60
        image[20:36, left : left + 20] = (220, 200, 60)
    return image.astype(np.uint8)


class Film(LeafSystem):
    """A camera, its `FrameInfo` with stamps 2 ms late, and an arm that hides a corner from a cycle on."""

    def __init__(self, latency=0, hidden_from=None):
        super().__init__()
        self._latency, self._hidden_from = latency, hidden_from
        self.DeclareAbstractOutputPort("camera", lambda: AbstractValue.Make(ImageRgba8U(WIDTH, HEIGHT)), self._draw)
        self.DeclareVectorOutputPort("frame", message_size(FrameInfo), self._describe)
        self.DeclareAbstractOutputPort("hidden", lambda: AbstractValue.Make(object()), self._hide)

    def _number(self, context):
        return round(context.get_time() / VISION_PERIOD) - self._latency

    def _draw(self, context, output):
        data = output.get_mutable_value().mutable_data
        data[..., :3] = picture(self._number(context))
        data[..., 3] = 255

    def _describe(self, context, output):
        number = self._number(context)
        output.SetFromVector([number * VISION_PERIOD + 0.002, float(number != DROPPED)])

    def _hide(self, context, output):
        mask = np.zeros((HEIGHT, WIDTH), np.uint8)
        mask[:, 40:] = 255
        shown = self._hidden_from is not None and self._number(context) >= self._hidden_from
        output.set_value(mask if shown else None)


class Laboratory:
    """A film and the foreground of its images."""

    def __init__(self, own_stamps=False, hidden_from=None, image_latency=0, **settings):
        builder = DiagramBuilder()
        film = builder.AddSystem(Film(image_latency, hidden_from))
        self.system = builder.AddSystem(
            BackgroundSubtractionSystem(
                BackgroundModel(), image_offset=OFFSET, own_stamps=own_stamps, image_latency=image_latency, **settings
            )
        )
        builder.Connect(film.GetOutputPort("camera"), self.system.GetInputPort("color_image"))
        if own_stamps:
            builder.Connect(film.GetOutputPort("frame"), self.system.GetInputPort("frame"))
        if hidden_from is not None:
            builder.Connect(film.GetOutputPort("hidden"), self.system.GetInputPort("hidden"))
        self.diagram = builder.Build()
        self.simulator = Simulator(self.diagram)

    def after(self, cycle, name="foreground"):
        """The output after the update of a cycle."""
        self.simulator.AdvanceTo((cycle + 0.5) * VISION_PERIOD)
        context = self.system.GetMyContextFromRoot(self.simulator.get_context())
        return self.system.GetOutputPort(name).Eval(context)


def same(one, other):
    """Whether two foregrounds are identical, or both are None."""
    if one is None or other is None:
        return one is other
    return (
        one.stamp == other.stamp
        and all(np.array_equal(getattr(one, name), getattr(other, name)) for name in ("image", "mask", "moving"))
        and one.usable == other.usable
    )


def test_the_first_image_is_described_in_its_own_cycle():
    found = Laboratory().after(0)
    assert isinstance(found, Foreground)
    assert found.stamp == 0.0 and found.usable and not found.mask.any()
    assert found.image_offset == OFFSET and found.image.shape == (HEIGHT, WIDTH, 3) and found.hidden is None


def test_the_results_are_those_of_the_model():
    laboratory, model = Laboratory(), BackgroundModel()
    state = model.start(model.smooth(picture(0)))
    for cycle in range(40):
        found = laboratory.after(cycle)
        if cycle:
            state, _ = model.update(state, model.smooth(picture(cycle)))
        np.testing.assert_array_equal(found.mask, state.mask)
        np.testing.assert_array_equal(found.moving, state.moving)
        assert found.stamp == pytest.approx(cycle * VISION_PERIOD, abs=1e-12)
    assert found.mask.any()


@pytest.mark.parametrize("delay", [0, 1, 15])
def test_the_delay_is_exactly_the_given_number_of_cycles(delay):
    now, late = Laboratory(), Laboratory(delay_cycles=delay)
    shown = [now.after(cycle) for cycle in range(30)]
    for cycle in range(30):
        delayed = late.after(cycle, "delayed")
        if cycle < delay:
            assert delayed is None
        else:
            assert same(delayed, shown[cycle - delay])
        assert same(late.after(cycle, "foreground"), shown[cycle])


@pytest.mark.parametrize("latency", [1, 12])
def test_late_images_have_the_stamps_of_their_capture(latency):
    now, late = Laboratory(), Laboratory(image_latency=latency)
    for cycle in range(latency):
        assert late.after(cycle) is None, "no image was captured before the start"
    for cycle in range(20):
        assert same(late.after(cycle + latency), now.after(cycle))


@pytest.mark.parametrize("latency", [0, 1, 12])
def test_only_every_second_image_is_looked_at(latency):
    """By the number of its capture, whatever the latency is."""
    laboratory, model = Laboratory(image_latency=latency, update_cycles=2, delay_cycles=3), BackgroundModel()
    state = model.start(model.smooth(picture(0)))
    for cycle in range(30):
        found = laboratory.after(cycle + latency)
        assert (found is None) == bool(cycle % 2)
        if cycle and found is not None:
            state, _ = model.update(state, model.smooth(picture(cycle)))
            np.testing.assert_array_equal(found.mask, state.mask)
            assert found.stamp == pytest.approx(cycle * VISION_PERIOD, abs=1e-12)
            assert laboratory.after(cycle + latency, "motion_energy").stamp == found.stamp
    assert state.mask.any() and laboratory.after(29 + latency, "motion_energy").stamp == pytest.approx(
        28 * VISION_PERIOD
    )
    assert laboratory.after(31 + latency, "delayed").stamp == pytest.approx(28 * VISION_PERIOD)


def test_stamps_of_the_images_and_a_dropped_image():
    laboratory = Laboratory(own_stamps=True, delay_cycles=3)
    for cycle in range(30):
        found = laboratory.after(cycle)
        if cycle == DROPPED:
            assert found is None
        else:
            assert found.stamp == pytest.approx(cycle * VISION_PERIOD + 0.002, abs=1e-12)
        if cycle >= 3:
            assert (laboratory.after(cycle, "delayed") is None) == (cycle == DROPPED + 3)


def test_a_dropped_image_is_not_used():
    laboratory, model = Laboratory(own_stamps=True), BackgroundModel()
    state = model.start(model.smooth(picture(0)))
    for cycle in range(1, 30):
        found = laboratory.after(cycle)
        if cycle != DROPPED:
            state, _ = model.update(state, model.smooth(picture(cycle)))
            np.testing.assert_array_equal(found.mask, state.mask)


def test_what_the_arm_hides_goes_to_the_model_and_on():
    laboratory = Laboratory(hidden_from=20)
    assert laboratory.after(19).hidden is None
    found = laboratory.after(30)
    assert found.hidden.shape == (HEIGHT, WIDTH) and found.hidden[0, 40] == 255
    assert not found.mask[found.hidden > 0].any()


def test_the_picture_is_the_newest_silhouette():
    laboratory = Laboratory(own_stamps=True, delay_cycles=3)
    nothing = Laboratory(image_latency=5).after(2, "motion_energy")
    assert not nothing.mask.any() and nothing.image_offset == OFFSET
    for cycle in (5, DROPPED - 1, DROPPED, 25):
        energy = laboratory.after(cycle, "motion_energy")
        newest = cycle - (cycle == DROPPED)
        assert energy.stamp == pytest.approx(newest * VISION_PERIOD + 0.002) and energy.image_offset == OFFSET
        assert energy.mask.shape == (HEIGHT, WIDTH)


def test_a_cloned_context_goes_on_in_the_same_way():
    laboratory = Laboratory(delay_cycles=4)
    kept = laboratory.after(20)
    clone = laboratory.simulator.get_context().Clone()
    first = laboratory.after(35, "delayed")
    laboratory.simulator = Simulator(laboratory.diagram, clone)
    laboratory.simulator.Initialize()
    assert same(laboratory.after(20), kept)
    assert same(laboratory.after(35, "delayed"), first)


def test_a_negative_delay_is_refused():
    with pytest.raises(DrakeTrackerError, match="delay_cycles is -1"):
        BackgroundSubtractionSystem(BackgroundModel(), delay_cycles=-1)


def test_the_picture_stays_while_images_are_dropped():
    energy = Laboratory(own_stamps=True).after(DROPPED, "motion_energy")
    assert energy.mask.shape == (HEIGHT, WIDTH)
    assert energy.stamp > 0.2


def texture(seed):
    rng = np.random.default_rng(seed)
    coarse = rng.integers(40, 200, (12, 25), dtype=np.uint8)
    return np.dstack([cv2.resize(coarse, (200, 96), interpolation=cv2.INTER_CUBIC)] * 3)


def last_of(images):
    """The foreground of the last of some images, from a system that has seen the others."""
    system = BackgroundSubtractionSystem(BackgroundModel())
    memory = system.CreateDefaultContext().get_abstract_state(0).get_value()
    for number, image in enumerate(images):
        memory, found = system._segmented(memory, BackgroundModel().smooth(image), None, number / 60)
    return found


def usable_after(images):
    """Whether the last of some images could be used, by a system that has seen the others."""
    return last_of(images).usable


def panned(*shifts):
    """Images of a camera at rest, and then displaced by ``shifts`` [px]: few pixels change, as on a table."""
    pattern = cv2.GaussianBlur(np.random.default_rng(1).normal(size=(96, 206)), (0, 0), 1.5)
    scene = cv2.cvtColor(np.uint8(np.clip(90.0 + 8.0 * pattern / pattern.std(), 0, 255)), cv2.COLOR_GRAY2RGB)
    moves = [np.array([[1.0, 0.0, -shift], [0.0, 1.0, 0.0]]) for shift in (*[0.0] * 30, *shifts)]
    return [cv2.warpAffine(scene, move, (206, 96), flags=cv2.INTER_CUBIC)[:, :200].copy() for move in moves]


def test_a_camera_that_begins_to_pan_is_noticed_after_two_pixels():
    found = last_of(panned(1.0, 2.0))
    assert found.camera is Verdict.COMPENSATED and found.displacement == pytest.approx(2.0, abs=0.2)
    assert cv2.countNonZero(found.mask) == 0 and found.hidden is None
    assert found.missing[:, 0].all() and not found.missing[8:-8, 8:].any()


def test_a_displacement_that_a_shadow_can_feign_is_no_motion_of_a_camera_at_rest(monkeypatch):
    monkeypatch.setattr(image_alignment, "suggests_motion", lambda background, difference, hidden: True)
    found = last_of(panned(0.3))
    assert found.camera is Verdict.STILL and found.usable and found.missing is None
    assert last_of(panned(2.0, 0.3)).camera is Verdict.COMPENSATED


def test_a_scene_in_another_light_is_learned_after_a_second():
    scene = texture(1)
    assert not usable_after([scene] * 30 + [scene // 2] * 20)
    assert usable_after([scene] * 30 + [scene // 2] * 90)


def test_another_scene_is_never_learned_since_the_camera_may_have_been_moved():
    assert not usable_after([texture(1)] * 30 + [texture(2)] * 120)
