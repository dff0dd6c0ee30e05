"""The background model of one camera as a Drake System, with the lag of the pipeline."""

from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, LeafSystem, State
from pydrake.systems.sensors import ImageRgba8U

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.frozen_state import FrozenState, read_only
from drake_tracker.core.messages import FrameInfo, message_size
from drake_tracker.core.timing import VISION_PERIOD, capture_time
from drake_tracker.vision.camera_motion import UnusableReason, Verdict
from drake_tracker.vision.config import CameraMotion
from drake_tracker.vision.detection_mask import DetectionMask
from drake_tracker.vision.silhouettes.background_model import Background, BackgroundModel
from drake_tracker.vision.silhouettes.foreground import Foreground
from drake_tracker.vision.silhouettes.image_alignment import AlignedImage, Alignment, ImageAlignment

LONGEST_DARK = 60
"""Images in a row in another light, after which the background is learned anew."""


@dataclass(frozen=True, eq=False)
class _Memory(FrozenState):
    """The state of a `BackgroundSubtractionSystem`.

    Attributes:
        background: of the model, None before the first image.
        alignment: with the background, of the images of a camera that moves.
        dark: number of images in a row that could not be used because the light has changed.
        line: the newest results, oldest first; None stands for a cycle without a new image.
        newest: the newest result, None before the first one.
    """

    background: Background | None
    alignment: Alignment
    dark: int
    line: tuple[Foreground | None, ...]
    newest: Foreground | None = None


