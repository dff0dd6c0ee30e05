"""The camera on the hand as a Drake System: its measurement of the target, fused with the measurement of the fixed
cameras."""

from dataclasses import dataclass
from operator import attrgetter

import cv2
import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, LeafSystem, State
from pydrake.systems.sensors import ImageRgba8U

from drake_tracker.core.frozen_state import FrozenState, declare_outputs, read_only
from drake_tracker.core.messages import (
    JawState,
    Prediction,
    TrackPoint,
    TrackPoints,
    WristPoint,
    message_size,
)
from drake_tracker.core.timing import (
    LAG_CYCLES,
    VISION_PERIOD,
    WRIST_SLOT,
    capture_time,
    lag_after_latency,
    vision_slot,
)
from drake_tracker.vision.hand.arm_silhouette import HandView
from drake_tracker.vision.hand.wrist_measurement import Expectation, FixedPoint, WristMeasurement, WristReason, nothing
from drake_tracker.vision.hand.wrist_messages import expectation, fixed_point, fused, pack_wrist, track_row
from drake_tracker.vision.hand.wrist_template import WristTemplate
from drake_tracker.vision.hand.wrist_view import WristView


@dataclass(frozen=True, eq=False)
class Shot(FrozenState):
    """An image of the camera on the hand.

    Attributes:
        stamp: capture time [s].
        image: grey, uint8 (h, w), without distortion.
    """

    stamp: float
    image: np.ndarray


@dataclass(frozen=True, eq=False)
class WristLines(FrozenState):
    """Outputs that are held back until the lag has passed, oldest first.

    Attributes:
        hands: joints and opening of the jaws of each cycle, shape (n + 1,) [rad, m].
        shots: of each cycle, None without an image.
    """

    hands: tuple[np.ndarray, ...] = ()
    shots: tuple[Shot | None, ...] = ()


@dataclass(frozen=True, eq=False)
class WristMemory(FrozenState):
    """State of a `WristViewSystem` besides its `WristLines`.

    Attributes:
        target: number of the track whose appearance is known, 0 for none.
        appearance: of the target, None while nothing is known.
        point: the newest `TrackPoint` vector, read-only.
        tracks: the newest `TrackPoints` vector, read-only.
        wrist: the newest `WristPoint` vector, read-only.
    """

    target: int
    appearance: WristTemplate | None
    point: np.ndarray
    tracks: np.ndarray
    wrist: np.ndarray


