"""The camera on the hand as a Drake System: its measurement of the target, fused with that of the fixed cameras."""

from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import BasicVector, Context, DiagramBuilder, LeafSystem, OutputPort, State, System
from pydrake.systems.sensors import ImageRgba8U

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.frozen_state import FrozenState, read_only
from drake_tracker.core.messages import (
    TRACK_FIELDS,
    JawState,
    Prediction,
    TrackPoint,
    TrackPoints,
    WristPoint,
    evaluate_prediction,
    message_rows,
    message_size,
    packet_target,
    prediction_end,
)
from drake_tracker.core.timing import LAG_CYCLES, VISION_PERIOD, WRIST_SLOT, capture_time, vision_slot
from drake_tracker.vision.fusion import fuse
from drake_tracker.vision.hand_view import HandView
from drake_tracker.vision.target import Reason
from drake_tracker.vision.wrist_view import (
    Appearance,
    Expectation,
    FixedPoint,
    WristMeasurement,
    WristReason,
    WristView,
    nothing,
)

_NUMBER, _X, _XX, _GAP, _SEEN, _SIZE = (
    TRACK_FIELDS.index(name) for name in ("number", "x", "xx", "gap", "seen", "size")
)
_UPPER = np.triu_indices(3)
FIXED, WRIST = 1, 2
"""Sources of a point; their sum means both."""


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
    """What is held back until the lag has passed, oldest first.

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
    appearance: Appearance | None
    point: np.ndarray
    tracks: np.ndarray
    wrist: np.ndarray


class WristParts(NamedTuple):
    """What a camera on the hand needs.

    Attributes:
        view: finds the object in its images.
        hand: the camera and the hand.
        held_width: opening of the jaws up to which they hold or have missed the object [m].
    """

    view: WristView
    hand: HandView
    held_width: float


class WristViewSystem(LeafSystem):
    """Finds the target in the images of a camera on the hand, and adds this measurement to those of the fixed cameras.

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

    The outputs ``tracks`` and ``point`` are those of the fixed cameras, with the fused position and covariance of the
    target where the camera on the hand measures it. ``wrist`` is a `WristPoint`. All depend on the state alone.

    Args:
        view: the arithmetic.
        hand: the camera and the hand.
        held_width: opening of the jaws up to which they hold or have missed the object [m]; nothing is measured then.
        lag_cycles: cycles from the capture of an image until its measurement.
        image_latency: cycles from the capture of an image until the input shows it, as with a `PipelinedCamera`.
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
        period: float = VISION_PERIOD,
        offset: float = vision_slot(WRIST_SLOT),
    ) -> None:
        super().__init__()
        if lag_cycles < image_latency:
            raise DrakeTrackerError(f"a lag of {lag_cycles} cycles is shorter than the latency of the images")
        self._view, self._hand, self._held_width = view, hand, held_width
        self._lag, self._latency, self._period = lag_cycles, image_latency, period
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
        ticket = {self.abstract_state_ticket(self._memory)}
        for name, message in views.items():

            def calc(context: Context, output: BasicVector, name: str = name) -> None:
                output.SetFromVector(getattr(context.get_abstract_state(self._memory).get_value(), name))

            self.DeclareVectorOutputPort(name, message_size(message), calc, ticket)
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._take_in)
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, offset, self._update)

    def _take_in(self, context: Context, state: State) -> None:
        """Appends the hand of this cycle and the image that the input shows."""
        lines: WristLines = context.get_abstract_state(self._lines).get_value()
        width = JawState(self._jaws.Eval(context)).width
        hand = read_only(np.array([*self._arm_state.Eval(context)[: self._hand.num_joints], width]))
        stamp, shot = capture_time(context.get_time(), self._latency, self._period), None
        if self._image.HasValue(context) and round(stamp / self._period) >= 0:
            image = cv2.cvtColor(self._image.Eval(context).data, cv2.COLOR_RGBA2GRAY)
            camera = self._hand.camera
            if camera.distortion.any():
                image = cv2.undistort(image, camera.K, camera.distortion)
            shot = Shot(stamp, read_only(image))
        state.get_mutable_abstract_state(self._lines).set_value(
            WristLines((*lines.hands, hand)[-self._lag - 1 :], (*lines.shots, shot)[-(self._lag - self._latency) - 1 :])
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
        row = next((row for row in message_rows(tracks, TRACK_FIELDS) if target and row[_NUMBER] == target), None)
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
        appearance: Appearance | None,
        stamp: float,
        expected: Expectation | None,
        fixed: FixedPoint | None,
    ) -> tuple[Appearance | None, WristMeasurement]:
        """Returns the appearance and the measurement after the image of a stamp [s]."""
        whole = len(lines.hands) == self._lag + 1 and len(lines.shots) == self._lag - self._latency + 1
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


