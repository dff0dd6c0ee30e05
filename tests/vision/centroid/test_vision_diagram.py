import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.primitives import LogVectorOutput
from pydrake.systems.sensors import ImageRgba8U

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.messages import Centroid, TrackPoint
from drake_tracker.core.timing import LAG_CYCLES, VISION_PERIOD
from drake_tracker.vision.centroid.normal_flow import NormalFlowDetector
from drake_tracker.vision.centroid.vision_diagram import VisionDiagram

PORTS = [
    "point",
    *("centroid_left", "motion_left", "motion_images_left"),
    *("centroid_right", "motion_right", "motion_images_right"),
]


class Late(LeafSystem):
    """Outputs its image some cycles late."""

    def __init__(self, latency):
        super().__init__()
        self.DeclareAbstractInputPort("image", AbstractValue.Make(ImageRgba8U()))
        self.images = self.DeclareAbstractState(AbstractValue.Make(()))
        self.latency = latency
        self.DeclareAbstractOutputPort("late", lambda: AbstractValue.Make(ImageRgba8U()), self.calc)
        self.DeclarePeriodicUnrestrictedUpdateEvent(VISION_PERIOD, 0.0, self.update)

    def update(self, context, state):
        images = (*context.get_abstract_state(self.images).get_value(), self.get_input_port().Eval(context).data.copy())
        state.get_mutable_abstract_state(self.images).set_value(images[-self.latency :])

    def calc(self, context, output):
        images = context.get_abstract_state(self.images).get_value()
        if len(images) == self.latency:
            image = ImageRgba8U(*images[0].shape[1::-1])
            image.mutable_data[:] = images[0]
            output.set_value(image)


def make_vision(laboratory, image_windows=None, lag_cycles=LAG_CYCLES, image_latency=0):
    image_windows = image_windows or laboratory.whole
    return VisionDiagram(
        laboratory.cameras,
        {
            side: NormalFlowDetector(window=window.mask(image_windows[side]))
            for side, window in laboratory.windows.items()
        },
        image_windows=image_windows,
        lag_cycles=lag_cycles,
        work_volume=laboratory.work_volume,
        image_latency=image_latency,
    )


def watch(laboratory, duration, path=None, image_windows=None, **options):
    """Returns (diagram, simulator, {port: rows}) of a film that the vision subsystem watched, a row each cycle."""
    builder = DiagramBuilder()
    film = builder.AddSystem(laboratory.film(path, image_windows))
    vision = builder.AddSystem(make_vision(laboratory, image_windows, **options))
    for side in ("left", "right"):
        port = film.GetOutputPort(f"camera_{side}")
        if options.get("image_latency"):
            late = builder.AddSystem(Late(options["image_latency"]))
            builder.Connect(port, late.get_input_port())
            port = late.get_output_port()
        builder.Connect(port, vision.GetInputPort(f"camera_{side}"))
    logs = {
        name: LogVectorOutput(vision.GetOutputPort(name), builder, publish_period=VISION_PERIOD)
        for name in ("point", "centroid_left", "centroid_right")
    }
    diagram = builder.Build()
    simulator = Simulator(diagram)
    simulator.AdvanceTo(duration)
    return vision, simulator, {name: log.FindLog(simulator.get_context()).data().T for name, log in logs.items()}


def column(rows, view, name):
    return rows[:, view.get_fields().index(name)]


def valid_points(rows):
    good = column(rows, TrackPoint, "valid") > 0
    return column(rows, TrackPoint, "stamp")[good], rows[good][:, 1:4]


@pytest.mark.parametrize("latency", [1, 12])
def test_late_images_give_the_same_points_at_the_same_time(small_laboratory, latency):
    _, _, at_once = watch(small_laboratory, 0.6)
    _, _, late = watch(small_laboratory, 0.6, image_latency=latency)
    assert column(at_once["point"], TrackPoint, "valid").any()
    for name, rows in at_once.items():
        np.testing.assert_array_equal(late[name], rows)


def test_images_that_are_too_late_for_the_lag_are_refused(small_laboratory):
    with pytest.raises(DrakeTrackerError, match="a lag of 15 cycles of images that are 13 cycles late leaves nothing"):
        make_vision(small_laboratory, image_latency=13)


