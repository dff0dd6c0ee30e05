from copy import deepcopy

import numpy as np
import pytest

from drake_tracker.arm.arm_model import make_arm_model, tool_down
from drake_tracker.arm.description import PUMA560, PUMA560_CUP, SEVEN_JOINT
from drake_tracker.arm.motion.differential_ik import joints_for
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.messages import ArmCommand, ServoTarget, ToolStatus, TouchReport
from drake_tracker.grasp.ball.touch_machine import TouchMachine, TouchPhase, contact_force, low_pass, touched_points
from drake_tracker.grasp.config import TouchConfig

PERIOD = 0.005
PARAMETERS = TouchConfig()
JOGS = np.array([[0.6, 0.2, 0.55, np.pi], [0.6, -0.2, 0.55, np.pi], [0.7, 0.0, 0.58, np.pi]])
START = np.array([0.6, 0.2, 0.60])


class Bench:
    """The machine alone: motions take their time, the arm stands at ``q``, and a force can be put on its tool."""

    def __init__(self, model):
        self.model = model
        self.machine = TouchMachine(model, JOGS, START, PERIOD, PARAMETERS)
        self.state = self.machine.initial_state()
        self.q = joints_for(model, PUMA560.q_start, tool_down(JOGS[0, :3], np.pi))
        self.time = self.begun = 0.0
        self.motion = self.state.motion

    def tick(self, force=0.0):
        command = ArmCommand(self.machine.command(self.state))
        if command.motion != self.motion:
            self.motion, self.begun = command.motion, self.time
        status = ToolStatus(np.zeros(8))
        status.motion, status.fraction = self.motion, min((self.time - self.begun) / command.duration, 1.0)
        none = np.zeros(6)
        _, J_WT = self.model.tool_pose_and_jacobian(self.q)
        effort = self.model.drive_torques(self.q, none, none) - J_WT[5] * force
        self.state = self.machine.update(self.state, self.time, status, self.q, none, none, effort)
        self.time += PERIOD

    def until(self, phase, force=0.0, limit=20.0):
        start = self.time
        while self.state.phase != phase:
            self.tick(force)
            assert self.time < start + limit, self.state.phase
        return self.time - start


@pytest.fixture
def bench(arm_model):
    return Bench(arm_model)


def test_it_goes_over_down_and_up_three_times_and_is_done(bench):
    for mark in range(3):
        bench.until(TouchPhase.DOWN)
        target = ServoTarget(bench.machine.target(bench.state, bench.time))
        np.testing.assert_allclose([target.x, target.y, target.z, target.yaw], JOGS[mark])
        assert target.valid and not (target.vx or target.vy or target.vz)
        assert ArmCommand(bench.machine.command(bench.state)).height == -PARAMETERS.reach_below
        took = bench.until(TouchPhase.UP, force=10.0)
        assert took <= (PARAMETERS.samples + 1) * PERIOD + 1e-9
        assert ArmCommand(bench.machine.command(bench.state)).height == PARAMETERS.clearance
        assert len(bench.state.points) == mark + 1
        bench.q = bench.q + 0.01
    bench.until(TouchPhase.DONE)
    points = touched_points(bench.machine.report(bench.state))
    np.testing.assert_allclose(points[0], JOGS[0, :3], atol=1e-6)
    assert np.all(np.linalg.norm(np.diff(points, axis=0), axis=1) > 1e-3)  # each is where the joints were then


def test_the_descent_is_as_slow_as_asked(bench):
    bench.until(TouchPhase.DOWN)
    peak = PARAMETERS.reach_below / bench.state.duration / 0.75
    assert peak == pytest.approx(PARAMETERS.descent_speed)


def test_the_noted_position_is_where_the_force_began(bench):
    bench.until(TouchPhase.DOWN)
    free = bench.model.tool_pose(bench.q).translation()
    bench.tick()
    for force in (1.0, 2.0, 3.0, 5.0, 8.0, 12.0):  # a soft board: the probe sinks in
        bench.q = bench.q + [0.0, 0.002, 0.0, 0.0, 0.0, 0.0]
        if bench.state.phase == TouchPhase.DOWN:
            bench.tick(force)
    assert bench.state.phase == TouchPhase.UP
    np.testing.assert_allclose(bench.state.points[0], free, atol=1e-9)
    assert np.linalg.norm(bench.model.tool_pose(bench.q).translation() - free) > 2e-3


