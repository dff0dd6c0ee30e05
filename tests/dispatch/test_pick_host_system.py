"""The host of the conveyor as a System, driven with messages."""

import math

import numpy as np
import pytest
from belt_parts import part_tracks
from pydrake.systems.analysis import Simulator

from drake_tracker.core.messages import (
    BELT_FIELDS,
    PART_FIELDS,
    BeltEstimate,
    EncoderReading,
    EncoderReport,
    PickDiagnosis,
    PickOrder,
    Prediction,
    ToolStatus,
    evaluate_prediction,
    message_rows,
    message_size,
    packet_target,
)
from drake_tracker.core.part_kinds import PART_SHAPES, PartKind
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.dispatch.candidate import Cell
from drake_tracker.dispatch.config import CycleTime, Eligibility, NearestDeadline, PickWindow
from drake_tracker.dispatch.cycle_time import CycleModel
from drake_tracker.dispatch.dispatcher import make_dispatcher
from drake_tracker.dispatch.encoder_history import LASTS, SPAN, EncoderCheck, EncoderHistory
from drake_tracker.dispatch.order_tracker import OrderClerk
from drake_tracker.dispatch.pick_host_system import CellPose, PickHostSystem
from drake_tracker.estimation.belt import BeltEstimator
from drake_tracker.estimation.config import Belt

SPEED, LAG = 0.15, 0.25
SEEKING, CARRYING = (0, 1), (5, 6, 7, 8)
POSES = [CellPose(0.345, 0.19, 0.45, 0.5 * math.pi), CellPose(0.41, 0.19, 0.45, 0.5 * math.pi)]


class Host:
    """A host that sees parts (number, kind, x, y at time 0, yaw) on a belt with `SPEED`, late by `LAG`."""

    def __init__(self, parts, encoder=False):
        model = CycleModel(CycleTime(), PickWindow())
        clerk = OrderClerk(
            make_dispatcher(NearestDeadline(), model, Eligibility()), model, [Cell(pose.x, pose.y) for pose in POSES]
        )
        self.system = PickHostSystem(
            BeltEstimator(Belt()), clerk, POSES, SEEKING, CARRYING, offset=0.0, has_encoder=encoder
        )
        self.parts, self.encoder, self.jump = parts, encoder, 0.0
        self.simulator = Simulator(self.system)
        self.context = self.simulator.get_mutable_context()
        self.phase = self.done = self.placed = 0
        self.time = 0.0
        self.step()
        self.simulator.Initialize()

    def step(self):
        stamp = self.time - LAG
        fix = lambda name, value: self.system.GetInputPort(name).FixValue(self.context, value)  # noqa: E731
        seen = [(number, kind, x, y + SPEED * stamp, yaw) for number, kind, x, y, yaw in self.parts]
        fix("parts", part_tracks(stamp, seen) if stamp > 0.0 else part_tracks(0.0, [])[:] * 0.0)
        diagnosis, status = (np.zeros(message_size(view)) for view in (PickDiagnosis, ToolStatus))
        said = PickDiagnosis(diagnosis)
        said.phase, said.done, said.placed = self.phase, self.done, self.placed
        ToolStatus(status).x = 0.6
        fix("diagnosis", diagnosis)
        fix("status", status)
        if self.encoder:
            distance = SPEED if self.jump is None else SPEED * self.time + (self.jump if self.time > 1.0 else 0.0)
            fix("encoder", np.array([self.time, distance, 1.0]))

    def run(self, duration):
        for _ in range(round(duration / VISION_PERIOD)):
            self.step()
            self.simulator.AdvanceTo(self.time + 0.5 * VISION_PERIOD)
            self.time += VISION_PERIOD

    def read(self, name, view):
        return view(np.array(self.system.GetOutputPort(name).Eval(self.context)))


def test_before_the_first_image_it_says_nothing():
    host = Host([(1, PartKind.BOX, 0.6, -0.4, 0.3)])
    assert not host.read("order", PickOrder).valid and not host.read("prediction", Prediction).valid


