import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from drake_tracker.core.messages import (
    EXPECTED_FIELDS,
    TARGET_STRIDE,
    TRACK_FIELDS,
    TRACK_SLOTS,
    Filtered,
    Prediction,
    TrackPoint,
    TrackPoints,
    TrackPredictions,
    evaluate_prediction,
    message_rows,
    message_size,
)
from drake_tracker.core.timing import ESTIMATOR_SLOT, VISION_PERIOD, vision_slot
from drake_tracker.estimation import EstimatorBankSystem, EstimatorSystem, make_estimator

LAG_CYCLES = 15
MOVING, STANDING, LOST = 1, 2, 4
READY = 60
"""Cycles after which every estimator here is ready."""


def stamp_of(cycle):
    return cycle * VISION_PERIOD


def circle(cycle, radius=0.12, speed=0.15):
    angle = speed * stamp_of(cycle) / radius
    return np.array([0.56 + radius * np.cos(angle), radius * np.sin(angle), 0.485])


def line(cycle):
    return np.array([0.4 + 0.1 * stamp_of(cycle), -0.2, 0.485])


def tracks_message(cycle, tracks, target=1):
    """A `TrackPoints` vector of ``tracks``: {number: position}, or {number: (position, state, cycle when seen)}."""
    message = np.zeros(message_size(TrackPoints))
    header = TrackPoints(message)
    header.stamp, header.target, header.valid = stamp_of(cycle), target, 1.0
    for row, (number, track) in zip(message_rows(message, TRACK_FIELDS), tracks.items()):
        position, state, seen = track if isinstance(track, tuple) else (track, MOVING, cycle)
        names = ("number", "state", "x", "y", "z", "seen")
        for name, value in zip(names, (number, state, *position, stamp_of(seen))):
            row[TRACK_FIELDS.index(name)] = value
    return message


def point_message(cycle, p_WQ):
    return np.array([stamp_of(cycle), *p_WQ, 0.0, 1.0])


class Runner:
    """A System with one input, which is given a message in every cycle."""

    def __init__(self, system):
        self.system, self.cycle = system, 0
        self.simulator = Simulator(system)

    @property
    def context(self):
        return self.simulator.get_context()

    def give(self, message):
        context = self.simulator.get_mutable_context()
        self.system.get_input_port().FixValue(context, message)
        # To the middle between two updates.
        self.simulator.AdvanceTo(self.cycle * VISION_PERIOD + vision_slot(ESTIMATOR_SLOT) + VISION_PERIOD / 2)
        self.cycle += 1

    def follow(self, cycles, tracks, target=1):
        """Gives messages of some cycles; ``tracks`` is a function of the cycle whose points arrive."""
        for _ in range(cycles):
            seen = self.cycle - LAG_CYCLES
            nothing = np.zeros(message_size(TrackPoints))
            self.give(tracks_message(seen, tracks(seen), target) if seen >= 0 else nothing)

    def output(self, name):
        return self.system.GetOutputPort(name).Eval(self.context).copy()

    def packet(self):
        return Prediction(self.output("prediction"))

    def members(self):
        return self.context.get_abstract_state(0).get_value().members

    def expected(self):
        """{number: (position, velocity, standard deviation)} of the output ``expected``."""
        rows = message_rows(self.output("expected"), EXPECTED_FIELDS)
        return {int(row[0]): (row[1:4], row[4:7], row[7]) for row in rows if row[0]}


def bank(kind="arc_length"):
    return Runner(EstimatorBankSystem(make_estimator(kind)))


def test_all_outputs_are_zeros_before_the_first_point():
    runner = bank()
    runner.follow(LAG_CYCLES, lambda cycle: {})
    for name in ("prediction", "filtered", "expected"):
        assert not runner.output(name).any()


