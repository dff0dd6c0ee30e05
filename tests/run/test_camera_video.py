"""Tests of the System that makes the camera video."""

import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.sensors import ImageRgba8U
from track_messages import regions, track, track_points

from drake_tracker.core.constants import SIDES
from drake_tracker.core.messages import (
    KNOT_COUNT,
    KNOT_SPACING,
    CatchDiagnosis,
    Regions,
    TrackPoints,
    TrackState,
    message_size,
    pack_prediction,
)
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.grasp.ball.catch_schema import CatchPhase
from drake_tracker.grasp.train.schema import Phase
from drake_tracker.run.camera_video import CameraVideoSystem
from drake_tracker.run.video_page import VideoPage
from drake_tracker.tasks.ball.filming import PREDICTING
from drake_tracker.tasks.filming import Film, Script, no_points
from drake_tracker.tasks.train.pictures.filming import TRAIN_SCRIPT
from drake_tracker.vision.detection_mask import DetectionMask
from drake_tracker.vision.silhouettes.target import REASONS, Reason

LAG = 5
OFFSET = (10, 20)


class Laboratory(LeafSystem):
    """Images whose grey level is the number of their cycle, with masks, centroids, packets and commands.

    The mask describes the cycle before the last; it has one pixel, in the column with the number of that cycle. The
    centroids are ``LAG`` cycles late. From ``blind_from`` [s] on, the jaws close without vision and the packets are 1 m
    off. Images appear ``latency`` cycles after their capture, and the masks with them.
    """

    def __init__(self, blind_from=np.inf, latency=0):
        super().__init__()
        self._blind_from, self._latency = blind_from, latency
        blank, nothing = ImageRgba8U(80, 60), DetectionMask(0.0, np.zeros((1, 1), np.uint8), OFFSET)
        for side in SIDES:
            self.DeclareAbstractOutputPort(f"camera_{side}", lambda: AbstractValue.Make(blank), self._image)
            self.DeclareAbstractOutputPort(f"motion_{side}", lambda: AbstractValue.Make(nothing), self._motion)
            self.DeclareVectorOutputPort(f"centroid_{side}", 5, self._centroid)
        self.DeclareVectorOutputPort("packet", 160, self._packet)
        self.DeclareVectorOutputPort("command", 7, self._command)
        self.DeclareVectorOutputPort("diagnosis", 6, lambda context, output: output.SetFromVector(np.zeros(6)))

    def _image(self, context, output):
        image = ImageRgba8U(80, 60)
        image.mutable_data[:] = max(round(context.get_time() / VISION_PERIOD) - self._latency, 0)
        output.set_value(image)

    def _motion(self, context, output):
        cycle = round(context.get_time() / VISION_PERIOD) - 2 - self._latency
        mask = np.zeros((60, 80), np.uint8)
        if cycle >= 0:
            mask[30, cycle] = 255
        output.set_value(DetectionMask(max(cycle, 0) * VISION_PERIOD, mask, OFFSET))

    def _centroid(self, context, output):
        stamp = context.get_time() - LAG * VISION_PERIOD
        output.SetFromVector([stamp, 50.0, 50.0, 9.0, 1.0] if stamp > 0 else np.zeros(5))

    def _packet(self, context, output):
        now = context.get_time()
        knots = np.zeros((KNOT_COUNT, 5))
        knots[:, 0] = 0.1 * (now + KNOT_SPACING * np.arange(KNOT_COUNT)) + (1.0 if now > self._blind_from else 0.0)
        output.SetFromVector(pack_prediction(now, 1, knots))

    def _command(self, context, output):
        blind = context.get_time() > self._blind_from - 1e-9
        output.SetFromVector([Phase.CLOSE if blind else Phase.TRACK, 0, 0, 0, 0, blind, 0.08])


class OneCamera(LeafSystem):
    """The same for one camera with a centroid every fourth cycle, from a pair of images two cycles apart."""

    def __init__(self):
        super().__init__()
        self.rendered = []
        self.DeclareAbstractOutputPort("camera", lambda: AbstractValue.Make(ImageRgba8U(80, 60)), self._image)
        nothing = DetectionMask(0.0, np.zeros((1, 1), np.uint8), (0, 0))
        self.DeclareAbstractOutputPort("motion", lambda: AbstractValue.Make(nothing), self._motion)
        self.DeclareVectorOutputPort("centroid", 5, self._centroid)
        self.DeclareVectorOutputPort("packet", 160, lambda context, output: output.SetFromVector(np.zeros(160)))
        follow = [CatchPhase.FOLLOW] + [0.0] * 6
        self.DeclareVectorOutputPort("command", 7, lambda context, output: output.SetFromVector(follow))
        diagnosis = np.zeros(message_size(CatchDiagnosis))
        self.DeclareVectorOutputPort("diagnosis", len(diagnosis), lambda context, out: out.SetFromVector(diagnosis))

    def _image(self, context, output):
        cycle = round(context.get_time() / VISION_PERIOD)
        self.rendered.append(cycle)
        image = ImageRgba8U(80, 60)
        image.mutable_data[:] = cycle
        output.set_value(image)

    def _motion(self, context, output):
        stamp = round(context.get_time() / VISION_PERIOD) // 4 * 4 - 1
        mask = np.full((60, 80), max(stamp, 0), np.uint8)
        output.set_value(DetectionMask(max(stamp, 0) * VISION_PERIOD, mask, (0, 0)))

    def _centroid(self, context, output):
        shown = (round(context.get_time() / VISION_PERIOD) - 4) // 4 * 4
        output.SetFromVector([(shown - 1) * VISION_PERIOD, 50.0, 50.0, 9.0, 1.0] if shown >= 4 else np.zeros(5))


