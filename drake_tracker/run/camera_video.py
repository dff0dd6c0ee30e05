"""The camera video of a run, as a System that writes while the run goes on."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import EnumMeta

import cv2
import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import LeafSystem
from pydrake.systems.sensors import ImageRgba8U

from drake_tracker.core.messages import (
    ArmCommand,
    Centroid,
    GraspDiagnosis,
    Prediction,
    message_size,
)
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.grasp.gate import Gate
from drake_tracker.grasp.schema import Phase
from drake_tracker.run.video_file import VideoFile
from drake_tracker.run.video_page import SIDES, CameraSight, PageState, VideoPage, port_of
from drake_tracker.tasks.ball.foresight import path_points
from drake_tracker.tasks.style import PHASES_THAT_PREDICT
from drake_tracker.tasks.train.diagram import load_cameras, look_windows
from drake_tracker.vision.motion_centroid_system import MotionEnergy

FRAMES_PER_SECOND = 30
"""Of the video: every second camera image."""
_NOWHERE = np.zeros((0, 3))
_GATE_WORDS = {
    Gate.OPEN: "open",
    Gate.SETTLING: "settling",
    Gate.FLIPPING: "jaws turn over",
    Gate.STALE: "no fresh packet",
    Gate.NO_MEMORY: "not been here before",
    Gate.PREDICTIONS_FAILED: "failed here a lap ago",
    Gate.OUT_OF_REACH: "out of reach",
}
_PATH_TIMES = np.arange(0.0, 1.01, 0.1)
"""From now on, the times [s] at which the predicted path is marked."""


@dataclass(frozen=True, eq=False)
class _Recent:
    """The images and masks of the last cycles, newest last: tuples of (cycle number, {side: array}); and the packet
    that the arm goes by.
    """

    packet: np.ndarray
    images: tuple = ()
    masks: tuple = ()

    def __deepcopy__(self, memo):
        return self


def _say_attempt(phase, diagnosis):
    """Notes of a run of the train: the attempt, and why the machine waits."""
    attempts, gate = int(diagnosis.attempts), Gate(int(diagnosis.gate))
    waits = phase == Phase.TRACK and gate in _GATE_WORDS
    return f"attempt {attempts}" if attempts else "", f"gate: {_GATE_WORDS[gate]}" if waits else ""


@dataclass(frozen=True)
class Script:
    """What a task's video tells besides images.

    phases: enumeration of the phases; predicting: those in which a path is shown. diagnosis: named view of the
    machine's; notes: (phase, diagnosis) -> two short lines. path: (valid packet, now) -> points (n, 3) [m, W]; goal:
    the same, of a `CameraSight.goal`.
    """

    phases: EnumMeta = Phase
    predicting: tuple = PHASES_THAT_PREDICT
    diagnosis: type = GraspDiagnosis
    notes: Callable = _say_attempt
    path: Callable = lambda packet, now: path_points(packet, now + _PATH_TIMES)
    goal: Callable = lambda packet, now: _NOWHERE


TRAIN_SCRIPT = Script()


class CameraVideoSystem(LeafSystem):
    """Composes what the cameras see and what the vision makes of it, and gives it to whoever wants it.

    .. pydrake_system::

        name: CameraVideoSystem
        input_ports:
        - camera_left
        - camera_right
        - motion_left
        - motion_right
        - centroid_left
        - centroid_right
        - packet
        - command
        - diagnosis

    These are two cameras' ports; a single one has ``camera``, ``motion``, ``centroid``. ``camera_*`` are ImageRgba8U,
    ``motion_*`` hold a `MotionEnergy`, ``centroid_*`` are `Centroid`, ``packet`` is a `Prediction`, ``command`` an
    `ArmCommand`, ``diagnosis`` what the script says. Frames are published
    `FRAMES_PER_SECOND` times a second from time 0, at instants at which the vision reads the cameras too, so that no
    image is rendered twice. An unrestricted update keeps the images that late centroids describe; where one describes
    the time between two of them it is the earlier. While vision is not used the last packet before is held, as the arm
    holds it.

    Args:
      sinks: a `VideoFile`, or others that have its ``wanted`` and ``write``: a frame is drawn once for all of them,
      and only if one wants it. page: a `VideoPage`. cameras: {side: CameraModel}, calibrated.
      offsets: {side: (u0, v0)}, the full image's pixel that is the first of the images. lag_cycles: from image to
      centroid. script: a `Script`. every: cycles from one image kept to the next; others are not rendered for this.
      update_cycles: from one centroid to the next.
    """

    def __init__(self, sinks, page, cameras, offsets, lag_cycles, script=TRAIN_SCRIPT, every=1, update_cycles=1):
        super().__init__()
        self._sinks, self._page, self._cameras, self._offsets = sinks, page, cameras, offsets
        self._sides, self._script = tuple(cameras), script
        self._kept = math.ceil((lag_cycles + update_cycles + 2) / every)
        self._images, self._motions, self._centroids = {}, {}, {}
        image = AbstractValue.Make(ImageRgba8U())
        energy = AbstractValue.Make(MotionEnergy(0.0, np.zeros((1, 1), np.uint8), (0, 0)))
        for side in self._sides:
            self._images[side] = self.DeclareAbstractInputPort(port_of("camera", side), image)
            self._motions[side] = self.DeclareAbstractInputPort(port_of("motion", side), energy)
            self._centroids[side] = self.DeclareVectorInputPort(port_of("centroid", side), message_size(Centroid))
        self._packet = self.DeclareVectorInputPort("packet", message_size(Prediction))
        self._command = self.DeclareVectorInputPort("command", message_size(ArmCommand))
        self._diagnosis = self.DeclareVectorInputPort("diagnosis", message_size(script.diagnosis))
        self._recent = self.DeclareAbstractState(AbstractValue.Make(_Recent(np.zeros(message_size(Prediction)))))
        self.DeclarePeriodicUnrestrictedUpdateEvent(every * VISION_PERIOD, 0.0, self._remember)
        self.DeclarePeriodicPublishEvent(1.0 / FRAMES_PER_SECOND, 0.0, self._write)

    def _remember(self, context, state):
        recent = context.get_abstract_state(self._recent).get_value()
        images = {side: self._image(context, side) for side in self._sides}
        motions = {side: self._motions[side].Eval(context) for side in self._sides}
        masks = {side: motion.mask for side, motion in motions.items()}
        stamp = motions[self._sides[0]].stamp
        frozen = ArmCommand(self._command.Eval(context)).frozen
        new = _Recent(
            recent.packet if frozen else np.array(self._packet.Eval(context)),
            (*recent.images[-self._kept :], (_cycle(context.get_time()), images)),
            (*recent.masks[-self._kept :], (_cycle(stamp), masks)),
        )
        state.get_mutable_abstract_state(self._recent).set_value(new)

    def _write(self, context):
        sinks = [sink for sink in self._sinks if sink.wanted]
        if not sinks:
            return
        now = context.get_time()
        recent = context.get_abstract_state(self._recent).get_value()
        masks = dict(recent.masks)
        centroids = {side: Centroid(self._centroids[side].Eval(context)) for side in self._sides}
        stamp = centroids[self._sides[0]].stamp
        described = _cycle(stamp) if stamp > 0.0 else None
        command = ArmCommand(self._command.Eval(context))
        phase = self._script.phases(int(command.phase))
        late = [] if described is None else [images for cycle, images in recent.images if cycle <= described]
        path = goal = _NOWHERE
        if phase in self._script.predicting and Prediction(recent.packet).valid:
            path, goal = self._script.path(recent.packet, now), self._script.goal(recent.packet, now)
        sights = {
            side: CameraSight(
                image=self._image(context, side),
                offset=self._offsets[side],
                path=self._cameras[side].project(path),
                late_image=late[-1][side] if late else None,
                energy=masks.get(described, {}).get(side),
                centroid=(centroids[side].u, centroids[side].v) if centroids[side].valid else None,
                goal=self._cameras[side].project(goal),
            )
            for side in self._sides
        }
        state = PageState(
            time=now,
            phase=phase,
            notes=self._script.notes(phase, self._script.diagnosis(self._diagnosis.Eval(context))),
            stamp=stamp if described is not None else None,
            blind=bool(command.frozen),
        )
        frame = self._page.draw(sights, state)
        for sink in sinks:
            sink.write(frame)

    def _image(self, context, side):
        return cv2.cvtColor(self._images[side].Eval(context).data, cv2.COLOR_RGBA2BGR)


class CameraVideoRecorder:
    """What `add_camera_video` returns: `finish` ends the video."""

    def __init__(self, sinks):
        self._sinks = sinks

    def finish(self, root_context):
        """Ends the video. The Context is not needed: everything has been written as it came."""
        for sink in self._sinks:
            sink.close()


def add_camera_video(builder, hand_eye, scenario, path, onlooker=None):
    """Adds a `CameraVideoSystem` that films a `HandEyeDiagram`, for `film`'s ``path`` and ``onlooker``.

    Returns a `CameraVideoRecorder`.
    """
    config = scenario.cameras
    cameras = load_cameras(scenario)
    windows = look_windows(scenario, cameras)
    page = VideoPage(
        {side: windows[side].polygon for side in SIDES},
        (config.width, config.height),
        title=scenario.name,
        subtitle=f"seed {scenario.seed}, {scenario.track.speed:g} m/s",
        lag=scenario.vision.lag_cycles * VISION_PERIOD,
    )
    offsets = {side: hand_eye.world.cameras[f"camera_{side}"].window[:2] for side in SIDES}
    return film(builder, hand_eye, (path, onlooker), page, cameras, offsets, scenario.vision.lag_cycles)


def film(builder, hand_eye, audience, page, *arguments, **settings):
    """Adds a `CameraVideoSystem`, wired to a `HandEyeDiagram`, that draws ``page``.

    ``audience`` is (path, onlooker): the MP4 file to write, or None; and who else is to see the frames, or None:
    ``open`` tells it the page, ``wanted``, ``write`` and ``close`` are as of a `VideoFile`. ``arguments`` and
    ``settings`` are the System's other ones. Returns a `CameraVideoRecorder`.
    """
    path, onlooker = audience
    sinks = []
    if path is not None:
        sinks.append(VideoFile(path, FRAMES_PER_SECOND, page.size))
    if onlooker is not None:
        onlooker.open(page)
        sinks.append(onlooker)
    system = builder.AddNamedSystem("camera_video", CameraVideoSystem(sinks, page, *arguments, **settings))
    for k in range(system.num_input_ports()):
        port = system.get_input_port(k)
        name = port.get_name()
        builder.Connect(hand_eye.GetOutputPort("delivered" if name == "packet" else name), port)
    return CameraVideoRecorder(sinks)


def _cycle(time):
    return round(time / VISION_PERIOD)
