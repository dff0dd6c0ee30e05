"""The motion centroid of one camera as a Drake System, and the delay line that gives it the paper's lag."""

from collections.abc import Callable
from dataclasses import dataclass
from operator import attrgetter
from typing import Any, NamedTuple

import cv2
import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, DiagramBuilder, InputPort, LeafSystem, OutputPort, State
from pydrake.systems.sensors import ImageGrey8U, ImageRgba8U

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.frozen_state import FrozenState, declare_outputs, read_only
from drake_tracker.core.messages import Centroid, FrameInfo, message_size
from drake_tracker.core.timing import VISION_PERIOD, capture_time, delay_cycles
from drake_tracker.vision.centroid.config import NormalFlow
from drake_tracker.vision.centroid.detectors import DETECTORS, make_detector
from drake_tracker.vision.centroid.motion_detector import MotionDetector
from drake_tracker.vision.centroid.search_window import SearchWindow, Track
from drake_tracker.vision.delay_line_system import DelayLineSystem
from drake_tracker.vision.detection_mask import DetectionMask
from drake_tracker.vision.region_centroid import RegionCentroid, enlarged_centroid, reduced


@dataclass(frozen=True, eq=False)
class _Memory(FrozenState):
    """The state of a `MotionCentroidSystem`.

    Attributes:
        smoothed: smoothed images, oldest first; None stands for a dropped or unread image.
        described: those from which the newest centroid was computed; empty without one.
        centroid: the newest `Centroid` vector.
        energy: its mask.
        track: what a predicted window remembers.
        found: what a derived System remembers.
        stamps: of the smoothed images [s], when they have stamps of their own.
    """

    smoothed: tuple[np.ndarray | None, ...]
    described: tuple[np.ndarray, ...]
    centroid: np.ndarray
    energy: DetectionMask
    track: Track = ()
    stamps: tuple[float, ...] = ()
    found: Any = None