class Notebook:
    """A sink that stores what would be drawn."""

    wanted = True

    def __init__(self):
        self.pages = []

    def write(self, sights, state):
        self.pages.append((sights, state))


class Camera:
    """A camera whose pixel coordinates are x and y in millimetres."""

    def project(self, p_WQ):
        return 1e3 * np.asarray(p_WQ)[:, :2]


def synthetic_film(sides, offset, lag_cycles, script, **settings):
    return Film(
        title="train",
        subtitle="seed 0",
        polygons={},
        image_size=(80, 60),
        cameras={side: Camera() for side in sides},
        offsets=dict.fromkeys(sides, offset),
        lag=lag_cycles * VISION_PERIOD,
        lag_cycles=lag_cycles,
        script=script,
        **settings,
    )


def film(duration, blind_from=np.inf, latency=0, laboratory=Laboratory, **settings):
    notebook = Notebook()
    builder = DiagramBuilder()
    laboratory = builder.AddSystem(laboratory(blind_from=blind_from, latency=latency))
    page = synthetic_film(SIDES, OFFSET, LAG, TRAIN_SCRIPT, image_latency=latency, **settings)
    video = builder.AddSystem(CameraVideoSystem([notebook], page))
    for k in range(video.num_input_ports()):
        name = video.get_input_port(k).get_name()
        builder.Connect(laboratory.GetOutputPort(name), video.GetInputPort(name))
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(duration)
    video.pass_rest(simulator.get_context())
    return notebook.pages


def film_one(duration):
    notebook, camera = Notebook(), OneCamera()
    builder = DiagramBuilder()
    builder.AddSystem(camera)
    script = Script(
        phases=CatchPhase,
        predicting=PREDICTING,
        diagnosis=CatchDiagnosis,
        notes=lambda phase, diagnosis: (phase.name, ""),
        path=no_points,
    )
    video = builder.AddSystem(
        CameraVideoSystem([notebook], synthetic_film(("",), (0, 0), 5.0, script, every=2, update_cycles=4))
    )
    for k in range(video.num_input_ports()):
        port = video.get_input_port(k)
        builder.Connect(camera.GetOutputPort(port.get_name()), port)
    Simulator(builder.Build()).AdvanceTo(duration)
    return notebook.pages, camera.rendered


def test_no_image_is_rendered_for_the_video_of_a_single_camera():
    pages, rendered = film_one(1.0)
    assert all(cycle % 2 == 0 for cycle in rendered), "an image was rendered only for the video"
    for sights, state in pages[6:]:
        described = round(state.stamp / VISION_PERIOD)
        assert state.phase is CatchPhase.FOLLOW and state.notes == ("FOLLOW", "")
        assert sights[""].late_image[0, 0, 0] == described - 1, "the first image of the pair"
        assert sights[""].energy[0, 0] == described
        assert len(sights[""].path) == len(sights[""].goal) == 0


def test_there_are_thirty_frames_per_second_from_time_zero():
    times = [state.time for _, state in film(1.0)]
    np.testing.assert_allclose(times, np.arange(31) / 30.0, atol=1e-9)


def test_the_late_images_and_masks_are_those_of_the_centroids_stamp():
    for sights, state in film(1.0)[4:]:
        described = round(state.time / VISION_PERIOD) - LAG
        assert state.stamp == pytest.approx(described * VISION_PERIOD)
        for sight in sights.values():
            assert sight.image[0, 0, 0] == round(state.time / VISION_PERIOD)
            assert sight.late_image[0, 0, 0] == described
            assert np.nonzero(sight.energy) == (30, described)
            assert sight.centroid == (50.0, 50.0) and sight.offset == OFFSET


def test_nothing_late_is_shown_before_the_first_centroid():
    sights, state = film(0.05)[0]
    assert state.stamp is None
    assert sights["left"].late_image is None and sights["left"].energy is None and sights["left"].centroid is None


