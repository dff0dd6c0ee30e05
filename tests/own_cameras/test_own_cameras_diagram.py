"""The diagram for your own cameras: its ports, and that estimates do not flow back into the vision."""

import numpy as np
import pytest
from films import CAMERAS, HEIGHT, WIDTH

from drake_tracker.estimation import make_estimator
from drake_tracker.footage.footage import Footage
from drake_tracker.footage.timeline import align
from drake_tracker.own_cameras.own_cameras_diagram import OwnCamerasDiagram, Plane
from drake_tracker.vision.centroid.frame_difference import FrameDifferenceDetector
from drake_tracker.vision.image_tracks.image_tracker import ImageTracker

LEFT = ["camera_left", "frame_left", "centroid_left", "motion_left"]
RIGHT = ["camera_right", "frame_right", "centroid_right", "motion_right"]
POINTS = ["point", "filtered", "prediction"]
SINGLE = {"motion", "motion_lag", "localiser", "source_left", "host"}


def make(count, cameras, plane=None, objects=1):
    times = np.arange(10) / 50.0
    black = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
    films = [Footage("a", (WIDTH, HEIGHT), lambda: ((t, black) for t in times), times) for _ in range(count)]
    estimator = make_estimator("coordinated_turn")
    detectors = [FrameDifferenceDetector() for _ in films]
    trackers = [ImageTracker(objects) for _ in films] if objects > 1 else ()
    return OwnCamerasDiagram(align(films), detectors, cameras, estimator, plane=plane, trackers=trackers)


@pytest.mark.parametrize(
    ("count", "cameras", "plane", "ports", "systems"),
    [
        (2, list(CAMERAS.values()), None, LEFT + RIGHT + POINTS, {"vision", "source_left", "source_right", "host"}),
        (1, [CAMERAS["camera_left"]], Plane(np.eye(4)), LEFT + POINTS, SINGLE),
        (1, [], None, LEFT + POINTS, SINGLE),
    ],
)
def test_ports_of_two_cameras_of_one_with_a_plane_and_of_one_alone(count, cameras, plane, ports, systems):
    diagram = make(count, cameras, plane)
    assert diagram.num_input_ports() == 0
    names = {diagram.get_output_port(k).get_name() for k in range(diagram.num_output_ports())}
    assert names == set(ports)
    assert {system.get_name() for system in diagram.GetSystems()} == systems
    for (to, _), (source, _) in diagram.connection_map().items():
        if to.get_name() in ("vision", "motion"):
            assert source.get_name().startswith("source_")


def test_several_objects_have_ports_and_an_estimator_each():
    diagram = make(2, list(CAMERAS.values()), objects=3)
    names = {diagram.get_output_port(k).get_name() for k in range(diagram.num_output_ports())}
    own = [*POINTS, "number", "centroid_left", "centroid_right"]
    expected = {f"{name}{suffix}" for name in own for suffix in ("", "_2", "_3")}
    assert names == expected | {"objects", "tracks_left", "tracks_right"} | set(LEFT + RIGHT) and diagram.places == 3
    hosts = {"host", "host_2", "host_3"}
    assert {system.get_name() for system in diagram.GetSystems()} == hosts | {
        "vision", "pairs", "source_left", "source_right",
    }  # fmt: skip


@pytest.mark.parametrize("plane", [None, Plane(np.eye(4))])
def test_several_objects_of_one_camera_have_ports_and_an_estimator_each(plane):
    diagram = make(1, [CAMERAS["camera_left"]] if plane else [], plane, objects=3)
    names = {diagram.get_output_port(k).get_name() for k in range(diagram.num_output_ports())}
    own = [*POINTS, "number", "centroid_left"]
    assert names == {f"{name}{suffix}" for name in own for suffix in ("", "_2", "_3")} | {"tracks_left", *LEFT}
    systems = {system.get_name() for system in diagram.GetSystems()}
    assert systems == SINGLE | {"targets", "localiser_2", "localiser_3", "host_2", "host_3"}
    assert diagram.places == 3 and diagram.in_space == (plane is not None)


def test_the_vision_runs_at_the_frame_rate_of_the_footage():
    diagram = make(1, [])
    assert diagram.GetSubsystemByName("motion_lag").get_input_port().size() == 5
    context = diagram.CreateDefaultContext()
    assert diagram.GetOutputPort("frame_left").Eval(context).tolist() == pytest.approx([0.0, 1.0])
    context.SetTime(0.1)
    assert diagram.GetOutputPort("frame_left").Eval(context).tolist() == pytest.approx([0.1, 1.0])
    context.SetTime(0.21)  # after the end
    assert diagram.GetOutputPort("frame_left").Eval(context).tolist() == pytest.approx([0.2, 0.0])
