from dataclasses import replace

import numpy as np
import pytest

from drake_tracker.arm.arm_model import tool_down
from drake_tracker.arm.description import PUMA560
from drake_tracker.arm.motion.differential_ik import joints_for
from drake_tracker.arm.motion.tool_motion import MotionFrame
from drake_tracker.core.messages import (
    KNOT_COUNT,
    KNOT_SPACING,
    ArmCommand,
    Frozen,
    JawState,
    OperatorCommand,
    ServoTarget,
    ToolStatus,
    message_size,
    pack_prediction,
)
from drake_tracker.core.timing import SERVO_PERIOD
from drake_tracker.grasp.config import GraspConfig
from drake_tracker.grasp.gate import Gate
from drake_tracker.grasp.jaws import FORCE_SHARE, GRIP_CONFIRMED, OBLIQUE_CONFIRMED
from drake_tracker.grasp.prediction_memory import PredictionMemory
from drake_tracker.grasp.train.grasp_machine import (
    GUIDED_RETREAT,
    LONGEST_WAIT,
    PATIENCE,
    SEEN_FOR,
    GraspMachine,
    GraspObservation,
)
from drake_tracker.grasp.train.schema import BY_HAND, PROGRAMS, Phase

PARAMETERS = GraspConfig(descent="blind", gate="auto")
WIDTH, OPENING, FORCE = PARAMETERS.object_width, PARAMETERS.jaw_opening, PARAMETERS.grip_force
LAG, LEAD = 0.25, 0.045


def path(t):
    a = 1.25 * np.asarray(t)
    pose = np.broadcast_arrays(0.56 + 0.12 * np.cos(a), 0.12 * np.sin(a), 0.485, a + np.pi / 2)
    return np.stack(pose, axis=-1)


def good_memory(stamp):
    """Predictions made here one lap earlier that came true, and lead where those of now lead."""
    here, there = path(stamp)[[0, 1, 3]], path(stamp + 0.7)[[0, 1, 3]]
    return PredictionMemory(
        (), np.array([[stamp - 10.0 + 0.03 * k, *here, 0.0, 0.0, 0.0, *there, 0.01, 0.0] for k in range(6)])
    )


class Bench:
    """Ticks of a GraspMachine; the hand is always just where it was sent."""

    def __init__(self, model, parameters=PARAMETERS):
        self.machine = GraspMachine(parameters, model, SERVO_PERIOD, 0.485)
        self.model = model
        self.state = self.machine.initial_state()
        self.time = 20.0
        self.commands = []

    def tick(
        self,
        valid=1,
        stale=0,
        flipping=0,
        fraction=1.0,
        width=OPENING,
        force=0.0,
        packet=None,
        operator=(0, 0, 0, 0, 0),
        ahead=0.0,
        left=0.0,
        jaw_speed=0.0,
    ):
        """Ticks once. The predicted path is ``ahead`` of the hand and to the ``left`` of it [m]."""
        stamp, due = self.time - LAG, self.time + LEAD
        if packet is None:
            times = stamp + KNOT_SPACING * np.arange(KNOT_COUNT)
            knots = np.column_stack([path(times), np.full(KNOT_COUNT, 0.002)])
            knots[:, 0] += ahead * np.cos(knots[:, 3]) - left * np.sin(knots[:, 3])
            knots[:, 1] += ahead * np.sin(knots[:, 3]) + left * np.cos(knots[:, 3])
            packet = pack_prediction(stamp, 1, knots)
        target = ServoTarget(np.array([due, *path(due), 0, 0, 0, 1.25, stamp, 1, 0.002, stale, valid]))
        status = ToolStatus(np.array([self.state.motion, fraction, flipping, *path(due), 1.0]))
        jaws = JawState(np.array([width, jaw_speed, force]))
        operator = OperatorCommand(np.array([*operator, 0.0]))
        q = self.joints(due - SERVO_PERIOD)
        self.state = self.machine.update(
            self.state, GraspObservation(self.time, target, packet, jaws, status, q, operator)
        )
        self.commands.append(ArmCommand(self.machine.command(self.state)))
        self.time += SERVO_PERIOD
        return self.state.phase

    def joints(self, due):
        if self.state.phase != Phase.TRACK:
            return np.zeros(6)
        x, y, z, yaw = path(due)
        over = tool_down([x, y, z + self.machine.config.hover_height], yaw + np.pi)
        return joints_for(self.model, PUMA560.q_start, over)

    def until(self, phase, limit=200, **seen):
        """Ticks until a phase is entered; returns the time [s] it took."""
        start = self.time
        for _ in range(limit):
            if self.tick(**seen) == phase:
                return self.time - start
        raise AssertionError(f"never in {phase.name}: {self.state.phase.name}, gate {self.state.gate.name}")

    def put(self, phase, **changes):
        """Puts the machine into a phase that has just been entered."""
        self.state = replace(self.state, phase=phase, entered=self.time, gripped_since=np.inf, **changes)

    def remember_well(self):
        self.state = replace(self.state, memory=good_memory(self.time - LAG))


