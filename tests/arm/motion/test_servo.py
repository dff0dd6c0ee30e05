import numpy as np
import pytest
from variants import variant

from drake_tracker.arm.config import ServoConfig
from drake_tracker.arm.motion.servo import RESTART_DISTANCE, Servo
from drake_tracker.core.messages import (
    KNOT_COUNT,
    KNOT_SPACING,
    TARGET_STRIDE,
    Frozen,
    Prediction,
    ServoTarget,
    message_size,
    pack_prediction,
)
from drake_tracker.core.timing import SERVO_PERIOD

RADIUS, SPEED = 0.12, 0.2
LEAD = 0.0308
LAG = 0.26
PATH_LENGTH = KNOT_SPACING * (KNOT_COUNT - 1)
NOTHING = np.zeros(message_size(Prediction))


def poses(x, y, yaw):
    return np.stack(np.broadcast_arrays(x, y, 0.485, yaw), axis=-1)


def circle(t, direction=1.0):
    a = direction * SPEED / RADIUS * t
    return poses(0.56 + RADIUS * np.cos(a), RADIUS * np.sin(a), a + direction * np.pi / 2)


def oval(t):
    a = SPEED / np.hypot(0.16, 0.22) * np.sqrt(2.0) * t
    heading = np.arctan2(0.22 * np.cos(a), -0.16 * np.sin(a))
    nearest = np.round((a + np.pi / 2 - heading) / (2 * np.pi))
    return poses(0.56 + 0.16 * np.cos(a), 0.22 * np.sin(a), heading + 2 * np.pi * nearest)


def still(t):
    return poses(0.6 + 0.0 * t, 0.1, 0.3)


def packet_at(stamp, path=circle, seq=0, turns=0):
    times = stamp + KNOT_SPACING * np.arange(KNOT_COUNT)
    return pack_prediction(stamp, seq, np.column_stack([path(times) + [0, 0, 0, 2 * np.pi * turns], 0.001 + times]))


def run(servo, start, stop, packet_of, state=None, frozen=Frozen.FREE):
    """Ticks from ``start`` to ``stop`` [s] with the packet that packet_of(time) gives; returns all states."""
    states = []
    state = servo.initial_state() if state is None else state
    for k in range(round((stop - start) / SERVO_PERIOD)):
        time = start + k * SERVO_PERIOD
        state = servo.update(state, time, packet_of(time), frozen)
        states.append(state)
    return states


def live(path=circle):
    return lambda time: packet_at(time - LAG, path)


def errors(states, path=circle):
    error = np.array([state.x - path(state.due) for state in states])
    error[:, 3] -= 2 * np.pi * np.round(error[0, 3] / (2 * np.pi))  # whole turns are the filter's own affair
    return error


@pytest.mark.parametrize("path, bound", [(circle, 1.3e-3), (oval, 0.6e-3)])
def test_follows_the_newest_packet_advanced_to_the_instant_the_set_point_is_due(path, bound):
    states = run(Servo(lead=LEAD), 1.0, 12.0, live(path))
    error = errors(states, path)
    assert states[0].due == 1.0 + LEAD
    assert np.linalg.norm(error[0, :3]) < 2e-4  # it starts on the path, with its rates
    assert np.max(np.linalg.norm(error[:, :3], axis=1)) < bound
    assert np.max(np.abs(error[:, 3])) < np.deg2rad(1.2)


def test_a_faster_filter_follows_more_closely():
    slow, quick = (run(Servo(ServoConfig(tracking_index=index), lead=LEAD), 1.0, 8.0, live()) for index in (0.01, 0.2))
    worst = [np.max(np.linalg.norm(errors(states)[-60:, :3], axis=1)) for states in (slow, quick)]
    assert worst[1] < 2e-4 < worst[0]


def test_noise_of_the_packets_is_smoothed():
    rng = np.random.default_rng(5)

    def noisy(time):
        offset = [*rng.normal(0.0, 0.003, 3), rng.normal(0.0, 0.05)]
        return packet_at(time - LAG, lambda t: still(t) + offset)

    states = run(Servo(lead=LEAD), 1.0, 16.0, noisy)[100:]
    std = np.std([state.x for state in states], axis=0)
    assert np.all(std[:3] < 0.65 * 0.003) and std[3] < 0.6 * 0.05
    assert np.all(std > 0.0)


