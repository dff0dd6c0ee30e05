import re

import numpy as np
import pytest
from cuboids import CAMERAS
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.primitives import LogVectorOutput
from pydrake.systems.sensors import ImageRgba8U

from drake_tracker.core.constants import SIDES
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.messages import JawState, Regions, TrackPoint, TrackPoints, message_size
from drake_tracker.core.timing import LAG_CYCLES, VISION_PERIOD
from drake_tracker.vision.hand.arm_silhouette import ArmSilhouette
from drake_tracker.vision.several_vision_diagram import SeveralVisionDiagram
from drake_tracker.vision.silhouettes.config import SilhouetteTracker
from drake_tracker.vision.silhouettes.target_config import Coloured, Inside, Nearest


class BlockArm:
    """Stands in for an `ArmShape`: a cube that moves with its only joint, and with the opening of the jaws."""

    def pieces(self, q, jaw_width=0.0):
        corners = np.array([(x, y, z) for x in (0.0, 0.05) for y in (0.0, 0.05) for z in (0.0, 0.05)])
        return [corners + [0.5 + jaw_width, -0.2 + 0.2 * q[0], 0.5]]


class Joints(LeafSystem):
    """The joint angle is the time [s]; the jaws open by a tenth of it [m]."""

    def __init__(self):
        super().__init__()
        self.DeclareVectorOutputPort("arm_state", 2, lambda context, out: out.SetFromVector([context.get_time(), 1.0]))
        self.DeclareVectorOutputPort("jaws", message_size(JawState), self._calc_jaws)

    def _calc_jaws(self, context, output):
        jaws = JawState(np.zeros(message_size(JawState)))
        jaws.width = 0.1 * context.get_time()
        output.SetFromVector(jaws[:])


class LateFilm(LeafSystem):
    """Shows the images of the laboratory's film some cycles late."""

    def __init__(self, film, latency):
        super().__init__()
        self._film, self._latency = film, latency
        self._scratch = film.CreateDefaultContext()
        for side in SIDES:
            port = film.GetOutputPort(f"camera_{side}")
            self.DeclareAbstractOutputPort(
                f"camera_{side}", port.Allocate, lambda context, output, port=port: self._calc(context, output, port)
            )

    def _calc(self, context, output, port):
        self._scratch.SetTime(max(context.get_time() - self._latency * VISION_PERIOD, 0.0))
        image: ImageRgba8U = port.Eval(self._scratch)
        output.get_mutable_value().mutable_data[:] = image.data


class Watch:
    """A film of the small laboratory, and the vision that watches it."""

    def __init__(self, laboratory, duration, path=None, arm=False, image_latency=0, image_windows=None, **settings):
        builder = DiagramBuilder()
        film = builder.AddSystem(LateFilm(laboratory.film(path, image_windows), image_latency))
        self.vision = builder.AddSystem(
            SeveralVisionDiagram(
                laboratory.cameras,
                image_windows=image_windows or laboratory.whole,
                work_volume=laboratory.work_volume,
                arm=(BlockArm(), 1) if arm else None,
                image_latency=image_latency,
                **settings,
            )
        )
        for side in SIDES:
            builder.Connect(film.GetOutputPort(f"camera_{side}"), self.vision.GetInputPort(f"camera_{side}"))
        if arm:
            joints = builder.AddSystem(Joints())
            for name in ("arm_state", "jaws"):
                builder.Connect(joints.GetOutputPort(name), self.vision.GetInputPort(name))
        names = ("point", "tracks", "regions_left", "centroid_right")
        logs = {
            name: LogVectorOutput(self.vision.GetOutputPort(name), builder, publish_period=VISION_PERIOD)
            for name in names
        }
        self.simulator = Simulator(builder.Build())
        self.simulator.AdvanceTo(duration)
        self.rows = {name: log.FindLog(self.simulator.get_context()).data().T for name, log in logs.items()}

    def part(self, name, port):
        """The value of an output of a System within the vision."""
        system = self.vision.GetSubsystemByName(name)
        return system.GetOutputPort(port).Eval(system.GetMyContextFromRoot(self.simulator.get_context()))


def ports(diagram):
    return (
        [diagram.get_input_port(k).get_name() for k in range(diagram.num_input_ports())],
        [diagram.get_output_port(k).get_name() for k in range(diagram.num_output_ports())],
    )


def documented():
    """The names of the inputs and of the outputs in the docstring."""
    inputs, outputs = SeveralVisionDiagram.__doc__.split("input_ports:")[1].split("output_ports:")
    outputs = outputs.split("\n\n")[0]
    return re.findall(r"- (\w+)", inputs), re.findall(r"- (\w+)", outputs)


def test_the_ports_are_those_of_the_docstring(small_laboratory):
    vision = SeveralVisionDiagram(small_laboratory.cameras, arm=(BlockArm(), 1))
    inputs, outputs = ports(vision)
    assert set(inputs) == set(documented()[0]) and set(outputs) == set(documented()[1])
    assert len(inputs) == len(set(inputs)) and vision.get_name() == "vision"
    assert vision.GetInputPort("arm_state").size() == 2
    assert vision.GetOutputPort("tracks").size() == message_size(TrackPoints)


def test_ports_that_exist_with_some_settings_only(small_laboratory):
    inputs, _ = ports(SeveralVisionDiagram(small_laboratory.cameras))
    assert set(inputs) == {"camera_left", "camera_right", "expected", "selected"}
    inputs, _ = ports(SeveralVisionDiagram(small_laboratory.cameras, own_stamps=True))
    assert set(inputs) == {"camera_left", "camera_right", "frame_left", "frame_right", "expected", "selected"}