def test_the_path_starts_at_the_predicted_present_position():
    sights, state = film(0.5)[-1]
    assert sights["left"].path[0, 0] == pytest.approx(100.0 * state.time, abs=1e-6)
    assert sights["left"].path[-1, 0] == pytest.approx(100.0 * (state.time + 1.0), abs=1e-6)


def test_the_packet_held_is_shown_while_the_arm_is_blind():
    sights, state = film(1.0, blind_from=0.5)[-1]
    assert state.phase == Phase.CLOSE
    assert sights["right"].path[0, 0] == pytest.approx(100.0 * state.time, abs=1e-6)


@pytest.mark.parametrize("latency", [1, 2])
def test_frames_with_late_images_show_the_same(latency):
    """Whatever is drawn belongs to the image; the frames whose images appear after the end are drawn at the end."""
    for (expected, state), (found, late_state) in zip(film(0.99, 0.5), film(0.99, 0.5, latency), strict=True):
        for name in ("time", "phase", "notes", "stamp", "blind"):
            assert getattr(state, name) == getattr(late_state, name)
        for side in SIDES:
            for name in ("image", "path", "late_image", "energy", "goal"):
                np.testing.assert_array_equal(getattr(expected[side], name), getattr(found[side], name))
            assert expected[side].centroid == found[side].centroid


def test_two_simulations_draw_the_same():
    first, second = film(0.4), film(0.4)
    for (a, _), (b, _) in zip(first, second):
        np.testing.assert_array_equal(a["left"].path, b["left"].path)


def test_a_page_can_draw_what_the_system_outputs():
    window = np.array([[20.0, 30.0], [80.0, 30.0], [80.0, 70.0]])
    page = VideoPage(dict.fromkeys(SIDES, window), (256, 256), "train", "seed 0", 0.25)
    (sights, state) = film(0.3)[-1]
    assert page.draw(sights, state).shape == (page.size[1], page.size[0], 3)


def test_a_frame_is_passed_to_the_sinks_that_want_it():
    keen, idle = Notebook(), Notebook()
    idle.wanted = False
    builder = DiagramBuilder()
    laboratory = builder.AddSystem(Laboratory())
    video = builder.AddSystem(CameraVideoSystem([keen, idle], synthetic_film(SIDES, OFFSET, LAG, TRAIN_SCRIPT)))
    for k in range(video.num_input_ports()):
        name = video.get_input_port(k).get_name()
        builder.Connect(laboratory.GetOutputPort(name), video.GetInputPort(name))
    Simulator(builder.Build()).AdvanceTo(0.1)
    assert len(keen.pages) == 4 and not idle.pages


class SeveralLaboratory(Laboratory):
    """The same with regions and tracks: object 1, the target, moves by 1 mm per cycle; object 2 is covered."""

    def __init__(self, **settings):
        super().__init__(**settings)
        for side in SIDES:
            self.DeclareVectorOutputPort(f"regions_{side}", message_size(Regions), self._regions)
        self.DeclareVectorOutputPort("tracks", message_size(TrackPoints), self._tracks)

    def _regions(self, context, output):
        stamp = context.get_time() - LAG * VISION_PERIOD
        output.SetFromVector(regions(stamp, (round(60.0 * stamp), 30, 8, 6, 1)) if stamp > 0 else 0.0 * regions(0.0))

    def _tracks(self, context, output):
        stamp = context.get_time() - LAG * VISION_PERIOD
        tracks = [track(1, 0.06 * stamp, 0.03, vx=0.06), track(2, 0.02, 0.02, state=TrackState.OCCLUDED)]
        output.SetFromVector(track_points(max(stamp, 0.0), tracks, 1, Reason.OUT_OF_VIEW))


@pytest.mark.parametrize("latency", [0, 2])
def test_regions_and_tracks_belong_to_the_late_image_and_are_carried_on_to_the_present_one(latency):
    pages = film(0.99, latency=latency, laboratory=SeveralLaboratory, several=True)
    for sights, state in pages[4:]:
        assert state.reason == REASONS[Reason.OUT_OF_VIEW]
        described = round(state.time / VISION_PERIOD) - LAG
        for sight in sights.values():
            assert sight.late_image[0, 0, 0] == described
            assert [(mark.u, mark.number) for mark in sight.regions] == [(described, 1)]
            first, second = sight.tracks
            assert first.row.target and not second.row.target and not second.row.seen
            assert first.then[0] == pytest.approx(described) and first.now[0] == pytest.approx(described + LAG)


def test_a_video_of_one_object_has_no_marks_of_tracks():
    sights, state = film(0.3)[-1]
    assert sights["left"].regions == sights["left"].tracks == () and state.reason == ""
