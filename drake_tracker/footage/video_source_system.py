"""Footage as a Drake System, in place of the simulated cameras."""

from functools import partial

import cv2
import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import LeafSystem
from pydrake.systems.sensors import ImageRgba8U

from drake_tracker.core.messages import FrameInfo, message_size

_BEFORE = 0.125
"""Part of a period by which a reader may come early and still read the tick that is due."""


class VideoSource(LeafSystem):
    """Shows the images of one camera, one a tick.

    .. pydrake_system::

        name: VideoSource
        output_ports:
        - image
        - frame

    ``image`` is an `ImageRgba8U`, the newest image taken; ``frame`` is a `FrameInfo`: its own stamp [s], and whether it
    was taken in this tick. Where none was, the image before stays, and the stamp is the tick's. Both are functions of
    the time alone: the footage is on disk, or is what the camera sees. It is read in order, so that a Context that goes
    back in time makes a file be read anew from its beginning.

    Args:
        sequence: `FrameSequence`. period: of its ticks [s].
    """

    def __init__(self, sequence, period):
        super().__init__()
        self._sequence, self._period = sequence, period
        width, height = sequence.footage.size
        self.DeclareAbstractOutputPort(
            "image", partial(AbstractValue.Make, ImageRgba8U(width, height)), self._calc_image, {self.time_ticket()}
        )
        self.DeclareVectorOutputPort("frame", message_size(FrameInfo), self._calc_frame, {self.time_ticket()})

    def _tick(self, context):
        return self._sequence.at(int(np.floor(context.get_time() / self._period + _BEFORE)))

    def _calc_image(self, context, output):
        cv2.cvtColor(self._tick(context).image, cv2.COLOR_RGB2RGBA, dst=output.get_mutable_value().mutable_data)

    def _calc_frame(self, context, output):
        tick = self._tick(context)
        output.SetFromVector([tick.stamp, float(tick.fresh)])
