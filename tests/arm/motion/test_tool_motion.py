import numpy as np
import pytest
from arm_plants import joint6_at

from drake_tracker.arm.arm_model import tool_down
from drake_tracker.arm.description import PUMA560
from drake_tracker.arm.motion.differential_ik import SPEED_SHARE, joints_for, make_parameters, step_joints
from drake_tracker.arm.motion.tool_motion import GUIDED_JUMP, JUMP_DISTANCE, MotionFrame, ToolMotion
from drake_tracker.arm.motion.tool_yaw import FLIP_ANGLE, flip_duration
from drake_tracker.core.messages import ArmCommand, Frozen, ServoTarget
from drake_tracker.core.timing import SERVO_PERIOD

HOME = np.array([0.56, 0.0, 0.485, np.pi])
HOVER, APPROACH = 0.22, 1.0
OBJECT, HELD = MotionFrame.OBJECT, MotionFrame.HELD
RADIUS, SPEED = 0.12, 0.2


def command(motion=1, frame=OBJECT, height=HOVER, duration=APPROACH, frozen=0):
    return ArmCommand(np.array([1, motion, duration, frame, height, frozen, 0.088]))


def target(pose, rate=(0.0, 0.0, 0.0, 0.0), valid=1):
    return ServoTarget(np.array([0.0, *pose, *rate, 0.0, 0.0, 0.0, 0.0, valid]))


def circle(t, direction=1, speed=SPEED):
    """The target on a circle, its yaw continuous."""
    rate = direction * speed / RADIUS
    a = rate * t
    c, s = np.cos(a), np.sin(a)
    pose = [0.56 + RADIUS * c, RADIUS * s, 0.485, a + direction * np.pi / 2]
    return target(pose, [-RADIUS * rate * s, RADIUS * rate * c, 0.0, rate])


def pose_of(seen):
    return np.array([seen.x, seen.y, seen.z, seen.yaw])


class Run:
    """Ticks of a ToolMotion with joint 6 by arithmetic: joint 6 is at zero when the tool's yaw is ``yaw_of_zero``."""

    def __init__(self, yaw=np.pi, p_WT=(0.56, 0.0, 0.705), yaw_of_zero=np.pi, symmetric=True, slope=(0.0, 0.0)):
        self.motion = ToolMotion(HOME, SERVO_PERIOD, symmetric, slope=slope)
        self.state = self.motion.initial_state(p_WT, yaw)
        self.yaw_of_zero = yaw_of_zero
        self.k = 0
        self.rows, self.q6, self.branches, self.flips = [], [], [], []

    @property
    def time(self):
        return self.k * self.motion.period

    def tick(self, order, seen):
        q6 = joint6_at(0.0, self.yaw_of_zero, self.state.tool[3])
        self.state = self.motion.update(self.state, self.time, order, seen, q6)
        self.rows.append(self.state.tool[:4])
        self.q6.append(joint6_at(0.0, self.yaw_of_zero, self.state.tool[3]))
        self.branches.append(self.state.branch)
        self.flips.append(self.motion.flipping(self.state, self.time))
        self.k += 1
        return self.state.tool[:4]

    def rates(self):
        return np.diff(self.rows, axis=0) / SERVO_PERIOD

    def accelerations(self):
        return np.diff(self.rows, 2, axis=0) / SERVO_PERIOD**2


@pytest.mark.parametrize("direction", [1, -1])
def test_joint_6_is_unwound_over_twenty_laps(arm_model, direction):
    run = Run()
    while run.time < 20 * 2 * np.pi * RADIUS / SPEED:
        run.tick(command(), circle(run.time, direction))
    q6 = np.array(run.q6)
    assert np.max(np.abs(q6)) < np.deg2rad(140.0) < arm_model.position_upper[5]
    assert np.max(np.abs(np.diff(q6))) / SERVO_PERIOD < SPEED_SHARE * arm_model.velocity_limit[5]
    assert np.max(np.abs(run.accelerations()[:, 3])) < 50.0  # rad/s^2: 10 N m on joint 6 of 21
    turned = run.rows[-1][3] - run.branches[-1] * np.pi - (run.rows[60][3] - run.branches[60] * np.pi)
    assert abs(turned) == pytest.approx(SPEED / RADIUS * (run.time - 61 * SERVO_PERIOD), abs=0.1)
    assert abs(run.branches[-1]) == pytest.approx(40, abs=1)  # two half turns a lap
    assert np.all(np.array(run.flips)[np.flatnonzero(np.diff(run.branches)) + 1])