def test_a_packet_out_of_order_or_invalid_is_ignored():
    servo = Servo(lead=LEAD)
    state = run(servo, 1.0, 2.0, live())[-1]
    wrong = packet_at(state.packet[0] - 0.1, lambda t: still(t) + [1.0, 0, 0, 0])
    invalid = packet_at(state.packet[0] + 1.0, lambda t: still(t) + [1.0, 0, 0, 0])
    invalid[4] = 0.0
    for packet in (wrong, invalid, NOTHING):
        after = servo.update(state, 2.0, packet, Frozen.FREE)
        np.testing.assert_array_equal(after.packet, state.packet)
        assert after.arrived == state.arrived
        assert np.linalg.norm((after.x - circle(after.due))[:3]) < 2e-3


def test_a_packet_that_arrives_twice_counts_once():
    servo = Servo(lead=LEAD)
    state = run(servo, 1.0, 2.0, live())[-1]
    once = servo.update(state, 2.0, packet_at(1.75), Frozen.FREE)
    twice = servo.update(once, 2.03, packet_at(1.75), Frozen.FREE)
    assert twice.arrived == once.arrived == 2.0
    nothing = servo.update(once, 2.03, NOTHING, Frozen.FREE)
    np.testing.assert_array_equal(twice.x, nothing.x)


def test_a_packet_with_a_nan_is_refused():
    servo = Servo(lead=LEAD)
    state = run(servo, 1.0, 2.0, live())[-1]
    broken = packet_at(1.9)
    broken[20] = np.nan
    after = servo.update(state, 2.0, broken, Frozen.FREE)
    np.testing.assert_array_equal(after.packet, state.packet)
    assert np.all(np.isfinite(servo.target(after)))


def test_without_packets_it_follows_the_last_path_then_coasts_and_then_gives_up():
    servo = Servo(lead=LEAD, coast=0.3)
    state = run(servo, 1.0, 3.0, live())[-1]
    end = state.packet[0] + PATH_LENGTH
    states = run(servo, 3.0, end + 1.0, lambda time: NOTHING, state)
    due = np.array([each.due for each in states])
    error = np.linalg.norm(errors(states)[:, :3], axis=1)
    assert np.max(error[due <= end]) < 1.5e-3
    coasting = [each for each in states if each.due > end]
    velocity = np.array([each.v for each in coasting])
    np.testing.assert_array_equal(velocity, np.broadcast_to(velocity[0], velocity.shape))  # constant velocity
    steps = np.diff([each.x for each in coasting], axis=0)
    np.testing.assert_allclose(steps, SERVO_PERIOD * velocity[1:], atol=1e-12)
    assert [each.valid for each in states] == list(due <= end + 0.3)
    assert np.any(due > end + 0.3)


def test_the_target_is_stale_after_stale_after_without_packets_until_the_next_packet():
    servo = Servo(variant(ServoConfig, stale_after=0.2)(), lead=LEAD)
    first = servo.update(servo.initial_state(), 1.0, packet_at(0.75), Frozen.FREE)
    assert not first.stale
    states = run(servo, 1.0 + SERVO_PERIOD, 1.5, lambda time: packet_at(0.75), first)
    ages = 1.0 + SERVO_PERIOD * np.arange(1, len(states) + 1) - 1.0
    assert [each.stale for each in states] == list(ages > 0.2)
    assert sum(each.stale for each in states) >= 8 and all(each.valid for each in states)
    assert not servo.update(states[-1], 1.5, packet_at(1.25), Frozen.FREE).stale


def test_before_the_first_packet_nothing_is_valid():
    servo = Servo(lead=LEAD)
    for state in run(servo, 0.0, 0.3, lambda time: NOTHING):
        said = ServoTarget(servo.target(state))
        assert said.valid == 0.0 and said.stale == 1.0 and said.std == 0.0
        assert np.all(np.isfinite(said[:]))


def test_while_blind_it_ignores_new_packets_and_follows_the_path_it_holds():
    servo = Servo(lead=LEAD)
    state = run(servo, 1.0, 3.0, live())[-1]

    def elsewhere(time):
        return packet_at(time - LAG, lambda t: circle(t) + [0.03, 0.0, 0.05, 0.5])

    states = run(servo, 3.0, 3.9, elsewhere, state, frozen=Frozen.BLIND)
    assert all(np.array_equal(each.packet, state.packet) for each in states)
    assert np.max(np.linalg.norm(errors(states)[:, :3], axis=1)) < 1.5e-3
    assert not any(each.stale for each in states)  # it is not asked, so it does not complain
    thawed = servo.update(states[-1], 3.9, elsewhere(3.9), Frozen.FREE)
    assert thawed.packet[0] == pytest.approx(3.9 - LAG) and not thawed.stale