@pytest.fixture
def bench(arm_model):
    return Bench(arm_model)


def open_gate(bench):
    """Tracks until settled, remembers that predictions from here came true, and lets the machine go."""
    bench.put(Phase.TRACK)
    bench.state = replace(bench.state, entered=bench.time - 10.0)
    bench.remember_well()
    return bench.tick()


def test_it_waits_for_an_object_seen_for_a_while(bench):
    for _ in range(5):
        assert bench.tick(valid=0) == Phase.ACQUIRE
    took = bench.until(Phase.TRACK)
    assert took == pytest.approx(SEEN_FOR + SERVO_PERIOD, abs=1.1 * SERVO_PERIOD)
    assert bench.commands[-1].frame == MotionFrame.OBJECT
    assert bench.commands[0].frame == MotionFrame.HOME


def test_a_stale_or_flickering_object_is_not_seen(bench):
    for _ in range(40):
        assert bench.tick(stale=1) == Phase.ACQUIRE
    for k in range(40):
        assert bench.tick(valid=float(k % 4 != 0)) == Phase.ACQUIRE


def test_a_lost_object_sends_it_home(bench):
    bench.put(Phase.TRACK)
    assert bench.tick(stale=1) == Phase.TRACK  # coasting is not lost
    assert bench.tick(valid=0, stale=1) == Phase.ACQUIRE


def test_with_hold_it_stands_still_above_while_no_packets_arrive(arm_model):
    bench = Bench(arm_model, replace(PARAMETERS, when_stale="hold"))
    bench.until(Phase.TRACK)
    assert bench.tick(stale=1) == Phase.HOVER
    said = bench.commands[-1]
    assert (said.frame, said.height, said.frozen) == (MotionFrame.HELD, PARAMETERS.hover_height, 0.0)
    for _ in range(40):
        assert bench.tick(valid=0, stale=1) == Phase.HOVER
    assert bench.until(Phase.TRACK) == pytest.approx(SEEN_FOR + SERVO_PERIOD, abs=1.1 * SERVO_PERIOD)


def test_with_hold_a_descent_that_has_begun_is_blind_all_the_same(arm_model):
    bench = Bench(arm_model, replace(PARAMETERS, when_stale="hold"))
    open_gate(bench)
    assert bench.state.phase == Phase.INTERCEPT
    for _ in range(5):
        assert bench.tick(stale=1) == Phase.INTERCEPT


def test_the_whole_success(bench):
    bench.until(Phase.TRACK)
    bench.state = replace(bench.state, entered=bench.time - 10.0)
    bench.remember_well()
    assert bench.tick() == Phase.INTERCEPT
    assert bench.state.gate == Gate.OPEN
    to_close = bench.until(Phase.CLOSE)
    assert to_close == pytest.approx(PARAMETERS.descent_duration - PARAMETERS.closing_lead, abs=0.1 * SERVO_PERIOD)
    for _ in range(4):
        assert bench.tick(width=0.06, force=2.0) == Phase.CLOSE
    to_lift = bench.until(Phase.LIFT, width=WIDTH + 0.001, force=FORCE)
    assert to_lift == pytest.approx(GRIP_CONFIRMED + SERVO_PERIOD, abs=1.1 * SERVO_PERIOD)
    to_hold = bench.until(Phase.HOLD, width=WIDTH + 0.001, force=FORCE)
    assert to_hold == pytest.approx(PARAMETERS.lift_duration, abs=1.1 * SERVO_PERIOD)
    for _ in range(100):
        assert bench.tick(width=WIDTH, force=FORCE) == Phase.HOLD
    assert bench.state.attempts == 1


