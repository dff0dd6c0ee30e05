"""One camera's motion centroid as a Drake System, and the delay line that makes it 15 cycles late."""

from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import LeafSystem
from pydrake.systems.primitives import DiscreteTimeDelay
from pydrake.systems.sensors import ImageRgba8U

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.frozen_state import read_only
from drake_tracker.core.messages import Centroid, FrameInfo, message_size
from drake_tracker.core.timing import LAG_CYCLES, VISION_PERIOD, delay_cycles


@dataclass(frozen=True, eq=False)
class MotionEnergy:
    """What the detector saw at one instant, for figures and video.

    Attributes:
        stamp: capture time of the image described [s].
        mask: uint8 of the image's shape, read-only, 255 where something moves.
        image_offset: full-frame coordinates (u0, v0) of the mask's top left pixel.
    """

    stamp: float
    mask: np.ndarray
    image_offset: tuple

    def __deepcopy__(self, memo):
        return self


@dataclass(frozen=True, eq=False)
class _Memory:
    """Smoothed images, oldest first, and the newest centroid with the images that it rests on and their mask.

    ``readings`` is what a predicted window remembers, ``stamps`` are those of the smoothed images. Never changed in
    place, hence shared by copies.
    """

    smoothed: tuple
    described: tuple
    centroid: np.ndarray
    energy: MotionEnergy
    readings: tuple = ()
    stamps: tuple = ()

    def __deepcopy__(self, memo):
        return self


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

    ``color_image`` is an `ImageRgba8U`, read every ``period`` [s] from time 0 in an unrestricted update. It may show
    only a rectangle of the full frame whose top left pixel is ``image_offset`` = (u0, v0).

    ``centroid`` is a `Centroid` vector in full-frame pixel coordinates, without the lag: it rests on the newest image,
    while its stamp is that of the image it describes. It is zero until enough images are buffered; after that the stamp
    is always set, and ``valid`` is 0 when too few pixels move. ``motion_energy`` is an abstract `MotionEnergy` of the
    same instant. ``motion_images`` holds what the detector's ``images`` returns for the images used (for normal flow a
    `MotionImages`), or None before there are enough; it costs nothing unless it is read.

    With ``update_cycles`` above 1 a new centroid is found only every so many cycles (Nashman and Chaconas 1990: an
    update rate of 66.8 ms, 4 cycles); the outputs stay as they are meanwhile, and images that no centroid will rest on
    are not read.

    With ``own_stamps`` there is one more input, ``frame``, a `FrameInfo`: for images from a camera that drops some or
    takes them a little early or late. In a cycle without a fresh image nothing is put into the buffer, and each
    centroid that would rest on that cycle is invalid: the image before, taken twice, would look as if everything had
    stopped. The others count, since their images lie as far apart as ever. The stamp is then that of the images
    described, interpolated between those used, instead of the cycle's.

    Args:
        detector: a `NormalFlow`, or another detector with its methods ``smooth``, ``mask``, ``centroid`` and ``images``
            and its properties ``stride``, ``buffer_length`` and ``stamp_age_cycles``.
        own_stamps: whether there is the input ``frame``.
        follow: a `PredictedWindow` outside of which nothing is looked at, or None.

    Raises DrakeTrackerError when ``update_cycles`` is not a whole number of at least 1.
    """

    def __init__(
        self,
        detector,
        *,
        image_offset=(0, 0),
        period=VISION_PERIOD,
        update_cycles=1,
        follow=None,
        own_stamps=False,
    ):
        super().__init__()
        if update_cycles != int(update_cycles) or update_cycles < 1:
            raise DrakeTrackerError(f"update_cycles is {update_cycles}; it must be a whole number, 1 or more")
        self._detector = detector
        self._period = period
        self._follow = follow
        self._update_cycles = int(update_cycles)
        self._offset = (int(image_offset[0]), int(image_offset[1]))
        self._stamp_age = detector.stamp_age_cycles * period
        self._image = self.DeclareAbstractInputPort("color_image", AbstractValue.Make(ImageRgba8U()))
        self._frame = self.DeclareVectorInputPort("frame", message_size(FrameInfo)) if own_stamps else None
        nothing = MotionEnergy(0.0, read_only(np.zeros((1, 1), np.uint8)), self._offset)
        blank = _Memory((), (), read_only(np.zeros(message_size(Centroid))), nothing)
        self._memory = self.DeclareAbstractState(AbstractValue.Make(blank))
        from_memory = {self.abstract_state_ticket(self._memory)}
        self.DeclareVectorOutputPort("centroid", message_size(Centroid), self._calc_centroid, from_memory)
        self.DeclareAbstractOutputPort(
            "motion_energy", lambda: AbstractValue.Make(nothing), self._calc_motion_energy, from_memory
        )
        self.DeclareAbstractOutputPort(
            "motion_images", lambda: AbstractValue.Make(blank), self._calc_motion_images, from_memory
        )
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._update)

    def _get_memory(self, context):
        return context.get_abstract_state(self._memory).get_value()

    def _update(self, context, state):
        cycle = round(context.get_time() / self._period)
        memory = self._get_memory(context)
        length, stride = self._detector.buffer_length, self._detector.stride
        frame = None if self._frame is None else FrameInfo(self._frame.Eval(context))
        newest = None
        needed = any((cycle + age) % self._update_cycles == 0 for age in range(0, length, stride))
        if needed and (frame is None or frame.fresh):
            grey = cv2.cvtColor(self._image.Eval(context).data, cv2.COLOR_RGBA2GRAY)
            newest = read_only(self._detector.smooth(grey))
        smoothed = (memory.smoothed + (newest,))[-length:]
        stamps = memory.stamps if frame is None else (memory.stamps + (float(frame.stamp),))[-length:]
        described, centroid, energy, readings = memory.described, memory.centroid, memory.energy, memory.readings
        if len(smoothed) == length and cycle % self._update_cycles == 0:
            stamp = context.get_time() - self._stamp_age if frame is None else self._described_stamp(stamps)
            described = smoothed[::stride]
            if any(image is None for image in described):
                described, mask, region = (), np.zeros_like(energy.mask), None
            else:
                mask = self._detector.mask(*described)
                if self._follow is not None:
                    mask = self._follow.apply(mask, readings, stamp)
                region = self._detector.centroid(mask)
            if self._follow is not None:
                readings = self._follow.remember(readings, stamp, region)
            u0, v0 = self._offset
            if region is None:
                centroid = np.array([stamp, 0.0, 0.0, 0.0, 0.0])
            else:
                centroid = np.array([stamp, region.u + u0, region.v + v0, region.pixel_count, 1.0])
            energy = MotionEnergy(stamp, read_only(mask), self._offset)
        memory = _Memory(smoothed, described, read_only(centroid), energy, readings, stamps)
        state.get_mutable_abstract_state(self._memory).set_value(memory)

    def _described_stamp(self, stamps):
        """Returns the stamp [s] of the image described, interpolated between those of the images used."""
        used = stamps[:: self._detector.stride]
        position = (len(stamps) - 1 - self._detector.stamp_age_cycles) / self._detector.stride
        return float(np.interp(position, np.arange(len(used)), used))

    def _calc_centroid(self, context, output):
        output.SetFromVector(self._get_memory(context).centroid)

    def _calc_motion_energy(self, context, output):
        output.set_value(self._get_memory(context).energy)

    def _calc_motion_images(self, context, output):
        described = self._get_memory(context).described
        output.set_value(self._detector.images(*described) if described else None)


class LaggedCentroid(NamedTuple):
    """The parts that `add_motion_centroid` made. ``output_port`` is the `Centroid` as late as the paper's."""

    system: MotionCentroidSystem
    delay: DiscreteTimeDelay

    @property
    def image_input_port(self):
        """Where the camera's image goes in."""
        return self.system.GetInputPort("color_image")

    @property
    def frame_input_port(self):
        """Where the image's own stamp goes in, if there is such a port."""
        return self.system.GetInputPort("frame")

    @property
    def output_port(self):
        """The lagged centroid."""
        return self.delay.get_output_port()


