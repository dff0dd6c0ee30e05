import copy

import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.sensors import ImageRgba8U

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.messages import Centroid, FrameInfo, message_size
from drake_tracker.core.timing import (
    ESTIMATOR_SLOT,
    LAG_CYCLES,
    TIME_STEP,
    VISION_PERIOD,
    lag_of_throughput,
    vision_slot,
)
from drake_tracker.vision.centroid.config import FrameDifference, NormalFlow
from drake_tracker.vision.centroid.frame_difference import FrameDifferenceDetector
from drake_tracker.vision.centroid.motion_centroid_system import MotionCentroidSystem, add_motion_centroid
from drake_tracker.vision.centroid.normal_flow import MotionImages, NormalFlowDetector

WIDTH, HEIGHT = 120, 96
SPEED_U, SPEED_V = 48.0, 12.0
"""Of the body in the images [px/s]."""


def true_centre(time):
    return 30.0 + SPEED_U * time, 40.0 + SPEED_V * time


class Film(LeafSystem):
    """A camera that sees a bright rectangle move; it can start late, and it can show a part of the frame only."""

    def __init__(self, offset=(0, 0), size=(WIDTH, HEIGHT), start=0.0):
        super().__init__()
        self._start = start
        self._columns, self._rows = np.meshgrid(offset[0] + np.arange(size[0]), offset[1] + np.arange(size[1]))
        self.DeclareAbstractOutputPort("color_image", lambda: AbstractValue.Make(ImageRgba8U(*size)), self._calc)

    def _calc(self, context, output):
        u, v = true_centre(max(context.get_time(), self._start))
        alpha = np.clip(14.5 - abs(self._columns - u), 0, 1) * np.clip(8.5 - abs(self._rows - v), 0, 1)
        image = output.get_mutable_value()
        image.mutable_data[:] = np.rint(40.0 + 130.0 * alpha)[..., None]


class Recorder(LeafSystem):
    """Writes down its input at every ``period`` [s], from ``offset`` [s] on."""

    def __init__(self, period, offset):
        super().__init__()
        self.rows = []
        self.DeclareVectorInputPort("centroid", message_size(Centroid))
        self.DeclarePeriodicPublishEvent(period, offset, self._write)

    def _write(self, context):
        self.rows.append((context.get_time(), Centroid(self.get_input_port().Eval(context).copy())))


def run(film, duration, detector=None, image_offset=(0, 0), sample=VISION_PERIOD, sample_offset=0.0, **lag):
    """Simulates a film and its lagged centroid; returns (diagram, simulator, parts, [(time, Centroid)])."""
    builder = DiagramBuilder()
    camera = builder.AddNamedSystem("camera", film)
    settings = {"image_offset": image_offset, "lag_cycles": LAG_CYCLES, **lag}
    parts = add_motion_centroid(
        builder, detector=detector or NormalFlowDetector(), image=camera.get_output_port(), **settings
    )
    recorder = builder.AddNamedSystem("recorder", Recorder(sample, sample_offset))
    builder.Connect(parts.output_port, recorder.get_input_port())
    diagram = builder.Build()
    simulator = Simulator(diagram)
    simulator.AdvanceTo(duration)
    return diagram, simulator, parts, recorder.rows


@pytest.mark.parametrize("preset_stride", [1, 2, 3])
def test_centroid_appears_exactly_15_cycles_after_its_stamp(preset_stride):
    detector = NormalFlowDetector(NormalFlow(stride=preset_stride))
    # The estimator's slot: a quarter of a plant step after the images.
    offset = vision_slot(ESTIMATOR_SLOT)
    _, _, _, rows = run(Film(), 0.7, detector, sample_offset=offset)
    lags = [t - offset - c.stamp for t, c in rows if c.valid]
    assert len(lags) > 20
    assert lags == pytest.approx([LAG_CYCLES * VISION_PERIOD] * len(lags), abs=1e-12)
    first = next(t for t, c in rows if c.valid)
    assert first == pytest.approx((LAG_CYCLES + preset_stride) * VISION_PERIOD + offset)
    assert all((c[:] == 0.0).all() for t, c in rows if t < first)


def test_new_centroid_is_out_before_the_next_plant_step():
    # Sampled on a grid finer than the plant's step, the change falls into the first slot after the images.
    fine = TIME_STEP / 4
    _, _, _, rows = run(Film(), 0.4, sample=fine, sample_offset=fine / 2)
    changes = [b[0] for a, b in zip(rows, rows[1:]) if b[1].stamp != a[1].stamp]
    assert len(changes) > 4
    assert np.mod(np.array(changes) - fine / 2 + 1e-9, VISION_PERIOD) == pytest.approx(0.0, abs=1e-6)


def test_centroid_is_where_the_body_was_at_its_stamp():
    _, _, _, rows = run(Film(), 0.8)
    valid = [c for _, c in rows if c.valid]
    assert len(valid) > 20
    for c in valid:
        assert (c.u, c.v) == pytest.approx(true_centre(c.stamp), abs=0.6)
        assert c.pixel_count >= 12


