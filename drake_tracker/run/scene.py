"""The 3-D recording of a run in Meshcat: the laboratory and the predicted path."""

import weakref
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.geometry import (
    Cylinder,
    Meshcat,
    MeshcatAnimation,
    MeshcatParams,
    MeshcatVisualizer,
    MeshcatVisualizerParams,
    Rgba,
    Role,
    Sphere,
)
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context, DiagramBuilder, LeafSystem, State

from drake_tracker.core.files.atomic_file import write_text
from drake_tracker.core.frozen_state import FrozenState
from drake_tracker.core.messages import ArmCommand, Frozen, Prediction, TrackPoint, message_size
from drake_tracker.diagrams.hand_eye import HandEyeDiagram
from drake_tracker.run.scene_server import SceneServer, hidden_address
from drake_tracker.tasks.filming import FRAMES_PER_SECOND, PATH_MARKS, View

PREDICTED, SEEN = Rgba(0.30, 0.76, 1.0), Rgba(1.0, 0.69, 0.0)
"""Colours of the predicted path and of the measured points, as in the camera video."""
_PREFIX = "laboratory"
_PATH, _TRAIL = "tracking/predicted", "tracking/seen"
_TRAIL_FRAMES = range(0, 31, 5)
"""Ages, in frames, of the measured points that are marked."""


@dataclass(frozen=True, eq=False)
class _Drawn(FrozenState):
    """Content of the drawing.

    Attributes:
        packet: vector of the `Prediction` that the arm follows.
        trail: latest measured points p_WQ [m], newest first; None for a frame without a point.
    """

    packet: np.ndarray
    trail: tuple[np.ndarray | None, ...] = ()


class TrackingDisplaySystem(LeafSystem):
    """Draws the predicted path and the latest measured points into Meshcat.

    .. pydrake_system::

        name: TrackingDisplaySystem
        input_ports:
        - packet
        - point
        - command

    - ``packet``: a `Prediction`. A packet of all zeros is not drawn.
    - ``point``: a `TrackPoint`. A point of all zeros is not drawn, and the input may be left unconnected.
    - ``command``: an `ArmCommand`. All zeros is its first phase, with the arm not blind.

    The inputs are read `FRAMES_PER_SECOND` times a second with offset 0, in an unrestricted update and in a publish
    event. While the arm is blind, the packet that it holds is drawn.

    Args:
        meshcat: the Meshcat instance to draw into.
        view: what is shown, and in which phases.
    """

    def __init__(self, meshcat: Meshcat, view: View) -> None:
        super().__init__()
        self._meshcat, self._view = meshcat, view
        self._packet = self.DeclareVectorInputPort("packet", message_size(Prediction))
        self._point = self.DeclareVectorInputPort("point", message_size(TrackPoint))
        self._command = self.DeclareVectorInputPort("command", message_size(ArmCommand))
        self._drawn = self.DeclareAbstractState(AbstractValue.Make(_Drawn(np.zeros(message_size(Prediction)))))
        for path, count, colour in ((_PATH, PATH_MARKS, PREDICTED), (_TRAIL, len(_TRAIL_FRAMES), SEEN)):
            for k in range(count):
                meshcat.SetObject(f"{path}/{k}", Sphere(0.007 * (1.0 - 0.6 * k / count)), colour)
        self.DeclarePeriodicUnrestrictedUpdateEvent(1.0 / FRAMES_PER_SECOND, 0.0, self._remember)
        self.DeclarePeriodicPublishEvent(1.0 / FRAMES_PER_SECOND, 0.0, self._draw)

    def _remember(self, context: Context, state: State) -> None:
        drawn = context.get_abstract_state(self._drawn).get_value()
        blind = ArmCommand(self._command.Eval(context)).frozen == Frozen.BLIND
        packet = drawn.packet if blind else np.array(self._packet.Eval(context))
        newest = None
        if self._point.HasValue(context) and not blind:
            point = TrackPoint(self._point.Eval(context))
            newest = np.array([point.x, point.y, point.z]) if point.valid else None
        trail = (newest, *drawn.trail[: _TRAIL_FRAMES[-1]])
        state.get_mutable_abstract_state(self._drawn).set_value(_Drawn(packet, trail))

    def _draw(self, context: Context) -> None:
        now = context.get_time()
        drawn = context.get_abstract_state(self._drawn).get_value()
        phase = int(ArmCommand(self._command.Eval(context)).phase)
        valid = bool(Prediction(drawn.packet).valid) and phase in self._view.phases
        points: Sequence[np.ndarray | None] = list(self._view.path(drawn.packet, now)) if valid else []
        self._place(_PATH, points, now)
        self._place(_TRAIL, [drawn.trail[k] for k in _TRAIL_FRAMES if k < len(drawn.trail)], now)

    def _place(self, path: str, points: Sequence[np.ndarray | None], now: float) -> None:
        """Moves the marks of a path in Meshcat, or hides them when a point is None.

        Args:
            path: path of the marks in Meshcat.
            points: positions of the marks in W [m].
            now: present time [s].
        """
        shown = len(points) > 0 and all(point is not None for point in points)
        self._meshcat.SetProperty(path, "visible", shown, now)
        if shown:
            for k, point in enumerate(points):
                self._meshcat.SetTransform(f"{path}/{k}", RigidTransform(point), now)


