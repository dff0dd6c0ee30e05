"""A bank of estimators as a Drake System: one for each tracked object."""

import math
from dataclasses import dataclass, field
from operator import attrgetter
from typing import Any

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, LeafSystem, State

from drake_tracker.core.frozen_state import FrozenState, declare_outputs, read_only
from drake_tracker.core.messages import (
    EXPECTED_FIELDS,
    KNOT_FIELDS,
    TARGET_STRIDE,
    TRACK_FIELDS,
    Filtered,
    Prediction,
    TrackPoint,
    TrackPoints,
    TrackPredictions,
    TrackState,
    message_rows,
    message_size,
    prediction_knots,
)
from drake_tracker.core.timing import ESTIMATOR_SLOT, VISION_PERIOD, vision_slot
from drake_tracker.estimation.estimator import Estimator, EstimatorState
from drake_tracker.estimation.estimator_system import make_packet, predict_path
from drake_tracker.estimation.point_check import NO_TRAIL, heading_at_rest, passed, refuse_point

_NUMBER, _STATE, _X, _SEEN, _YAW, _YAW_KNOWN = (
    TRACK_FIELDS.index(name) for name in ("number", "state", "x", "seen", "yaw", "yaw_known")
)
_UNSEEN = (TrackState.OCCLUDED, TrackState.NOT_OBSERVED, TrackState.OUT_OF_VIEW)
"""States in which the fixed cameras do not see an object. A camera on the hand may have seen it."""
_VELOCITY_STEP = 0.01
"""Time step from which the velocity of a predicted path is taken [s]."""


@dataclass(frozen=True, eq=False)
class BankMember(FrozenState):
    """The estimator of one track.

    Attributes:
        estimate: state of the estimator.
        stamp: newest stamp offered to the estimator [s].
        trail: the last places (x, y) in W that the object passed, shape (n, 2) [m].
    """

    estimate: EstimatorState
    stamp: float = -math.inf
    trail: np.ndarray = field(default_factory=lambda: NO_TRAIL)


@dataclass(frozen=True, eq=False)
class BankMemory(FrozenState):
    """State of an `EstimatorBankSystem`.

    Attributes:
        members: {number of a track: its estimator}; never changed after it was made.
        target: number of the track of which the packets are, 0 without one.
        seq: number of packets made so far.
        packet: the newest `Prediction` vector, read-only.
        filtered: the newest `Filtered` vector, read-only.
        expected: the newest `TrackPredictions` vector, read-only.
    """

    members: dict[int, BankMember]
    target: int
    seq: int
    packet: np.ndarray
    filtered: np.ndarray
    expected: np.ndarray


