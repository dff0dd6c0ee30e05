"""The orders of a host, followed through picks, failures and withdrawals."""

from dataclasses import replace

import pytest

from drake_tracker.core.messages import PickDiagnosis, ToolStatus, message_size
from drake_tracker.dispatch.candidate import Candidate, Cell
from drake_tracker.dispatch.config import CycleTime, Eligibility, NearestDeadline, PickWindow
from drake_tracker.dispatch.cycle_time import CycleModel
from drake_tracker.dispatch.dispatcher import make_dispatcher
from drake_tracker.dispatch.order_tracker import ArmReport, OrderClerk, OrderTracker, report_of

CELLS = [Cell(0.345, 0.19), Cell(0.41, 0.19), Cell(0.345, 0.255)]
SEEKING = ArmReport(0.60, 0.0, done=0, placed=0, seeking=True, carrying=False)
BUSY, CARRYING = replace(SEEKING, seeking=False), replace(SEEKING, seeking=False, carrying=True)


def part(number, y, clear=1.0):
    return Candidate(number, kind=1, x=0.6, y=y, yaw=0.0, v=0.15, std=0.002, clear=clear)


@pytest.fixture
def clerk():
    model = CycleModel(CycleTime(), PickWindow())
    return OrderClerk(make_dispatcher(NearestDeadline(), model, Eligibility()), model, CELLS)


def through(clerk, book, *steps):
    """Updates the book with (report, parts) every 0.1 s."""
    for k, (arm, parts) in enumerate(steps):
        book = clerk.update(book, arm, parts, 10.0 + 0.1 * k)
    return book


def test_the_first_order_is_for_the_part_that_the_dispatcher_chooses_and_the_first_cell(clerk):
    book = through(clerk, OrderTracker(), (SEEKING, [part(1, -0.3), part(2, 0.0)]))
    assert (book.seq, book.order.number, book.order.cell) == (1, 2, 0)


def test_without_parts_that_can_be_picked_there_is_no_order(clerk):
    assert through(clerk, OrderTracker(), (SEEKING, [])).order is None
    assert through(clerk, OrderTracker(), (SEEKING, [part(1, 0.34), part(2, -0.2, clear=0.0)])).order is None


def test_an_order_stays_while_its_part_can_be_picked(clerk):
    book = through(clerk, OrderTracker(), (SEEKING, [part(1, -0.3)]), (SEEKING, [part(1, -0.28), part(2, 0.0)]))
    assert (book.seq, book.order.number) == (1, 1)


@pytest.mark.parametrize("others", [[part(1, 0.34), part(2, -0.2)], [part(2, -0.2)]], ids=["too late", "lost"])
def test_an_order_is_replaced_when_its_part_can_no_longer_be_picked(clerk, others):
    book = through(clerk, OrderTracker(), (SEEKING, [part(1, -0.1)]), (SEEKING, others))
    assert (book.seq, book.order.number) == (2, 2)


def test_an_order_is_withdrawn_when_no_other_part_is_left(clerk):
    book = through(clerk, OrderTracker(), (SEEKING, [part(1, -0.1)]), (SEEKING, []))
    assert book.order is None and book.seq == 1


def test_a_hand_that_may_still_be_in_time_goes_on_while_no_other_part_can_be_picked(clerk):
    book = through(clerk, OrderTracker(), (SEEKING, [part(1, -0.1)]), (SEEKING, [part(1, 0.37)]))
    assert book.order.number == 1
    assert through(clerk, book, (SEEKING, [part(1, 0.37), part(2, -0.2)])).order.number == 2
    assert through(clerk, book, (SEEKING, [part(1, 0.41)])).order is None


def test_cells_are_filled_in_the_order_that_is_asked_for(clerk):
    clerk = OrderClerk(clerk.dispatcher, clerk.model, CELLS, filling=[2, 0, 1])
    book = through(clerk, OrderTracker(), (SEEKING, [part(1, -0.1)]))
    assert book.order.cell == 2
    book = through(clerk, OrderTracker(filled=frozenset({2})), (SEEKING, [part(1, -0.1)]))
    assert book.order.cell == 0