def test_cropped_image_reports_full_frame_coordinates():
    # Without the guards, whose statistics would be of different sets of pixels.
    detector = NormalFlowDetector(NormalFlow(normalise_gain=False, noise_factor=0.0))
    _, whole_simulator, whole, rows = run(Film(), 0.6, detector)
    offset = (6, 20)
    film = Film(offset, (90, 60))
    _, cropped_simulator, cropped, cropped_rows = run(film, 0.6, detector, image_offset=offset)
    pairs = [(a, b) for (_, a), (_, b) in zip(rows, cropped_rows) if a.valid]
    assert len(pairs) > 15
    for a, b in pairs:
        assert b[:] == pytest.approx(a[:], abs=1e-9)

    def energy(parts, simulator):
        context = parts.system.GetMyContextFromRoot(simulator.get_context())
        return parts.system.GetOutputPort("motion_energy").Eval(context)

    part, frame = energy(cropped, cropped_simulator), energy(whole, whole_simulator)
    assert part.image_offset == offset and part.stamp == frame.stamp > 0.5
    assert part.mask.any()
    assert (part.mask == frame.mask[20:80, 6:96]).all()
    assert not part.mask.flags.writeable


def test_without_motion_the_stamp_runs_on():
    _, _, _, rows = run(Film(start=9.0), 0.5)
    late = [(t, c) for t, c in rows if t > 0.3]
    assert late and all(c.valid == 0.0 and c.stamp > 0.0 and c.pixel_count == 0.0 for _, c in late)
    assert [c.stamp for _, c in late] == sorted({c.stamp for _, c in late})


def test_motion_images_on_demand():
    _, simulator, parts, _ = run(Film(), 0.3)
    port = parts.system.GetOutputPort("motion_images")
    images = port.Eval(parts.system.GetMyContextFromRoot(simulator.get_context()))
    assert isinstance(images, MotionImages)
    assert all(image.shape == (HEIGHT, WIDTH) for image in images)
    assert 160.0 < images.smoothed.max() < 175.0
    energy = parts.system.GetOutputPort("motion_energy").Eval(
        parts.system.GetMyContextFromRoot(simulator.get_context())
    )
    assert (images.motion_energy == energy.mask).all()
    assert port.Eval(parts.system.CreateDefaultContext()) is None


def test_all_memory_is_in_the_context():
    diagram, simulator, _, _ = run(Film(), 0.35)
    context = simulator.get_context()
    replayed = Simulator(diagram, context.Clone())
    simulator.AdvanceTo(0.6)
    replayed.AdvanceTo(0.6)
    a, b = (s.get_context().get_discrete_state_vector().value() for s in (simulator, replayed))
    assert a.any() and (a == b).all()
    memory = context.get_abstract_state(0).get_value()
    assert copy.deepcopy(memory) is memory
    assert not any(image.flags.writeable for image in memory.smoothed)


def test_ports_do_not_feed_through():
    assert not MotionCentroidSystem(NormalFlowDetector()).HasAnyDirectFeedthrough()


def test_shortest_lag_is_the_age_of_the_described_image():
    _, _, _, rows = run(Film(), 0.3, lag_cycles=3)
    assert {round((t - c.stamp) / VISION_PERIOD, 6) for t, c in rows if c.valid} == {4.0}  # Logged before the update.
    with pytest.raises(DrakeTrackerError, match="lag of 1 cycles"):
        add_motion_centroid(DiagramBuilder(), lag_cycles=1)


@pytest.mark.parametrize(
    "detector", [NormalFlowDetector(), FrameDifferenceDetector(), FrameDifferenceDetector(FrameDifference(stride=1))]
)
def test_a_new_centroid_every_few_cycles_with_the_same_lag(detector):
    lag = lag_of_throughput(6, detector.buffer_length - 1, detector.stamp_age_cycles)
    offset = vision_slot(ESTIMATOR_SLOT)
    every, some = (
        run(Film(), 0.8, detector, sample_offset=offset, lag_cycles=lag, update_cycles=cycles)[3] for cycles in (1, 4)
    )
    shown = {}
    for time, centroid in some:
        shown.setdefault(centroid.stamp, (time, centroid))
    fresh = [(time, centroid) for time, centroid in shown.values() if centroid.valid]
    times = [time for time, _ in fresh]
    assert len(fresh) >= 9
    assert np.diff(times) == pytest.approx(4 * VISION_PERIOD)
    assert [t - offset - c.stamp for t, c in fresh] == pytest.approx([lag * VISION_PERIOD] * len(fresh))
    # Each is the one that would have been found anyway.
    anyway = {round(c.stamp, 9): c for _, c in every if c.valid}
    assert all((anyway[round(c.stamp, 9)][:] == c[:]).all() for _, c in fresh)


