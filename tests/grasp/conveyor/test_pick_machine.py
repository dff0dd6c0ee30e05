"""Ticks of a PickMachine without a simulation: its transitions, what it counts, and how parts lie in their cells."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import ndtr

from drake_tracker.arm.arm_model import make_arm_model, tool_down, tool_yaw
from drake_tracker.arm.description import PUMA560, UR5E
from drake_tracker.arm.motion.differential_ik import joints_for, make_parameters, step_joints
from drake_tracker.arm.motion.tool_motion import MotionFrame
from drake_tracker.arm.motion.tool_yaw import swing_about_base
from drake_tracker.arm.motion.transform_equation import PEAK_OVER_MEAN, motion_time, share_done
from drake_tracker.core.messages import (
    KNOT_COUNT,
    KNOT_SPACING,
    TARGET_STRIDE,
    ArmCommand,
    Frozen,
    JawState,
    OperatorCommand,
    PickOrder,
    ServoTarget,
    ToolStatus,
    message_size,
    pack_prediction,
)
from drake_tracker.core.part_kinds import PART_SHAPES, PartKind
from drake_tracker.core.timing import SERVO_PERIOD
from drake_tracker.grasp.config import PickConfig
from drake_tracker.grasp.conveyor.pick_machine import ALONG_JAWS, LONGEST_WAIT, ROUNDED, PickMachine
from drake_tracker.grasp.conveyor.pick_motions import way_time
from drake_tracker.grasp.conveyor.pick_schema import PICK_TRANSITIONS, PickObservation, PickPhase
from drake_tracker.grasp.descent import calibrated
from drake_tracker.grasp.gate import Gate
from drake_tracker.grasp.jaws import GRIP_CONFIRMED
from drake_tracker.grasp.operator_override import OperatorMode

CONFIG = PickConfig()
WIDTH, OPENING, FORCE = PART_SHAPES[PartKind.BOX].width, CONFIG.jaw_opening, CONFIG.grip_force
HOME = np.array([0.60, 0.0, 0.465, np.pi])
CELL = (0.345, 0.19, 0.465)
PLACES = np.array([[0.3, -0.6, 0.45], [0.45, 0.6, 0.5]])
LAG, LEAD, SPEED = 0.25, 0.045, 0.15
STOP, TAKE_OVER = float(OperatorMode.STOP), float(OperatorMode.TAKE_OVER)
REACH = 0.5
"""How far the hand follows the part along the belt [m]."""
HOLDING = {"width": WIDTH, "force": FORCE}


class Bench:
    """Ticks of a PickMachine; the hand is always just where the part is, unless something keeps it away."""

    def __init__(self, model, config=CONFIG, slope=(0.0, 0.0)):
        self.machine = PickMachine(config, model, SERVO_PERIOD, HOME, PLACES, slope)
        self.model, self.q = model, np.array(PUMA560.q_start)
        self.state = self.machine.initial_state()
        self.time = 10.0
        self.order = np.zeros(message_size(PickOrder))
        self.commands = []

    def say(self, job, number=3, kind=PartKind.BOX, place_yaw=0.5 * np.pi):
        """The host gives an order."""
        order = PickOrder(np.zeros(message_size(PickOrder)))
        order.job, order.number, order.kind, order.valid = job, number, kind, 1.0
        order.width, order.height = PART_SHAPES[kind].width, PART_SHAPES[kind].height
        order.place_x, order.place_y, order.place_z = CELL
        order.place_yaw = place_yaw
        self.order = np.array(order[:])

    def tick(
        self, *, number=3, valid=1, stale=0, flipping=0, fraction=1.0, width=OPENING, force=0.0, off=0.0, std=0.002,
        operator=(0.0, 0.0, 0.0, 0.0, 0.0), yaw=0.2, branch=0.0, away=0.0, turned=0.0,
    ):  # fmt: skip
        """Ticks once.

        ``off`` is how far the predicted path lies across the jaws from the hand [m]; ``away`` and ``turned`` are how
        far the measured hand is from where it was commanded to be [m, rad].
        """
        stamp, due = self.time - LAG, self.time + LEAD
        times = stamp + KNOT_SPACING * np.arange(KNOT_COUNT)
        path = np.column_stack([np.full(KNOT_COUNT, 0.6), SPEED * (times - 10.0), np.full(KNOT_COUNT, 0.465)])
        path[:, :2] += off * np.array([-np.sin(yaw), np.cos(yaw)])
        packet = pack_prediction(
            stamp,
            number * TARGET_STRIDE + 7,
            np.column_stack([path, np.full((KNOT_COUNT, 1), yaw), np.full(KNOT_COUNT, std)]),
        )
        here = (0.6, SPEED * (due - 10.0), 0.465)
        seq = number * TARGET_STRIDE + 7
        target = ServoTarget(np.array([due, *here, yaw, 0, SPEED, 0, 0, stamp, seq, std, stale, valid]))
        height = 0.004 if self.state.phase == PickPhase.CLOSE else 0.09
        tool = (here[0], min(here[1], REACH), here[2] + height, yaw + np.pi * branch)
        measured = tool_down([tool[0] - away, *tool[1:3]], tool[3] + turned)
        self.q = joints_for(self.model, self.q, measured)
        self.state = self.machine.update(
            self.state,
            PickObservation(
                time=self.time,
                target=target,
                packet=packet,
                order=PickOrder(self.order),
                jaws=JawState(np.array([width, 0.0, force])),
                status=ToolStatus(np.array([self.state.motion, fraction, flipping, *tool, branch])),
                arm_state=np.concatenate([self.q, np.zeros_like(self.q)]),
                operator=OperatorCommand(np.array([*operator, 0.0])),
            ),
        )
        self.commands.append(ArmCommand(self.machine.command(self.state)))
        self.time += SERVO_PERIOD
        return self.state.phase

    def until(self, phase, limit=100, **seen):
        """Ticks until a phase is entered; returns the time it took [s]."""
        start = self.time
        for _ in range(limit):
            if self.tick(**seen) == phase:
                return self.time - start
        raise AssertionError(f"never in {phase.name}: {self.state.phase.name}, gate {self.state.gate.name}")

    def reach(self, phase, **seen):
        """Goes to a phase of a pick that succeeds."""
        before = (PickPhase.TRACK, PickPhase.INTERCEPT, PickPhase.CLOSE, PickPhase.LIFT, PickPhase.CARRY)
        rest = (PickPhase.LOWER, PickPhase.RELEASE, PickPhase.RAISE)
        for each in (*before, *rest):
            self.until(each, **seen, **(HOLDING if each in (*before[3:], *rest[:2]) else {}))
            if each == phase:
                return


@pytest.fixture
def bench(arm_model):
    bench = Bench(arm_model)
    bench.say(job=1)
    return bench


def test_it_waits_for_an_order_and_for_packets_about_its_part(arm_model):
    bench = Bench(arm_model)
    for _ in range(5):
        assert bench.tick() == PickPhase.WAIT
    assert bench.commands[-1].frame == MotionFrame.HOME and bench.commands[-1].jaw_width == OPENING
    bench.say(job=1, number=3)
    for unseen in ({"number": 4}, {"valid": 0}):
        assert bench.tick(**unseen) == PickPhase.WAIT
    assert bench.tick(number=3) == PickPhase.TRACK
    assert bench.commands[-1].frame == MotionFrame.OBJECT


def test_the_whole_success(bench):
    bench.until(PickPhase.TRACK)
    bench.until(PickPhase.INTERCEPT)
    assert bench.state.gate == Gate.OPEN and bench.state.attempts == 1
    to_close = bench.until(PickPhase.CLOSE)
    assert to_close == pytest.approx(CONFIG.descent_duration - CONFIG.closing_lead, abs=1.1 * SERVO_PERIOD)
    to_lift = bench.until(PickPhase.LIFT, **HOLDING)
    assert to_lift == pytest.approx(GRIP_CONFIRMED + SERVO_PERIOD, abs=1.1 * SERVO_PERIOD)
    to_carry = bench.until(PickPhase.CARRY, **HOLDING)
    assert to_carry == pytest.approx(CONFIG.lift_duration, abs=1.1 * SERVO_PERIOD)
    assert (bench.state.picked, bench.state.placed) == (1, 0)
    bench.until(PickPhase.LOWER, **HOLDING)
    assert bench.commands[-1].frame == MotionFrame.GOAL and bench.commands[-1].height == CONFIG.place_height
    assert bench.state.goal[:3] == pytest.approx(CELL)
    bench.until(PickPhase.RELEASE, **HOLDING)
    assert bench.until(PickPhase.RAISE) == pytest.approx(CONFIG.release_duration, abs=1.1 * SERVO_PERIOD)
    bench.until(PickPhase.WAIT)
    found = bench.state
    assert (found.done, found.attempts, found.picked, found.placed, found.failed) == (1, 1, 1, 1, 0)
    for _ in range(10):
        assert bench.tick() == PickPhase.WAIT, "an order is carried out once"


@pytest.mark.parametrize("grade, rise", [(0.2, 0.2 * CELL[1]), (-0.2, 0.0)])
def test_beside_a_belt_that_rises_the_hand_is_higher_above_the_cell_and_takes_longer(arm_model, grade, rise):
    bench = Bench(arm_model, slope=(0.0, grade))
    bench.say(job=1)
    bench.reach(PickPhase.CARRY)
    assert bench.commands[-1].height == pytest.approx(CONFIG.carry_height + rise)
    bench.until(PickPhase.LOWER, **HOLDING)
    assert bench.commands[-1].height == CONFIG.place_height
    longer = np.sqrt(1.0 + rise / (CONFIG.carry_height - CONFIG.place_height))
    assert bench.commands[-1].duration == pytest.approx(CONFIG.lower_duration * longer)
    bench.until(PickPhase.RELEASE, **HOLDING)
    bench.until(PickPhase.RAISE)
    assert bench.commands[-1].height == pytest.approx(CONFIG.carry_height + rise)


def test_jaws_open_in_the_cell_and_stay_closed_before(bench):
    bench.reach(PickPhase.RELEASE)
    assert max(each.jaw_width for each in bench.commands if each.phase in (PickPhase.CARRY, PickPhase.LOWER)) < WIDTH
    bench.until(PickPhase.RAISE)
    assert bench.commands[-1].jaw_width > WIDTH
    bench.until(PickPhase.WAIT)
    assert max(each.jaw_width for each in bench.commands if each.phase == PickPhase.RAISE) <= WIDTH + CONFIG.release_gap
    for _ in range(5):
        bench.tick()
    assert bench.commands[-1].jaw_width == OPENING


def test_it_follows_new_packets_until_the_jaws_hold_the_part(bench):
    bench.reach(PickPhase.CARRY)
    frozen = {PickPhase(int(each.phase)): Frozen(int(each.frozen)) for each in bench.commands}
    assert frozen[PickPhase.TRACK] == Frozen.FREE
    assert frozen[PickPhase.INTERCEPT] == frozen[PickPhase.CLOSE] == Frozen.GUIDED
    assert frozen[PickPhase.LIFT] == frozen[PickPhase.CARRY] == Frozen.BLIND


def test_each_obstacle_keeps_the_hand_above_the_part(bench):
    bench.until(PickPhase.TRACK)
    for seen, gate in (
        ({"fraction": 0.5}, Gate.SETTLING),
        ({"flipping": 1}, Gate.FLIPPING),
        ({"stale": 1}, Gate.STALE),
        ({"std": 0.05}, Gate.SUCCESS_UNLIKELY),
    ):
        for _ in range(20):
            assert bench.tick(**seen) == PickPhase.TRACK
        assert bench.state.gate == gate
    assert bench.tick() == PickPhase.INTERCEPT


def test_rounded_pads_push_a_part_between_jaws_that_are_hardly_wider(arm_model):
    bench = Bench(arm_model, replace(CONFIG, jaw_opening=WIDTH + 0.0004))
    bench.say(job=1)
    bench.until(PickPhase.TRACK, std=0.003)
    bench.tick(std=0.003)
    across, along = 2.0 * ndtr(np.array([0.0002 + ROUNDED, ALONG_JAWS]) / 0.003) - 1.0
    assert bench.state.p_success == pytest.approx(calibrated(across * along, "belt"), abs=1e-3)
    assert bench.state.p_success > 0.87, "seen in 98 % of such descents"


def test_no_descent_to_a_belt_is_certain(bench):
    bench.until(PickPhase.TRACK)
    bench.tick(std=1e-6)
    assert bench.state.p_success == pytest.approx(0.981, abs=1e-3), "98 % of such descents lift their part"


def test_a_missed_part_makes_it_retreat_and_counts_as_failed(bench):
    bench.reach(PickPhase.CLOSE)
    assert bench.tick(width=0.005) == PickPhase.RETREAT
    bench.until(PickPhase.WAIT)
    assert (bench.state.done, bench.state.failed, bench.state.picked, bench.state.placed) == (1, 1, 0, 0)
    bench.say(job=2)
    bench.until(PickPhase.INTERCEPT)
    assert bench.state.attempts == 2


def test_jaws_without_a_grip_have_missed_after_a_while(bench):
    bench.reach(PickPhase.CLOSE)
    took = bench.until(PickPhase.RETREAT, width=0.06)
    assert took == pytest.approx(CONFIG.close_timeout, abs=2.1 * SERVO_PERIOD)


def test_a_part_that_slips_from_the_jaws_is_a_failure(bench):
    bench.reach(PickPhase.CARRY)
    assert bench.tick(width=0.002) == PickPhase.RETREAT
    bench.until(PickPhase.WAIT)
    assert (bench.state.picked, bench.state.placed, bench.state.failed) == (1, 0, 1)


def test_it_gives_up_a_descent_that_will_miss(bench):
    bench.reach(PickPhase.INTERCEPT)
    assert bench.tick(off=0.30) == PickPhase.RETREAT
    assert bench.state.p_success < CONFIG.abort_probability


def test_the_jaws_wait_a_moment_for_a_hand_that_catches_up(bench):
    bench.reach(PickPhase.INTERCEPT)
    in_time = bench.until(PickPhase.CLOSE, off=0.012)
    late = CONFIG.descent_duration - CONFIG.closing_lead + LONGEST_WAIT
    assert in_time == pytest.approx(late, abs=1.1 * SERVO_PERIOD)


def test_a_lost_part_ends_the_order(bench):
    bench.reach(PickPhase.TRACK)
    assert bench.tick(stale=1) == PickPhase.TRACK  # coasting is not lost
    assert bench.tick(valid=0) == PickPhase.WAIT
    assert (bench.state.done, bench.state.failed) == (1, 1)
    assert bench.tick() == PickPhase.WAIT, "the host must give a new order"


@pytest.mark.parametrize("change", ["replaced", "cancelled"])
def test_an_order_that_the_host_withdraws_before_the_descent_ends(bench, change):
    bench.reach(PickPhase.TRACK)
    bench.say(job=2 if change == "replaced" else 1, number=4 if change == "replaced" else 0)
    assert bench.tick() == PickPhase.WAIT
    assert bench.state.done == 1
    if change == "replaced":
        assert bench.tick(number=4) == PickPhase.TRACK
        assert PickOrder(bench.state.order).job == 2


def test_an_order_is_not_withdrawn_during_the_descent(bench):
    bench.reach(PickPhase.INTERCEPT)
    bench.say(job=2, number=4)
    bench.until(PickPhase.CLOSE)
    bench.until(PickPhase.LIFT, **HOLDING)
    assert PickOrder(bench.state.order).job == 1


@pytest.mark.parametrize("phase", [phase for phase in PickPhase if phase not in (PickPhase.STOPPED, PickPhase.MANUAL)])
def test_the_operator_stops_the_hand_in_every_phase(arm_model, phase):
    assert PICK_TRANSITIONS[phase][0][1] == PickPhase.STOPPED
    bench = Bench(arm_model)
    bench.state = replace(bench.state, phase=phase, entered=bench.time)
    assert bench.tick(operator=(STOP, 0, 0, 0, 0)) == PickPhase.STOPPED
    width = bench.commands[-1].jaw_width
    for _ in range(10):
        assert bench.tick(operator=(STOP, 0, 0, 0, 0)) == PickPhase.STOPPED
    assert bench.commands[-1].jaw_width == width, "the jaws stay as they are"


def test_after_a_stop_a_full_hand_goes_on_to_the_cell_and_counts_its_part_once(bench):
    bench.reach(PickPhase.CARRY)
    for _ in range(5):
        assert bench.tick(operator=(STOP, 0, 0, 0, 0), **HOLDING) == PickPhase.STOPPED
    assert bench.tick(**HOLDING) == PickPhase.CARRY
    bench.until(PickPhase.LOWER, **HOLDING)
    bench.until(PickPhase.RELEASE, **HOLDING)
    bench.until(PickPhase.RAISE)
    bench.until(PickPhase.WAIT)
    assert (bench.state.picked, bench.state.placed, bench.state.failed) == (1, 1, 0)


@pytest.mark.parametrize("phase", [PickPhase.RELEASE, PickPhase.RAISE])
def test_a_part_that_lies_in_its_cell_is_placed_even_if_the_operator_stops_the_hand_there(bench, phase):
    bench.reach(phase)
    assert bench.tick(operator=(STOP, 0, 0, 0, 0)) == PickPhase.STOPPED
    assert bench.tick() == PickPhase.RETREAT
    bench.until(PickPhase.WAIT)
    assert (bench.state.done, bench.state.placed, bench.state.failed) == (1, 1, 0)


def test_a_stop_without_an_order_is_not_a_failure(arm_model):
    bench = Bench(arm_model)
    assert bench.tick(operator=(STOP, 0, 0, 0, 0)) == PickPhase.STOPPED
    bench.until(PickPhase.WAIT)
    assert (bench.state.done, bench.state.failed) == (0, 0)


@pytest.mark.parametrize("kept", [{"away": 0.05}, {"away": -0.008}, {"turned": 0.1}])
@pytest.mark.parametrize("phase", [PickPhase.CARRY, PickPhase.LOWER])
def test_a_hand_that_something_keeps_from_the_cell_does_not_let_go(bench, phase, kept):
    bench.reach(phase)
    motion = bench.state.motion
    for _ in range(100):
        assert bench.tick(**kept, **HOLDING) in (PickPhase.CARRY, PickPhase.LOWER)
    assert bench.state.phase == PickPhase.CARRY and bench.state.motion > motion, "it tries anew"
    bench.until(PickPhase.LOWER, **HOLDING)
    bench.until(PickPhase.RELEASE, **HOLDING)
    bench.until(PickPhase.WAIT)
    assert (bench.state.picked, bench.state.placed, bench.state.failed) == (1, 1, 0)


@pytest.fixture(scope="module", params=[PUMA560, UR5E], ids=["puma560", "ur5e"])
def arm(request):
    return make_arm_model(request.param), np.array(request.param.q_start)


@pytest.mark.parametrize("wound", [-2.6, -0.8, 0.9, 2.4, 3.3])
@pytest.mark.parametrize("place_yaw", [0.0, 1.5, 3.1])
def test_an_arm_can_follow_the_motion_to_the_cell(arm, wound, place_yaw):
    """An ell has one direction only: the hand turns by up to a whole turn, and winds its last joint up or down."""
    model, q_start = arm
    bench = Bench(model)
    start = np.array([0.6, 0.0, 0.5])
    bench.q = joints_for(model, q_start, tool_down(start, 0.0))
    bench.q[-1] += np.round((wound - bench.q[-1]) / (0.5 * np.pi)) * 0.5 * np.pi
    yaw = tool_yaw(model.tool_pose(bench.q))
    bench.say(job=1, kind=PartKind.ELL, place_yaw=place_yaw)
    bench.until(PickPhase.CLOSE, yaw=yaw)
    bench.until(PickPhase.CARRY, yaw=yaw, width=PART_SHAPES[PartKind.ELL].width, force=FORCE)
    q, place, goal_yaw = bench.q, bench.state.goal[:3] + [0.0, 0.0, CONFIG.carry_height], bench.state.goal[3]
    parameters, p_WT = make_parameters(model, SERVO_PERIOD), model.tool_pose(q).translation()
    steps = int(bench.state.duration / SERVO_PERIOD)
    for share in (share_done(k / steps) for k in range(1, steps + 1)):
        wanted = tool_down(p_WT + share * (place - p_WT), yaw + share * (goal_yaw - yaw))
        q, _ = step_joints(model, parameters, q, wanted)
        assert np.linalg.norm(model.tool_pose(q).translation() - wanted.translation()) < 0.03
    assert model.tool_pose(q).IsNearlyEqualTo(wanted, 1e-4), "it is there when the motion ends"


def test_the_operator_moves_the_hand(bench):
    bench.reach(PickPhase.TRACK)
    assert bench.tick(operator=(TAKE_OVER, 0.55, 0.1, 0.6, 0.2)) == PickPhase.MANUAL
    assert bench.state.goal[:3] == pytest.approx([0.55, 0.1, 0.6])
    assert bench.commands[-1].frame == MotionFrame.GOAL and bench.commands[-1].height == 0.0


@pytest.mark.parametrize("kind", [PartKind.BOX, PartKind.DISC, PartKind.ELL])
@pytest.mark.parametrize("yaw", [0.2, 2.0, -2.5])
@pytest.mark.parametrize("branch", [0.0, 1.0])
def test_a_part_is_put_down_in_the_nearest_direction_that_looks_as_ordered(arm_model, kind, yaw, branch):
    """The tool turns by ``turn``, and the part with it, from ``yaw``. A disc has the direction of the jaws."""
    bench = Bench(arm_model)
    bench.say(job=1, kind=kind)
    seen = {"yaw": yaw, "branch": branch}
    bench.until(PickPhase.CLOSE, **seen)
    bench.until(PickPhase.CARRY, **seen, width=PART_SHAPES[kind].width, force=FORCE)
    turn = bench.state.goal[3] - (yaw + np.pi * branch)
    period = 2.0 * np.pi / (PART_SHAPES[kind].turns or 2)
    if abs(turn) > 0.5 * period + 1e-9:  # then the last joint cannot reach the nearest one
        nearest = turn - np.copysign(period, turn)
        p_WT = arm_model.tool_pose(bench.q).translation()
        wrist = bench.q[-1] + swing_about_base(p_WT, bench.state.goal) - nearest
        assert not arm_model.position_lower[-1] + 0.1 < wrist < arm_model.position_upper[-1] - 0.1
    off = (yaw + turn - 0.5 * np.pi + 0.5 * period) % period - 0.5 * period
    assert off == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(
    "field, value",
    [
        ("place_x", np.nan),
        ("place_y", np.inf),
        ("place_z", 0.40),
        ("place_z", 0.60),
        ("place_x", 0.60),
        ("place_yaw", 1e9),
        ("kind", 7.0),
        ("kind", 0.0),
        ("width", 0.09),
        ("width", 0.0),
        ("number", -3.0),
        ("valid", 0.0),
        ("job", np.nan),
    ],
)
def test_an_order_that_cannot_be_right_is_ignored(field, value, bench):
    bench.say(1)
    setattr(PickOrder(bench.order), field, value)
    for _ in range(20):
        assert bench.tick() == PickPhase.WAIT
    bench.say(2)
    bench.until(PickPhase.TRACK)
    assert PickOrder(bench.state.order).job == 2


@pytest.mark.parametrize("angle", np.linspace(0.0, np.pi, 7))
def test_a_hand_that_meets_a_part_uses_its_largest_speed(angle):
    speed, v_WO = 0.8, np.array([0.0, 0.3, 0.0])
    displacement = 0.9 * np.array([np.sin(angle), -np.cos(angle), 0.0])
    time = way_time(displacement, v_WO, v_WO, speed, 1000.0)
    peak = np.linalg.norm(v_WO + PEAK_OVER_MEAN / time * displacement)
    if v_WO @ displacement < -1e-9:  # as fast as it may along the way; across it the hand goes with the part
        assert peak == pytest.approx(np.hypot(speed, 0.3 * np.sin(angle)), abs=1e-9)
    else:
        assert time == pytest.approx(motion_time(0.9, 0.0, speed, 1000.0))


def test_a_part_that_comes_towards_a_resting_hand_costs_no_time():
    displacement, rest = np.array([0.0, -0.5, 0.0]), np.zeros(3)
    time = way_time(displacement, rest, np.array([0.0, 0.15, 0.0]), 0.8, 4.0)
    assert time <= way_time(displacement, rest, rest, 0.8, 4.0)
    assert time < way_time(displacement, rest, np.array([0.0, -0.15, 0.0]), 0.8, 4.0)
