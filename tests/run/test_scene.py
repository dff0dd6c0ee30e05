"""Tests of the 3-D recording in Meshcat."""

import base64
import re

import numpy as np
import pytest
from pydrake.geometry import Box
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.multibody.tree import SpatialInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem

from drake_tracker.core.messages import KNOT_COUNT, KNOT_SPACING, pack_prediction
from drake_tracker.grasp.train.schema import Phase
from drake_tracker.run.scene import TrackingDisplaySystem, add_scene_recording
from drake_tracker.tasks.train.pictures.filming import TRAIN_VIEW


class Tracker(LeafSystem):
    """A point that moves along x at 0.1 m/s, its prediction, and a command that becomes blind at 0.5 s."""

    def __init__(self):
        super().__init__()
        self.DeclareVectorOutputPort("accepted", 160, self._packet)
        self.DeclareVectorOutputPort("point", 6, self._point)
        self.DeclareVectorOutputPort("command", 7, self._command)

    def _packet(self, context, output):
        now = context.get_time()
        knots = np.zeros((KNOT_COUNT, 5))
        knots[:, 0] = 0.1 * (now + KNOT_SPACING * np.arange(KNOT_COUNT)) + (1.0 if now > 0.51 else 0.0)
        output.SetFromVector(pack_prediction(now, 1, knots))

    def _point(self, context, output):
        now = context.get_time()
        output.SetFromVector([now, 0.1 * now, 0.0, 0.5, 0.0, 1.0])

    def _command(self, context, output):
        blind = context.get_time() > 0.49
        output.SetFromVector([Phase.CLOSE if blind else Phase.TRACK, 0, 0, 0, 0, blind, 0.08])


class Canvas:
    """Replaces Meshcat: stores the positions and the visibility of the marks over time."""

    def __init__(self):
        self.places, self.visible = {}, {}

    def SetObject(self, path, shape, rgba):
        pass

    def SetTransform(self, path, X, time):
        self.places[path, round(time, 3)] = X.translation()

    def SetProperty(self, path, name, value, time):
        self.visible[path, round(time, 3)] = value


def draw(duration):
    canvas = Canvas()
    builder = DiagramBuilder()
    tracker = builder.AddSystem(Tracker())
    display = builder.AddSystem(TrackingDisplaySystem(canvas, TRAIN_VIEW))
    for own, theirs in {"packet": "accepted", "point": "point", "command": "command"}.items():
        builder.Connect(tracker.GetOutputPort(theirs), display.GetInputPort(own))
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(duration)
    return canvas


def test_the_predicted_path_is_ahead_of_the_present():
    canvas = draw(0.4)
    for k in range(9):
        assert canvas.places[f"tracking/predicted/{k}", 0.4][0] == pytest.approx(0.1 * (0.4 + 0.15 * k), abs=1e-9)


def test_the_packet_held_is_shown_and_no_point_while_the_arm_is_blind():
    canvas = draw(1.0)
    assert canvas.places["tracking/predicted/0", 1.0][0] == pytest.approx(0.1, abs=1e-9)
    assert canvas.visible["tracking/predicted", 1.0] is True
    assert canvas.visible["tracking/seen", 1.0] is False


def test_the_latest_points_are_marked():
    canvas = draw(0.467)
    newest = [canvas.places[f"tracking/seen/{k}", 0.467][0] for k in range(3)]
    np.testing.assert_allclose(np.diff(newest), -0.1 * 5 / 30, atol=1e-9)


def laboratory():
    """A falling box with the ports of a hand-eye diagram."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.01)
    body = plant.AddRigidBody("box", SpatialInertia.SolidBoxWithMass(1.0, 0.1, 0.1, 0.1))
    plant.RegisterVisualGeometry(body, RigidTransform(), Box(0.1, 0.1, 0.1), "box", [0.8, 0.2, 0.2, 1.0])
    plant.Finalize()
    builder.ExportOutput(scene_graph.get_query_output_port(), "truth_query")
    tracker = builder.AddSystem(Tracker())
    for port in ("accepted", "point", "command"):
        builder.ExportOutput(tracker.GetOutputPort(port), port)
    return builder.Build()


def test_the_recording_is_one_file_with_an_animation(tmp_path):
    builder = DiagramBuilder()
    hand_eye = builder.AddSystem(laboratory())
    recorder = add_scene_recording(builder, hand_eye=hand_eye, view=TRAIN_VIEW, path=tmp_path / "recording.html")
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(0.5)
    recorder.finish(simulator.get_context())
    html = (tmp_path / "recording.html").read_text()
    assert "<script src=" not in html
    assert len(html) < 6e6
    messages = b"".join(base64.b64decode(chunk) for chunk in re.findall(r"base64,([A-Za-z0-9+/=]+)", html))
    assert b"set_animation" in messages
    assert b"tracking/predicted/0" in messages and b"laboratory/box" in messages


def test_nothing_is_written_or_printed_unless_requested(tmp_path, capsys):
    builder = DiagramBuilder()
    hand_eye = builder.AddSystem(laboratory())
    recorder = add_scene_recording(builder, hand_eye=hand_eye, view=TRAIN_VIEW, path=None)
    simulator = Simulator(builder.Build())
    simulator.Initialize()
    recorder.finish(simulator.get_context())
    assert capsys.readouterr().out == ""
    assert list(tmp_path.iterdir()) == []