@pytest.mark.parametrize("encoder", [False, True])
def test_it_orders_a_part_and_predicts_where_it_will_be(encoder):
    host = Host([(4, PartKind.BOX, 0.61, -0.5, 0.3)], encoder)
    host.run(1.0)
    order, packet = host.read("order", PickOrder), host.read("prediction", Prediction)
    assert (order.job, order.number, order.cell, order.valid) == (1, 4, 0, 1)
    assert (order.width, order.height) == (0.030, 0.030)
    assert order.place_z == pytest.approx(0.45 + 0.015) and order.place_yaw == pytest.approx(0.5 * math.pi)
    assert packet_target(packet.seq) == 4
    due = host.time + 0.3
    x, y, z, yaw, std = evaluate_prediction(np.array(packet[:]), due)
    assert (x, y, z, yaw) == pytest.approx((0.61, -0.5 + SPEED * due, 0.465, 0.3), abs=0.003)
    assert 0.0 < std < 0.02


def test_an_encoder_that_jumps_moves_no_part():
    host = Host([(4, PartKind.BOX, 0.61, -0.5, 0.3)], encoder=True)
    host.jump = 0.4
    for _ in range(16):
        host.run(0.1)
        belt = host.read("belt", BeltEstimate)
        if host.time > 0.6:
            y = message_rows(np.array(belt[:]), BELT_FIELDS)[0, BELT_FIELDS.index("y")]
            assert y == pytest.approx(-0.5 + SPEED * host.time, abs=0.012)


def test_a_disc_is_taken_in_the_direction_in_which_it_will_lie():
    """The hand need not turn between belt and cell; which way vision says that a disc points has no meaning."""
    host = Host([(1, PartKind.DISC, 0.61, -0.5, 2.0)])
    host.run(1.0)
    packet = host.read("prediction", Prediction)
    assert evaluate_prediction(np.array(packet[:]), host.time)[3] == POSES[0].yaw


def test_the_middle_of_a_part_is_ordered_into_the_middle_of_the_cell():
    host = Host([(1, PartKind.ELL, 0.6, -0.5, 0.3)])
    host.run(1.0)
    order = host.read("order", PickOrder)
    assert order.place_x == pytest.approx(POSES[0].x)
    assert order.place_y == pytest.approx(POSES[0].y - PART_SHAPES[PartKind.ELL].middle)


def test_the_order_is_repeated_with_a_new_number_of_the_message():
    host = Host([(1, PartKind.BOX, 0.6, -0.5, 0.3)])
    host.run(1.0)
    first = host.read("order", PickOrder)
    host.run(VISION_PERIOD)
    second = host.read("order", PickOrder)
    assert second.seq == first.seq + 1 and second.job == first.job and second.stamp > first.stamp


def test_a_new_packet_comes_with_each_new_image_only():
    host = Host([(1, PartKind.BOX, 0.6, -0.5, 0.3)])
    host.run(1.0)
    before = host.read("prediction", Prediction)
    frozen, host.step = host.step, lambda: None  # vision stands still
    host.run(3 * VISION_PERIOD)
    assert host.read("prediction", Prediction).seq == before.seq
    host.step = frozen
    host.run(VISION_PERIOD)
    assert host.read("prediction", Prediction).seq == before.seq + 1


def test_while_the_arm_carries_the_next_part_is_ordered():
    host = Host([(1, PartKind.BOX, 0.6, -0.45, 0.3), (2, PartKind.DISC, 0.6, -0.75, 0.3)])
    host.run(1.5)
    assert host.read("order", PickOrder).number == 1
    host.phase = CARRYING[0]
    host.run(0.5)
    order = host.read("order", PickOrder)
    assert (order.number, order.job, order.cell) == (2, 2, 1)
    assert packet_target(host.read("prediction", Prediction).seq) == 2


def test_the_estimate_for_displays_holds_for_the_present_and_says_how_much_room_there_is():
    host = Host([(1, PartKind.BOX, 0.6, -0.45, 0.0), (2, PartKind.BOX, 0.6, -0.55, 0.0)])
    host.run(1.0)
    estimate = host.read("belt", BeltEstimate)
    rows = message_rows(np.array(estimate[:]), BELT_FIELDS)
    now = host.time - VISION_PERIOD
    assert estimate.stamp == pytest.approx(now) and estimate.speed == pytest.approx(SPEED, abs=0.01)
    for row, y in zip(rows, (-0.45, -0.55)):
        assert row[BELT_FIELDS.index("y")] == pytest.approx(y + SPEED * now, abs=0.004)
        # the jaws reach 60 mm across the part; the other one has a radius of 29.2 mm
        assert row[BELT_FIELDS.index("clear")] == pytest.approx(0.1 - 0.060 - 0.0292, abs=0.004)
    assert not rows[2:].any()