class MotionCentroidSystem(LeafSystem):
    """Finds the motion centroid in the images of one camera (Allen et al. 1991, section 3.1).

    .. pydrake_system::

        name: MotionCentroidSystem
        input_ports:
        - color_image
        output_ports:
        - centroid
        - motion_energy
        - motion_images

    ``color_image`` is an `ImageRgba8U`, or with ``grey`` an `ImageGrey8U`, read every ``period`` at ``offset`` in an
    unrestricted update. It may show only a rectangle of the full frame.

    ``centroid`` is a `Centroid` vector in full-frame pixel coordinates [px], without the lag: it is computed with the
    newest image, but its stamp is the capture time of the described image. It is all zeros until enough images are
    buffered; from then on the stamp is always set, and ``valid`` is 0 when too few pixels move. ``motion_energy`` is an
    abstract `DetectionMask` of the same instant. ``motion_images`` holds the result of the detector's ``images`` for
    the images used (for normal flow a `MotionImages`), or None before there are enough images. The port costs nothing
    unless it is read.

    With ``update_cycles`` above 1 a new centroid is computed only every so many cycles (Nashman and Chaconas 1990: an
    update rate of 66.8 ms, 4 cycles); the outputs hold their values in between, and images that no centroid needs are
    not read.

    With ``own_stamps`` there is one more input, ``frame``, a `FrameInfo` vector: for a camera that drops images or
    captures them a little early or late. In a cycle without a fresh image nothing is put into the buffer, and every
    centroid that would need that image is invalid: using the previous image twice would look as if everything had
    stopped. The other centroids are valid, since their images have the usual spacing. The stamp is then the capture
    time of the described image, interpolated between the stamps of the images used, instead of the time of the cycle.

    Args:
        detector: `MotionDetector`.
        image_offset: full-frame coordinates (u0, v0) [px] of the top left pixel of ``color_image``.
        period: of a cycle [s].
        offset: of the update within the cycle [s].
        update_cycles: cycles from one centroid to the next.
        follow: `SearchWindow` outside of which motion is ignored, or None.
        own_stamps: whether there is the input ``frame``.
        grey: whether the images have grey values only.
        image_latency: cycles from the capture of an image until the input shows it, as with a `PipelinedCamera`.
        reduce_by: whole factor by which the images are reduced before anything else, see `reduced`. Window and pixels
            of the detector refer to the reduced image; all outputs but masks are in pixels of the full image.
        found: what a derived System remembers at the start, see `find`.

    Raises DrakeTrackerError when ``update_cycles`` is not a whole number of at least 1.
    """

    def __init__(
        self,
        detector: MotionDetector,
        *,
        image_offset: tuple[int, int] = (0, 0),
        period: float = VISION_PERIOD,
        offset: float = 0.0,
        update_cycles: int = 1,
        follow: SearchWindow | None = None,
        own_stamps: bool = False,
        grey: bool = False,
        image_latency: int = 0,
        reduce_by: int = 1,
        found: Any = None,
    ) -> None:
        super().__init__()
        if update_cycles != int(update_cycles) or update_cycles < 1:
            raise DrakeTrackerError(f"update_cycles is {update_cycles}; it must be a whole number, 1 or more")
        self._detector = detector
        self._period, self._offset = period, offset
        self._follow = follow
        self._update_cycles, self._latency = int(update_cycles), image_latency
        self._reduce_by = reduce_by
        self._image_offset = (int(image_offset[0]), int(image_offset[1]))
        self._stamp_age = detector.stamp_age_cycles * period
        self._image = self.DeclareAbstractInputPort(
            "color_image", AbstractValue.Make(ImageGrey8U() if grey else ImageRgba8U())
        )
        self._frame = self.DeclareVectorInputPort("frame", message_size(FrameInfo)) if own_stamps else None
        nothing = DetectionMask(0.0, read_only(np.zeros((1, 1), np.uint8)), self._image_offset)
        blank = _Memory((), (), read_only(np.zeros(message_size(Centroid))), nothing, found=found)
        self._memory = self.DeclareAbstractState(AbstractValue.Make(blank))
        from_memory = {self.abstract_state_ticket(self._memory)}
        declare_outputs(self, self._memory, {"centroid": (Centroid, attrgetter("centroid"))})
        self.DeclareAbstractOutputPort(
            "motion_energy", lambda: AbstractValue.Make(nothing), self._calc_motion_energy, from_memory
        )
        self.DeclareAbstractOutputPort(
            "motion_images", lambda: AbstractValue.Make(blank), self._calc_motion_images, from_memory
        )
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, offset, self._update)

    def _get_memory(self, context: Context) -> _Memory:
        return context.get_abstract_state(self._memory).get_value()

    def _update(self, context: Context, state: State) -> None:
        time = capture_time(context.get_time(), self._latency, self._period, self._offset)
        cycle = round((time - self._offset) / self._period)
        if cycle < 0:
            return
        memory = self._get_memory(context)
        length, stride = self._detector.buffer_length, self._detector.stride
        frame = None if self._frame is None else FrameInfo(self._frame.Eval(context))
        newest = None
        if needs_image(self._detector, self._update_cycles, cycle) and (frame is None or frame.fresh):
            grey = reduced(_grey(self._image.Eval(context).data), self._reduce_by)
            newest = read_only(self._detector.smooth(grey))
        smoothed = (memory.smoothed + (newest,))[-length:]
        stamps = memory.stamps if frame is None else (memory.stamps + (float(frame.stamp),))[-length:]
        described, centroid, energy, track = memory.described, memory.centroid, memory.energy, memory.track
        found = memory.found
        if len(smoothed) == length and cycle % self._update_cycles == 0:
            stamp = time - self._stamp_age if frame is None else self._described_stamp(stamps)
            used = smoothed[::stride]
            described = tuple(image for image in used if image is not None)
            if len(described) < len(used):
                described, mask, region = (), np.zeros_like(energy.mask), None
            else:
                found, mask, region = self.find(found, stamp, track, described)
            if self._follow is not None:
                track = self._follow.remember(track, stamp, region)
            u0, v0 = self._image_offset
            if region is None:
                centroid = np.array([stamp, 0.0, 0.0, 0.0, 0.0])
            else:
                u, v, count = enlarged_centroid(region, self._reduce_by)
                centroid = np.array([stamp, u + u0, v + v0, count, 1.0])
            energy = DetectionMask(stamp, read_only(mask), self._image_offset)
        memory = _Memory(smoothed, described, read_only(centroid), energy, track, stamps, found)
        state.get_mutable_abstract_state(self._memory).set_value(memory)

    def find(
        self, found: Any, stamp: float, track: Track, images: tuple[np.ndarray, ...]
    ) -> tuple[Any, np.ndarray, RegionCentroid | None]:
        """Finds the motion. A derived System may do it in another way.

        Args:
            found: what the System remembers of the cycle before.
            stamp: of the image described [s].
            track: what `SearchWindow` remembers.
            images: the smoothed images that the detector needs.

        Returns (new memory, mask of the motion, centroid in pixels of the image or None).
        """
        mask = self._detector.mask(*images)
        if self._follow is not None:
            mask = self._follow.apply(mask, track, stamp)
        return found, mask, self._detector.centroid(mask)

    def _described_stamp(self, stamps: tuple[float, ...]) -> float:
        """Returns the stamp [s] of the described image, interpolated between the stamps of the images used."""
        used = stamps[:: self._detector.stride]
        position = (len(stamps) - 1 - self._detector.stamp_age_cycles) / self._detector.stride
        return float(np.interp(position, np.arange(len(used)), used))

    def _calc_motion_energy(self, context: Context, output: AbstractValue) -> None:
        output.set_value(self._get_memory(context).energy)

    def _calc_motion_images(self, context: Context, output: AbstractValue) -> None:
        described = self._get_memory(context).described
        output.set_value(self._detector.images(*described) if described else None)