def test_the_jaws_begin_to_close_before_the_descent_ends(bench):
    assert open_gate(bench) == Phase.INTERCEPT
    start, first = bench.time - SERVO_PERIOD, None
    while first is None:
        bench.tick()
        if bench.commands[-1].jaw_width < OPENING - 1e-9:
            first = bench.time - SERVO_PERIOD - start
    assert first < PARAMETERS.descent_duration - 0.5 * PARAMETERS.closing_lead
    assert first >= PARAMETERS.descent_duration - PARAMETERS.closing_lead - 1e-9


def test_the_jaws_begin_to_close_after_as_many_ticks_whenever_the_descent_began(arm_model):
    """Times of ticks are sums that are rounded, each to another side."""
    closings = set()
    for k in range(150):
        bench = Bench(arm_model)
        bench.time = (37 + k + 0.7) * SERVO_PERIOD
        bench.put(Phase.INTERCEPT)
        ticks = 0
        while bench.tick() == Phase.INTERCEPT:
            ticks += 1
            bench.time = (37 + k + 0.7 + ticks) * SERVO_PERIOD
        closings.add(ticks)
    assert closings == {round((PARAMETERS.descent_duration - PARAMETERS.closing_lead) / SERVO_PERIOD)}


def test_after_a_miss_the_object_must_be_seen_anew(bench):
    bench.until(Phase.TRACK)
    bench.put(Phase.RETREAT)
    bench.until(Phase.ACQUIRE)
    assert bench.until(Phase.TRACK) >= SEEN_FOR - 1e-6


@pytest.mark.parametrize("descent", ["blind", "guided"])
def test_a_guided_hand_leaves_a_missed_object_quickly_but_not_the_operators_goal(arm_model, descent):
    durations = {}
    for phase in (Phase.CLOSE, Phase.STOPPED):
        bench = Bench(arm_model, replace(PARAMETERS, descent=descent))
        bench.put(phase)
        assert bench.tick(width=0.0) == Phase.RETREAT
        assert bench.until(Phase.ACQUIRE) == pytest.approx(bench.commands[0].duration, abs=1.01 * SERVO_PERIOD)
        durations[phase] = bench.commands[0].duration
    normal = PARAMETERS.retreat_duration
    assert durations == {Phase.CLOSE: GUIDED_RETREAT if descent == "guided" else normal, Phase.STOPPED: normal}


def test_what_lies_beyond_the_end_of_the_predicted_path_is_out_of_reach(arm_model):
    bench = Bench(arm_model, replace(PARAMETERS, descent_duration=1.4))
    assert open_gate(bench) == Phase.TRACK
    assert bench.state.gate == Gate.OUT_OF_REACH


def test_a_miss_is_noticed_when_the_jaws_meet_and_is_followed_by_another_attempt(bench):
    open_gate(bench)
    bench.until(Phase.CLOSE)
    assert bench.tick(width=WIDTH) == Phase.CLOSE  # on the way
    assert bench.tick(width=WIDTH - 0.011) == Phase.RETREAT
    assert bench.until(Phase.ACQUIRE) == pytest.approx(PARAMETERS.retreat_duration, abs=1.1 * SERVO_PERIOD)
    bench.until(Phase.TRACK)
    assert open_gate(bench) == Phase.INTERCEPT
    assert bench.state.attempts == 2


def test_jaws_that_stop_without_force_have_missed_after_the_timeout(bench):
    bench.put(Phase.CLOSE)
    took = bench.until(Phase.RETREAT, width=0.055, force=FORCE)  # too wide for the object
    assert took == pytest.approx(PARAMETERS.close_timeout, abs=2.1 * SERVO_PERIOD)
    bench.put(Phase.CLOSE)
    bench.until(Phase.RETREAT, width=WIDTH, force=0.9 * FORCE_SHARE * FORCE)  # not gripped