def test_the_arm_itself_follows_a_lap_with_the_flips_in_it(arm_model):
    motion = ToolMotion(HOME, SERVO_PERIOD)
    q = joints_for(arm_model, PUMA560.q_start, tool_down(HOME[:3] + [0.0, 0.0, HOVER], HOME[3]))
    state = motion.initial_state(HOME[:3] + [0.0, 0.0, HOVER], HOME[3])
    parameters = make_parameters(arm_model, SERVO_PERIOD)
    flips = 0
    for k in range(round(1.6 * 2 * np.pi * RADIUS / SPEED / SERVO_PERIOD)):  # 1.6 laps
        seen = circle(k * SERVO_PERIOD)
        before = state.branch
        state = motion.update(state, k * SERVO_PERIOD, command(), seen, q[5])
        flips += state.branch != before and k > 0
        q, ok = step_joints(arm_model, parameters, q, tool_down(state.tool[:3], state.tool[3]))
        assert ok and abs(q[5]) < np.deg2rad(140.0)
    assert flips >= 2
    expected = pose_of(seen)[:3] + [0.0, 0.0, HOVER]
    np.testing.assert_allclose(arm_model.tool_pose(q).translation(), expected, atol=1e-4)


def test_it_hovers_exactly_over_the_object_once_the_approach_is_over():
    run = Run()
    while run.time < APPROACH - 1e-9:
        run.tick(command(), circle(run.time))
    assert run.state.fraction == pytest.approx(1.0)
    tool = run.tick(command(), circle(run.time))
    expected = pose_of(circle(run.time - SERVO_PERIOD)) + [0.0, 0.0, HOVER, np.pi * run.state.branch]
    np.testing.assert_allclose(tool, expected, atol=1e-12)


def test_every_motion_leads_into_the_next_without_a_step_of_speed():
    # Home, approach, descent, lift, home again, and a descent begun in the middle of an approach.
    plan = [
        (0.3, command(1, MotionFrame.HOME)),
        (1.6, command(2)),
        (1.96, command(3, OBJECT, 0.0, 0.36, frozen=1)),
        (3.1, command(4, HELD, 0.15, 1.0, frozen=1)),
        (4.3, command(5, MotionFrame.HOME)),
        (4.8, command(6)),
        (5.16, command(7, OBJECT, 0.0, 0.36, frozen=1)),
        (6.2, command(8, MotionFrame.HOME)),
    ]
    run = Run()
    for end, order in plan:
        while run.time < end:
            run.tick(order, circle(run.time))
    acceleration = np.abs(run.accelerations())
    # .22 m in .36 s by a trapezoid with ramps of a quarter takes 9.05 m/s^2; a step of .2 m/s in a tick would be 6.7
    assert np.max(acceleration[:, 2]) < 9.8
    assert np.max(acceleration[:, :2]) < 4.0
    assert np.max(acceleration[:, 3]) < 40.0


def test_the_descent_keeps_the_path_of_the_object_and_takes_its_duration():
    run = Run()
    while run.time < 2.0:
        run.tick(command(), circle(run.time))
    heights, beside = [], []
    while run.state.fraction < 1.0 or run.state.motion == 1:
        seen = circle(run.time)
        tool = run.tick(command(2, OBJECT, 0.0, 0.36, frozen=1), seen)
        heights.append(tool[2] - seen.z)
        beside.append(np.linalg.norm(tool[:2] - [seen.x, seen.y]))
    rate = np.max(-np.diff(heights)) / SERVO_PERIOD
    assert len(heights) == 12  # .36 s
    assert heights[-1] == pytest.approx(0.0, abs=1e-9)
    assert np.max(beside) < 1e-3
    assert rate == pytest.approx(HOVER / 0.36 * 4.0 / 3.0, rel=0.01)


@pytest.mark.parametrize("frozen", [Frozen.BLIND, Frozen.GUIDED])
def test_no_flip_begins_while_flips_are_locked_however_far_joint_6_goes(frozen):
    run = Run()
    while run.time < 1.5 or run.flips[-1]:
        run.tick(command(), circle(run.time))
    branch = run.state.branch
    locked_from = len(run.q6)
    for _ in range(100):
        run.tick(command(2, OBJECT, 0.0, 0.36, frozen=frozen), circle(run.time))
    assert np.max(np.abs(run.q6[locked_from:])) > FLIP_ANGLE + 0.3  # it did go beyond
    assert set(run.branches[locked_from:]) == {branch} and not any(run.flips[locked_from:])
    run.tick(command(2), circle(run.time))
    assert run.flips[-1]