def _grey(image: np.ndarray) -> np.ndarray:
    """Returns an image (h, w, 4) or (h, w, 1) as grey values (h, w)."""
    return image[:, :, 0] if image.shape[2] == 1 else cv2.cvtColor(image, cv2.COLOR_RGBA2GRAY)


def needs_image(detector: MotionDetector, update_cycles: int, cycle: int) -> bool:
    """Returns whether a `MotionCentroidSystem` reads the image of a cycle, given by its number.

    Args:
        detector: its detector.
        update_cycles: cycles from one centroid to the next.
        cycle: number of the cycle.
    """
    return any((cycle + age) % update_cycles == 0 for age in range(0, detector.buffer_length, detector.stride))


class LaggedCentroid(NamedTuple):
    """The Systems that `add_motion_centroid` added.

    Attributes:
        system: finds the centroid.
        delay: the delay line behind it.
    """

    system: MotionCentroidSystem
    delay: DelayLineSystem

    @property
    def image_input_port(self) -> InputPort:
        """The input for the camera's `ImageRgba8U`."""
        return self.system.GetInputPort("color_image")

    @property
    def frame_input_port(self) -> InputPort:
        """The input for the image's `FrameInfo`, which exists only with ``own_stamps``."""
        return self.system.GetInputPort("frame")

    @property
    def output_port(self) -> OutputPort:
        """The output with the `Centroid` vector, a lag after its stamp."""
        return self.delay.get_output_port()