@pytest.mark.parametrize("kind", ["arc_length", "coordinated_turn", "closed_path", "alpha_beta_gamma"])
def test_the_packets_of_one_track_are_those_of_a_single_estimator(kind):
    several, single = bank(kind), Runner(EstimatorSystem(make_estimator(kind)))
    for _ in range(2 * READY):
        cycle = several.cycle - LAG_CYCLES
        seen = cycle >= 0 and not 80 <= cycle < 85
        position, newest = circle(max(cycle, 0)), 79 if 80 <= cycle < 85 else cycle
        tracks = tracks_message(cycle, {1: (position, MOVING, newest)})
        several.give(tracks if cycle >= 0 else np.zeros(message_size(TrackPoints)))
        single.give(point_message(cycle, position) if seen else np.zeros(message_size(TrackPoint)))
        packet, alone = several.packet(), Prediction(single.output("prediction"))
        packet.seq %= TARGET_STRIDE
        np.testing.assert_array_equal(packet[:], alone[:])
        np.testing.assert_array_equal(several.output("filtered"), single.output("filtered"))
    assert several.packet().valid and Filtered(several.output("filtered")).valid


def test_every_track_has_an_estimator_of_its_own():
    runner = bank()
    runner.follow(LAG_CYCLES + READY, lambda cycle: {1: circle(cycle), 4: line(cycle)}, target=4)
    assert set(runner.members()) == {1, 4}
    alone = bank()
    alone.follow(LAG_CYCLES + READY, lambda cycle: {4: line(cycle)}, target=4)
    np.testing.assert_array_equal(runner.output("prediction"), alone.output("prediction"))


def test_another_target_gives_its_own_packets_at_once_and_the_numbers_go_on():
    def both(cycle):
        return {1: circle(cycle), 2: line(cycle)}

    runner = bank()
    runner.follow(LAG_CYCLES + READY, both, target=1)
    before = runner.packet()
    runner.follow(1, both, target=2)
    after = runner.packet()
    assert after.seq == before.seq + 1 + TARGET_STRIDE and after.stamp == pytest.approx(before.stamp + VISION_PERIOD)
    ahead = evaluate_prediction(after[:], after.stamp + 0.5)
    np.testing.assert_allclose(ahead[:3], line(after.stamp / VISION_PERIOD + 30), atol=2e-3)


def test_without_a_target_the_last_packet_stays():
    runner = bank()
    runner.follow(LAG_CYCLES + READY, lambda cycle: {1: circle(cycle)})
    packet = runner.output("prediction")
    runner.follow(5, lambda cycle: {1: circle(cycle)}, target=0)
    np.testing.assert_array_equal(runner.output("prediction"), packet)


def test_an_estimator_is_dropped_with_its_track():
    runner = bank()
    runner.follow(LAG_CYCLES + READY, lambda cycle: {1: circle(cycle), 2: line(cycle)})
    runner.follow(1, lambda cycle: {1: circle(cycle)})
    assert set(runner.members()) == {1}
    seq = runner.packet().seq
    # The number appears again: its estimator begins anew, and makes no packet from a single point.
    runner.follow(1, lambda cycle: {1: circle(cycle), 2: line(cycle)}, target=2)
    assert set(runner.members()) == {1, 2} and runner.packet().seq == seq


def test_an_object_that_stands_is_a_point_as_well():
    runner = bank("coordinated_turn")
    place = np.array([0.5, 0.1, 0.485])
    runner.follow(LAG_CYCLES + 20, lambda cycle: {1: circle(cycle) if cycle < 0 else place})
    stamps = [member.stamp for member in runner.members().values()]
    runner.follow(10, lambda cycle: {1: (place, STANDING, cycle)})
    (stamp,) = (member.stamp for member in runner.members().values())
    assert stamp == pytest.approx(stamps[0] + 10 * VISION_PERIOD)