def test_ports(small_laboratory):
    vision = make_vision(small_laboratory)
    assert [vision.get_output_port(k).get_name() for k in range(vision.num_output_ports())] == PORTS
    assert [vision.get_input_port(k).get_name() for k in range(vision.num_input_ports())] == [
        "camera_left",
        "camera_right",
    ]
    assert vision.get_name() == "vision"


def test_points_lie_where_the_body_was_at_their_stamps(small_laboratory):
    _, _, logged = watch(small_laboratory, 1.6)
    stamps, points = valid_points(logged["point"])
    assert len(stamps) > 60
    error = points - small_laboratory.circle(stamps)
    assert np.abs(error).max() < 0.010  # two pixels
    # A stamp that is a cycle off would shift all points by 2.5 mm along the path.
    heading = np.pi / 2 + small_laboratory.speed / small_laboratory.radius * stamps
    along = np.sum(error[:, :2] * np.column_stack([np.cos(heading), np.sin(heading)]), axis=1)
    assert abs(along.mean()) < 0.0012


def test_a_point_comes_every_cycle_a_lag_after_its_stamp(small_laboratory):
    _, _, logged = watch(small_laboratory, 0.8, lag_cycles=20)
    stamps, _ = valid_points(logged["point"])
    assert np.diff(stamps) == pytest.approx(VISION_PERIOD, abs=1e-9)
    first = int(np.argmax(column(logged["point"], TrackPoint, "valid")))
    # A row is what the port showed before the updates of its instant: the point came one cycle before it.
    assert (first - 1) * VISION_PERIOD - stamps[0] == pytest.approx(20 * VISION_PERIOD)


def test_images_of_the_window_alone_give_the_same_points(small_laboratory):
    _, _, whole = watch(small_laboratory, 0.8)
    bounds = {side: window.bounds for side, window in small_laboratory.windows.items()}
    assert all(width < 160 for _, _, width, _ in bounds.values())
    _, _, cut = watch(small_laboratory, 0.8, image_windows=bounds)
    assert len(valid_points(whole["point"])[0]) > 20
    for name in ("centroid_left", "centroid_right"):
        u, v = column(cut[name], Centroid, "u"), column(cut[name], Centroid, "v")
        assert u == pytest.approx(column(whole[name], Centroid, "u"), abs=0.2)
        assert v == pytest.approx(column(whole[name], Centroid, "v"), abs=0.2)


@pytest.mark.parametrize(
    "path",
    [lambda time: None, lambda time: np.array([0.56, 0.1, 0.485])],
    ids=["empty table", "body at rest"],
)
def test_where_nothing_moves_no_point_is_valid(small_laboratory, path):
    _, _, logged = watch(small_laboratory, 0.6, path)
    assert not column(logged["point"], TrackPoint, "valid").any()
    assert column(logged["point"], TrackPoint, "stamp")[-1] > 0.2, "an invalid point says since when there was none"


def test_what_moves_outside_the_work_volume_is_not_looked_at(small_laboratory):
    _, _, logged = watch(small_laboratory, 0.6, lambda time: np.array([0.60, 0.15 * time, 0.62]))
    assert not column(logged["point"], TrackPoint, "valid").any()


def test_intermediate_images_can_be_looked_at(small_laboratory):
    vision, simulator, _ = watch(small_laboratory, 0.3)
    context = vision.GetMyContextFromRoot(simulator.get_context())
    for side in ("left", "right"):
        energy = vision.GetOutputPort(f"motion_{side}").Eval(context)
        assert energy.mask.shape == (160, 160) and energy.mask.any()
        assert energy.stamp == pytest.approx(0.3 - 2 * VISION_PERIOD, abs=VISION_PERIOD + 1e-9)
        assert vision.GetOutputPort(f"motion_images_{side}").Eval(context) is not None


def test_a_lag_too_short_for_the_images_is_refused(small_laboratory):
    with pytest.raises(DrakeTrackerError, match="lag of 2 cycles"):
        make_vision(small_laboratory, lag_cycles=2)
