"""The orders that the host gives to the arm: the part, the cell, and the outcome."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from drake_tracker.core.frozen_state import FrozenState
from drake_tracker.dispatch.candidate import Candidate, Cell, FreeHand
from drake_tracker.dispatch.cycle_time import CycleModel, motion_time
from drake_tracker.dispatch.dispatcher import Dispatcher, Plan, choose_plan


@dataclass(frozen=True)
class Order:
    """An order.

    Attributes:
        seq: sequence number, from 1.
        number: of the part.
        kind: of the part, a `core.part_kinds.PartKind` as a number.
        cell: number of the cell.
    """

    seq: int
    number: int
    kind: int
    cell: int


@dataclass(frozen=True)
class ArmReport:
    """The arm's report about its work.

    Attributes:
        x: of the tool in W [m].
        y: of the tool in W [m].
        done: sequence number of the last order that was carried out or failed.
        placed: number of parts put down.
        seeking: whether the hand seeks or follows the part of its order, and has not yet begun to descend.
        carrying: whether the hand carries a part or puts it down, so that it will take the next order soon.
    """

    x: float
    y: float
    done: int
    placed: int
    seeking: bool
    carrying: bool


@dataclass(frozen=True)
class OrderTracker(FrozenState):
    """The host's memory of its orders.

    Attributes:
        seq: sequence number of the newest order.
        order: the order that the arm works on, or will work on next; None without one.
        placing: the order before it, whose part the arm is putting down; None when it is not.
        filled: numbers of the cells that have a part.
        placed: number of parts put down when an order was last closed.
        free_at: time at which the hand will have put down the part of ``placing`` [s].
        picked: numbers of the parts that the arm has taken.
        plan: the newest plan.
    """

    seq: int = 0
    order: Order | None = None
    placing: Order | None = None
    filled: frozenset[int] = frozenset()
    placed: int = 0
    free_at: float = 0.0
    picked: frozenset[int] = frozenset()
    plan: Plan = Plan()


class OrderClerk:
    """Arithmetic of the orders.

    Args:
        dispatcher: decides which part is next.
        model: the arm's cycle.
        cells: the cells, in the order of their numbers.
        filling: their numbers in the order in which they are filled; None: in the order of their numbers.
    """

    def __init__(
        self, dispatcher: Dispatcher, model: CycleModel, cells: Sequence[Cell], filling: Sequence[int] | None = None
    ) -> None:
        self.dispatcher, self.model, self.cells = dispatcher, model, tuple(cells)
        self.filling = tuple(range(len(self.cells))) if filling is None else tuple(filling)

    def update(self, book: OrderTracker, arm: ArmReport, candidates: Sequence[Candidate], now: float) -> OrderTracker:
        """Returns the book after looking at the arm and at the belt.

        A part is chosen while the arm still puts down the previous part. The choice may change until the hand is free;
        then it stays, unless the part can no longer be picked in time and another one can. A hand that is already on
        its way may be faster than the model says, so that an order is withdrawn without another one only when the part
        leaves the window.

        Args:
            book: before.
            arm: what the arm says.
            candidates: the parts on the belt now.
            now: the time [s].
        """
        book = self._closed(book, arm)
        if book.order is not None and arm.carrying and book.placing is None:
            taken = book.picked | {book.order.number}
            free_at = self._free_at(book.order, arm, now)
            book = replace(book, placing=book.order, order=None, free_at=free_at, picked=taken)
        offered = [each for each in candidates if each.number not in book.picked]
        hand = self._hand(book, arm, now)
        if book.order is not None and not arm.carrying:
            if not arm.seeking:
                return book
            part = next((each for each in offered if each.number == book.order.number), None)
            if part is not None and self.model.pick_time(hand, part, now) is not None:
                return book
            worth_trying = part is not None and self.model.in_window(part, now)[1] >= now + self.model.cycle.close
        else:
            worth_trying = False
        occupied = book.filled | ({book.placing.cell} if book.placing is not None else set())
        cells = [k for k in self.filling if k not in occupied]
        free = [self.cells[k] for k in cells]
        plan = choose_plan(self.dispatcher, hand, offered, free, now) if cells else Plan()
        if plan.number is None:
            return book if worth_trying else replace(book, order=None, plan=plan)
        if book.order is not None and plan.number == book.order.number:
            return replace(book, plan=plan)
        kind = next(each.kind for each in offered if each.number == plan.number)
        order = Order(book.seq + 1, plan.number, kind, cells[0])
        return replace(book, seq=order.seq, order=order, plan=plan)

    def _closed(self, book: OrderTracker, arm: ArmReport) -> OrderTracker:
        """Returns the book without the orders that the arm has carried out, or has failed to carry out."""
        if book.placing is not None and arm.done >= book.placing.seq:
            filled = book.filled | {book.placing.cell} if arm.placed > book.placed else book.filled
            book = replace(book, placing=None, filled=filled, placed=arm.placed)
        if book.order is not None and arm.done >= book.order.seq:
            book = replace(book, order=None, placed=arm.placed)
        return book

    def _hand(self, book: OrderTracker, arm: ArmReport, now: float) -> FreeHand:
        """Returns where and when the hand will be free."""
        if book.placing is None:
            return FreeHand(arm.x, arm.y, now)
        cell = self.cells[book.placing.cell]
        return FreeHand(cell.x, cell.y, max(book.free_at, now))

    def _free_at(self, order: Order, arm: ArmReport, now: float) -> float:
        """Returns the time at which a hand that begins to carry the part of an order will have put it down [s]."""
        cycle, cell = self.model.cycle, self.cells[order.cell]
        carry = motion_time(abs(complex(cell.x - arm.x, cell.y - arm.y)), cycle.carry_speed, cycle.carry_acceleration)
        return now + carry + cycle.lower + cycle.release + cycle.rise


def report_of(diagnosis: Any, status: Any, seeking: Sequence[int], carrying: Sequence[int]) -> ArmReport:
    """Returns the report in the messages of the arm.

    Args:
        diagnosis: a `PickDiagnosis`.
        status: a `ToolStatus`.
        seeking: phases in which the hand has not yet begun to descend.
        carrying: phases in which it carries a part, puts it down or comes back.
    """
    phase = int(diagnosis.phase)
    return ArmReport(
        float(status.x),
        float(status.y),
        int(diagnosis.done),
        int(diagnosis.placed),
        phase in seeking,
        phase in carrying,
    )
