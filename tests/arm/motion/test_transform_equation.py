import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix

from drake_tracker.arm.arm_model import tool_down, tool_yaw
from drake_tracker.arm.description import PUMA560
from drake_tracker.arm.motion.differential_ik import joints_for
from drake_tracker.arm.motion.transform_equation import (
    LEVEL,
    Drive,
    apply_drive,
    motion_time,
    share_done,
    shrink_drive,
    slope_along,
    solve_drive,
    surface_normal,
    tool_down_rotation,
)
from drake_tracker.core.belt_frame import BeltFrame

HEIGHT = 0.22
STILL = Drive(np.zeros(3), 0.0)


def obj_grasp(p_WO, yaw_O):
    """Obj . Grasp: the grasping frame stands HEIGHT above the object, z axis down, x axis along the object's."""
    X_WO = RigidTransform(RotationMatrix.MakeZRotation(yaw_O), p_WO)
    X_OG = RigidTransform(RotationMatrix.MakeXRotation(np.pi), [0.0, 0.0, HEIGHT])
    return X_WO @ X_OG


def as_transform(drive, R_WT):
    """Drive as the paper writes it, X_TG in the tool's own frame."""
    R_WG = RotationMatrix.MakeZRotation(drive.turn) @ R_WT
    return RigidTransform(R_WT.inverse() @ R_WG, R_WT.inverse() @ drive.translation)


def chain(model, q):
    """Base, T6 and Tool at joint positions q, each read from the arm's own frames."""
    plant, context = model.plant, model.plant.CreateDefaultContext()
    plant.SetPositions(context, model.arm_instance, q)
    world, shoulder, wrist = plant.world_frame(), plant.GetFrameByName("base"), plant.GetFrameByName("link6")
    return (
        plant.CalcRelativeTransform(context, world, shoulder),
        plant.CalcRelativeTransform(context, shoulder, wrist),
        plant.CalcRelativeTransform(context, wrist, model.tool_frame),
    )


def test_the_equation_of_figure_11_holds_as_a_product_of_rigid_transforms(arm_model):
    rng = np.random.default_rng(11)
    tools = []
    for _ in range(8):
        over = tool_down(rng.uniform([0.42, -0.2, 0.55], [0.7, 0.2, 0.75]), rng.uniform(2.0, 4.0))
        q = joints_for(arm_model, PUMA560.q_start, over)
        base, t6, tool = chain(arm_model, q)
        tools.append(tool.GetAsMatrix4())
        X_WT = arm_model.tool_pose(q)
        p_WO, yaw_O = rng.uniform([0.4, -0.2, 0.48], [0.7, 0.2, 0.49]), rng.uniform(-3.0, 3.0)
        X_WG = obj_grasp(p_WO, yaw_O)
        drive = solve_drive(X_WT.translation(), tool_yaw(X_WT), X_WG.translation(), yaw_O)
        left = base @ t6 @ tool @ as_transform(drive, X_WT.rotation())
        np.testing.assert_allclose(left.GetAsMatrix4(), X_WG.GetAsMatrix4(), atol=1e-5)
    np.testing.assert_allclose(tools, np.broadcast_to(tools[0], (8, 4, 4)), atol=1e-12)  # Tool is a constant


def test_solved_for_the_tool_it_gives_the_joints_that_satisfy_it_while_the_object_moves(arm_model):
    rng = np.random.default_rng(12)
    q = joints_for(arm_model, PUMA560.q_start, tool_down([0.56, 0.0, 0.70], np.pi))
    X_WT = arm_model.tool_pose(q)
    start = solve_drive(X_WT.translation(), tool_yaw(X_WT), [0.65, 0.1, 0.485 + HEIGHT], 3.6)
    for fraction in (0.1, 0.5, 0.9, 1.0):
        p_WO, yaw_O = rng.uniform([0.45, -0.15, 0.48], [0.65, 0.15, 0.49]), rng.uniform(2.5, 3.8)
        X_WG = obj_grasp(p_WO, yaw_O)
        drive = shrink_drive(start, STILL, fraction, 1.0)
        p_WT, yaw_T, _ = apply_drive(drive, X_WG.translation(), yaw_O)
        q = joints_for(arm_model, q, tool_down(p_WT, yaw_T))
        base, t6, tool = chain(arm_model, q)
        left = base @ t6 @ tool @ as_transform(drive, arm_model.tool_pose(q).rotation())
        np.testing.assert_allclose(left.GetAsMatrix4(), X_WG.GetAsMatrix4(), atol=1e-5)
    np.testing.assert_array_equal(p_WT, X_WG.translation())  # Drive is the identity at the end


