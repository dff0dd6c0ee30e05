"""The camera video of a run, written during the run."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import cv2
import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, DiagramBuilder, LeafSystem, State
from pydrake.systems.sensors import ImageRgba8U

from drake_tracker.core.frozen_state import FrozenState
from drake_tracker.core.messages import ArmCommand, Centroid, Frozen, Prediction, Regions, TrackPoints, message_size
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.diagrams.hand_eye import HandEyeDiagram, inputs
from drake_tracker.run.drawn_video import DrawnVideo
from drake_tracker.run.track_marks import region_marks, track_marks
from drake_tracker.run.video_page import CameraSight, PageState, VideoPage
from drake_tracker.run.video_process import VideoProcess
from drake_tracker.tasks.filming import FRAMES_PER_SECOND, NO_POINTS, Film, port_of
from drake_tracker.tasks.tracks import reason_words
from drake_tracker.vision.detection_mask import DetectionMask

_FRAME_CYCLES = round(1.0 / (FRAMES_PER_SECOND * VISION_PERIOD))
"""Vision cycles from one frame to the next."""


class FrameSink(Protocol):
    """Receives the content of the frames of a video and draws them, such as a `DrawnVideo`."""

    @property
    def wanted(self) -> bool:
        """Whether the next frame is wanted."""
        ...

    def write(self, sights: Mapping[str, CameraSight], state: PageState) -> None:
        """Receives the content of the next frame, see `VideoPage.draw`. It is not changed afterwards."""
        ...

    def close(self) -> None:
        """Ends the video."""
        ...


class PageSink(FrameSink, Protocol):
    """A sink that needs the layout of the frames before the first frame, such as the live view."""

    def open(self, page: VideoPage) -> None:
        """Receives the page with which to draw the frames."""
        ...


@dataclass(frozen=True, eq=False)
class _Recent(FrozenState):
    """The images and masks of the last cycles, which late centroids describe.

    Attributes:
        images: (number of the cycle, {side: BGR image}), newest last.
        masks: (number of the cycle, {side: mask of the moving pixels}), newest last.
    """

    images: tuple[tuple[int, dict[str, np.ndarray]], ...] = ()
    masks: tuple[tuple[int, dict[str, np.ndarray]], ...] = ()


@dataclass(frozen=True, eq=False)
class _Moment:
    """Content of one frame in addition to the images, at the capture time of the frame's present image.

    Attributes:
        cycle: number of the cycle.
        time: of the image [s].
        packet: vector of the `Prediction` that the arm follows.
        centroids: {side: vector of the `Centroid`}.
        command: vector of the `ArmCommand`.
        diagnosis: vector of the diagnosis.
        regions: {side: vector of the `Regions`}, empty unless vision tracks several objects.
        tracks: vector of the `TrackPoints`, all zeros unless vision tracks several objects.
    """

    cycle: int
    time: float
    packet: np.ndarray
    centroids: dict[str, np.ndarray]
    command: np.ndarray
    diagnosis: np.ndarray
    regions: dict[str, np.ndarray]
    tracks: np.ndarray


@dataclass(frozen=True, eq=False)
class _Moments(FrozenState):
    """Content of the frames whose images have not appeared yet.

    Attributes:
        packet: vector of the `Prediction` that the arm follows.
        moments: the moments, oldest first; none where images appear at once.
    """

    packet: np.ndarray
    moments: tuple[_Moment, ...] = ()


class CameraVideoSystem(LeafSystem):
    """Passes on the content of the camera video: images, motion energy, centroids and predicted path.

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

    These are the ports for two cameras. A single camera has ``camera``, ``motion`` and ``centroid``. With a vision that
    tracks several objects there are ``regions_left``, ``regions_right`` and ``tracks`` too.

    - ``camera_*``: ImageRgba8U, the newest image.
    - ``motion_*``: a `DetectionMask`, the moving pixels of the newest image pair.
    - ``centroid_*``: a `Centroid`. All zeros: there is none to draw.
    - ``regions_*``: a `Regions`, with the stamp of the centroids. ``tracks``: a `TrackPoints`.
    - ``packet``: a `Prediction`. All zeros: there is no path to draw.
    - ``command``: an `ArmCommand`. All zeros is its first phase, with the arm not blind.
    - ``diagnosis``: the message that the script names.

    There are `FRAMES_PER_SECOND` frames per second, with offset 0. The vision reads the cameras at the same instants,
    so that no image is rendered twice. An unrestricted update every ``film.every`` vision cycles keeps the images that
    late centroids describe. If a centroid describes an instant between two images, the earlier image is drawn. While
    the arm is blind, the packet that it holds is drawn.

    If images appear ``film.image_latency`` cycles after their capture, a frame is due when its image appears, and shows
    everything else as it was at the capture. `pass_rest` passes the last frames on after the end.

    Args:
        sinks: receivers of the frames, such as a `DrawnVideo`.
        film: what the video shows.
    """

    def __init__(self, sinks: Sequence[FrameSink], film: Film) -> None:
        super().__init__()
        self._sinks, self._cameras, self._offsets = sinks, film.cameras, film.offsets
        self._sides, self._script, self._latency = tuple(film.cameras), film.script, film.image_latency
        self._passed = -1
        self._kept = math.ceil((film.lag_cycles + film.update_cycles + 2) / film.every)
        self._images: dict[str, Any] = {}
        self._motions: dict[str, Any] = {}
        self._centroids: dict[str, Any] = {}
        image = AbstractValue.Make(ImageRgba8U())
        energy = AbstractValue.Make(DetectionMask(0.0, np.zeros((1, 1), np.uint8), (0, 0)))
        for side in self._sides:
            self._images[side] = self.DeclareAbstractInputPort(port_of("camera", side), image)
            self._motions[side] = self.DeclareAbstractInputPort(port_of("motion", side), energy)
            self._centroids[side] = self.DeclareVectorInputPort(port_of("centroid", side), message_size(Centroid))
        self._regions = {}
        if film.several:
            for side in self._sides:
                name = port_of("regions", side)
                self._regions[side] = self.DeclareVectorInputPort(name, message_size(Regions))
        self._tracks = self.DeclareVectorInputPort("tracks", message_size(TrackPoints)) if film.several else None
        self._packet = self.DeclareVectorInputPort("packet", message_size(Prediction))
        self._command = self.DeclareVectorInputPort("command", message_size(ArmCommand))
        self._diagnosis = self.DeclareVectorInputPort("diagnosis", message_size(film.script.diagnosis))
        self._recent = self.DeclareAbstractState(AbstractValue.Make(_Recent()))
        self._moments = self.DeclareAbstractState(AbstractValue.Make(_Moments(np.zeros(message_size(Prediction)))))
        period, late = film.every * VISION_PERIOD, film.image_latency % film.every
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._note)
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, late * VISION_PERIOD, self._remember)
        late = film.image_latency % _FRAME_CYCLES
        self.DeclarePeriodicPublishEvent(1.0 / FRAMES_PER_SECOND, late * VISION_PERIOD, self._write)

    def pass_rest(self, root_context: Context) -> None:
        """Passes on the frames whose images have not appeared at the end.

        Args:
            root_context: of the whole diagram, at the end; it is not changed.
        """
        if self._latency > 0:
            later = root_context.Clone()
            context = self.GetMyContextFromRoot(later)
            for moment in context.get_abstract_state(self._moments).get_value().moments:
                if moment.cycle > self._passed:
                    later.SetTime((moment.cycle + self._latency) * VISION_PERIOD)
                    self._pass(context, moment)

    def _note(self, context: Context, state: State) -> None:
        last = context.get_abstract_state(self._moments).get_value()
        blind = ArmCommand(self._command.Eval(context)).frozen == Frozen.BLIND
        packet = last.packet if blind else np.array(self._packet.Eval(context))
        moments = last.moments
        if self._latency > 0 and _cycle(context.get_time()) % _FRAME_CYCLES == 0:
            moments = (*moments[-(self._latency // _FRAME_CYCLES) - 1 :], self._moment(context))
        state.get_mutable_abstract_state(self._moments).set_value(_Moments(packet, moments))

    def _moment(self, context: Context) -> _Moment:
        return _Moment(
            _cycle(context.get_time()),
            context.get_time(),
            context.get_abstract_state(self._moments).get_value().packet,
            {side: np.array(self._centroids[side].Eval(context)) for side in self._sides},
            np.array(self._command.Eval(context)),
            np.array(self._diagnosis.Eval(context)),
            {side: np.array(port.Eval(context)) for side, port in self._regions.items()},
            np.zeros(message_size(TrackPoints)) if self._tracks is None else np.array(self._tracks.Eval(context)),
        )

    def _remember(self, context: Context, state: State) -> None:
        cycle = _cycle(context.get_time()) - self._latency
        if cycle < 0:
            return
        recent = context.get_abstract_state(self._recent).get_value()
        images = {side: self._image(context, side) for side in self._sides}
        motions = {side: self._motions[side].Eval(context) for side in self._sides}
        masks = {side: motion.mask for side, motion in motions.items()}
        stamp = motions[self._sides[0]].stamp
        new = _Recent(
            (*recent.images[-self._kept :], (cycle, images)), (*recent.masks[-self._kept :], (_cycle(stamp), masks))
        )
        state.get_mutable_abstract_state(self._recent).set_value(new)

    def _write(self, context: Context) -> None:
        if self._latency == 0:
            self._pass(context, self._moment(context))
            return
        cycle = _cycle(context.get_time()) - self._latency
        for moment in context.get_abstract_state(self._moments).get_value().moments:
            if moment.cycle == cycle:
                self._pass(context, moment)

    def _pass(self, context: Context, moment: _Moment) -> None:
        """Passes on the frame of a moment, in a Context in which its image appears."""
        self._passed = moment.cycle
        sinks = [sink for sink in self._sinks if sink.wanted]
        if not sinks:
            return
        recent = context.get_abstract_state(self._recent).get_value()
        masks = dict(recent.masks)
        centroids = {side: Centroid(vector) for side, vector in moment.centroids.items()}
        stamp = centroids[self._sides[0]].stamp
        described = _cycle(stamp) if stamp > 0.0 else None
        command = ArmCommand(moment.command)
        phase = self._script.phases(int(command.phase))
        late = [] if described is None else [images for cycle, images in recent.images if cycle <= described]
        path = goal = NO_POINTS
        if phase in self._script.predicting and Prediction(moment.packet).valid:
            path = self._script.path(moment.packet, moment.time)
            goal = self._script.goal(moment.packet, moment.time)
        sights = {
            side: CameraSight(
                image=self._image(context, side),
                offset=self._offsets[side],
                path=self._cameras[side].project(path),
                late_image=late[-1][side] if late else None,
                energy=masks.get(described, {}).get(side),
                centroid=(centroids[side].u, centroids[side].v) if centroids[side].valid else None,
                goal=self._cameras[side].project(goal),
                regions=region_marks(moment.regions[side]) if side in moment.regions else (),
                tracks=track_marks(moment.tracks, self._cameras[side], moment.time),
            )
            for side in self._sides
        }
        state = PageState(
            time=moment.time,
            phase=phase,
            notes=self._script.notes(phase, self._script.diagnosis(moment.diagnosis)),
            stamp=stamp if described is not None else None,
            blind=command.frozen == Frozen.BLIND,
            reason=reason_words(moment.tracks),
        )
        for sink in sinks:
            sink.write(sights, state)

    def _image(self, context: Context, side: str) -> np.ndarray:
        return cv2.cvtColor(self._images[side].Eval(context).data, cv2.COLOR_RGBA2BGR)


class CameraVideoRecorder:
    """A `Recorder` that completes the camera video.

    Args:
        system: passes the frames on.
        sinks: receivers of the frames.
    """

    def __init__(self, system: CameraVideoSystem, sinks: Sequence[FrameSink]) -> None:
        self._system, self._sinks = system, sinks

    @property
    def processes(self) -> list[int]:
        """The process numbers of the processes that draw."""
        return [number for sink in self._sinks if isinstance(sink, VideoProcess) for number in sink.running]

    def finish(self, root_context: Context) -> None:
        """Passes on the frames that are left, and closes the sinks."""
        try:
            self._system.pass_rest(root_context)
        finally:
            for sink in self._sinks:
                sink.close()


def add_camera_video(
    builder: DiagramBuilder,
    *,
    hand_eye: HandEyeDiagram,
    film: Film,
    path: Path | None,
    onlooker: PageSink | None = None,
) -> CameraVideoRecorder:
    """Adds a `CameraVideoSystem` for a `HandEyeDiagram`.

    Args:
        builder: builder that contains ``hand_eye``.
        hand_eye: diagram to film.
        film: what the video shows.
        path: MP4 file to write, or None.
        onlooker: another receiver of the frames, or None.

    If images appear late, since processes make them beside the simulation, a process draws and encodes the video.

    Returns the recorder.
    """
    page = VideoPage(film.polygons, film.image_size, film.title, film.subtitle, film.lag, film.goal, film.several)
    sinks: list[FrameSink] = []
    if path is not None:
        sinks.append(VideoProcess(path, page) if film.image_latency > 0 else DrawnVideo(path, page))
    if onlooker is not None:
        onlooker.open(page)
        sinks.append(onlooker)
    system = builder.AddNamedSystem("camera_video", CameraVideoSystem(sinks, film))
    for port in inputs(system):
        name = port.get_name()
        builder.Connect(hand_eye.GetOutputPort("accepted" if name == "packet" else name), port)
    return CameraVideoRecorder(system, sinks)


def _cycle(time: float) -> int:
    return round(time / VISION_PERIOD)