def test_a_flip_takes_its_duration_and_turns_half_a_turn():
    run = Run()
    while not (run.flips and run.flips[-1]):
        run.tick(command(), circle(run.time))
    start = len(run.rows) - 1
    while run.flips[-1]:
        run.tick(command(), circle(run.time))
    lasted = (len(run.rows) - 1 - start) * SERVO_PERIOD
    assert lasted == pytest.approx(flip_duration(-1, SPEED / RADIUS), abs=SERVO_PERIOD)
    lapsed = (len(run.rows) - start) * SERVO_PERIOD
    turned = run.rows[-1][3] - run.rows[start - 1][3] - SPEED / RADIUS * lapsed
    assert abs(turned) == pytest.approx(np.pi, abs=1e-9)


@pytest.mark.parametrize("frame", [MotionFrame.HOME, MotionFrame.HELD, MotionFrame.OBJECT])
def test_a_motion_begun_during_a_flip_does_not_turn_the_jaws_twice_as_fast(frame):
    run = Run()
    while not (run.flips and run.flips[-1]):
        run.tick(command(), circle(run.time))
    start = run.time
    while run.time < start + 0.25:
        run.tick(command(), circle(run.time))
    before = len(run.rows)
    for _ in range(60):
        run.tick(command(2, frame), circle(run.time))
    assert np.max(np.abs(run.accelerations()[before - 3 : before + 3, 3])) < 20.0
    assert np.max(np.abs(run.rates()[:, 3])) < 6.2


def test_a_reference_that_jumps_is_approached_anew_and_not_followed():
    run = Run()
    here = [0.60, 0.05, 0.485, np.pi]
    for _ in range(60):
        run.tick(command(), target(here))
    there = np.array([0.52, -0.1, 0.485, np.pi + 0.2])
    jumped_at = len(run.rows)
    for _ in range(40):
        run.tick(command(), target(there))
    assert run.rows[jumped_at - 1][0] == pytest.approx(0.60)
    assert np.max(np.abs(run.rates()[jumped_at - 1 :, :3])) < 1.4 * 0.15 / APPROACH
    assert np.max(np.abs(run.accelerations()[:, :3])) < 2.0
    np.testing.assert_allclose(run.rows[-1][:3], there[:3] + [0.0, 0.0, HOVER], atol=1e-9)


def test_a_moving_reference_that_jumps_changes_the_hands_speed_by_little_at_once():
    run, v = Run(), 0.15

    def moving(k, y):
        return target([0.45 + v * k * SERVO_PERIOD, y, 0.485, np.pi], (v, 0.0, 0.0, 0.0))

    for k in range(50):
        run.tick(command(), moving(k, 0.0))
    for k in range(50, 80):
        run.tick(command(), moving(k, 0.12))
    steps = np.diff(run.rates()[40:, 0])
    assert run.rates()[48, 0] == pytest.approx(v, abs=1e-6)
    assert np.max(np.abs(steps)) < 0.02  # it goes on as the object does, and begins to go aside


def test_a_jump_of_the_direction_alone_is_approached_anew_too():
    run = Run()
    for _ in range(60):
        run.tick(command(), target([0.6, 0.0, 0.485, np.pi]))
    settled = len(run.rows)
    for _ in range(40):
        run.tick(command(), target([0.6, 0.0, 0.485, np.pi + 0.5]))
    assert np.max(np.abs(run.rates()[settled - 1 :, 3])) < 1.4 * 0.5 / APPROACH
    assert run.rows[-1][3] == pytest.approx(np.pi + 0.5)


def test_a_step_below_the_jump_distance_is_followed_at_once():
    run = Run()
    for _ in range(60):
        run.tick(command(), target([0.6, 0.0, 0.485, np.pi]))
    tool = run.tick(command(), target([0.6 + 0.9 * JUMP_DISTANCE, 0.0, 0.485, np.pi]))
    assert tool[0] == pytest.approx(0.6 + 0.9 * JUMP_DISTANCE)


@pytest.mark.parametrize("frozen", Frozen)
def test_a_guided_descent_follows_a_step_that_is_approached_anew_otherwise(frozen):
    """A train that changes its speed moves the predicted place by 30 mm and more at once."""
    run = Run()
    for _ in range(60):
        run.tick(command(frozen=frozen), target([0.6, 0.0, 0.485, np.pi]))
    step = 0.5 * (JUMP_DISTANCE + GUIDED_JUMP)
    moved = run.tick(command(frozen=frozen), target([0.6 + step, 0.0, 0.485, np.pi]))[0] - 0.6
    assert moved == pytest.approx(step) if frozen == Frozen.GUIDED else moved < 0.1 * step
    moved = run.tick(command(frozen=frozen), target([0.6 + step + 1.1 * GUIDED_JUMP, 0.0, 0.485, np.pi]))[0] - 0.6
    assert moved < step + 0.8 * GUIDED_JUMP