@pytest.mark.parametrize("descent", ["blind", "guided"])
def test_a_guided_hand_waits_for_oblique_jaws_that_still_move(arm_model, descent):
    """Jaws that creep over the corners of an oblique object for 0.6 s, and then hold it, or creep on for too long."""
    bench = Bench(arm_model, replace(PARAMETERS, descent=descent))
    bench.remember_well()
    bench.put(Phase.CLOSE, jaw_width=WIDTH)
    took = bench.until(Phase.RETREAT, width=0.053, force=FORCE, jaw_speed=-0.02)
    longest = (PATIENCE if descent == "guided" else 1.0) * PARAMETERS.close_timeout
    assert took == pytest.approx(longest, abs=2.1 * SERVO_PERIOD)
    bench.remember_well()
    bench.put(Phase.CLOSE, jaw_width=WIDTH)
    start = bench.time
    while bench.time < start + PARAMETERS.close_timeout + 0.1 and bench.state.phase == Phase.CLOSE:
        bench.tick(width=0.053, force=FORCE, jaw_speed=-0.02)
    assert bench.state.phase == (Phase.CLOSE if descent == "guided" else Phase.RETREAT)
    if descent == "guided":
        assert bench.until(Phase.LIFT, width=WIDTH, force=FORCE) < 0.15


def test_a_guided_hand_lifts_an_object_that_stays_oblique(arm_model):
    """Its jaws stood at 51 to 56 mm about a train of 40 mm; the hand opened them, and the train fell off its track."""
    bench = Bench(arm_model, replace(PARAMETERS, descent="guided"))
    for width, force, lifts in (
        (0.055, FORCE, True),
        (0.055, 0.9 * FORCE_SHARE * FORCE, False),  # hardly pressed
        (OPENING - 0.005, FORCE, False),  # the fingers stand on something
    ):
        bench.remember_well()
        bench.put(Phase.CLOSE, jaw_width=WIDTH, jaws_moved=bench.time)
        if not lifts:
            bench.until(Phase.RETREAT, width=width, force=force)
            continue
        took = bench.until(Phase.LIFT, width=width, force=force)
        assert took == pytest.approx(OBLIQUE_CONFIRMED + SERVO_PERIOD, abs=1.1 * SERVO_PERIOD)
        assert bench.tick(width=width, force=force) == Phase.LIFT


def test_a_short_touch_is_no_grip(bench):
    bench.put(Phase.CLOSE)
    for k in range(12):
        assert bench.tick(width=WIDTH, force=FORCE * (k % 2)) == Phase.CLOSE


@pytest.mark.parametrize("phase", [Phase.LIFT, Phase.HOLD])
def test_an_object_that_slips_out_counts_as_missed_at_once(bench, phase):
    bench.put(phase)
    assert bench.tick(width=WIDTH, force=FORCE) == phase
    assert bench.tick(width=0.01, force=FORCE) == Phase.RETREAT
    assert bench.commands[-1].jaw_width > 0.0  # they open again


def test_force_that_fades_while_lifting_does_not_drop_a_held_object(bench):
    bench.put(Phase.LIFT)
    for _ in range(10):
        assert bench.tick(width=WIDTH, force=0.3 * FORCE) == Phase.LIFT


@pytest.mark.parametrize("phase", [Phase.INTERCEPT, Phase.CLOSE, Phase.LIFT])
def test_once_committed_it_does_not_use_vision(bench, phase):
    bench.put(phase)
    for _ in range(5):
        bench.tick(valid=0, stale=1, width=WIDTH, force=FORCE * (phase == Phase.LIFT))
    assert bench.state.phase == phase


def test_the_motion_counter_goes_up_with_every_new_motion_and_with_no_other_change(bench):
    bench.until(Phase.TRACK)
    assert open_gate(bench) == Phase.INTERCEPT
    bench.until(Phase.CLOSE)
    bench.until(Phase.LIFT, width=WIDTH, force=FORCE)
    bench.until(Phase.HOLD, width=WIDTH, force=FORCE)
    bench.until(Phase.RETREAT, width=0.0)
    bench.until(Phase.ACQUIRE)
    motion = [command.motion for command in bench.commands]
    phases = [Phase(int(command.phase)) for command in bench.commands]
    for k in range(1, len(motion)):
        changed = phases[k] != phases[k - 1]
        same = (phases[k - 1], phases[k]) in {(Phase.INTERCEPT, Phase.CLOSE), (Phase.LIFT, Phase.HOLD)}
        assert motion[k] - motion[k - 1] == (1 if changed and not same else 0)
    assert set(phases) == set(Phase) - {Phase.HOVER, *BY_HAND}