class WristViewSystem(LeafSystem):
    """Finds the target in the images of a camera on the hand, and fuses this measurement with the measurements of the
    fixed cameras.

    .. pydrake_system::

        name: WristViewSystem
        input_ports:
        - camera_wrist
        - arm_state
        - jaws
        - tracks
        - fixed_point
        - prediction
        output_ports:
        - point
        - tracks
        - wrist

    ``camera_wrist`` is an `ImageRgba8U`, and ``arm_state`` and ``jaws`` are the joints (q, v) [rad, rad/s] and a
    `JawState`; all three are read every ``period`` at offset 0. The image may stay unconnected. ``tracks`` and
    ``fixed_point`` are the `TrackPoints` and the `TrackPoint` of the fixed cameras, and ``prediction`` is the newest
    packet of the host; they are read every ``period`` at ``offset``, when the lag of the image has passed. Unconnected,
    ``prediction`` means that nothing is predicted, and nothing is measured.

    The outputs ``tracks`` and ``point`` come from the fixed cameras, with the fused position and covariance of the
    target when the camera on the hand measures it. ``wrist`` is a `WristPoint`. All depend on the state alone.

    Args:
        view: the arithmetic.
        hand: the camera and the hand.
        held_width: opening of the jaws up to which they hold or have missed the object [m]; nothing is measured then.
        lag_cycles: cycles from the capture of an image until its measurement.
        image_latency: cycles from the capture of an image until the input shows it, as with a `PipelinedCamera`.
        update_cycles: cycles from one image that is looked at to the next.
        period: of a cycle [s].
        offset: of the measurement within a cycle [s].

    Raises DrakeTrackerError when the lag is shorter than the latency.
    """

    def __init__(
        self,
        view: WristView,
        hand: HandView,
        *,
        held_width: float,
        lag_cycles: int = LAG_CYCLES,
        image_latency: int = 0,
        update_cycles: int = 1,
        period: float = VISION_PERIOD,
        offset: float = vision_slot(WRIST_SLOT),
    ) -> None:
        super().__init__()
        self._view, self._hand, self._held_width = view, hand, held_width
        self._lag, self._latency, self._period = lag_cycles, image_latency, period
        self._shots_kept = lag_after_latency(lag_cycles, image_latency) + 1
        self._update_cycles = update_cycles
        self._image = self.DeclareAbstractInputPort("camera_wrist", AbstractValue.Make(ImageRgba8U()))
        self._arm_state = self.DeclareVectorInputPort("arm_state", 2 * hand.num_joints)
        self._jaws = self.DeclareVectorInputPort("jaws", message_size(JawState))
        self._tracks = self.DeclareVectorInputPort("tracks", message_size(TrackPoints))
        self._point = self.DeclareVectorInputPort("fixed_point", message_size(TrackPoint))
        self._prediction = self.DeclareVectorInputPort("prediction", message_size(Prediction))
        self._lines = self.DeclareAbstractState(AbstractValue.Make(WristLines()))
        views = {"point": TrackPoint, "tracks": TrackPoints, "wrist": WristPoint}
        empty = {name: read_only(np.zeros(message_size(view))) for name, view in views.items()}
        self._memory = self.DeclareAbstractState(AbstractValue.Make(WristMemory(0, None, **empty)))
        declare_outputs(self, self._memory, {name: (view, attrgetter(name)) for name, view in views.items()})
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._take_in)
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, offset, self._update)

    def _take_in(self, context: Context, state: State) -> None:
        """Appends the hand of this cycle and the image that the input shows."""
        lines: WristLines = context.get_abstract_state(self._lines).get_value()
        width = JawState(self._jaws.Eval(context)).width
        hand = read_only(np.array([*self._arm_state.Eval(context)[: self._hand.num_joints], width]))
        stamp, shot = capture_time(context.get_time(), self._latency, self._period), None
        cycle = round(stamp / self._period)
        if self._image.HasValue(context) and cycle >= 0 and cycle % self._update_cycles == 0:
            image = cv2.cvtColor(self._image.Eval(context).data, cv2.COLOR_RGBA2GRAY)
            camera = self._hand.camera
            if camera.distortion.any():
                image = cv2.undistort(image, camera.K, camera.distortion)
            shot = Shot(stamp, read_only(image))
        state.get_mutable_abstract_state(self._lines).set_value(
            WristLines((*lines.hands, hand)[-self._lag - 1 :], (*lines.shots, shot)[-self._shots_kept :])
        )

    def _update(self, context: Context, state: State) -> None:
        memory: WristMemory = context.get_abstract_state(self._memory).get_value()
        tracks, point = self._tracks.Eval(context), self._point.Eval(context)
        packet = self._prediction.Eval(context) if self._prediction.HasValue(context) else None
        header = TrackPoints(tracks)
        if not header.valid or header.stamp <= TrackPoints(memory.tracks).stamp:
            return
        target = int(header.target)
        appearance = memory.appearance if target == memory.target else None
        lines: WristLines = context.get_abstract_state(self._lines).get_value()
        row = track_row(tracks, target)
        measured, found = nothing(WristReason.NO_PREDICTION), None
        if row is not None:
            found = fixed_point(row, header.stamp)
            expected = expectation(packet, target, header.stamp)
            appearance, measured = self._measured(lines, appearance, header.stamp, expected, found)
        fused_tracks, fused_point, source = fused(tracks, point, target, found, measured)
        wrist = pack_wrist(header.stamp, measured, source)
        state.get_mutable_abstract_state(self._memory).set_value(
            WristMemory(target, appearance, read_only(fused_point), read_only(fused_tracks), read_only(wrist))
        )

    def _measured(
        self,
        lines: WristLines,
        appearance: WristTemplate | None,
        stamp: float,
        expected: Expectation | None,
        fixed: FixedPoint | None,
    ) -> tuple[WristTemplate | None, WristMeasurement]:
        """Returns the appearance and the measurement after the image of a stamp [s]."""
        whole = len(lines.hands) == self._lag + 1 and len(lines.shots) == self._shots_kept
        shot = lines.shots[0] if whole else None
        if shot is None or abs(shot.stamp - stamp) > 0.5 * self._period:
            return appearance, nothing(WristReason.NO_IMAGE)
        if expected is None:
            return appearance, nothing(WristReason.NO_PREDICTION)
        *q, width = lines.hands[0]
        if width <= self._held_width:
            return appearance, nothing(WristReason.JAWS_CLOSED)
        image, seen = shot.image.astype(np.float32), self._hand.scene(width)
        return self._view.measure(appearance, image, seen, self._hand.at(np.array(q)), expected, fixed)
