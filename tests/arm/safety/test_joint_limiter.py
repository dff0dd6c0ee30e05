import numpy as np
import pytest

from drake_tracker.arm.arm_clearance import ArmClearance
from drake_tracker.arm.arm_model import tool_down
from drake_tracker.arm.description import PUMA560
from drake_tracker.arm.motion.differential_ik import (
    LIMIT_MARGIN,
    joints_for,
    limit_acceleration,
    make_parameters,
    step_joints,
)
from drake_tracker.arm.safety.joint_limiter import TORQUE_SHARE, JointLimiter, Limit
from drake_tracker.core.timing import SERVO_PERIOD
from drake_tracker.world.train.plant import table_box

TABLE = 0.45
FOLDED = np.array([0.0, -0.1, -3.5, 0.0, -1.0, 0.0])
HAND_IN_COLUMN = np.array([0.0, -0.1, -3.9, 0.0, -1.5, 0.0])


@pytest.fixture(scope="module")
def clearance():
    return ArmClearance(PUMA560, [table_box(height=TABLE)])


@pytest.fixture(scope="module")
def limiter(arm_model, clearance):
    return JointLimiter(arm_model, SERVO_PERIOD, clearance)


@pytest.fixture(scope="module")
def q_start(arm_model):
    return over_table(arm_model, 0.25)


def over_table(arm_model, height):
    return joints_for(arm_model, PUMA560.q_start, tool_down([0.56, 0.0, TABLE + height], np.pi))


def follow(limiter, q, targets):
    """Returns the steps that the limiter makes of a series of wanted set-points, from rest at q."""
    steps, v = [], np.zeros_like(q)
    for wanted in targets:
        step = limiter.step(q, v, np.asarray(wanted, dtype=float))
        steps.append(step)
        q, v = step.q, step.v
    return steps


def seen(steps):
    return frozenset().union(*(step.limits for step in steps))


def test_set_points_of_the_inverse_kinematics_pass_bit_for_bit(arm_model, limiter, q_start):
    """A descent to the grasp as in every run: 0.22 m in 0.35 s, with a joint that turns meanwhile."""
    parameters = make_parameters(arm_model, SERVO_PERIOD)
    q, v = q_start, np.zeros(6)
    for k in range(40):
        fraction = min(k * SERVO_PERIOD / 0.35, 1.0)
        height = 0.25 - 0.21 * (10 * fraction**3 - 15 * fraction**4 + 6 * fraction**5)
        goal = tool_down([0.56 + 0.004 * k, 0.0, TABLE + height], np.pi + 0.01 * k)
        wanted, _ = step_joints(arm_model, parameters, q, goal)
        wanted, v_wanted = limit_acceleration(arm_model, parameters, q, v, wanted)
        step = limiter.step(q, v, wanted)
        assert step.q is wanted and not step.limits
        np.testing.assert_array_equal(step.v, v_wanted)
        q, v = step.q, step.v


def test_no_wish_makes_the_arm_break_a_limit(arm_model, limiter, clearance, q_start):
    """Wishes from anywhere, near and far: the arm obeys its limits and touches nothing."""
    rng = np.random.default_rng(7)
    q, v, limits, nearest = q_start, np.zeros(6), set(), 1.0
    for k in range(600):
        if k % 20 == 0:
            far = rng.uniform(arm_model.position_lower - 1.0, arm_model.position_upper + 1.0)
            down = joints_for(arm_model, q_start, tool_down([0.5, rng.uniform(-0.2, 0.2), TABLE - 0.1], np.pi))
            goal = [far, down, np.full(6, np.nan), q_start][rng.integers(4)]
        step = limiter.step(q, v, goal if k % 2 else q + 0.3 * (goal - q))
        change = np.abs(step.v - v) / SERVO_PERIOD * arm_model.inertia(q)
        q, v = step.q, step.v
        limits |= step.limits
        nearest = min(nearest, clearance.distance(q, 0.05))
        assert np.all(q >= arm_model.position_lower) and np.all(q <= arm_model.position_upper)
        assert np.all(np.abs(v) <= arm_model.velocity_limit * (1 + 1e-12))
        assert np.all(change <= arm_model.effort_limit * (1 + 1e-9))
    assert limits >= {Limit.INVALID, Limit.SPEED, Limit.ACCELERATION, Limit.TORQUE, Limit.OBSTACLE}
    assert nearest > 0.0