def test_the_jaws_move_at_their_speed_and_stop_at_their_ends(bench):
    bench.put(Phase.CLOSE)
    widths = [OPENING]
    for _ in range(14):
        bench.tick(width=0.05)
        widths.append(bench.commands[-1].jaw_width)
    bench.put(Phase.RETREAT)
    for _ in range(14):
        bench.tick()
        widths.append(bench.commands[-1].jaw_width)
    steps = np.diff(widths)
    assert np.max(np.abs(steps)) == pytest.approx(PARAMETERS.jaw_speed * SERVO_PERIOD)
    assert min(widths) == 0.0 and widths[-1] == pytest.approx(OPENING)
    assert np.sum(steps < 0) == np.sum(steps > 0) == int(np.ceil(OPENING / (PARAMETERS.jaw_speed * SERVO_PERIOD)))


def test_the_gate_gives_its_reasons_in_this_order(bench):
    bench.tick()
    assert bench.state.gate == Gate.NOT_TRACKING
    bench.put(Phase.TRACK)
    bench.tick(flipping=1, stale=1)
    assert bench.state.gate == Gate.STALE, "trouble on the link is not called settling"
    bench.tick(flipping=1)
    assert bench.state.gate == Gate.SETTLING
    bench.state = replace(bench.state, entered=bench.time - 10.0)
    bench.tick(flipping=1)
    assert bench.state.gate == Gate.FLIPPING
    bench.tick()
    assert bench.state.gate == Gate.NO_MEMORY
    memory = good_memory(bench.time - LAG)
    failed = memory.records.copy()
    failed[2, 4] = -0.02
    bench.state = replace(bench.state, memory=PredictionMemory((), failed))
    bench.tick()
    assert bench.state.gate == Gate.PREDICTIONS_FAILED and bench.state.remembered_error == pytest.approx(0.02)
    assert bench.state.phase == Phase.TRACK
    bench.remember_well()
    bench.machine.config = replace(PARAMETERS, descent_duration=0.1)
    bench.tick()
    bench.machine.config = PARAMETERS
    assert bench.state.gate == Gate.OUT_OF_REACH and bench.state.phase == Phase.TRACK
    bench.remember_well()
    assert bench.tick() == Phase.INTERCEPT and bench.state.gate == Gate.OPEN


def test_the_rehearsal_starts_from_the_last_set_point(bench, monkeypatch):
    asked = []
    monkeypatch.setattr("drake_tracker.grasp.train.grasp_machine.can_follow", lambda *question: asked.append(question))
    assert open_gate(bench) == Phase.TRACK
    assert bench.state.gate == Gate.OUT_OF_REACH
    ((_, _, _, q, packet, start, from_height, half_turns, duration),) = asked
    assert duration == PARAMETERS.descent_duration
    last_due = bench.time - SERVO_PERIOD + LEAD - SERVO_PERIOD
    assert start == pytest.approx(last_due)
    expected = path(last_due)[:3] + [0.0, 0.0, PARAMETERS.hover_height]
    np.testing.assert_allclose(bench.model.tool_pose(q).translation(), expected, atol=1e-5)
    assert packet[0] == pytest.approx(bench.time - SERVO_PERIOD - LAG)
    assert (from_height, half_turns) == (PARAMETERS.hover_height, 1.0)


def test_the_descent_to_a_standing_object_may_be_slower(bench, monkeypatch):
    """A standing train over which a joint was too slow for the descent was never grasped."""
    slow = 2.5 * PARAMETERS.descent_duration
    monkeypatch.setattr("drake_tracker.grasp.train.grasp_machine.can_follow", lambda *question: question[-1] == slow)
    assert open_gate(bench) == Phase.TRACK and bench.state.gate == Gate.OUT_OF_REACH
    monkeypatch.setattr("drake_tracker.grasp.train.grasp_machine.stands", lambda packet: True)
    bench.remember_well()
    assert bench.tick() == Phase.INTERCEPT
    assert bench.commands[-1].duration == pytest.approx(slow)
    wanted = slow - PARAMETERS.closing_lead
    assert bench.until(Phase.CLOSE) == pytest.approx(wanted, abs=2 * SERVO_PERIOD)


