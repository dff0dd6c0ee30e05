"""Fuzzes what comes over the network: messages to the host, messages to the arm, and packets of predicted path.

The examples are derived from the seed corpus in ``corpus/`` and are the same in every run. Their numbers are chosen for
about 30 s of processor time in total.
"""

import struct
from pathlib import Path

import numpy as np
import pytest
from arm_computer import GUARD, ArmComputer
from bus_ends import Bench, Receiver
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from packets import BAD_PACKETS, TABLE_HEIGHT, VOLUME, circle_packet

from drake_tracker.arm.config import ServoConfig
from drake_tracker.arm.motion.servo import Servo
from drake_tracker.arm.safety.packet_guard import LARGEST_ACCELERATION, Rejection
from drake_tracker.core.messages import (
    KNOT_COUNT,
    KNOT_SPACING,
    PREDICTION_HEADER,
    Frozen,
    PacketReport,
    Prediction,
    TrackPoint,
    message_size,
    prediction_knots,
)
from drake_tracker.core.timing import PATH_DURATION, SERVO_PERIOD, VISION_PERIOD
from drake_tracker.link.config import Lossy
from drake_tracker.link.lossy_link import LinkState, LossyLink
from drake_tracker.network.channels import channel_of, encode_signal
from drake_tracker.network.cycles import AGREEING, REORDERED, CycleCollector, NotUnderstood, read_image, read_vector

CORPUS = {path.stem: path.read_bytes() for path in sorted((Path(__file__).parent / "corpus").glob("*.bin"))}
QUIET = (HealthCheck.too_slow, HealthCheck.function_scoped_fixture, HealthCheck.large_base_example)


def fuzz(examples):
    """The same examples in every run; no example has a time limit."""
    return settings(
        max_examples=examples, derandomize=True, deadline=None, database=None, suppress_health_check=list(QUIET)
    )


NUMBERS = st.one_of(
    st.floats(width=64),
    st.sampled_from([0.0, -0.0, 1.0, 5e-324, 1e300, -1e300, 1.8e308, -1.8e308, np.inf, -np.inf, np.nan, 2.0**63]),
)
INTEGERS = st.one_of(st.integers(-(2**63), 2**63 - 1), st.sampled_from([0, -1, 1, 2**63 - 1, -(2**63), 2**31, 10**13]))
CHANGES = st.lists(
    st.one_of(
        st.tuples(st.just("byte"), st.integers(0, 4000), st.integers(0, 255)),
        st.tuples(st.just("number"), st.integers(0, 4000), NUMBERS),
        st.tuples(st.just("integer"), st.integers(0, 4000), INTEGERS),
        st.tuples(st.just("cut"), st.integers(0, 4000), st.just(0)),
        st.tuples(st.just("insert"), st.integers(0, 4000), st.binary(max_size=40)),
    ),
    min_size=1,
    max_size=4,
)


def mutate(data, changes):
    """The data after some changes (kind, place, value)."""
    for kind, place, value in changes:
        place %= len(data) + 1
        if kind == "byte":
            data = data[:place] + bytes([value]) + data[place + 1 :]
        elif kind == "number":
            data = data[:place] + struct.pack(">d", value) + data[place + 8 :]
        elif kind == "integer":
            data = data[:place] + struct.pack(">q", value) + data[place + 8 :]
        elif kind == "cut":
            data = data[:place]
        else:
            data = data[:place] + value + data[place:]
    return data


MESSAGES = st.one_of(
    st.sampled_from(list(CORPUS.values())),
    st.builds(mutate, st.sampled_from(list(CORPUS.values())), CHANGES),
    st.binary(max_size=200),
)


def from_corpus(name):
    """Runs a test on each file of the corpus first, whatever the fuzzer chooses afterwards."""

    def decorate(test):
        for data in CORPUS.values():
            test = example(**{name: [data] if name.endswith("s") else data})(test)
        return test

    return decorate


@pytest.fixture(scope="module")
def bench():
    bench = Bench()
    bench.good(60)
    return bench


@fuzz(250)
@from_corpus("messages")
@given(messages=st.lists(MESSAGES, min_size=1, max_size=4))
def test_no_message_ends_or_silences_the_host(bench, messages):
    for data in messages:
        bench.lcm.Publish(channel_of("point"), data)
    bench.host.step(0.0)
    # A message with a time slightly ahead may cost the cycles until then, and a row of those that agree a restart.
    bench.good(REORDERED + AGREEING)
    bench.lcm.HandleSubscriptions(0)
    assert abs(bench.host.time - bench.cycle * VISION_PERIOD) < 2 * VISION_PERIOD
    before = bench.packets
    bench.good(1)
    bench.lcm.HandleSubscriptions(0)
    assert bench.packets == before + 1


@fuzz(1000)
@from_corpus("data")
@given(data=MESSAGES)
def test_a_message_is_read_completely_or_refused(data):
    for read, expected in ((read_image, (8, 4)), (read_vector, TrackPoint.get_fields())):
        try:
            time, content, _ = read(data, expected)
        except NotUnderstood:
            continue
        assert 0.0 <= time <= 1e10
        assert read(content, expected)[1] == content if read is read_image else len(content) == len(expected)


@fuzz(300)
@given(times=st.lists(st.one_of(st.floats(0.0, 1e10), st.integers(0, 2000).map(lambda k: k / 60)), max_size=60))
def test_cycles_are_in_order_whatever_the_times(times):
    collector = CycleCollector(["left", "right"], VISION_PERIOD)
    last = None
    for k, time in enumerate(times):
        for cycle in collector.put(("left", "right")[k % 2], time, k):
            assert cycle.anew == (last is None) or cycle.anew
            assert cycle.anew or cycle.number > last
            assert cycle.messages
            last = cycle.number


