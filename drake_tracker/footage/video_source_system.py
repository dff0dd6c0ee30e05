"""Footage as a Drake System, in place of a simulated camera."""

from functools import partial

import cv2
import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import BasicVector, Context, LeafSystem
from pydrake.systems.sensors import ImageGrey8U, ImageRgba8U

from drake_tracker.core.messages import FrameInfo, message_size
from drake_tracker.footage.frame_sequence import FrameSequence, Tick

_BEFORE = 0.125
"""Fraction of a period by which a reader may be early and still read the tick that is due."""


class VideoSource(LeafSystem):
    """Outputs the images of one camera, one per tick.

    .. pydrake_system::

        name: VideoSource
        output_ports:
        - image
        - grey
        - frame

    ``image`` is an `ImageRgba8U`, the newest image captured; ``grey`` an `ImageGrey8U`, the same without colours, which
    costs much less; ``frame`` is a `FrameInfo` vector: its own stamp [s], and whether it was captured in this tick. In
    a tick without a new image, the previous image is kept, and the stamp is the time of the tick. Both are functions of
    time alone: they have no state, no period and no offset, and are never all zeros, except that the image is black
    before the first one. The footage is read in order, so that a Context that goes back in time makes a file be read
    again from its beginning.

    Args:
        sequence: the images by tick.
        period: of the ticks [s].
    """

    def __init__(self, sequence: FrameSequence, period: float) -> None:
        super().__init__()
        self._sequence, self._period = sequence, period
        width, height = sequence.footage.size
        self.DeclareAbstractOutputPort(
            "image", partial(AbstractValue.Make, ImageRgba8U(width, height)), self._calc_image, {self.time_ticket()}
        )
        self.DeclareAbstractOutputPort(
            "grey", partial(AbstractValue.Make, ImageGrey8U(width, height)), self._calc_grey, {self.time_ticket()}
        )
        self.DeclareVectorOutputPort("frame", message_size(FrameInfo), self._calc_frame, {self.time_ticket()})

    def _tick(self, context: Context) -> Tick:
        return self._sequence.at(int(np.floor(context.get_time() / self._period + _BEFORE)))

    def _calc_image(self, context: Context, output: AbstractValue) -> None:
        cv2.cvtColor(self._tick(context).image, cv2.COLOR_RGB2RGBA, dst=output.get_mutable_value().mutable_data)

    def _calc_grey(self, context: Context, output: AbstractValue) -> None:
        output.get_mutable_value().mutable_data[:, :, 0] = self._tick(context).grey

    def _calc_frame(self, context: Context, output: BasicVector) -> None:
        tick = self._tick(context)
        output.SetFromVector([tick.stamp, float(tick.fresh)])