def add_motion_centroid(
    builder: DiagramBuilder,
    *,
    detector: Any = NormalFlow(),
    image: OutputPort | None = None,
    window: np.ndarray | None = None,
    image_offset: tuple[int, int] = (0, 0),
    lag_cycles: float | None = None,
    period: float = VISION_PERIOD,
    offset: float = 0.0,
    update_cycles: int = 1,
    follow: SearchWindow | None = None,
    own_stamps: bool = False,
    grey: bool = False,
    image_latency: int = 0,
    reduce_by: int = 1,
    name: str | None = None,
    system_class: Callable[..., MotionCentroidSystem] = MotionCentroidSystem,
) -> LaggedCentroid:
    """Adds a `MotionCentroidSystem` and the delay line that outputs each centroid ``lag_cycles`` after its stamp.

    "The total associated delay time for finding the centroid of a moving object becomes 15 cycles or 0.25 seconds"
    (Allen et al. 1991, section 3.1); here it counts from the middle image of three. Part of it passes while the images
    after the described one arrive, the delay line adds the rest. The centroid is delayed, not the image, which is
    cheaper and has the same effect. Both Systems update at the same instants, the delay line after the centroid.

    `timing.lag_of_throughput` converts a throughput that is counted from the first of several images to a lag. The lag
    is the same whatever ``update_cycles`` is: the delay line runs every cycle.

    Args:
        builder: of the diagram.
        detector: a `MotionDetector`, or the settings of one, such as `NormalFlow`.
        image: output port with the camera's images, such as the colour image of an `RgbdSensor`; None connects
            nothing.
        window: uint8 (h, w) of the image's shape, 0 where motion is ignored; None uses the whole image. Only for a
            detector that is given by its settings.
        image_offset: full-frame coordinates (u0, v0) [px] of the image's top left pixel.
        lag_cycles: cycles from the stamp of a centroid until it is output; None is the shortest lag possible.
        period: of a cycle [s].
        offset: of the updates within the cycle [s].
        update_cycles: cycles from one centroid to the next.
        follow: `SearchWindow` outside of which motion is ignored, or None.
        own_stamps: whether there is an input for the images' own stamps.
        grey: whether the images have grey values only.
        image_latency: cycles from the capture of an image until the input shows it; the delay line adds the rest of the
            lag.
        reduce_by: see `MotionCentroidSystem`.
        name: of the System; the delay line has the same with ``_lag``. None is "motion", or "motion_2" and so on.
        system_class: makes the System, for one that is derived from `MotionCentroidSystem`.

    Raises DrakeTrackerError when the lag is too short for the detector's images, or when a setting is out of range.
    """
    if type(detector) in DETECTORS.makers:
        detector = make_detector(detector, window=window, period=period)
    elif window is not None:
        raise DrakeTrackerError("a detector object has its own window; pass the window to the detector")
    if lag_cycles is None:
        lag_cycles = detector.stamp_age_cycles + image_latency + 1
    steps = delay_cycles(lag_cycles, detector.stamp_age_cycles) - image_latency
    if steps < 1:
        late = f" of images that are {image_latency} cycles late" if image_latency else ""
        raise DrakeTrackerError(
            f"a lag of {lag_cycles:g} cycles{late} leaves nothing to the delay line; add {1 - steps} cycle or more"
        )
    name = name or _free_name(builder, "motion")
    system = system_class(
        detector,
        image_offset=image_offset,
        period=period,
        offset=offset,
        update_cycles=update_cycles,
        follow=follow,
        own_stamps=own_stamps,
        grey=grey,
        image_latency=image_latency,
        reduce_by=reduce_by,
    )
    delay = DelayLineSystem(message_size(Centroid), steps, period=period, offset=offset)
    parts = LaggedCentroid(builder.AddNamedSystem(name, system), builder.AddNamedSystem(f"{name}_lag", delay))
    builder.Connect(system.GetOutputPort("centroid"), delay.get_input_port())
    if image is not None:
        builder.Connect(image, parts.image_input_port)
    return parts


def _free_name(builder: DiagramBuilder, name: str) -> str:
    """Returns the name, with a number if a System of the diagram already has the name."""
    number, free = 1, name
    while builder.HasSubsystemNamed(free):
        number += 1
        free = f"{name}_{number}"
    return free
