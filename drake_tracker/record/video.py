"""The camera video of a run, as a System that writes while the run goes on."""

from dataclasses import dataclass

import cv2
import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import LeafSystem
from pydrake.systems.sensors import ImageRgba8U

from drake_tracker.diagrams.train import load_cameras
from drake_tracker.grasp.gate import Gate
from drake_tracker.grasp.grasp_system import GraspDiagnosis
from drake_tracker.grasp.schema import Phase
from drake_tracker.messages import (
    ArmCommand,
    Centroid,
    Prediction,
    evaluate_prediction,
    message_size,
)
from drake_tracker.record.style import PHASES_THAT_PREDICT
from drake_tracker.record.video_file import VideoFile
from drake_tracker.record.video_page import SIDES, CameraSight, PageState, VideoPage
from drake_tracker.timing import VISION_PERIOD
from drake_tracker.vision.motion_centroid_system import MotionEnergy
from drake_tracker.vision.window import project_window

FRAMES_PER_SECOND = 30
"""Of the video: every second camera image."""
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


class CameraVideoSystem(LeafSystem):
    """Composes what the cameras see and what the vision makes of it, and appends it to a video.

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

    ``camera_*`` are ImageRgba8U, ``motion_*`` hold a `MotionEnergy`, ``centroid_*`` are `Centroid`, ``packet`` is a
    `Prediction`, ``command`` an `ArmCommand`, ``diagnosis`` a `GraspDiagnosis`. Frames are published
    `FRAMES_PER_SECOND` times a second from time 0, at instants at which the vision reads the cameras too, so that no
    image is rendered twice. An unrestricted update at 60 Hz keeps the images that late centroids describe. While vision
    is not used the last packet before is held, as the arm holds it.

    Args:
      video: a `VideoFile`. page: a `VideoPage`. cameras: {side: CameraModel}, calibrated.
      offsets: {side: (u0, v0)}, the full image's pixel that is the first of the images. lag_cycles: from image to
      centroid.
    """

    def __init__(self, video, page, cameras, offsets, lag_cycles):
        super().__init__()
        self._video, self._page, self._cameras, self._offsets = video, page, cameras, offsets
        self._kept = lag_cycles + 3
        self._images, self._motions, self._centroids = {}, {}, {}
        image = AbstractValue.Make(ImageRgba8U())
        energy = AbstractValue.Make(MotionEnergy(0.0, np.zeros((1, 1), np.uint8), (0, 0)))
        for side in SIDES:
            self._images[side] = self.DeclareAbstractInputPort(f"camera_{side}", image)
            self._motions[side] = self.DeclareAbstractInputPort(f"motion_{side}", energy)
            self._centroids[side] = self.DeclareVectorInputPort(f"centroid_{side}", message_size(Centroid))
        self._packet = self.DeclareVectorInputPort("packet", message_size(Prediction))
        self._command = self.DeclareVectorInputPort("command", message_size(ArmCommand))
        self._diagnosis = self.DeclareVectorInputPort("diagnosis", message_size(GraspDiagnosis))
        self._recent = self.DeclareAbstractState(AbstractValue.Make(_Recent(np.zeros(message_size(Prediction)))))
        self.DeclarePeriodicUnrestrictedUpdateEvent(VISION_PERIOD, 0.0, self._remember)
        self.DeclarePeriodicPublishEvent(1.0 / FRAMES_PER_SECOND, 0.0, self._write)

    def _remember(self, context, state):
        recent = context.get_abstract_state(self._recent).get_value()
        images = {side: self._image(context, side) for side in SIDES}
        motions = {side: self._motions[side].Eval(context) for side in SIDES}
        masks = {side: motion.mask for side, motion in motions.items()}
        stamp = motions[SIDES[0]].stamp
        frozen = ArmCommand(self._command.Eval(context)).frozen
        new = _Recent(
            recent.packet if frozen else np.array(self._packet.Eval(context)),
            (*recent.images[-self._kept :], (_cycle(context.get_time()), images)),
            (*recent.masks[-self._kept :], (_cycle(stamp), masks)),
        )
        state.get_mutable_abstract_state(self._recent).set_value(new)

    def _write(self, context):
        now = context.get_time()
        recent = context.get_abstract_state(self._recent).get_value()
        images, masks = dict(recent.images), dict(recent.masks)
        centroids = {side: Centroid(self._centroids[side].Eval(context)) for side in SIDES}
        stamp = centroids[SIDES[0]].stamp
        described = _cycle(stamp) if stamp > 0.0 else None
        command = ArmCommand(self._command.Eval(context))
        phase = Phase(int(command.phase))
        path = _path_ahead(recent.packet, now) if phase in PHASES_THAT_PREDICT else np.zeros((0, 3))
        sights = {
            side: CameraSight(
                image=self._image(context, side),
                offset=self._offsets[side],
                path=self._cameras[side].project(path),
                late_image=images.get(described, {}).get(side),
                energy=masks.get(described, {}).get(side),
                centroid=(centroids[side].u, centroids[side].v) if centroids[side].valid else None,
            )
            for side in SIDES
        }
        diagnosis = GraspDiagnosis(self._diagnosis.Eval(context))
        state = PageState(
            time=now,
            phase=phase,
            attempts=int(diagnosis.attempts),
            gate=Gate(int(diagnosis.gate)),
            stamp=stamp if described is not None else None,
            blind=bool(command.frozen),
        )
        self._video.write(self._page.draw(sights, state))

    def _image(self, context, side):
        return cv2.cvtColor(self._images[side].Eval(context).data, cv2.COLOR_RGBA2BGR)