def test_held_stands_where_the_object_was_when_the_motion_began():
    run = Run()
    while run.time < 2.0:
        run.tick(command(), circle(run.time))
    last = pose_of(circle(run.time - SERVO_PERIOD))
    for _ in range(50):
        run.tick(command(2, HELD, 0.15, 1.0, frozen=1), circle(run.time))
    np.testing.assert_allclose(run.rows[-1][:3], last[:3] + [0.0, 0.0, 0.15], atol=1e-9)
    np.testing.assert_allclose(run.rows[-1], run.rows[-5], atol=1e-12)


def test_without_an_object_it_waits_over_home_and_without_a_target_it_does_not_leave():
    run = Run()
    for _ in range(50):
        run.tick(command(1, MotionFrame.HOME), target(np.zeros(4), valid=0))
    np.testing.assert_allclose(run.rows, np.tile(HOME + [0.0, 0.0, HOVER, 0.0], (50, 1)), atol=1e-12)
    for _ in range(50):
        run.tick(command(2), target(np.zeros(4), valid=0))
    np.testing.assert_allclose(run.rows[-1], HOME + [0.0, 0.0, HOVER, 0.0], atol=1e-12)


@pytest.mark.parametrize("yaw, yaw_of_zero", [(np.pi, np.pi), (-np.pi, 0.0), (np.pi - 0.1, -2.0), (3 * np.pi, np.pi)])
def test_a_hand_without_symmetry_never_flips(yaw, yaw_of_zero):
    """It turns the shortest way to the wanted direction, wherever the last joint's zero is, and follows it for ever."""
    run = Run(yaw=yaw, yaw_of_zero=yaw_of_zero, symmetric=False)
    for k in range(150):
        run.tick(command(), target([0.56, 0.0, 0.485, np.pi + 0.02 * k], [0.0, 0.0, 0.0, 0.02 / SERVO_PERIOD]))
    assert not np.any(run.flips) and len(set(run.branches)) == 1
    turned = np.array(run.rows)[:, 3]
    final = np.pi + 0.02 * 149
    assert np.cos(turned[-1] - final) == pytest.approx(1.0)
    assert np.sum(np.abs(np.diff(turned))) < 0.02 * 149 + 0.3
    assert np.max(np.abs(run.q6)) > FLIP_ANGLE  # where symmetric jaws would have turned over


def test_a_goal_that_is_corrected_does_not_count_as_moving():
    """A step of the reference and a new motion at one tick: an object's step is its speed, a place's is not."""
    ways = {}
    for moving in (True, False):
        run = Run()
        run.motion = ToolMotion(HOME, 0.005, moving=moving)
        for _ in range(40):
            run.tick(command(motion=1, duration=0.15), target(HOME))
        for _ in range(60):
            run.tick(command(motion=2, duration=0.15), target(HOME + [0.0, 0.02, 0.0, 0.0]))
        ways[moving] = np.array(run.rows)[40:, 1]
    assert ways[False].max() == pytest.approx(0.02, abs=1e-9) and np.all(np.diff(ways[False]) >= -1e-12)
    assert ways[True].min() < -0.005