def test_values_that_are_not_finite_are_not_used():
    host = Host([(1, PartKind.BOX, 0.6, -0.45, 0.0), (2, PartKind.BOX, math.nan, -0.65, 0.0)])
    host.run(1.0)
    rows = message_rows(np.array(host.read("belt", BeltEstimate)[:]), BELT_FIELDS)
    assert set(rows[:, 0]) == {0.0, 1.0} and np.isfinite(rows).all()


@pytest.mark.parametrize("stamp, kind", [(1e300, PartKind.BOX), (5.0, PartKind.BOX), (None, 9), (None, 0)])
def test_parts_that_cannot_be_right_do_not_silence_the_host(stamp, kind):
    host = Host([(1, PartKind.BOX, 0.6, -0.4, 0.3)])
    host.run(0.5)
    host.step()
    seen = [(2, PartKind.BOX, 0.6, -0.3, 0.0)]
    message = part_tracks(host.time - LAG if stamp is None else stamp, seen)
    message_rows(message, PART_FIELDS)[0, PART_FIELDS.index("kind")] = kind
    host.system.GetInputPort("parts").FixValue(host.context, message)
    host.simulator.AdvanceTo(host.time + 0.5 * VISION_PERIOD)
    host.time += VISION_PERIOD
    host.run(1.0)
    numbers = message_rows(np.array(host.read("belt", BeltEstimate)[:]), BELT_FIELDS)[:, 0]
    assert 1.0 in numbers and 2.0 not in numbers
    assert host.read("prediction", Prediction).stamp == pytest.approx(host.time - LAG, abs=0.05)


@pytest.mark.parametrize("stopped", [False, True])
def test_an_encoder_that_stops_is_noticed_and_vision_goes_on(stopped):
    host = Host([(4, PartKind.BOX, 0.61, -0.5, 0.3)], encoder=True)
    host.run(1.0)
    if stopped:
        host.jump = None
    host.run(1.2)
    report = host.read("encoder_report", EncoderReport)
    assert bool(report.used) is not stopped
    assert report.unused_cycles > 30 if stopped else report.unused_cycles == 0
    y = message_rows(np.array(host.read("belt", BeltEstimate)[:]), BELT_FIELDS)[0, BELT_FIELDS.index("y")]
    assert y == pytest.approx(-0.5 + SPEED * host.time, abs=0.004)


SPEED = 0.15


def doubted(encoder, parts, duration=3.0):
    """Times of images after which the encoder was doubted: distances of encoder and parts as functions of time."""
    history, check, found = EncoderHistory(), EncoderCheck(), []
    for time in np.arange(0.0, duration, 1 / 60):
        reading = EncoderReading(np.zeros(message_size(EncoderReading)))
        reading.time, reading.distance, reading.valid = time, encoder(time), 1.0
        history = history.extended(reading)
        check = check.after(time, {number: place(time) for number, place in enumerate(parts, 1)}, history)
        if time < check.doubted_until:
            found.append(time)
    return np.array(found)


def moves(time):
    return SPEED * time


def noisy(time):
    return SPEED * time + 0.002 * np.sin(97.0 * time)


def test_an_encoder_that_agrees_is_not_doubted():
    assert len(doubted(moves, [noisy, moves])) == 0


def test_an_encoder_that_stands_still_is_doubted_at_once_and_trusted_again_when_it_agrees():
    stops = doubted(lambda t: SPEED * (min(t, 1.0) + max(t - 1.2, 0.0)), [noisy], 4.0)
    assert stops[0] == pytest.approx(1.08, abs=0.05)
    assert stops[-1] == pytest.approx(1.2 + SPAN + LASTS, abs=0.1)


def test_a_part_that_the_hand_moves_is_no_reason_for_doubt():
    assert len(doubted(moves, [moves, lambda t: SPEED * min(t, 1.0)])) == 0
    assert len(doubted(moves, [lambda t: SPEED * min(t, 1.0)])) > 0, "the only part that is seen contradicts it"


def test_without_parts_or_readings_there_is_nothing_to_compare():
    assert len(doubted(moves, [])) == 0
    check = EncoderCheck()
    for time in np.arange(0.0, 1.0, 1 / 60):
        check = check.after(time, {1: SPEED * time}, EncoderHistory())
    assert check.doubted_until == float("-inf") and check.after(0.5, {1: 9.0}, EncoderHistory()) is check