class CameraVideoRecorder:
    """What `add_camera_video` returns: `finish` ends the video."""

    def __init__(self, video):
        self._video = video

    def finish(self, root_context):
        """Ends the video. The Context is not needed: everything has been written as it came."""
        self._video.close()


def add_camera_video(builder, hand_eye, scenario, path):
    """Adds a `CameraVideoSystem` that films a `HandEyeDiagram` and writes the MP4 file ``path``.

    Returns a `CameraVideoRecorder`.
    """
    config = scenario.cameras
    cameras = load_cameras(scenario)
    vision = scenario.vision
    windows = {side: project_window(cameras[side], vision.work_volume, vision.outline) for side in SIDES}
    page = VideoPage(
        {side: windows[side].polygon for side in SIDES},
        (config.width, config.height),
        title=scenario.name,
        subtitle=f"seed {scenario.seed}, {scenario.track.speed:g} m/s",
        lag=vision.lag_cycles * VISION_PERIOD,
    )
    video = VideoFile(path, FRAMES_PER_SECOND, page.size)
    offsets = {side: hand_eye.world.cameras[f"camera_{side}"].window[:2] for side in SIDES}
    system = builder.AddNamedSystem(
        "camera_video", CameraVideoSystem(video, page, cameras, offsets, vision.lag_cycles)
    )
    ports = {name: name for name in ("command", "diagnosis")}
    ports |= {f"{kind}_{side}": f"{kind}_{side}" for kind in ("camera", "motion", "centroid") for side in SIDES}
    ports["packet"] = "delivered"
    for own, theirs in ports.items():
        builder.Connect(hand_eye.GetOutputPort(theirs), system.GetInputPort(own))
    return CameraVideoRecorder(video)


def _path_ahead(packet, now):
    """Returns the points (n, 3) [m, W] of a `Prediction` vector from ``now`` [s] on; none when it is not valid."""
    if not Prediction(packet).valid:
        return np.zeros((0, 3))
    return np.array([evaluate_prediction(packet, now + t)[:3] for t in _PATH_TIMES])


def _cycle(time):
    return round(time / VISION_PERIOD)