def test_the_point_lies_where_the_body_was_at_its_stamp(small_laboratory):
    rows = Watch(small_laboratory, 2.0).rows["point"]
    points = [TrackPoint(row) for row in rows if TrackPoint(row).valid]
    assert len(points) > 60
    stamps = np.array([point.stamp for point in points])
    errors = np.array([[point.x, point.y, point.z] for point in points]) - small_laboratory.circle(stamps)
    assert np.linalg.norm(errors[len(errors) // 2 :], axis=1).max() < 0.012
    assert np.diff(stamps) == pytest.approx(VISION_PERIOD, abs=1e-9)


@pytest.mark.parametrize("lag", [1, 5, LAG_CYCLES])
def test_the_tracks_appear_exactly_a_lag_after_the_images(small_laboratory, lag):
    rows = Watch(small_laboratory, 0.5, lag_cycles=lag).rows["tracks"]
    first = int(np.argmax([TrackPoints(row).valid for row in rows]))
    # A row is what the port showed before the updates of its instant.
    assert first == lag + 1 and TrackPoints(rows[first]).stamp == 0.0
    for cycle in range(first, len(rows)):
        assert TrackPoints(rows[cycle]).stamp == pytest.approx((cycle - 1 - lag) * VISION_PERIOD, abs=1e-9)
    assert not rows[:first].any()


@pytest.mark.parametrize("latency", [1, 12])
@pytest.mark.parametrize("arm", [False, True])
def test_late_images_give_the_same_results_at_the_same_time(small_laboratory, latency, arm):
    at_once = Watch(small_laboratory, 0.7, arm=arm)
    late = Watch(small_laboratory, 0.7, arm=arm, image_latency=latency)
    assert any(TrackPoints(row).target for row in at_once.rows["tracks"])
    for name, rows in at_once.rows.items():
        np.testing.assert_array_equal(late.rows[name], rows, err_msg=name)


@pytest.mark.parametrize("latency", [0, 1, 7])
def test_the_arm_is_hidden_where_it_was_when_the_image_was_captured(small_laboratory, latency):
    watch = Watch(small_laboratory, 0.6 + 0.5 * VISION_PERIOD, arm=True, image_latency=latency)
    for side in SIDES:
        foreground = watch.part(f"foreground_{side}", "foreground")
        assert foreground.stamp == pytest.approx(0.6 - latency * VISION_PERIOD)
        silhouette = ArmSilhouette(small_laboratory.cameras[side], small_laboratory.whole[side])
        expected = silhouette.mask(BlockArm().pieces([foreground.stamp], 0.1 * foreground.stamp))
        assert expected.any()
        np.testing.assert_array_equal(foreground.hidden, expected)
        # A cycle more or less is another silhouette.
        other = silhouette.mask(BlockArm().pieces([foreground.stamp + 3 * VISION_PERIOD], 0.1 * foreground.stamp))
        assert not np.array_equal(foreground.hidden, other)


def test_images_of_a_window_have_full_frame_coordinates(small_laboratory):
    windows = {side: window.bounds for side, window in small_laboratory.windows.items()}
    whole, cut = Watch(small_laboratory, 0.8), Watch(small_laboratory, 0.8, image_windows=windows)
    one, two = (Regions(each.rows["regions_left"][-1]) for each in (whole, cut))
    assert one.count == two.count == 1.0
    assert (one.u0, one.v0) == pytest.approx((two.u0, two.v0), abs=0.3)


def test_only_the_window_is_searched(small_laboratory):
    def outside(time):
        return np.array([0.60, 0.15 * time, 0.62])

    watch = Watch(small_laboratory, 0.6, outside, windows=small_laboratory.windows)
    assert not any(TrackPoints(row).target for row in watch.rows["tracks"])


def test_the_picture_shows_the_newest_silhouettes(small_laboratory):
    watch = Watch(small_laboratory, 0.5 + 0.5 * VISION_PERIOD)
    context = watch.vision.GetMyContextFromRoot(watch.simulator.get_context())
    for side in SIDES:
        energy = watch.vision.GetOutputPort(f"motion_{side}").Eval(context)
        assert energy.stamp == pytest.approx(0.5) and energy.mask.shape == (160, 160) and energy.mask.any()


def test_a_lag_shorter_than_the_latency_is_refused(small_laboratory):
    with pytest.raises(DrakeTrackerError, match="a lag of 5 cycles is shorter than the latency"):
        SeveralVisionDiagram(small_laboratory.cameras, lag_cycles=5, image_latency=6)


@pytest.mark.parametrize(
    "settings",
    [
        SilhouetteTracker(min_pixels=0),
        SilhouetteTracker(confirm_after=0),
        SilhouetteTracker(coast_time=-1.0),
        SilhouetteTracker(target=Coloured("gold")),
        SilhouetteTracker(target=Coloured("#d0b040", tolerance=-5.0)),
        SilhouetteTracker(target=Inside(((0.7, 0.2, 0.6), (0.4, -0.2, 0.4)))),
        SilhouetteTracker(target=Nearest((0.5, 0.0))),
    ],
    ids=str,
)
def test_a_wrong_setting_is_refused_when_the_diagram_is_built(settings):
    with pytest.raises(DrakeTrackerError):
        SeveralVisionDiagram({"left": CAMERAS[0], "right": CAMERAS[1]}, settings)