class BackgroundSubtractionSystem(LeafSystem):
    """Segments the images of one camera, and passes the result on after the lag of the pipeline.

    .. pydrake_system::

        name: BackgroundSubtractionSystem
        input_ports:
        - color_image
        - hidden
        - displacement
        output_ports:
        - foreground
        - delayed
        - motion_energy

    ``color_image`` is an `ImageRgba8U`, read every ``period`` at offset 0 in an unrestricted update. ``hidden`` is the
    silhouette of the robot's own arm in this image, a uint8 array of the image's shape or None. ``displacement`` is the
    displacement of the hand in this image, shape (2,) [px]. Both may stay unconnected. ``foreground`` is the
    `Foreground` of the newest image, and ``delayed`` the `Foreground` of some cycles ago, each None before the first
    image. ``motion_energy`` is the newest silhouette as a `DetectionMask`, for pictures.

    With ``own_stamps`` there is the input ``frame``, a `FrameInfo`: in a cycle without a fresh image there is no
    result. There is none either for an image whose cycle is not a multiple of ``update_cycles``; it is not read.

    Args:
        model: `BackgroundModel`.
        image_offset: full-frame coordinates (u0, v0) [px] of the top left pixel of ``color_image``.
        delay_cycles: cycles from the update with an image to the output of its result at ``delayed``.
        period: of a cycle [s].
        image_latency: cycles from the capture of an image until the input shows it, as with a `PipelinedCamera`.
        own_stamps: whether there is the input ``frame``.
        camera_motion: settings of the detection of motion of the camera itself.
        update_cycles: cycles from one image that is looked at to the next.

    Raises DrakeTrackerError when the delay is negative.
    """

    def __init__(
        self,
        model: BackgroundModel,
        *,
        image_offset: tuple[int, int] = (0, 0),
        delay_cycles: int = 0,
        period: float = VISION_PERIOD,
        image_latency: int = 0,
        own_stamps: bool = False,
        camera_motion: CameraMotion = CameraMotion(),
        update_cycles: int = 1,
    ) -> None:
        super().__init__()
        if delay_cycles < 0:
            raise DrakeTrackerError(f"delay_cycles is {delay_cycles}; it must be 0 or more")
        self._model, self._period, self._update_cycles = model, period, update_cycles
        self._alignment = ImageAlignment(camera_motion)
        self._length, self._latency = int(delay_cycles) + 1, image_latency
        self._image_offset = (int(image_offset[0]), int(image_offset[1]))
        self._image = self.DeclareAbstractInputPort("color_image", AbstractValue.Make(ImageRgba8U()))
        self._hidden = self.DeclareAbstractInputPort("hidden", AbstractValue.Make(object()))
        self._displacement = self.DeclareVectorInputPort("displacement", 2)
        self._frame = self.DeclareVectorInputPort("frame", message_size(FrameInfo)) if own_stamps else None
        self._memory = self.DeclareAbstractState(AbstractValue.Make(_Memory(None, self._alignment.start(), 0, ())))
        ticket = {self.abstract_state_ticket(self._memory)}
        nothing = DetectionMask(0.0, read_only(np.zeros((1, 1), np.uint8)), self._image_offset)

        def port(name: str, calc: Any, value: Any) -> None:
            self.DeclareAbstractOutputPort(name, lambda: AbstractValue.Make(value), calc, ticket)

        port("foreground", self._calc_foreground, object())
        port("delayed", self._calc_delayed, object())
        port("motion_energy", self._calc_motion_energy, nothing)
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._update)

    def _update(self, context: Context, state: State) -> None:
        time = capture_time(context.get_time(), self._latency, self._period)
        cycle = round(time / self._period)
        if cycle < 0:
            return
        memory = context.get_abstract_state(self._memory).get_value()
        found = None
        frame = None if self._frame is None else FrameInfo(self._frame.Eval(context))
        if cycle % self._update_cycles == 0 and (frame is None or frame.fresh):
            hidden = self._hidden.Eval(context) if self._hidden.HasValue(context) else None
            image = self._model.smooth(cv2.cvtColor(self._image.Eval(context).data, cv2.COLOR_RGBA2RGB))
            stamp = time if frame is None else float(frame.stamp)
            memory, found = self._segmented(memory, image, hidden, stamp)
            if self._displacement.HasValue(context):
                found = replace(found, hand=read_only(self._displacement.Eval(context)))
        line = (*memory.line, found)[-self._length :]
        state.get_mutable_abstract_state(self._memory).set_value(
            replace(memory, line=line, newest=found or memory.newest)
        )

    def _segmented(
        self, memory: _Memory, image: np.ndarray, hidden: np.ndarray | None, stamp: float
    ) -> tuple[_Memory, Foreground]:
        """Returns the memory after an image, and the foreground of the image.

        Args:
            memory: the memory before.
            image: smoothed, uint8 (h, w, 3).
            hidden: silhouette of the arm, or None.
            stamp: capture time [s].
        """
        background, alignment = memory.background, memory.alignment
        seen = AlignedImage(image, None, None, Verdict.STILL, 0.0)
        usable, other_light = True, False
        if background is None or memory.dark > LONGEST_DARK:
            # Nothing is known of the scene in this light. A scene that is another for a different reason is never
            # learned: the camera may have been moved, and its calibration be wrong.
            background, alignment = self._model.start(image), self._alignment.start()
        else:
            difference = self._model.difference(background, image)
            alignment, seen = self._alignment.update(alignment, background, image, difference, hidden)
            usable, other_light = seen.verdict is not Verdict.UNUSABLE, seen.reason is UnusableReason.LIGHT
            if usable:
                unseen = hidden if seen.missing is None else seen.missing
                if hidden is not None and seen.missing is not None:
                    unseen = cv2.bitwise_or(hidden, seen.missing)
                background, usable = self._model.update(
                    background, seen.image, unseen, seen.tolerance, difference if seen.image is image else None
                )
                other_light = not usable
        found = Foreground(
            stamp,
            seen.image,
            background.mask,
            background.moving,
            self._image_offset,
            hidden,
            usable,
            seen.verdict,
            seen.displacement,
            None if seen.missing is None else read_only(seen.missing),
            background.border,
        )
        dark = memory.dark + 1 if other_light else 0
        return replace(memory, background=background, alignment=alignment, dark=dark), found

    def _line(self, context: Context) -> tuple[Foreground | None, ...]:
        line: tuple[Foreground | None, ...] = context.get_abstract_state(self._memory).get_value().line
        return line

    def _calc_foreground(self, context: Context, output: AbstractValue) -> None:
        line = self._line(context)
        output.set_value(line[-1] if line else None)

    def _calc_delayed(self, context: Context, output: AbstractValue) -> None:
        line = self._line(context)
        output.set_value(line[0] if len(line) == self._length else None)

    def _calc_motion_energy(self, context: Context, output: AbstractValue) -> None:
        newest = context.get_abstract_state(self._memory).get_value().newest
        if newest is None:
            output.set_value(DetectionMask(0.0, read_only(np.zeros((1, 1), np.uint8)), self._image_offset))
        else:
            output.set_value(DetectionMask(newest.stamp, newest.mask, self._image_offset))
