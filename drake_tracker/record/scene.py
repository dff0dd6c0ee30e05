"""The Meshcat recording of a run: the laboratory in three dimensions, with the predicted path drawn in."""

from pathlib import Path

import numpy as np
from pydrake.geometry import (
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
from pydrake.systems.framework import LeafSystem

from drake_tracker.grasp.schema import Phase
from drake_tracker.messages import ArmCommand, Prediction, TrackPoint, evaluate_prediction, message_size
from drake_tracker.record.style import FAR_PREDICTED, PREDICTED

FRAMES_PER_SECOND = 30
"""Of the recording."""
_PREFIX = "laboratory"
_PATH, _POINT = "tracking/prediction", "tracking/point"
_PATH_TIMES = np.arange(0.0, 1.21, 0.1)
"""From now on, the times [s] at which the predicted path is marked."""
_RAISED = np.array([0.0, 0.0, 0.055])
"""What is drawn stands this far [m] above the object's reference point, or the object would hide it."""
_CAMERA, _LOOK_AT = np.array([1.62, -1.02, 1.14]), np.array([0.40, 0.02, 0.58])
_SHOWN = (Phase.ACQUIRE, Phase.TRACK, Phase.INTERCEPT, Phase.CLOSE)
"""Phases in which the predicted path means something."""


class PredictionDisplaySystem(LeafSystem):
    """Draws the newest predicted path and the newest triangulated point into Meshcat.

    .. pydrake_system::

        name: PredictionDisplaySystem
        input_ports:
        - packet
        - point
        - command

    ``packet`` is a `Prediction`, ``point`` a `TrackPoint`, ``command`` an `ArmCommand`; published `FRAMES_PER_SECOND` times
    a second from time 0. While vision is not used the last packet before is held, as the arm holds it.
    """

    def __init__(self, meshcat):
        super().__init__()
        self._meshcat = meshcat
        self._packet = self.DeclareVectorInputPort("packet", message_size(Prediction))
        self._point = self.DeclareVectorInputPort("point", message_size(TrackPoint))
        self._command = self.DeclareVectorInputPort("command", message_size(ArmCommand))
        self._held = self.DeclareDiscreteState(message_size(Prediction))
        for k, time in enumerate(_PATH_TIMES):
            radius = 0.008 * (1.0 - 0.6 * time / _PATH_TIMES[-1])
            meshcat.SetObject(f"{_PATH}/{k:02}", Sphere(radius), _rgba(PREDICTED))
        meshcat.SetObject(_POINT, Sphere(0.007), _rgba(FAR_PREDICTED))
        self.DeclarePeriodicDiscreteUpdateEvent(1.0 / FRAMES_PER_SECOND, 0.0, self._hold)
        self.DeclarePeriodicPublishEvent(1.0 / FRAMES_PER_SECOND, 0.0, self._draw)

    def _hold(self, context, state):
        if not ArmCommand(self._command.Eval(context)).frozen:
            state.set_value(self._packet.Eval(context))

    def _draw(self, context):
        now = context.get_time()
        command = ArmCommand(self._command.Eval(context))
        held = np.array(context.get_discrete_state(self._held).value())
        shown = bool(Prediction(held).valid) and int(command.phase) in _SHOWN
        self._meshcat.SetProperty(_PATH, "visible", shown, now)
        if shown:
            for k, time in enumerate(_PATH_TIMES):
                self._place(f"{_PATH}/{k:02}", evaluate_prediction(held, now + time)[:3], now)
        point = TrackPoint(self._point.Eval(context))
        seen = bool(point.valid) and not command.frozen
        self._meshcat.SetProperty(_POINT, "visible", seen, now)
        if seen:
            self._place(_POINT, [point.x, point.y, point.z], now)

    def _place(self, path, p_WQ, now):
        self._meshcat.SetTransform(path, RigidTransform(np.asarray(p_WQ) + _RAISED), now)


class SceneRecorder:
    """What `add_scene_recording` returns: `finish` writes the recording."""

    def __init__(self, meshcat, path):
        self._meshcat, self._path = meshcat, path

    def finish(self, root_context):
        """Publishes the recording and writes it as one HTML file that needs nothing else."""
        recording = self._meshcat.get_mutable_recording()
        recording.set_loop_mode(MeshcatAnimation.LoopMode.kLoopRepeat)
        recording.set_repetitions(1000)
        self._meshcat.StopRecording()
        self._meshcat.PublishRecording()
        if self._path is not None:
            Path(self._path).write_text(self._meshcat.StaticHtml(), encoding="utf-8")


def add_scene_recording(builder, hand_eye, path, announce):
    """Shows a `HandEyeDiagram` in Meshcat and records it, `FRAMES_PER_SECOND` times a second.

    Meshcat is served to this machine alone, and must be used by the thread that calls this.

    Args:
      path: HTML file to write at the end, or None. announce: whether to print the address and to show the run live.

    Returns a `SceneRecorder`.
    """
    meshcat = Meshcat(MeshcatParams(host="localhost", show_stats_plot=False))
    _set_stage(meshcat)
    parameters = MeshcatVisualizerParams(
        publish_period=1.0 / FRAMES_PER_SECOND, role=Role.kIllustration, prefix=_PREFIX
    )
    MeshcatVisualizer.AddToBuilder(builder, hand_eye.GetOutputPort("truth_query"), meshcat, parameters)
    display = builder.AddNamedSystem("prediction_display", PredictionDisplaySystem(meshcat))
    for own, theirs in {"packet": "delivered", "point": "point", "command": "command"}.items():
        builder.Connect(hand_eye.GetOutputPort(theirs), display.GetInputPort(own))
    meshcat.StartRecording(FRAMES_PER_SECOND, set_visualizations_while_recording=True)
    if announce:
        print(f"Meshcat: {meshcat.web_url()}", flush=True)
    return SceneRecorder(meshcat, path)


def _set_stage(meshcat):
    """Chooses the viewpoint, the background and the light."""
    meshcat.SetCameraPose(_CAMERA, _LOOK_AT)
    for path in ("/Grid", "/Axes"):
        meshcat.SetProperty(path, "visible", False)
    meshcat.SetProperty("/Background", "top_color", [0.80, 0.84, 0.89])
    meshcat.SetProperty("/Background", "bottom_color", [0.96, 0.97, 0.98])
    # One lamp that casts shadows does most; the others fill in. Lights stand in three.js's frame: x, z, -y of W.
    meshcat.SetProperty("/Lights/SpotLight", "visible", True)
    lamp = "/Lights/SpotLight/<object>"
    meshcat.SetProperty(lamp, "castShadow", True)
    meshcat.SetProperty(lamp, "position", [1.3, 2.8, 1.6])


def _rgba(colour):
    return Rgba(*(int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5)))