class EstimatorBankSystem(LeafSystem):
    """Runs one estimator for each track, and outputs the predictions of the target's.

    .. pydrake_system::

        name: EstimatorBankSystem
        input_ports:
        - tracks
        output_ports:
        - prediction
        - filtered
        - expected

    - ``tracks``: a `TrackPoints` vector, read at each update. The estimator of a track is updated with its position
      where the object was seen at the stamp of the message, also if it stands. It is dropped with its track.
    - ``prediction`` and ``filtered``: as those of `EstimatorSystem`, for the target. When another track becomes the
      target, the next packet belongs to that track. The number of packets so far goes on counting; ``seq`` is this
      number plus `TARGET_STRIDE` times the number of the track, so that the arm knows which object a packet is about.
      An object at rest keeps the direction of the last piece of its path (`point_check.heading_at_rest`).
    - ``expected``: a `TrackPredictions` vector for vision, with the tracks that were not seen at the newest stamp and
      whose estimators are ready.

    The System is updated every ``period``, after ``offset``. All outputs depend on the state alone.

    Args:
        estimator: the estimator, which keeps no state of its own and serves all tracks.
        period: period of the update [s].
        offset: time of the first update [s].
    """

    def __init__(
        self,
        estimator: Estimator[Any],
        *,
        period: float = VISION_PERIOD,
        offset: float = vision_slot(ESTIMATOR_SLOT),
    ) -> None:
        super().__init__()
        self._estimator, self._period = estimator, period
        packet, filtered, expected = (
            read_only(np.zeros(message_size(view))) for view in (Prediction, Filtered, TrackPredictions)
        )
        state = self.DeclareAbstractState(AbstractValue.Make(BankMemory({}, 0, 0, packet, filtered, expected)))
        self._tracks = self.DeclareVectorInputPort("tracks", message_size(TrackPoints))
        outputs = {
            "prediction": (Prediction, attrgetter("packet")),
            "filtered": (Filtered, attrgetter("filtered")),
            "expected": (TrackPredictions, attrgetter("expected")),
        }
        declare_outputs(self, state, outputs)
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, offset, self._update)

    def _update(self, context: Context, state: State) -> None:
        memory: BankMemory = state.get_abstract_state(0).get_value()
        message = self._tracks.Eval(context)
        header = TrackPoints(message)
        if not header.valid or not np.isfinite([header.stamp, header.target]).all():
            return
        rows = [row for row in message_rows(message, TRACK_FIELDS) if np.isfinite(row[_NUMBER]) and row[_NUMBER] > 0.0]
        members, updated, standing = {}, set(), {}
        for row in rows:
            number = int(row[_NUMBER])
            member = memory.members.get(number) or BankMember(self._estimator.initial_state())
            newest = self._updated(member, row, header.stamp, context.get_time())
            if newest is not member:
                updated.add(number)
            members[number] = newest
            if row[_STATE] == TrackState.STANDING:
                standing[number] = row
        target = int(header.target)
        seq, packet, filtered = memory.seq, memory.packet, memory.filtered
        if target in updated and self._estimator.ready(members[target].estimate):
            seq += 1
            packet, filtered = make_packet(self._estimator, members[target].estimate, target * TARGET_STRIDE + seq)
            if target in standing:
                row = standing[target]
                yaw = float(row[_YAW]) if row[_YAW_KNOWN] else None
                packet, filtered = at_rest(packet, filtered, members[target].trail, row[_X : _X + 2], yaw)
        expected = self._expected(members, rows, header.stamp)
        state.get_mutable_abstract_state(0).set_value(
            BankMemory(members, target, seq, read_only(packet), read_only(filtered), read_only(expected))
        )

    def _updated(self, member: BankMember, row: np.ndarray, stamp: float, time: float) -> BankMember:
        """Returns the estimator of a track after a message, the same object when there is no new point."""
        p_WQ = row[_X : _X + 3].copy()
        point = TrackPoint(np.array([stamp, *p_WQ, 0.0, 1.0]))
        if (
            not np.isfinite(row).all()
            or row[_SEEN] < stamp
            or stamp <= member.stamp
            or refuse_point(point[:], time, self._period)
        ):
            return member
        moves = row[_STATE] != TrackState.STANDING
        trail = passed(member.trail, float(p_WQ[0]), float(p_WQ[1])) if moves else member.trail
        return BankMember(self._estimator.update(member.estimate, stamp, p_WQ), stamp, trail)

    def _expected(self, members: dict[int, BankMember], rows: list[np.ndarray], stamp: float) -> np.ndarray:
        """Returns the `TrackPredictions` of the tracks that were not seen at a stamp [s], for the next one."""
        message = np.zeros(message_size(TrackPredictions))
        time = stamp + self._period
        TrackPredictions(message).time = time
        lost = [int(row[_NUMBER]) for row in rows if row[_SEEN] < stamp or row[_STATE] in _UNSEEN]
        for slot, number in zip(message_rows(message, EXPECTED_FIELDS), lost):
            estimate = members[number].estimate
            if self._estimator.ready(estimate):
                path, std = predict_path(self._estimator, estimate, np.array([time, time + _VELOCITY_STEP]))
                velocity = (path[1, :3] - path[0, :3]) / _VELOCITY_STEP
                slot[:] = [number, *path[0, :3], *velocity, std[0]]
        return message


def at_rest(
    packet: np.ndarray, filtered: np.ndarray, trail: np.ndarray, place: np.ndarray, yaw: float | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the packet and the filtered state of an object that stands, with the direction in which it lies.

    The images show this direction. If they do not, it is the one that the object's trail tells.

    Args:
        packet: a `Prediction` vector.
        filtered: the `Filtered` vector that belongs to it.
        trail: the last places that the object passed, shape (n, 2) [m].
        place: where it is seen, shape (2,) [m]. The filter may still be on its way to that place.
        yaw: direction that the images show, up to half a turn [rad], None if they do not.
    """
    packet, filtered = packet.copy(), filtered.copy()
    state = Filtered(filtered)
    if yaw is None:
        turn = heading_at_rest(trail, float(place[0]), float(place[1]), state.yaw) - state.yaw
    else:
        turn = math.remainder(yaw - state.yaw, math.pi)
    prediction_knots(packet)[:, KNOT_FIELDS.index("yaw")] += turn
    state.yaw += turn
    return packet, filtered