def test_an_object_that_stops_after_a_corner_has_the_direction_of_its_last_piece_of_path():
    """At 0.1 m/s it turns left by a right angle, goes on for 25 mm and stops. The filter does not see the new direction
    in time."""
    corner, rest = 60, 75

    def track(cycle):
        x, y = 0.1 * stamp_of(min(cycle, corner)), 0.1 * stamp_of(min(max(cycle - corner, 0), rest - corner))
        return (np.array([0.4 + x, y, 0.485]), STANDING if cycle > rest else MOVING, cycle)

    runner = bank("coordinated_turn")
    runner.follow(LAG_CYCLES + rest + 20, lambda cycle: {1: track(cycle)})
    packet = runner.packet()
    yaw = evaluate_prediction(packet[:], packet.stamp)[3]
    assert abs(yaw - np.pi / 2) < np.deg2rad(15.0) and runner.output("filtered")[4] == pytest.approx(yaw)
    (member,) = runner.members().values()
    own = make_estimator("coordinated_turn").predict(member.estimate, np.array([packet.stamp]))[0, 3]
    assert abs(own - np.pi / 2) > np.deg2rad(25.0)


@pytest.mark.parametrize("seen, expected", [(100.0, 100.0), (-80.0, 100.0), (20.0, 20.0)])
def test_an_object_that_stands_has_the_direction_that_its_silhouettes_show(seen, expected):
    """It came along +y. The images show a direction up to half a turn only."""
    rest, where = 60, (TRACK_FIELDS.index("yaw"), TRACK_FIELDS.index("yaw_known"))

    def track(cycle):
        y = 0.1 * stamp_of(min(cycle, rest)) - 0.2
        return (np.array([0.5, y, 0.485]), STANDING if cycle > rest else MOVING, cycle)

    def with_yaw(cycle):
        message = tracks_message(cycle, {1: track(cycle)})
        message_rows(message, TRACK_FIELDS)[0, where] = np.radians(seen), float(cycle > rest)
        return message

    runner = bank("coordinated_turn")
    runner.follow(LAG_CYCLES + rest, lambda cycle: {1: track(cycle)})
    assert runner.output("filtered")[4] == pytest.approx(np.pi / 2, abs=0.05)
    for _ in range(30):
        runner.give(with_yaw(runner.cycle - LAG_CYCLES))
    packet = runner.packet()
    yaw = np.degrees(evaluate_prediction(packet[:], packet.stamp)[3])
    assert yaw == pytest.approx(expected) and np.degrees(runner.output("filtered")[4]) == pytest.approx(expected)


def lost_from(first, track):
    """A track that is not seen from a cycle on: its position stays in the message."""
    return lambda cycle: (track(min(cycle, first - 1)), LOST if cycle >= first else MOVING, min(cycle, first - 1))


def test_an_object_is_expected_only_while_it_is_not_seen():
    runner = bank()
    hidden = lost_from(READY, circle)
    runner.follow(LAG_CYCLES + READY, lambda cycle: {1: hidden(cycle), 2: line(cycle)})
    assert runner.expected() == {}
    for cycle in range(READY, READY + 20):
        runner.follow(1, lambda cycle: {1: hidden(cycle), 2: line(cycle)})
        ((number, (position, velocity, std)),) = runner.expected().items()
        assert number == 1
        assert TrackPredictions(runner.output("expected")).time == pytest.approx(stamp_of(cycle + 1))
        np.testing.assert_allclose(position, circle(cycle + 1), atol=2e-3)
        np.testing.assert_allclose(velocity, (circle(cycle + 2) - circle(cycle + 1)) / VISION_PERIOD, atol=0.02)
        assert 0.0 < std < 0.05
    runner.follow(1, lambda cycle: {1: circle(cycle), 2: line(cycle)})
    assert runner.expected() == {}


def test_what_is_not_seen_makes_no_packet_and_no_point():
    runner = bank()
    hidden = lost_from(READY, circle)
    runner.follow(LAG_CYCLES + READY, lambda cycle: {1: hidden(cycle)})
    packet, member = runner.output("prediction"), runner.members()[1]
    runner.follow(10, lambda cycle: {1: hidden(cycle)})
    np.testing.assert_array_equal(runner.output("prediction"), packet)
    assert runner.members()[1].stamp == member.stamp