def test_no_drive_is_asked_for_more_than_its_torque(arm_model, limiter, q_start):
    """Unless the arm must stop, the torques of the reference leave the joint servo something to correct with."""
    rng = np.random.default_rng(1)
    q, v, most, limited = q_start, np.zeros(6), 0.0, set()
    for _ in range(300):
        goal = q_start + rng.uniform(-1.0, 1.0, 6) * [1.0, 0.3, 0.3, 1.0, 1.0, 1.0]
        step = limiter.step(q, v, goal)
        if not step.limits & {Limit.OBSTACLE, Limit.LINK}:
            torque = arm_model.drive_torques(q, v, (step.v - v) / SERVO_PERIOD)
            most = max(most, np.max(np.abs(torque) / arm_model.effort_limit))
        limited |= step.limits
        q, v = step.q, step.v
    assert Limit.TORQUE in limited
    assert 0.9 < most <= TORQUE_SHARE + 1e-9


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e308])
def test_a_set_point_that_is_no_place_stops_the_arm(arm_model, limiter, q_start, bad):
    moving = [q_start + 0.02 * k * np.eye(6)[0] for k in range(1, 6)]
    steps = follow(limiter, q_start, [*moving, *[np.where(np.eye(6)[1] > 0, bad, q_start)] * 10])
    assert np.isfinite(steps[-1].q).all()
    if not np.isfinite(bad):
        assert Limit.INVALID in seen(steps)
        np.testing.assert_allclose(steps[-1].v, 0.0, atol=1e-12)


def test_a_joint_that_is_sent_beyond_its_range_stops_before_the_end(arm_model, limiter, q_start):
    goal = q_start.copy()
    goal[5] = 10.0
    steps = follow(limiter, q_start, [goal] * 80)
    q6 = np.array([step.q[5] for step in steps])
    assert {Limit.SPEED, Limit.POSITION} <= seen(steps)
    assert q6[-1] == pytest.approx(arm_model.position_upper[5] - LIMIT_MARGIN, abs=1e-3)
    braking = -np.diff([step.v[5] for step in steps]) / SERVO_PERIOD
    assert np.max(braking) * arm_model.inertia(q_start)[5] < arm_model.effort_limit[5]


def test_speed_is_reduced_along_the_path(arm_model, limiter, q_start):
    along = np.array([1.0, 0.5, 0, 0, 0, 0])
    step = limiter.step(q_start, 1.9 * along, q_start + 0.3 * along)
    assert Limit.SPEED in step.limits
    assert step.v[1] == pytest.approx(0.5 * step.v[0])


def test_a_hand_that_is_sent_through_the_table_stops_above_it_and_comes_back(arm_model, limiter, clearance, q_start):
    below = over_table(arm_model, -0.10)
    steps = follow(limiter, q_start, [q_start + (below - q_start) * min(k / 6, 1.0) for k in range(60)])
    assert seen(steps) & {Limit.OBSTACLE}
    assert min(clearance.distance(step.q, 0.1) for step in steps) >= 0.005 - 1e-9
    np.testing.assert_allclose(steps[-1].v, 0.0, atol=1e-12)
    back = follow(limiter, steps[-1].q, [q_start] * 60)
    np.testing.assert_allclose(back[-1].q, q_start, atol=1e-6)


def test_an_arm_that_is_too_near_may_move_away_but_not_nearer(arm_model, limiter):
    near = over_table(arm_model, 0.015)
    assert limiter.step(near, np.zeros(6), over_table(arm_model, 0.020)).limits == frozenset()
    assert limiter.step(near, np.zeros(6), over_table(arm_model, 0.014)).limits == {Limit.OBSTACLE}


def test_the_hand_stops_before_the_arm_touches_itself(arm_model):
    clearance = ArmClearance(PUMA560)
    steps = follow(JointLimiter(arm_model, SERVO_PERIOD, clearance), FOLDED, [HAND_IN_COLUMN] * 60)
    assert Limit.LINK in seen(steps)
    assert min(clearance.distance(step.q, 0.1) for step in steps) > 0.0


def test_without_a_clearance_only_the_joints_are_limited(arm_model, q_start):
    below = over_table(arm_model, -0.10)
    steps = follow(JointLimiter(arm_model), q_start, [below] * 60)
    np.testing.assert_allclose(steps[-1].q, below, atol=1e-6)