def test_solving_for_the_drive_and_for_the_tool_are_inverse_and_keep_full_turns():
    drive = solve_drive([0.5, 0.1, 0.9], 1.0, [0.6, -0.1, 0.7], 1.0 + 5 * np.pi, (0.1, 0.0), (0.05, -0.2))
    assert drive.turn == pytest.approx(5 * np.pi)
    p_WT, yaw_T, slope_T = apply_drive(drive, [0.6, -0.1, 0.7], 1.0 + 5 * np.pi, (0.05, -0.2))
    np.testing.assert_allclose([*p_WT, yaw_T, *slope_T], [0.5, 0.1, 0.9, 1.0, 0.1, 0.0], atol=1e-12)


def test_a_tool_on_a_slope_is_square_to_it_with_its_x_axis_as_seen_from_above():
    rng = np.random.default_rng(2)
    for slope, yaw in zip(rng.uniform(-0.3, 0.3, (20, 2)), rng.uniform(-3.0, 3.0, 20)):
        X_WT = tool_down([0.5, 0.0, 0.7], yaw, slope)  # a RotationMatrix must be orthonormal
        assert tool_yaw(X_WT) == pytest.approx(yaw)
        x_T, z_T = X_WT.rotation().matrix()[:, 0], X_WT.rotation().matrix()[:, 2]
        assert x_T[2] == pytest.approx(x_T[:2] @ slope)  # x_T lies in the surface
        np.testing.assert_allclose(z_T, -surface_normal(slope), atol=1e-12)
    frame = BeltFrame(np.deg2rad(10.0), 0.45)
    over_belt = RotationMatrix(frame.X_WB[:3, :3]) @ RotationMatrix(tool_down_rotation(0.4))
    seen = frame.to_world(np.array([[0.5, 0.1, 0.45, 0.4]]))[0, 3]
    np.testing.assert_allclose(tool_down_rotation(seen, frame.slope), over_belt.matrix(), atol=1e-12)


def test_a_slope_follows_from_a_velocity_that_is_fast_enough():
    np.testing.assert_allclose(slope_along(np.array([0.0, -0.1, 0.02]), LEVEL), [0.0, -0.2])
    np.testing.assert_allclose(slope_along(np.array([0.06, 0.08, -0.01]), LEVEL), [-0.06, -0.08])
    np.testing.assert_allclose(slope_along(np.array([0.01, 0.0, 0.01]), (0.1, 0.2)), [0.1, 0.2])
    np.testing.assert_allclose(slope_along(np.array([0.1, 0.0, 9.0]), LEVEL), [np.tan(np.deg2rad(20.0)), 0.0])