def test_an_estimator_that_is_not_ready_expects_nothing():
    runner = bank("closed_path")
    hidden = lost_from(1, circle)
    runner.follow(LAG_CYCLES + 3, lambda cycle: {1: hidden(cycle)})
    assert set(runner.members()) == {1} and runner.expected() == {}


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf, 1e7])
def test_bad_numbers_change_nothing(wrong):
    runner = bank()
    runner.follow(LAG_CYCLES + READY, lambda cycle: {1: circle(cycle), 2: line(cycle)})
    packet, members = runner.output("prediction"), runner.members()
    bad = np.array([wrong, 0.0, 0.485])
    runner.follow(3, lambda cycle: {1: bad, 2: line(cycle)})
    np.testing.assert_array_equal(runner.output("prediction"), packet)
    assert runner.members()[1].stamp == members[1].stamp
    runner.follow(READY, lambda cycle: {1: circle(cycle), 2: line(cycle)})
    after = runner.packet()
    assert after.seq > Prediction(packet).seq
    np.testing.assert_allclose(after[:][5:8], circle(after.stamp / VISION_PERIOD), atol=1e-3)


@pytest.mark.parametrize(("cycles", "why"), [(LAG_CYCLES + 3, "future"), (-700, "past"), (0, "again")])
def test_a_stamp_that_cannot_be_right_changes_nothing(cycles, why):
    runner = bank()
    runner.follow(LAG_CYCLES + READY, lambda cycle: {1: circle(cycle)})
    packet, stamp = runner.output("prediction"), runner.members()[1].stamp
    newest = runner.cycle - 1 - LAG_CYCLES
    runner.give(tracks_message(newest + cycles, {1: circle(newest)}))
    np.testing.assert_array_equal(runner.output("prediction"), packet)
    assert runner.members()[1].stamp == stamp


def test_a_message_that_is_not_valid_keeps_all_estimators():
    runner = bank()
    runner.follow(LAG_CYCLES + READY, lambda cycle: {1: circle(cycle)})
    runner.give(np.zeros(message_size(TrackPoints)))
    assert set(runner.members()) == {1}


def test_a_full_message_is_read_whole():
    runner = bank("coordinated_turn")
    offsets = {number: np.array([0.0, 0.05 * number, 0.0]) for number in range(1, TRACK_SLOTS + 1)}
    hidden = {number: lost_from(READY, lambda cycle, offset=offset: line(cycle) + offset)
              for number, offset in offsets.items()}  # fmt: skip
    runner.follow(LAG_CYCLES + READY + 1, lambda cycle: {number: track(cycle) for number, track in hidden.items()})
    expected = runner.expected()
    assert list(expected) == list(offsets)
    for number, (position, _, _) in expected.items():
        np.testing.assert_allclose(position, line(READY + 1) + offsets[number], atol=5e-3)


def test_a_cloned_context_goes_on_in_the_same_way():
    def both(cycle):
        return {1: circle(cycle), 2: line(cycle)}

    runner = bank()
    runner.follow(LAG_CYCLES + READY, both)
    other = Runner(runner.system)
    other.simulator, other.cycle = Simulator(runner.system, runner.context.Clone()), runner.cycle
    kept = runner.output("prediction")
    other.follow(20, both)
    np.testing.assert_array_equal(runner.output("prediction"), kept)
    runner.follow(20, both)
    for name in ("prediction", "filtered", "expected"):
        np.testing.assert_array_equal(runner.output(name), other.output(name))


def test_a_bad_row_does_not_stop_the_estimators_of_other_tracks():
    runner = bank()
    runner.follow(LAG_CYCLES + READY, lambda cycle: {1: circle(cycle), 2: line(cycle)})
    seq = runner.packet().seq
    runner.follow(3, lambda cycle: {1: circle(cycle), 2: np.array([np.nan, 0.0, 0.485])})
    assert runner.packet().seq == seq + 3