@pytest.mark.parametrize(("stride", "lag"), [(1, 5.5), (2, 5.0)])
def test_a_difference_shows_6_cycles_after_its_first_image(stride, lag):
    """Nashman and Chaconas 1990, section 4: a throughput of 100.2 ms; the stamp is the middle of the two captures."""
    detector = FrameDifferenceDetector(FrameDifference(stride=stride))
    assert lag_of_throughput(6, detector.buffer_length - 1, detector.stamp_age_cycles) == lag
    offset = vision_slot(ESTIMATOR_SLOT)
    _, _, _, rows = run(Film(), 0.6, detector, sample_offset=offset, lag_cycles=lag, update_cycles=4)
    valid = [(t, c) for t, c in rows if c.valid]
    first_capture, second_capture = (4 - stride) * VISION_PERIOD, 4 * VISION_PERIOD
    time, centroid = valid[0]
    assert centroid.stamp == pytest.approx((first_capture + second_capture) / 2)
    assert time - offset - first_capture == pytest.approx(6 * VISION_PERIOD)
    for _, c in valid:
        assert (c.u, c.v) == pytest.approx(true_centre(c.stamp), abs=0.6)


def test_images_that_no_centroid_rests_on_are_not_read():
    class Counting(FrameDifferenceDetector):
        smoothed = 0

        def smooth(self, grey):
            self.smoothed += 1
            return super().smooth(grey)

    detector = Counting()
    _, simulator, parts, _ = run(Film(), 0.99, detector, lag_cycles=5, update_cycles=4)
    assert detector.smoothed == 30  # of 60: every other one
    images = parts.system.GetOutputPort("motion_images").Eval(
        parts.system.GetMyContextFromRoot(simulator.get_context())
    )
    assert images.motion_energy.any()


@pytest.mark.parametrize("cycles", [0, 1.5, -4])
def test_a_number_of_update_cycles_that_is_none_is_refused(cycles):
    with pytest.raises(DrakeTrackerError, match="update_cycles is"):
        MotionCentroidSystem(FrameDifferenceDetector(), update_cycles=cycles)


class Shutter(LeafSystem):
    """Says that the images of some cycles were dropped, and that all others were taken a little late."""

    late = 0.002

    def __init__(self, dropped):
        super().__init__()
        self._dropped = dropped
        self.DeclareVectorOutputPort("frame", message_size(FrameInfo), self._calc)

    def _calc(self, context, output):
        cycle = round(context.get_time() / VISION_PERIOD)
        dropped = cycle in self._dropped
        output.SetFromVector([context.get_time() + (0.0 if dropped else self.late), float(not dropped)])


@pytest.mark.parametrize(
    "detector, described_by",
    [
        (NormalFlowDetector(), (-2, 0, 2)),
        (FrameDifferenceDetector(FrameDifference(stride=2)), (-1, 1)),
        (FrameDifferenceDetector(FrameDifference(stride=1)), (-0.5, 0.5)),
    ],
)
def test_a_dropped_image_makes_the_centroids_invalid_that_would_rest_on_it(detector, described_by):
    dropped = {14, 15, 22}
    builder = DiagramBuilder()
    film, shutter = builder.AddSystem(Film()), builder.AddSystem(Shutter(dropped))
    system = builder.AddSystem(MotionCentroidSystem(detector, own_stamps=True))
    builder.Connect(film.get_output_port(), system.GetInputPort("color_image"))
    builder.Connect(shutter.get_output_port(), system.GetInputPort("frame"))
    recorder = builder.AddSystem(Recorder(VISION_PERIOD, VISION_PERIOD / 2))
    builder.Connect(system.GetOutputPort("centroid"), recorder.get_input_port())
    Simulator(builder.Build()).AdvanceTo(0.6)
    seen = [c for _, c in recorder.rows if c.stamp > 0.0]
    assert len(seen) > 28
    for c in seen:
        described = round(2.0 * (c.stamp - Shutter.late) / VISION_PERIOD) / 2.0
        used = {described + age for age in described_by}
        assert c.valid == float(not used & dropped), described
        if c.valid:
            assert c.stamp == pytest.approx(described * VISION_PERIOD + Shutter.late, abs=1e-9)
            # The film goes on by the cycle's time.
            assert (c.u, c.v) == pytest.approx(true_centre(c.stamp - Shutter.late), abs=0.6)


@pytest.mark.parametrize(("period", "offset"), [(1 / 50, 0.0), (1 / 50, 0.004), (VISION_PERIOD, 0.01)])
def test_the_lag_is_exact_at_any_period_and_offset(period, offset):
    read_late = offset + 0.2 * period
    _, _, _, rows = run(Film(), 0.6, period=period, offset=offset, lag_cycles=7, sample=period, sample_offset=read_late)
    valid = [(t - read_late + offset, c) for t, c in rows if c.valid]
    assert len(valid) > 15
    for time, c in valid:
        assert time - c.stamp == pytest.approx(7 * period)
        assert (c.stamp - offset) / period == pytest.approx(round((c.stamp - offset) / period))
        assert (c.u, c.v) == pytest.approx(true_centre(c.stamp), abs=0.6)


def test_without_a_lag_it_is_the_shortest():
    _, _, _, rows = run(Film(), 0.3, FrameDifferenceDetector(), lag_cycles=None, sample_offset=VISION_PERIOD / 2)
    assert {round((t - c.stamp) / VISION_PERIOD - 0.5, 6) for t, c in rows if c.valid} == {2.0}