def expectation(packet: np.ndarray | None, target: int, stamp: float) -> Expectation | None:
    """Returns where a packet predicts an object, None if it does not.

    Args:
        packet: a `Prediction` vector, or None.
        target: number of the object's track.
        stamp: time of the prediction [s].
    """
    if packet is None or not Prediction(packet).valid or packet_target(Prediction(packet).seq) != target:
        return None
    if not Prediction(packet).stamp <= stamp <= prediction_end(packet):
        return None
    x, y, z, yaw, _ = evaluate_prediction(packet, stamp)
    return Expectation(np.array([x, y, z]), float(yaw))


def fixed_point(row: np.ndarray, stamp: float) -> FixedPoint | None:
    """Returns what the fixed cameras measured of a track, None if they did not see it at a stamp [s].

    Args:
        row: the track, with the fields `TRACK_FIELDS`.
        stamp: of the message [s].
    """
    if row[_SEEN] < stamp or not np.isfinite(row).all():
        return None
    covariance = np.zeros((3, 3))
    covariance[_UPPER] = row[_XX : _XX + 6]
    covariance = covariance + np.triu(covariance, 1).T
    return FixedPoint(row[_X : _X + 3].copy(), covariance, float(row[_SIZE]))


def fused(
    tracks: np.ndarray, point: np.ndarray, target: int, fixed: FixedPoint | None, measured: WristMeasurement
) -> tuple[np.ndarray, np.ndarray, int]:
    """Returns the tracks and the point of the target with the measurement of the camera on the hand.

    Args:
        tracks: a `TrackPoints` vector of the fixed cameras.
        point: a `TrackPoint` vector of theirs.
        target: number of the target's track, 0 without one.
        fixed: what they measured of the target, None for nothing.
        measured: what the camera on the hand measured.

    Returns (tracks, point, source): vectors of the same types, and the sum of `FIXED` and `WRIST`, each if it was used.
    """
    if measured.reason is not WristReason.VALID:
        return tracks.copy(), point.copy(), FIXED if fixed is not None else 0
    both = [(measured.p_WQ, measured.covariance)]
    if fixed is not None:
        both.append((fixed.p_WQ, fixed.covariance))
    p_WQ, covariance = fuse(both)
    tracks, stamp = tracks.copy(), TrackPoints(tracks).stamp
    TrackPoints(tracks).reason = Reason.NONE
    for row in message_rows(tracks, TRACK_FIELDS):
        if row[_NUMBER] == target:
            row[_X : _X + 3], row[_XX : _XX + 6], row[_SEEN] = p_WQ, covariance[_UPPER], stamp
            gap = row[_GAP]
    fused_point = np.array([stamp, *p_WQ, gap, 1.0])
    return tracks, fused_point, WRIST + (FIXED if fixed is not None else 0)


def pack_wrist(stamp: float, measured: WristMeasurement, source: int) -> np.ndarray:
    """Returns the `WristPoint` vector of a measurement.

    Args:
        stamp: of the image [s].
        measured: what the camera on the hand measured.
        source: what the point of the target comes from.
    """
    valid = measured.reason is WristReason.VALID
    return np.array(
        [stamp, *measured.p_WQ, *measured.covariance[_UPPER], measured.correlation, measured.reason, source, valid],
        dtype=float,
    )


def add_wrist_view(
    builder: DiagramBuilder,
    tracking: System,
    parts: WristParts,
    *,
    lag_cycles: int,
    image_latency: int,
    period: float,
    time_step: float,
    shares_arm: bool,
) -> dict[str, OutputPort]:
    """Adds a `WristViewSystem` behind a `TrackerSystem`, and exports its inputs.

    Args:
        builder: of the vision.
        tracking: the `TrackerSystem`.
        parts: the camera and what finds the object.
        lag_cycles: as for `WristViewSystem`.
        image_latency: as for `WristViewSystem`.
        period: of a cycle [s].
        time_step: the plant's step [s].
        shares_arm: whether the vision has the inputs ``arm_state`` and ``jaws`` already.

    Returns {name: output port} of the outputs that it adds to those of the tracker, or that take their place.
    """
    system = builder.AddNamedSystem(
        "wrist_view",
        WristViewSystem(
            parts.view,
            parts.hand,
            held_width=parts.held_width,
            lag_cycles=lag_cycles,
            image_latency=image_latency,
            period=period,
            offset=vision_slot(WRIST_SLOT, time_step),
        ),
    )
    builder.Connect(tracking.GetOutputPort("tracks"), system.GetInputPort("tracks"))
    builder.Connect(tracking.GetOutputPort("point"), system.GetInputPort("fixed_point"))
    for name in ("camera_wrist", "prediction", "arm_state", "jaws"):
        port = system.GetInputPort(name)
        if shares_arm and name in ("arm_state", "jaws"):
            builder.ConnectInput(name, port)
        else:
            builder.ExportInput(port, name)
    return {name: system.GetOutputPort(name) for name in ("point", "tracks", "wrist")}