def add_motion_centroid(
    builder,
    name,
    detector,
    *,
    image_offset=(0, 0),
    lag_cycles=LAG_CYCLES,
    period=VISION_PERIOD,
    update_cycles=1,
    follow=None,
    own_stamps=False,
):
    """Adds a `MotionCentroidSystem` and the delay that makes each centroid appear ``lag_cycles`` after its stamp.

    "The total associated delay time for finding the centroid of a moving object becomes 15 cycles or 0.25 seconds"
    (section 3.1): part of it passes while the images after the described one arrive, the delay line adds the rest. The
    centroid, not the image, is delayed, which costs less and comes to the same. Both Systems update at whole cycles,
    the delay line after the centroid; read the result later in the plant step.

    A throughput counted from the first image of several is turned into a lag by `timing.lag_of_throughput`. The lag is
    one single value whatever ``update_cycles`` is: the delay line runs every cycle.

    Returns a `LaggedCentroid`. Raises DrakeTrackerError when the lag is too short for the detector's images.
    """
    steps = delay_cycles(lag_cycles, detector.stamp_age_cycles)
    if steps == 0:
        raise DrakeTrackerError(f"a lag of {lag_cycles:g} cycles leaves nothing to the delay line; add 1 cycle or more")
    settings = {"image_offset": image_offset, "period": period, "update_cycles": update_cycles, "follow": follow}
    settings["own_stamps"] = own_stamps
    system = builder.AddNamedSystem(name, MotionCentroidSystem(detector, **settings))
    delay = builder.AddNamedSystem(f"{name}_lag", DiscreteTimeDelay(period, steps, message_size(Centroid)))
    builder.Connect(system.GetOutputPort("centroid"), delay.get_input_port())
    return LaggedCentroid(system, delay)