def test_it_settles_for_the_approach_and_a_while(bench):
    bench.put(Phase.TRACK)
    settling = 0
    while bench.state.gate in (Gate.SETTLING, Gate.NOT_TRACKING):
        bench.tick()
        settling += 1
    wanted = PARAMETERS.approach_duration + PARAMETERS.settle_time
    assert settling * SERVO_PERIOD == pytest.approx(wanted, abs=2 * SERVO_PERIOD)


def test_a_hand_that_still_approaches_waits_however_long_ago_the_phase_began(bench):
    bench.put(Phase.TRACK)
    bench.state = replace(bench.state, entered=bench.time - 10.0)
    bench.remember_well()
    assert bench.tick(fraction=0.5) == Phase.TRACK and bench.state.gate == Gate.SETTLING
    bench.remember_well()
    assert bench.tick() == Phase.INTERCEPT


def test_the_memory_grows_while_tracking_and_is_closed_while_blind(bench):
    bench.put(Phase.TRACK)
    for _ in range(40):
        bench.tick()
    waiting, records = len(bench.state.memory.waiting), len(bench.state.memory.records)
    assert waiting > 10 and records > 5
    for phase in (Phase.INTERCEPT, Phase.CLOSE, Phase.LIFT, Phase.HOLD, Phase.RETREAT):
        bench.put(phase)
        before = bench.state.memory
        bench.tick(width=WIDTH)
        assert bench.state.memory is before
    bench.put(Phase.ACQUIRE)
    bench.tick()
    assert bench.state.memory is not before


def test_the_command_is_the_phases_program(bench):
    bench.put(Phase.INTERCEPT)
    bench.tick()
    command = bench.commands[-1]
    assert (command.phase, command.frame, command.frozen) == (Phase.INTERCEPT, MotionFrame.OBJECT, 1.0)
    assert (command.height, command.duration) == (PARAMETERS.grasp_height, PARAMETERS.descent_duration)
    bench.put(Phase.LIFT)
    bench.tick(width=WIDTH)
    command = bench.commands[-1]
    assert (command.frame, command.height) == (MotionFrame.HELD, PARAMETERS.lift_height)


@pytest.mark.parametrize("phase", Phase)
def test_a_guided_descent_follows_vision_until_the_jaws_hold(arm_model, phase):
    blind, guided = (Bench(arm_model, replace(PARAMETERS, descent=descent)) for descent in ("blind", "guided"))
    for each in (blind, guided):
        each.put(phase)
    said = [each.machine.command(each.state) for each in (blind, guided)]
    if phase in (Phase.INTERCEPT, Phase.CLOSE):
        assert [ArmCommand(each).frozen for each in said] == [Frozen.BLIND, Frozen.GUIDED]
    else:
        np.testing.assert_array_equal(*said)


def test_a_tick_changes_only_what_it_returns(bench):
    state = bench.state
    bench.tick()
    assert (state.jaw_width, state.seen_since, len(state.memory.waiting)) == (OPENING, np.inf, 0)
    assert len(bench.state.memory.waiting) == 1
    assert state.__deepcopy__({}) is state
    assert message_size(ArmCommand) == len(bench.machine.command(state))


STOP, TAKE_OVER = (1, 0, 0, 0, 0), (2, 0.50, 0.10, 0.70, 1.0)


@pytest.mark.parametrize("phase", [phase for phase in Phase if phase not in BY_HAND])
def test_the_operator_stops_it_in_every_phase_and_the_jaws_stay_as_they_are(bench, phase):
    bench.put(phase, jaw_width=0.05)
    bench.tick(width=WIDTH, force=FORCE)
    width = bench.state.jaw_width
    for _ in range(30):
        assert bench.tick(width=WIDTH, force=FORCE, operator=STOP) == Phase.STOPPED
    motion = bench.commands[-1].motion
    assert motion == bench.commands[-30].motion and bench.commands[-1].frame == MotionFrame.GOAL
    assert bench.commands[-1].jaw_width == width and bench.commands[-1].frozen == 1.0
    for mode in (3.0, -1.0, np.nan):  # no order of his that could be meant otherwise
        assert bench.tick(operator=(mode, 0, 0, 0, 0)) == Phase.STOPPED