@pytest.mark.parametrize("duration", [0.36, 1.0])
def test_drive_starts_at_its_value_and_rate_and_ends_at_rest_at_zero(duration):
    start = Drive(np.array([0.2, -0.1, -0.3]), 2.0, np.array([0.2, -0.1]))
    rate = Drive(np.array([-0.05, 0.2, 0.4]), -1.0, np.array([0.0, 0.3]))

    def values(fraction):
        drive = shrink_drive(start, rate, fraction, duration)
        return np.array([*drive.translation, drive.turn, *drive.slope])

    whole_rate = np.array([*rate.translation, rate.turn, *rate.slope])
    np.testing.assert_array_equal(values(0.0), [0.2, -0.1, -0.3, 2.0, 0.2, -0.1])
    np.testing.assert_allclose(values(1.0), 0.0, atol=1e-15)
    np.testing.assert_allclose(values(1.7), 0.0, atol=1e-15)
    h = 1e-5
    np.testing.assert_allclose((values(h) - values(0.0)) / (h * duration), whole_rate, rtol=1e-3, atol=1e-3)
    np.testing.assert_allclose((values(1.0) - values(1.0 - h)) / (h * duration), 0.0, atol=1e-3)
    t = np.linspace(0.0, 1.0, 2001)
    speed = np.diff([values(f) for f in t], axis=0) / (t[1] * duration)
    assert np.max(np.abs(np.diff(speed, axis=0))) < 0.03  # no step of speed anywhere on the way


def test_speed_is_a_trapezoid_with_a_peak_of_four_thirds_of_the_mean():
    t = np.linspace(0.0, 1.0, 4001)
    done = np.array([share_done(f) for f in t])
    speed = np.diff(done) / t[1]
    assert done[0] == 0.0 and done[-1] == 1.0 and share_done(-0.3) == 0.0 and share_done(2.0) == 1.0
    assert speed.min() >= 0.0 and speed.max() == pytest.approx(4.0 / 3.0, rel=1e-6)
    np.testing.assert_allclose(done + done[::-1], 1.0, atol=1e-12)
    assert np.mean(speed > 1.333) == pytest.approx(0.5, abs=0.01)  # full speed for half of the time
    assert np.max(np.abs(np.diff(speed))) < 2e-3  # C1


@pytest.mark.parametrize("way, against", [(0.2, 0.0), (0.02, 0.0), (0.1, 0.5), (0.001, 0.3)])
def test_a_motion_takes_as_long_as_speed_and_acceleration_allow(way, against):
    duration = motion_time(way, against, 0.75, 10.0)
    start, rate = Drive(np.array([way, 0.0, 0.0]), 0.0), Drive(np.array([against, 0.0, 0.0]), 0.0)
    t = np.linspace(0.0, 1.0, 1001)
    place = np.array([shrink_drive(start, rate, f, duration).translation[0] for f in t])
    speed = np.diff(place) / (t[1] * duration)
    acceleration = np.diff(speed) / (t[1] * duration)
    assert np.max(abs(speed)) < 0.75 + 1e-3 and np.max(abs(acceleration)) < 10.0 + 1e-3
    assert np.max(abs(speed)) > 0.74 or np.max(abs(acceleration)) > 6.0  # and no longer than that


def test_the_hand_goes_straight_as_seen_from_an_object_that_moves_and_turns():
    start = solve_drive([0.5, 0.3, 0.9], 0.2, [0.68, 0.0, 0.7], np.pi / 2)
    seen = []
    for fraction in np.linspace(0.0, 1.0, 50):
        angle = 1.5 * fraction
        p_WG = np.array([0.56 + 0.12 * np.cos(angle), 0.12 * np.sin(angle), 0.7])
        p_WT, yaw_T, _ = apply_drive(shrink_drive(start, STILL, fraction, 1.0), p_WG, np.pi / 2 + angle)
        seen.append([*(p_WT - p_WG), yaw_T - np.pi / 2 - angle])
    seen = np.array(seen)
    line = seen[0] / np.linalg.norm(seen[0])
    along = seen @ line
    np.testing.assert_allclose(seen, np.outer(along, line), atol=1e-12)
    assert np.all(np.diff(along) <= 0.0) and along[-1] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("yaw", [-2.5, 0.0, 0.7, 4.0])
def test_tool_down_is_a_rotation_that_points_down_with_its_x_axis_at_yaw(yaw):
    R = tool_down_rotation(yaw)
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(R) == pytest.approx(1.0)
    np.testing.assert_allclose(R[:, 2], [0.0, 0.0, -1.0])
    np.testing.assert_allclose(R[:, 0], [np.cos(yaw), np.sin(yaw), 0.0])