def test_an_order_is_not_changed_during_the_descent(clerk):
    book = through(clerk, OrderTracker(), (SEEKING, [part(1, -0.1)]), (BUSY, []), (BUSY, [part(2, 0.0)]))
    assert (book.seq, book.order.number) == (1, 1)


def test_the_next_part_is_chosen_while_the_arm_puts_down_the_last_one(clerk):
    book = through(clerk, OrderTracker(), (SEEKING, [part(1, -0.1)]), (CARRYING, [part(2, -0.3)]))
    assert book.placing.number == 1 and (book.order.number, book.order.cell) == (2, 1)
    assert book.picked == {1}, "a part that was taken is not offered again"
    book = through(clerk, book, (CARRYING, [part(2, -0.28), part(3, -0.1)]))
    assert book.order.number == 3, "until the hand is free, the choice may change"
    assert (book.placing.number, book.order.cell) == (1, 1)


def test_a_placed_part_fills_its_cell(clerk):
    book = through(clerk, OrderTracker(), (SEEKING, [part(1, -0.1)]), (CARRYING, [part(2, -0.3)]))
    book = through(clerk, book, (replace(SEEKING, done=1, placed=1), [part(2, -0.2)]))
    assert book.filled == {0} and book.placing is None and book.order.number == 2


def test_a_part_that_was_lost_on_the_way_leaves_its_cell_free_and_is_not_tried_again(clerk):
    book = through(clerk, OrderTracker(), (SEEKING, [part(1, -0.1)]), (CARRYING, []), (BUSY, []))
    book = through(clerk, book, (replace(SEEKING, done=1), [part(1, 0.0)]))
    assert book.filled == frozenset() and book.order is None
    book = through(clerk, book, (replace(SEEKING, done=1), [part(2, 0.0)]))
    assert (book.order.number, book.order.cell) == (2, 0)


def test_a_missed_part_is_tried_again(clerk):
    book = through(clerk, OrderTracker(), (SEEKING, [part(1, -0.3)]), (BUSY, [part(1, -0.25)]))
    book = through(clerk, book, (replace(SEEKING, done=1), [part(1, -0.2)]))
    assert (book.seq, book.order.number) == (2, 1)


def test_with_full_trays_there_are_no_orders(clerk):
    book = OrderTracker(filled=frozenset({0, 1, 2}))
    assert through(clerk, book, (SEEKING, [part(1, -0.1)])).order is None
    book = OrderTracker(filled=frozenset({0, 2}))
    assert through(clerk, book, (SEEKING, [part(1, -0.1)])).order.cell == 1


def test_the_hand_is_expected_to_be_free_at_the_same_time_all_the_way_to_the_cell(clerk):
    """The carry, seen from its beginning; not a moving estimate."""
    book = through(clerk, OrderTracker(), (SEEKING, [part(1, -0.1)]))
    book = clerk.update(book, CARRYING, [], 10.1)
    cycle = CycleTime()
    after_carry = cycle.lower + cycle.release + cycle.rise
    assert 10.1 + after_carry < book.free_at < 10.1 + after_carry + 2.0
    near = replace(CARRYING, x=CELLS[0].x, y=CELLS[0].y)
    assert clerk.update(book, near, [], 10.9).free_at == book.free_at


def test_the_report_of_the_arm_comes_from_its_messages():
    diagnosis = PickDiagnosis([0.0] * message_size(PickDiagnosis))
    status = ToolStatus([0.0] * message_size(ToolStatus))
    diagnosis.phase, diagnosis.done, diagnosis.placed, status.x, status.y = 5.0, 3.0, 2.0, 0.4, -0.1
    assert report_of(diagnosis, status, (0, 1), (5, 6)) == ArmReport(0.4, -0.1, 3, 2, False, True)
    diagnosis.phase = 1.0
    assert report_of(diagnosis, status, (0, 1), (5, 6)).seeking