def test_it_travels_clear_of_the_pegs_and_comes_down_to_the_jogged_pose_first(bench):
    heights = [ArmCommand(bench.machine.command(bench.state)).height]
    bench.until(TouchPhase.ABOVE)
    heights.append(ArmCommand(bench.machine.command(bench.state)).height)
    assert heights == [PARAMETERS.clearance, 0.0]


def test_a_single_sample_is_no_touch(bench):
    bench.until(TouchPhase.DOWN)
    for _ in range(20):
        bench.tick(force=PARAMETERS.threshold + 1.0)
        for _ in range(10):
            bench.tick()
    assert bench.state.phase == TouchPhase.DOWN


def test_a_force_at_rest_does_not_count(bench):
    bench.until(TouchPhase.DOWN, force=50.0)
    for _ in range(40):
        bench.tick(force=50.0)
    assert bench.state.phase == TouchPhase.DOWN
    assert abs(TouchReport(bench.machine.report(bench.state)).force) < 0.1
    bench.until(TouchPhase.UP, force=60.0, limit=0.1)


def test_a_descent_that_finds_nothing_is_an_error_that_names_the_mark(bench):
    bench.until(TouchPhase.DOWN)
    bench.until(TouchPhase.UP, force=10.0)
    bench.until(TouchPhase.DOWN)
    with pytest.raises(DrakeTrackerError, match="not finished"):
        touched_points(bench.machine.report(bench.state))
    bench.until(TouchPhase.MISSED)
    with pytest.raises(DrakeTrackerError, match="felt nothing below mark 2 of the board"):
        touched_points(bench.machine.report(bench.state))


def test_a_state_is_its_own_copy_and_its_points_cannot_be_written(bench):
    bench.until(TouchPhase.DOWN)
    bench.until(TouchPhase.UP, force=10.0)
    assert deepcopy(bench.state) is bench.state
    with pytest.raises(ValueError):
        bench.state.points[0, 0] = 1.0


@pytest.mark.parametrize("description", [PUMA560_CUP, SEVEN_JOINT], ids=["six joints", "seven joints"])
def test_a_force_on_the_tool_is_found_whatever_the_motion(description):
    model = make_arm_model(description)
    q = joints_for(model, description.q_start, tool_down([0.55, 0.1, 0.56], np.pi))
    rng = np.random.default_rng(2)
    for force in ([0.0, 0.0, 3.0], [1.0, -2.0, 10.0], [0.0, 0.0, 0.0]):
        v, a = rng.uniform(-0.3, 0.3, (2, model.num_joints))
        _, J_WT = model.tool_pose_and_jacobian(q)
        effort = model.drive_torques(q, v, a) - J_WT[3:].T @ np.array(force)
        np.testing.assert_allclose(contact_force(model, q, v, a, effort), force, atol=1e-9)


def test_torques_of_free_motion_are_gravity_friction_and_inertia(arm_model):
    q, v, a = np.array([0.2, 0.8, -2.6, 0.1, -1.2, 0.3]), np.full(6, 0.2), np.full(6, 0.5)
    plant = arm_model.plant
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, q)
    rest = arm_model.drive_torques(q, 0 * v, 0 * a)
    np.testing.assert_allclose(rest, -plant.CalcGravityGeneralizedForces(context), atol=1e-9)
    np.testing.assert_allclose(
        arm_model.drive_torques(q, 0 * v, a) - rest, plant.CalcMassMatrix(context) @ a, atol=1e-9
    )
    damping = np.array([plant.GetJointByName(f"joint{i}").default_damping() for i in range(1, 7)])
    plant.SetVelocities(context, v)
    np.testing.assert_allclose(
        arm_model.drive_torques(q, v, 0 * a) - rest, damping * v + plant.CalcBiasTerm(context), atol=1e-9
    )


def test_a_low_pass_reaches_63_percent_after_its_time_constant():
    value = 0.0
    for _ in range(10):
        value = low_pass(value, 1.0, 0.005, 0.05)
    assert value == pytest.approx(1.0 - np.exp(-1.0))
