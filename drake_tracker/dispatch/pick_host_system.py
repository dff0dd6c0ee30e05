"""The host of the conveyor as a System: parts on the belt in, orders and packets of predicted path out."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from operator import attrgetter

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, LeafSystem, State

from drake_tracker.core.belt_frame import BeltFrame
from drake_tracker.core.frozen_state import FrozenState, declare_outputs, read_only
from drake_tracker.core.messages import (
    BELT_FIELDS,
    KNOT_COUNT,
    KNOT_SPACING,
    TARGET_STRIDE,
    BeltEstimate,
    EncoderReading,
    EncoderReport,
    PartTracks,
    PickDiagnosis,
    PickOrder,
    Prediction,
    ToolStatus,
    message_rows,
    message_size,
    pack_prediction,
)
from drake_tracker.core.part_kinds import PART_SHAPES, PartKind
from drake_tracker.core.timing import ESTIMATOR_SLOT, VISION_PERIOD, vision_slot
from drake_tracker.dispatch.candidate import Candidate, jaw_clearance, seen_parts
from drake_tracker.dispatch.encoder_history import EncoderCheck, EncoderHistory
from drake_tracker.dispatch.order_tracker import OrderClerk, OrderTracker, report_of
from drake_tracker.estimation.belt import BeltEstimator, BeltState, PartPath, PartPoint, Travel

FREE = 1.0
"""Clearance of a part without neighbours [m]."""
_KNOTS = KNOT_SPACING * np.arange(KNOT_COUNT)


@dataclass(frozen=True)
class CellPose:
    """Where a part belongs: its middle in the middle of the cell.

    Attributes:
        x: middle of the cell in W [m].
        y: middle of the cell in W [m].
        floor: z_W of its floor [m].
        yaw: direction of x_P of a part in it [rad].
    """

    x: float
    y: float
    floor: float
    yaw: float


@dataclass(frozen=True, eq=False)
class HostMemory(FrozenState):
    """State of a `PickHostSystem`.

    Attributes:
        belt: the estimate.
        encoder: readings of the encoder.
        check: whether they agree with vision.
        encoder_report: the newest `EncoderReport` vector, read-only.
        book: the orders.
        seq: number of packets made so far.
        packet: the newest `Prediction` vector, read-only.
        order: the newest `PickOrder` vector, read-only.
        estimate: the newest `BeltEstimate` vector, read-only.
    """

    belt: BeltState = BeltState()
    encoder: EncoderHistory = EncoderHistory()
    check: EncoderCheck = EncoderCheck()
    encoder_report: np.ndarray = field(default_factory=lambda: read_only(np.zeros(message_size(EncoderReport))))
    book: OrderTracker = OrderTracker()
    seq: int = 0
    packet: np.ndarray = field(default_factory=lambda: read_only(np.zeros(message_size(Prediction))))
    order: np.ndarray = field(default_factory=lambda: read_only(np.zeros(message_size(PickOrder))))
    estimate: np.ndarray = field(default_factory=lambda: read_only(np.zeros(message_size(BeltEstimate))))


class PickHostSystem(LeafSystem):
    """Estimates where the parts are, and tells the arm which one to pick.

    .. pydrake_system::

        name: PickHostSystem
        input_ports:
        - parts
        - encoder
        - diagnosis
        - status
        output_ports:
        - prediction
        - order
        - belt
        - encoder_report

    - ``parts``: a `PartTracks` vector, read at each update.
    - ``encoder``: an `EncoderReading` of the present time.
    - ``diagnosis``: the arm's `PickDiagnosis`, and ``status``: its `ToolStatus`: what it works on, and where it is.
    - ``prediction``: a `Prediction` of the part that the arm is to pick.
    - ``order``: a `PickOrder`, repeated in every period. All zeros: no order yet.
    - ``belt``: a `BeltEstimate` for the present, for logs and displays.
    - ``encoder_report``: an `EncoderReport`. The ports of the encoder exist only if the belt has one.

    The System is updated every ``period``, after ``offset``. All outputs depend on the state alone.

    Args:
        estimator: of the belt.
        clerk: makes the orders.
        cells: poses of the cells, in the order of those of the clerk.
        seeking: phases of the arm in which it has not yet begun to descend.
        carrying: phases of the arm in which it carries a part, puts it down or comes back.
        period: period of the update [s].
        offset: time of the first update [s].
        has_encoder: whether the belt has an encoder.
        frame: of the belt, in which the host estimates and decides.
    """

    def __init__(
        self,
        estimator: BeltEstimator,
        clerk: OrderClerk,
        cells: Sequence[CellPose],
        seeking: Sequence[int],
        carrying: Sequence[int],
        *,
        period: float = VISION_PERIOD,
        offset: float = vision_slot(ESTIMATOR_SLOT),
        has_encoder: bool = False,
        frame: BeltFrame = BeltFrame(),
    ) -> None:
        super().__init__()
        self._estimator, self._clerk, self._cells = estimator, clerk, tuple(cells)
        self._seeking, self._carrying, self._frame = tuple(seeking), tuple(carrying), frame
        self._parts = self.DeclareVectorInputPort("parts", message_size(PartTracks))
        self._encoder = self.DeclareVectorInputPort("encoder", message_size(EncoderReading)) if has_encoder else None
        self._diagnosis = self.DeclareVectorInputPort("diagnosis", message_size(PickDiagnosis))
        self._status = self.DeclareVectorInputPort("status", message_size(ToolStatus))
        state = self.DeclareAbstractState(AbstractValue.Make(HostMemory()))
        outputs = {
            "prediction": (Prediction, attrgetter("packet")),
            "order": (PickOrder, attrgetter("order")),
            "belt": (BeltEstimate, attrgetter("estimate")),
        }
        if has_encoder:
            outputs["encoder_report"] = (EncoderReport, attrgetter("encoder_report"))
        declare_outputs(self, state, outputs)
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, offset, self._update)

    def _update(self, context: Context, state: State) -> None:
        memory: HostMemory = state.get_abstract_state(0).get_value()
        now = context.get_time()
        stamp, points = seen_parts(self._parts.Eval(context), memory.belt.stamp, now)
        points = [_in_frame(each, self._frame) for each in points]
        readings, check, encoder_report = memory.encoder, memory.check, memory.encoder_report
        encoder = readings
        if self._encoder is not None:
            encoder = readings = readings.extended(EncoderReading(self._encoder.Eval(context)))
            places = {each.number: each.y for each in points if each.number not in memory.book.picked}
            check = check if stamp is None else check.after(stamp, places, readings)
            if now < check.doubted_until:
                encoder = EncoderHistory()
        belt = memory.belt
        if stamp is not None:
            belt = self._estimator.update(belt, stamp, points, encoder.travel(belt.stamp, stamp))
        travel = encoder.travel(belt.stamp, now)
        if self._encoder is not None:
            unused = travel is None and math.isfinite(belt.stamp)
            encoder_report = np.array([not unused, EncoderReport(encoder_report).unused_cycles + unused], float)
        candidates = self._candidates(belt, travel, now)
        report = report_of(
            PickDiagnosis(self._diagnosis.Eval(context)),
            ToolStatus(self._status.Eval(context)),
            self._seeking,
            self._carrying,
        )
        book = self._clerk.update(memory.book, report, candidates, now)
        seq, packet = memory.seq, memory.packet
        if book.order is not None and book.order.number in belt.numbers and belt.stamp > memory.belt.stamp:
            seq += 1
            packet = self._packet(belt, encoder, book.order.number, seq, now)
        order = self._order(book, memory.order, now)
        estimate = self._estimate(belt, candidates, now)
        state.get_mutable_abstract_state(0).set_value(
            HostMemory(
                belt,
                readings,
                check,
                read_only(encoder_report),
                book,
                seq,
                read_only(packet),
                read_only(order),
                read_only(estimate),
            )
        )

    def _path(self, belt: BeltState, number: int, times: np.ndarray, travel: Travel | None = None) -> PartPath:
        """Returns the predicted path of a part, see `BeltEstimator.predict`.

        A part without a direction gets the direction of a part in a cell: the hand need not turn between belt and cell.
        """
        path = self._estimator.predict(belt, number, times, travel)
        kind = next(part.kind for part in belt.parts if part.number == number)
        if PART_SHAPES[kind].turns == 0:
            path.rows[:, 3] = self._cells[0].yaw
        return path

    def _candidates(self, belt: BeltState, travel: Travel | None, now: float) -> list[Candidate]:
        """Returns the parts as they are now."""
        places = []
        for k, part in enumerate(belt.parts):
            path = self._path(belt, part.number, np.array([now]), travel)
            speed = travel.speed if travel is not None else belt.speed
            places.append((part, path.rows[0], path.std[0], speed + belt.mean[2 + 2 * k]))
        candidates = []
        for part, (x, y, _, yaw), std, speed in places:
            clear = min(
                (
                    jaw_clearance(x, y, yaw, float(row[0]), float(row[1]), PART_SHAPES[other.kind].radius)
                    for other, row, _, _ in places
                    if other.number != part.number
                ),
                default=FREE,
            )
            candidates.append(Candidate(part.number, int(part.kind), x, y, yaw, float(speed), float(std), clear))
        return candidates

    def _packet(self, belt: BeltState, encoder: EncoderHistory, number: int, seq: int, now: float) -> np.ndarray:
        """Returns the packet of a part, whose first knot is at the stamp of the estimate."""
        times = belt.stamp + _KNOTS
        travel = encoder.travel(belt.stamp, now)
        if travel is None:
            path = self._path(belt, number, times)
            rows, std = self._frame.to_world(path.rows), path.std
            return pack_prediction(belt.stamp, number * TARGET_STRIDE + seq, np.column_stack([rows, std]))
        rows, std = np.empty((KNOT_COUNT, 4)), np.empty(KNOT_COUNT)
        for k, time in enumerate(times.tolist()):  # the encoder knows how far the belt went until now
            measured = min(time, now)
            then = encoder.travel(belt.stamp, measured)
            path = self._path(belt, number, np.array([measured, time]), then)
            rows[k], std[k] = path.rows[1], path.std[1]
        rows = self._frame.to_world(rows)
        return pack_prediction(belt.stamp, number * TARGET_STRIDE + seq, np.column_stack([rows, std]))

    def _order(self, book: OrderTracker, last: np.ndarray, now: float) -> np.ndarray:
        """Returns the `PickOrder` vector of a book, all zeros before the first order."""
        vector = np.zeros(message_size(PickOrder))
        if book.seq == 0:
            return vector
        message = PickOrder(vector)
        message.stamp, message.seq, message.job, message.valid = now, PickOrder(last).seq + 1.0, book.seq, 1.0
        if book.order is not None:
            cell, shape = self._cells[book.order.cell], PART_SHAPES[PartKind(book.order.kind)]
            message.number, message.kind, message.cell = book.order.number, book.order.kind, book.order.cell
            message.width, message.height = shape.width, shape.height
            message.place_x = cell.x - shape.middle * math.cos(cell.yaw)
            message.place_y = cell.y - shape.middle * math.sin(cell.yaw)
            message.place_yaw = cell.yaw
            message.place_z = cell.floor + 0.5 * shape.height
        return vector

    def _estimate(self, belt: BeltState, candidates: Sequence[Candidate], now: float) -> np.ndarray:
        """Returns the `BeltEstimate` vector of the present."""
        vector = np.zeros(message_size(BeltEstimate))
        message = BeltEstimate(vector)
        message.stamp, message.speed, message.speed_std, message.valid = now, belt.speed, belt.speed_std, 1.0
        for slot, each, part in zip(message_rows(vector, BELT_FIELDS), candidates, belt.parts):
            yaw_std = part.yaw_var**0.5
            slot[:] = [each.number, each.kind, each.x, each.y, part.z, each.yaw, each.v, each.std, yaw_std, each.clear]
            slot[2:6] = self._frame.to_world(slot[None, 2:6])[0]
        return vector


def _in_frame(point: PartPoint, frame: BeltFrame) -> PartPoint:
    """Returns a part in the frame of the belt."""
    if frame.angle == 0.0:
        return point
    ((x, y, z, yaw),) = frame.to_belt(np.array([[point.x, point.y, point.z, point.yaw]])).tolist()
    return point._replace(x=x, y=y, z=z, yaw=yaw)