def test_a_hand_without_symmetry_does_not_spin_for_a_pose_that_is_given_a_turn_away():
    """Not even with vision out of use: an operator says where it is to go."""
    run = Run(yaw=-np.pi + 0.02, yaw_of_zero=np.pi, symmetric=False)
    for k in range(90):
        run.tick(command(motion=k // 30, frozen=float(k >= 30)), target(HOME if k < 30 else [*HOME[:3], -np.pi + 0.1]))
    assert np.ptp(np.array(run.rows)[:, 3]) < 0.2


@pytest.mark.parametrize("object_yaw", np.linspace(-3.0, 3.0, 13))
def test_a_hand_that_swings_about_the_base_chooses_the_branch_for_the_end_of_the_motion(object_yaw):
    """Joint 1 turns the hand as well: without the look ahead, the jaws flip on arrival, which takes half a second."""
    start, end = np.array([0.41, -0.52, 0.52]), np.array([0.61, 0.25, 0.465])

    def flips(swings):
        motion = ToolMotion(HOME, SERVO_PERIOD, swings=swings)
        state = motion.initial_state(start, 0.5 * np.pi)
        branches = []
        for k in range(70):
            azimuth = np.arctan2(state.tool[1], state.tool[0])
            q6 = azimuth - np.arctan2(start[1], start[0]) - (state.tool[3] - 0.5 * np.pi) - 0.9
            state = motion.update(state, k * SERVO_PERIOD, command(duration=0.9), target([*end, object_yaw]), q6)
            branches.append(state.branch)
        return len(set(branches)) - 1, abs(q6)

    count, q6 = flips(swings=True)
    assert count == 0 and q6 <= 0.5 * np.pi + 0.01
    assert flips(swings=False)[1] <= FLIP_ANGLE + 0.01


SLOPE = np.array([0.12, -0.10])


def descent():
    return command(2, height=0.004, duration=0.36, frozen=Frozen.BLIND)


def climbing(time, grade, noise=0.0, speed=SPEED):
    """An object on a straight along +x that climbs with a grade, seen with an error of its vertical speed."""
    pose = [0.4 + speed * time, 0.1, 0.5 + grade * speed * time, 0.0]
    return target(pose, [speed, 0.0, grade * speed + noise, 0.0])


def test_the_hand_stands_square_over_a_surface_with_a_known_slope_until_it_goes_to_a_goal():
    run = Run(slope=SLOPE)
    while run.time < 2.0:
        run.tick(command(), circle(run.time))
    normal = np.array([-SLOPE[0], -SLOPE[1], 1.0]) / np.sqrt(1.0 + SLOPE @ SLOPE)
    np.testing.assert_allclose(
        run.state.tool[:3], pose_of(circle(run.time - SERVO_PERIOD))[:3] + HOVER * normal, atol=1e-9
    )
    np.testing.assert_allclose(run.state.tool[4:], SLOPE, atol=1e-12)
    here = run.state.tool[:4].copy()
    run.tick(command(2, MotionFrame.GOAL, height=0.0), target(here))  # the operator's stop keeps the slope
    np.testing.assert_allclose(run.state.tool[4:], SLOPE, atol=1e-12)
    slopes = []
    while run.time < 4.5:
        run.tick(command(3, MotionFrame.GOAL, height=0.05), target([0.4, 0.3, 0.48, np.pi]))
        slopes.append(run.state.tool[4:])
    np.testing.assert_allclose(slopes[-1], 0.0, atol=1e-12)
    assert np.max(np.abs(np.diff(slopes, axis=0))) < 0.02, "the hand does not turn at once"


@pytest.mark.parametrize("grade", [0.0, 0.25, -0.18])
def test_the_hand_follows_the_slope_of_a_path_through_noise(grade):
    run, rng = Run(slope=None), np.random.default_rng(3)
    slopes = []
    while run.time < 2.0:  # above the object it stays vertical
        run.tick(command(), climbing(run.time, grade, rng.normal(0.0, 0.07 * 0.08), 0.08))
        np.testing.assert_array_equal(run.state.tool[4:], 0.0)
    while run.time < 8.0:
        run.tick(descent(), climbing(run.time, grade, rng.normal(0.0, 0.07 * 0.08), 0.08))
        slopes.append(run.state.tool[4:])
    assert np.max(np.abs(slopes[0])) < 0.02 and np.max(np.abs(np.diff(slopes, axis=0))) < 0.05
    late = np.array(slopes[15:])
    assert np.mean(late[:, 0]) == pytest.approx(grade, abs=0.01) and np.max(np.abs(late[:, 1])) == 0.0
    assert np.std(late[:, 0]) < 0.03 and np.max(np.abs(np.diff(late[:, 0]))) < 0.02


def test_an_object_too_slow_to_tell_its_slope_leaves_the_hand_as_it_is_and_a_cliff_is_not_followed():
    run = Run(slope=None)
    while run.time < 3.0:
        run.tick(descent(), climbing(run.time, 0.2))
    before = run.state.tool[4:].copy()
    assert before[0] == pytest.approx(0.2, abs=1e-3)
    for _ in range(60):
        run.tick(descent(), target(pose_of(climbing(3.0, 0.2)), [0.001, 0.0, 0.02, 0.0]))
    np.testing.assert_allclose(run.state.tool[4:], before, atol=1e-4)
    while run.time < 9.0:
        run.tick(descent(), climbing(run.time, 3.0, speed=0.05))
    assert run.state.tool[4] == pytest.approx(np.tan(np.deg2rad(20.0)), abs=1e-3)