@pytest.fixture(scope="module")
def receiver():
    return Receiver()


@fuzz(500)
@from_corpus("data")
@given(data=MESSAGES)
def test_no_message_ends_the_receiver_of_the_arm(receiver, data):
    for port in ("prediction", "filtered"):
        receiver.lcm.Publish(channel_of(port), data)
    receiver.advance()
    accepted, report = receiver.read("accepted"), PacketReport(receiver.read("packet_report"))
    assert np.isfinite(accepted).all() and np.isfinite(receiver.read("filtered")).all()
    assert report.received >= report.rejected == sum(report[3:])
    now = receiver.simulator.get_context().get_time()
    good = circle_packet(now - 0.1)
    receiver.lcm.Publish(channel_of("prediction"), encode_signal(good, Prediction.get_fields(), now).encode())
    receiver.advance()
    np.testing.assert_array_equal(receiver.read("accepted"), good)


PLACES = st.lists(st.tuples(st.integers(0, message_size(Prediction) - 1), NUMBERS), max_size=4)
SHIFTS = st.lists(st.tuples(st.integers(0, 4), st.floats(-1.0, 1.0)), max_size=3)
KINDS = st.sampled_from([None, *[spoil for spoil, _ in BAD_PACKETS.values()]])


@st.composite
def packets(draw, now=10.0):
    """A packet for the time ``now`` [s]: good, of a known bad kind, moved and sheared, or with any other numbers."""
    packet = circle_packet(now - 0.25, draw(st.integers(0, 100)), speed=draw(st.floats(0.0, 1.0)))
    spoil = draw(KINDS)
    if spoil is not None:
        packet = spoil(packet)
    for field, shift in draw(SHIFTS):
        slope = draw(st.floats(-0.1, 0.1)) if draw(st.booleans()) else 0.0
        with np.errstate(all="ignore"):
            packet[PREDICTION_HEADER + field :: 5] += shift + slope * np.arange(KNOT_COUNT)
    for place, value in draw(PLACES):
        packet[place] = value
    return packet


MOST_SPEED = GUARD.settings.max_speed + LARGEST_ACCELERATION * PATH_DURATION


@fuzz(1500)
@given(packet=packets())
def test_what_the_guard_accepts_can_be_followed(packet):
    rejection = GUARD.check(packet, 10.0)
    assert rejection in set(Rejection)
    if rejection:
        return
    knots = prediction_knots(packet)
    assert np.isfinite(packet).all() and Prediction(packet).valid == 1.0
    assert 10.0 - PATH_DURATION <= Prediction(packet).stamp <= 10.001
    assert (knots[0, :3] >= VOLUME[0] - 0.1).all() and (knots[0, :3] <= VOLUME[1] + 0.1).all()
    assert knots[:, 2].min() >= TABLE_HEIGHT - GUARD.settings.table_tolerance
    assert np.linalg.norm(np.diff(knots[:, :3], axis=0), axis=1).max() <= MOST_SPEED * KNOT_SPACING
    assert np.abs(np.diff(knots[:, 3])).max() < 3.1417 and knots[:, 4].min() >= 0.0


@fuzz(400)
@given(several=st.lists(packets(), min_size=1, max_size=6), blind=st.integers(0, 6), settings_=st.booleans())
def test_link_guard_and_servo_give_finite_targets_in_reach_of_the_packets(several, blind, settings_):
    link = LossyLink(Lossy(drop=0.1, jitter=0.05) if settings_ else Lossy(), seed=1)
    servo = Servo(ServoConfig(), lead=0.045)
    posted, guarded, state = LinkState(), GUARD.initial_state(), servo.initial_state()
    now = 10.0
    for k, packet in enumerate(several):
        posted = link.post(posted, packet, now)
        delivered = link.delivered(posted, now)
        if delivered is not None:
            guarded = GUARD.update(guarded, now, delivered)
        for _ in range(3):
            state = servo.update(state, now, guarded.accepted, Frozen.BLIND if k >= blind else Frozen.FREE)
            target = servo.target(state)
            assert np.isfinite(target).all()
            if target[-1]:
                reach = 0.2 + MOST_SPEED * 2.0
                assert (target[1:4] > VOLUME[0] - reach).all() and (target[1:4] < VOLUME[1] + reach).all()
            now += SERVO_PERIOD
    assert len(posted.in_flight) <= len(several) + 1


@pytest.fixture(scope="module")
def arm():
    return ArmComputer()


@fuzz(12)
@given(several=st.lists(packets(1.0), min_size=2, max_size=5))
def test_the_arm_survives_any_packets(arm, several):
    """The whole computer of the arm: good packets for half a second, then those of the fuzzer in turn."""

    def make(now, number):
        if now < 0.6:
            return circle_packet(now - 0.25, number)
        packet = several[number % len(several)].copy()
        stamp, first = Prediction(packet).stamp, Prediction(packet).first_time
        if np.isfinite([stamp, first]).all() and abs(stamp - 0.75) < 3.0:
            packet[[0, 2]] = stamp + now - 1.0, first + now - 1.0
        return packet

    logs = arm.run(make, 1.2)
    for name in ("target", "command", "status", "q_commanded", "arm_desired_state"):
        assert np.isfinite(logs[name][1]).all(), name
    q = logs["q_commanded"][1]
    assert (q >= arm.model.position_lower - 1e-9).all() and (q <= arm.model.position_upper + 1e-9).all()
    assert (np.abs(np.diff(q, axis=0)) / SERVO_PERIOD <= arm.model.velocity_limit + 1e-6).all()