def test_it_stops_ahead_of_where_it_is(bench):
    bench.put(Phase.TRACK)
    for _ in range(3):
        bench.tick()
    bench.tick(operator=STOP)
    here = path(bench.time - SERVO_PERIOD + LEAD)
    step = here - path(bench.time - 2 * SERVO_PERIOD + LEAD)
    ahead = bench.state.goal - here
    assert ahead @ step > 0.0 and np.linalg.norm(ahead[:3]) == pytest.approx(0.3 * 0.25 * 0.15, rel=0.02)
    goal = ServoTarget(bench.machine.goal_target(bench.state))
    assert (goal.valid, goal.vx, goal.yaw_rate) == (1.0, 0.0, 0.0)
    assert (goal.x, goal.y) == tuple(bench.state.goal[:2])
    assert goal.z + bench.commands[-1].height == pytest.approx(bench.state.goal[2])
    assert goal.yaw + np.pi == pytest.approx(bench.state.goal[3])  # the jaws are on their branch 1


def test_the_operator_takes_over_and_moves_the_tool(bench):
    bench.put(Phase.TRACK)
    assert bench.tick(operator=TAKE_OVER) == Phase.MANUAL
    assert bench.state.goal == pytest.approx(TAKE_OVER[1:])
    distance = np.linalg.norm(bench.state.goal[:3] - path(bench.time - SERVO_PERIOD + LEAD)[:3])
    assert bench.commands[-1].duration >= distance / PARAMETERS.manual_speed
    motion = bench.commands[-1].motion
    for _ in range(3):
        bench.tick(operator=TAKE_OVER)
    assert bench.commands[-1].motion == motion
    bench.tick(operator=(2, 0.50, 0.11, 0.70, 1.0))
    assert bench.commands[-1].motion == motion + 1 and bench.state.goal[1] == 0.11
    bench.tick(operator=(2, 0.50, np.inf, 0.70, 1.0))
    assert bench.commands[-1].motion == motion + 1
    bench.tick(operator=(2, 0.50, 0.11, 0.10, 1.0))
    assert bench.state.goal[2] == pytest.approx(0.485 + PARAMETERS.grasp_height), "not into the table"


@pytest.mark.parametrize("order", [STOP, TAKE_OVER])
def test_released_it_goes_up_first_and_begins_anew(bench, order):
    bench.put(Phase.TRACK)
    bench.tick(operator=order)
    assert bench.tick() == Phase.RETREAT
    bench.until(Phase.ACQUIRE)
    bench.until(Phase.TRACK)
    assert bench.state.attempts == 0


def test_released_with_full_jaws_it_keeps_holding(bench):
    bench.put(Phase.HOLD, jaw_width=0.0)
    for _ in range(5):
        bench.tick(operator=TAKE_OVER, width=WIDTH, force=FORCE)
    assert bench.tick(width=WIDTH, force=FORCE) == Phase.HOLD
    assert bench.tick(width=0.0) == Phase.RETREAT


def test_the_operators_phases_use_no_vision(bench):
    assert all(PROGRAMS[phase].blind and PROGRAMS[phase].frame == MotionFrame.GOAL for phase in BY_HAND)
    bench.put(Phase.TRACK)
    records = len(bench.state.memory.records)
    for _ in range(60):
        bench.tick(operator=STOP)
    assert len(bench.state.memory.records) == records and bench.state.seen_since == np.inf


def test_a_stop_in_the_descent_ends_above_the_table(arm_model):
    """Before, the hand went on for 0.25 s as from hover height, and its fingers touched the table."""
    machine = GraspMachine(PARAMETERS, arm_model, SERVO_PERIOD, 0.485)
    for height, fall in ((0.22, 0.1), (0.036, 0.8), (0.016, 0.53)):
        tool, rate = np.array([0.56, 0.0, machine.lowest + height, 0.0]), np.array([0.1, 0.0, -fall, 0.0])
        duration = machine.stopping_time(tool, rate)
        assert 0.3 * duration * fall <= height + 1e-12
        assert (duration == PARAMETERS.stop_duration) == (height == 0.22)
    assert 0.0 < machine.stopping_time(np.array([0.56, 0.0, machine.lowest, 0.0]), rate) <= 0.1
    assert machine.stopping_time(tool, -rate) == PARAMETERS.stop_duration