def test_packets_that_stopped_while_it_was_blind_are_stale_when_it_sees_again():
    servo = Servo(lead=LEAD)
    state = run(servo, 1.0, 3.0, live())[-1]
    last = packet_at(3.1 - LAG)
    state = run(servo, 3.0, 3.9, lambda time: packet_at(min(time, 3.1) - LAG), state, frozen=Frozen.BLIND)[-1]
    thawed = servo.update(state, 3.9, last, Frozen.FREE)
    assert thawed.packet[0] == last[0] and thawed.stale


def test_it_starts_again_where_the_path_jumps():
    servo = Servo(lead=LEAD)
    state = run(servo, 1.0, 3.0, live())[-1]

    def moved(t):
        return circle(t) + [0.0, 2 * RESTART_DISTANCE, 0.0, 0.0]

    states = run(servo, 3.0, 4.0, live(moved), state)
    error = np.linalg.norm(errors(states, moved)[:, :3], axis=1)
    assert np.max(error) < 1.5e-3
    assert np.linalg.norm(states[0].v[:2]) == pytest.approx(SPEED, rel=0.02)


def test_a_small_jump_is_smoothed_instead():
    servo = Servo(lead=LEAD)
    state = run(servo, 1.0, 3.0, live(still))[-1]
    jump = 0.5 * RESTART_DISTANCE
    shifted = servo.update(state, 3.0, packet_at(3.0 - LAG, lambda t: still(t) + [jump, 0, 0, 0]), Frozen.FREE)
    assert 0.1 * jump < shifted.x[0] - 0.6 < 0.5 * jump


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_direction_stays_continuous_when_packets_wrap_it_differently(direction):
    def path(t):
        return circle(t, direction)

    def wrapped(time):  # each packet begins within +-pi, as an estimator's does
        turns = -np.round(path(time - LAG)[3] / (2 * np.pi))
        return packet_at(time - LAG, path, turns=turns)

    states = run(Servo(lead=LEAD), 1.0, 12.0, wrapped)
    yaw = np.array([state.x[3] for state in states])
    np.testing.assert_allclose(np.diff(yaw), direction * SPEED / RADIUS * SERVO_PERIOD, atol=5e-3)
    assert abs(yaw[-1] - yaw[0]) > 4 * np.pi


def test_the_target_is_finite_and_close_whatever_the_link_does():
    rng = np.random.default_rng(9)
    servo = Servo(lead=LEAD)
    newest = packet_at(0.75)
    state = servo.update(servo.initial_state(), 1.0 - SERVO_PERIOD, newest, Frozen.FREE)
    for k in range(1500):
        time = 1.0 + k * SERVO_PERIOD
        draw = rng.uniform()
        if draw < 0.3:  # dropped, late, out of order, again and again the same
            newest = packet_at(time - LAG - rng.uniform(0.0, 0.2))
        packet = NOTHING if draw > 0.95 else newest
        state = servo.update(state, time, packet, Frozen.BLIND if draw > 0.7 else Frozen.FREE)
        said = servo.target(state)
        assert np.all(np.isfinite(said))
        assert np.linalg.norm((state.x - circle(state.due))[:3]) < 2e-3
    assert ServoTarget(said).valid == 1.0


def test_two_ticks_at_the_same_time_cause_no_division_by_zero():
    servo = Servo(lead=LEAD)
    state = servo.update(servo.initial_state(), 1.0, packet_at(0.75), Frozen.FREE)
    again = servo.update(state, 1.0, packet_at(0.76), Frozen.FREE)
    assert np.all(np.isfinite(servo.target(again)))


