"""The objects of one camera as Systems: numbers and centroids of several, and points in pixels."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantValueSource

from drake_tracker.core.messages import Centroid, TrackPoint
from drake_tracker.vision.centroid.plane_projector_system import PixelPointSystem
from drake_tracker.vision.image_tracks.image_objects import ImageObjects, ImageTracks, target_centroid, target_number
from drake_tracker.vision.image_tracks.image_regions import ImageRegion
from drake_tracker.vision.image_tracks.image_tracker_system import ImageTargetsSystem
from drake_tracker.vision.image_tracks.track_2d import start_track

PERIOD = 0.1


def objects_at(*places, stamp=0.5, hidden=()):
    """Objects 1, 2 and so on at places (u, v), all of them targets; those in ``hidden`` are not seen."""
    image = np.zeros((100, 100), np.uint8)
    tracks = []
    for number, (u, v) in enumerate(places, 1):
        region = ImageRegion(u, v, 40, int(u) - 4, int(v) - 4, 8, 8)
        track = start_track(number, stamp, region, image)
        tracks.append(replace(track, seen=stamp - 0.2) if number in hidden else track)
    return ImageObjects(tracks=tuple(tracks), targets=tuple(range(1, len(tracks) + 1)))


def run(energy, objects=3):
    """The System after two updates, and its context."""
    builder = DiagramBuilder()
    system = builder.AddSystem(ImageTargetsSystem(objects, period=PERIOD))
    source = builder.AddSystem(ConstantValueSource(AbstractValue.Make(energy)))
    builder.Connect(source.get_output_port(), system.GetInputPort("tracks"))
    simulator = Simulator(builder.Build())
    context = system.GetMyContextFromRoot(simulator.get_context())
    for port in (system.get_output_port(k) for k in range(system.num_output_ports())):
        assert not port.Eval(context).any()  # before the first image
    simulator.AdvanceTo(0.5 * PERIOD)
    return {port: system.GetOutputPort(port).Eval(context) for port in names(system)}


def names(system):
    return [system.get_output_port(k).get_name() for k in range(system.num_output_ports())]


def test_the_numbers_and_centroids_are_those_of_the_targets():
    known = objects_at((20.0, 30.0), (50.25, 60.5))
    ports = run(ImageTracks(0.5, known))
    assert list(ports) == ["number_1", "number_2", "centroid_2", "number_3", "centroid_3"]
    assert [ports[f"number_{k}"].item() for k in (1, 2, 3)] == [1.0, 2.0, 0.0]
    assert ports["centroid_2"].tolist() == [0.5, 50.25, 60.5, 40.0, 1.0]
    assert ports["centroid_3"].tolist() == [0.5, 0.0, 0.0, 0.0, 0.0]


def test_a_hidden_object_keeps_its_number_and_has_no_centroid():
    known = objects_at((20.0, 30.0), (50.0, 60.0), hidden=(2,))
    assert target_number(known, 1) == 2
    assert target_centroid(known, 1, 0.5).tolist() == [0.5, 0.0, 0.0, 0.0, 0.0]


def test_a_missing_image_shows_no_object():
    ports = run(ImageTracks(0.5, None))
    assert [ports[f"number_{k}"].item() for k in (1, 2, 3)] == [0.0, 0.0, 0.0]
    assert ports["centroid_2"].tolist() == [0.5, 0.0, 0.0, 0.0, 0.0]


@pytest.mark.parametrize("valid", [0.0, 1.0])
def test_a_point_in_pixels_is_the_centroid(valid):
    builder = DiagramBuilder()
    system = builder.AddSystem(PixelPointSystem())
    builder.ExportInput(system.centroid_ports[0], "centroid")
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    centroid = Centroid([0.5, 12.5, 7.25, 30.0, valid])
    diagram.get_input_port().FixValue(context, centroid[:])
    point = TrackPoint(system.point_port.Eval(system.GetMyContextFromRoot(context)))
    assert (point.stamp, point.gap, point.z, point.valid) == (0.5, 0.0, 0.0, valid)
    assert (point.x, point.y) == ((12.5, 7.25) if valid else (0.0, 0.0))