class SceneRecorder:
    """A `Recorder` that writes the 3-D recording.

    Args:
        meshcat: the Meshcat instance that records; it listens at ``host``.
        host: address of this machine.
        path: HTML file to write, or None.
    """

    def __init__(self, meshcat: Meshcat, host: str, path: Path | None) -> None:
        self._meshcat, self._host, self._path = meshcat, host, path
        self._server: SceneServer | None = None

    def show(self) -> str:
        """Shows the scene in browsers on this machine; returns the address of the page."""
        if self._server is None:
            self._server = SceneServer((self._host, self._meshcat.port()))
            weakref.finalize(self, self._server.close)
        return self._server.url

    def finish(self, root_context: Context) -> None:
        """Publishes the recording and writes it as a self-contained HTML file."""
        recording = self._meshcat.get_mutable_recording()
        recording.set_loop_mode(MeshcatAnimation.LoopMode.kLoopRepeat)
        recording.set_repetitions(1000)
        self._meshcat.StopRecording()
        self._meshcat.PublishRecording()
        if self._path is not None:
            write_text(self._path, self._meshcat.StaticHtml())


def add_scene_recording(
    builder: DiagramBuilder, *, hand_eye: HandEyeDiagram, view: View, path: Path | None
) -> SceneRecorder:
    """Adds a 3-D recording in Meshcat with `FRAMES_PER_SECOND` frames per second.

    Meshcat must be used by the thread that calls this function.

    Args:
        builder: builder that contains ``hand_eye``.
        hand_eye: diagram to record.
        view: how the task is shown.
        path: HTML file to write at the end, or None.

    Returns the recorder.
    """
    host = hidden_address()
    meshcat = Meshcat(MeshcatParams(host=host, port=0, show_stats_plot=False))
    _set_stage(meshcat, view)
    parameters = MeshcatVisualizerParams(
        publish_period=1.0 / FRAMES_PER_SECOND, role=Role.kIllustration, prefix=_PREFIX
    )
    MeshcatVisualizer.AddToBuilder(builder, hand_eye.GetOutputPort("truth_query"), meshcat, parameters)
    display = builder.AddNamedSystem("tracking_display", TrackingDisplaySystem(meshcat, view))
    for own, theirs in {"packet": "accepted", "point": "point", "command": "command"}.items():
        if theirs != "point" or hand_eye.HasOutputPort(theirs):
            builder.Connect(hand_eye.GetOutputPort(theirs), display.GetInputPort(own))
    meshcat.StartRecording(FRAMES_PER_SECOND, set_visualizations_while_recording=True)
    return SceneRecorder(meshcat, host, path)


def _set_stage(meshcat: Meshcat, view: View) -> None:
    """Sets the viewpoint, the background, the floor and the lights."""
    meshcat.SetCameraPose(np.array(view.eye), np.array(view.target))
    meshcat.SetProperty("/Cameras/default/rotated/<object>", "fov", view.fov_deg)
    for path in ("/Grid", "/Axes"):
        meshcat.SetProperty(path, "visible", False)
    meshcat.SetProperty("/Background/<object>", "top_color", [0.74, 0.79, 0.85])
    meshcat.SetProperty("/Background/<object>", "bottom_color", [0.93, 0.94, 0.95])
    if view.floor:
        meshcat.SetObject("stage/floor", Cylinder(2.6, 0.01), Rgba(0.86, 0.87, 0.88))
        meshcat.SetTransform("stage/floor", RigidTransform([0.4, 0.0, -0.006]))
    # One lamp casts shadows; the others fill in. Positions are in the frame of the browser: x, z, -y of W.
    lamp = "/Lights/SpotLight"
    meshcat.SetProperty(lamp, "visible", True)
    meshcat.SetProperty(f"{lamp}/<object>", "position", [1.5, 3.2, -0.9])
    meshcat.SetProperty(f"{lamp}/<object>", "intensity", 28.0)
    meshcat.SetProperty(f"{lamp}/<object>", "castShadow", True)
    for light, intensity in (("AmbientLight", 0.5), ("FillLight", 0.5)):
        meshcat.SetProperty(f"/Lights/{light}/<object>", "intensity", intensity)