def test_the_target_names_the_packet_it_rests_on():
    servo = Servo(lead=LEAD)
    state = servo.update(servo.initial_state(), 1.0, packet_at(0.75, seq=42), Frozen.FREE)
    said = ServoTarget(servo.target(state))
    assert (said.time, said.stamp, said.seq, said.valid, said.stale) == (1.0 + LEAD, 0.75, 42.0, 1.0, 0.0)
    assert said.std == pytest.approx(0.001 + 1.0 + LEAD)  # the packet's own std at that time
    np.testing.assert_allclose([said.x, said.y, said.z], circle(1.0 + LEAD)[:3], atol=2e-4)
    assert said.yaw_rate == pytest.approx(SPEED / RADIUS)
    assert np.hypot(said.vx, said.vy) == pytest.approx(SPEED, rel=0.01)


def test_a_state_cannot_be_changed_and_copies_to_itself():
    servo = Servo()
    state = servo.update(servo.initial_state(), 1.0, packet_at(0.75), Frozen.FREE)
    for array in (state.x, state.v, state.a, state.packet):
        with pytest.raises(ValueError):
            array[0] = 1.0
    assert state.__deepcopy__({}) is state


def test_a_guided_descent_follows_a_change_of_speed_at_once():
    """An object on a line that stops: how far the filter runs beyond it within 0.3 s."""

    def stops(t):
        return poses(0.5 + 0.2 * np.minimum(t, 2.0), 0.1, 0.0)

    def packet(time):  # what a filter predicts that sees the object without delay
        stamp = time
        times = KNOT_SPACING * np.arange(KNOT_COUNT)
        speed = 0.2 * (stamp < 2.0)
        knots = poses(float(stops(stamp)[0]) + speed * times, 0.1, 0.0)
        return pack_prediction(stamp, 0, np.column_stack([knots, 0.001 + times]))

    servo = Servo(lead=LEAD)
    before = run(servo, 0.0, 2.0, packet)[-1]
    late = {
        frozen: max(abs(each.x[0] - 0.9) for each in run(servo, 2.0, 2.3, packet, state=before, frozen=frozen))
        for frozen in (Frozen.FREE, Frozen.GUIDED, Frozen.BLIND)
    }
    assert 2.0 * late[Frozen.GUIDED] < late[Frozen.FREE] < 0.01 < 0.05 < late[Frozen.BLIND]


def test_a_guided_descent_follows_the_end_of_a_bend_with_little_overshoot():
    """A bend of 0.12 m radius that becomes a straight at 0.15 m/s: the greatest error of the direction."""

    def straightens(t):
        return poses(0.56, 0.1, 1.25 * np.minimum(t, 2.0))

    def packet(time):  # what a filter predicts that knows the path
        return packet_at(time - LAG, straightens)

    servo = Servo(lead=LEAD)
    before = run(servo, 0.0, 2.0 - LEAD, packet)[-1]
    worst = {
        frozen: np.rad2deg(max(abs(each.x[3] - 2.5) for each in states[3:]))
        for frozen in (Frozen.FREE, Frozen.GUIDED)
        for states in [run(servo, 2.0 - LEAD, 2.6, packet, state=before, frozen=frozen)]
    }
    assert worst[Frozen.GUIDED] < 1.5 < 3.0 < worst[Frozen.FREE], worst


def test_a_guided_descent_stays_with_its_object():
    """A packet about another object, a track with another number, is not followed before the descent is over."""
    servo = Servo(lead=LEAD)
    before = run(servo, 0.0, 1.0, live(still))[-1]
    other = 2 * TARGET_STRIDE
    states = run(servo, 1.0, 1.3, lambda time: packet_at(time - LAG, circle, other), before, frozen=Frozen.GUIDED)
    np.testing.assert_allclose(states[-1].x[:2], (0.6, 0.1), atol=1e-6)
    free = servo.update(states[-1], 1.3, packet_at(1.3 - LAG, circle, other), Frozen.FREE)
    assert np.linalg.norm(free.x[:2] - circle(free.due)[:2]) < 0.01


def test_an_object_that_does_not_turn_keeps_its_direction_and_its_path():
    turning, fixed = (run(Servo(lead=LEAD, yaw=yaw), 1.0, 4.0, live()) for yaw in (None, 0.5))
    for with_path, without in zip(turning[20:], fixed[20:]):
        np.testing.assert_array_equal(without.x[:3], with_path.x[:3])
        assert without.x[3] == pytest.approx(0.5) and without.v[3] == pytest.approx(0.0, abs=1e-9)
        np.testing.assert_array_equal(Prediction(without.packet).stamp, Prediction(with_path.packet).stamp)