@pytest.mark.parametrize(("std", "likely"), [(0.002, True), (0.02, False)])
def test_the_gate_opens_when_success_is_likely(arm_model, std, likely):
    """The path is not straight, and no lap is over."""
    bench = Bench(arm_model, replace(PARAMETERS, gate="probability", descent="guided"))
    phases, gates = set(), set()
    while bench.time < 23.0:
        times = bench.time - LAG + KNOT_SPACING * np.arange(KNOT_COUNT)
        knots = np.column_stack([path(times), np.full(KNOT_COUNT, std)])
        phases.add(bench.tick(packet=pack_prediction(times[0], 1, knots)))
        gates.add(bench.state.gate)
    assert (Phase.INTERCEPT in phases) == likely
    assert (Gate.SUCCESS_UNLIKELY in gates) != likely
    if not likely:
        assert 0.0 < bench.state.likely.cautious < bench.state.p_success < PARAMETERS.launch_probability


@pytest.mark.parametrize("descent", ["blind", "guided"])
@pytest.mark.parametrize("missed", [{"left": 0.06}, {"ahead": 0.2}])
def test_a_guided_descent_is_aborted_when_the_object_goes_elsewhere(arm_model, descent, missed):
    bench = Bench(arm_model, replace(PARAMETERS, descent=descent))
    bench.remember_well()
    bench.put(Phase.INTERCEPT)
    assert [bench.tick() for _ in range(7)] == [Phase.INTERCEPT] * 7
    ends = {bench.tick(**missed) for _ in range(6)}
    assert ends == ({Phase.RETREAT} if descent == "guided" else {Phase.INTERCEPT, Phase.CLOSE})


@pytest.mark.parametrize("descent", ["blind", "guided"])
def test_the_jaws_wait_for_a_hand_that_catches_up(arm_model, descent):
    times = []
    for missed in ({}, {"ahead": 0.03}):
        bench = Bench(arm_model, replace(PARAMETERS, descent=descent))
        bench.remember_well()
        bench.put(Phase.INTERCEPT)
        times.append(bench.until(Phase.CLOSE, **missed))
    waited = times[1] - times[0]
    assert waited == (pytest.approx(LONGEST_WAIT, abs=SERVO_PERIOD) if descent == "guided" else 0.0)
    bench.remember_well()
    bench.put(Phase.INTERCEPT)
    while bench.time < bench.state.entered + times[0] + 0.1:
        bench.tick(ahead=0.03)
    assert bench.tick() == Phase.CLOSE


def close_wide_open(arm_model, descent, **late):
    """Closes the jaws for 0.09 s and then sees something else; returns the bench."""
    bench = Bench(arm_model, replace(PARAMETERS, descent=descent))
    bench.remember_well()
    bench.put(Phase.CLOSE)
    for _ in range(3):
        bench.tick()
    before = bench.state.jaw_width
    assert WIDTH + 0.01 < before < OPENING
    bench.tick(**late)
    assert bench.state.phase != Phase.CLOSE or (bench.state.jaw_width == before) == (descent == "guided")
    return bench


@pytest.mark.parametrize("descent", ["blind", "guided"])
def test_closing_jaws_wait_for_a_hand_that_catches_up(arm_model, descent):
    bench = close_wide_open(arm_model, descent, ahead=0.03)
    width = bench.state.jaw_width
    bench.tick()
    assert bench.state.jaw_width < width, "it has caught up"
    bench = close_wide_open(arm_model, descent, ahead=0.03)
    while bench.time < bench.state.entered + LONGEST_WAIT + 0.05:
        bench.tick(ahead=0.03)
    assert bench.state.jaw_width < width, "they do not wait for ever"


@pytest.mark.parametrize("descent", ["blind", "guided"])
def test_jaws_that_are_still_wide_open_let_an_object_go_that_leaves(arm_model, descent):
    bench = close_wide_open(arm_model, descent, ahead=0.25)
    assert bench.state.phase == (Phase.RETREAT if descent == "guided" else Phase.CLOSE)
    bench = Bench(arm_model, replace(PARAMETERS, descent=descent))
    bench.put(Phase.CLOSE, jaw_width=WIDTH)
    assert bench.tick(width=WIDTH, ahead=0.25) == Phase.CLOSE, "they touch it already"
