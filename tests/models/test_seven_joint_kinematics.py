"""The seven-joint arm against its table of modified Denavit-Hartenberg parameters, multiplied out here by itself."""

import numpy as np
import pytest
from arm_plants import arm_plant, frame_pose

# Table of models/seven_joint/README.md: alpha [deg], a and d [in] of joints 1 to 7, tool plate beyond the wrist [in].
ALPHA = [0.0, 90.0, -90.0, 90.0, -90.0, 90.0, -90.0]
A = [0.0, 0.0, -5.625, -4.25, 4.25, -3.125, 3.125]
D = [0.0, 0.0, 27.0, 0.0, 27.0, 0.0, 0.0]
TOOL = 6.6
INCH, DEG = 0.0254, np.pi / 180.0
BASE = np.array([[-1.0, 0.0, 0.0, -0.35], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.60], [0.0, 0.0, 0.0, 1.0]])
"""Frame 0 in the frame of `base`: the pedestal."""


def translation(x, z):
    T = np.eye(4)
    T[[0, 2], 3] = x, z
    return T


def rotation(axis, angle):
    T = np.eye(4)
    i, j = {"x": (1, 2), "z": (0, 1)}[axis]
    T[[i, j], [i, j]] = np.cos(angle)
    T[i, j], T[j, i] = -np.sin(angle), np.sin(angle)
    return T


def dh_product(q, links=7):
    T = BASE
    for theta, alpha, a, d in list(zip(q, ALPHA, A, D, strict=True))[:links]:
        T = T @ rotation("x", alpha * DEG) @ translation(a * INCH, 0) @ rotation("z", theta) @ translation(0, d * INCH)
    return T


@pytest.fixture(scope="module")
def plant():
    return arm_plant("seven_joint")


@pytest.fixture
def context(plant):
    return plant.CreateDefaultContext()


def random_joints(plant, count, seed):
    return np.random.default_rng(seed).uniform(
        plant.GetPositionLowerLimits(), plant.GetPositionUpperLimits(), size=(count, 7)
    )


def test_joints_come_in_order(plant):
    assert plant.num_positions() == plant.num_velocities() == plant.num_actuators() == 7
    assert [plant.GetJointByName(f"joint{i}").position_start() for i in range(1, 8)] == list(range(7))
    actuators = [plant.get_joint_actuator(i) for i in plant.GetJointActuatorIndices()]
    assert [actuator.name() for actuator in actuators] == [f"joint{i}" for i in range(1, 8)]


def test_every_link_frame_is_its_dh_frame(plant, context):
    for q in random_joints(plant, 20, 1607):
        for link in range(1, 8):
            np.testing.assert_allclose(frame_pose(plant, context, q, f"link{link}"), dh_product(q, link), atol=1e-9)


def test_the_tool_plate_lies_ahead_of_the_wrist_and_is_turned_half_round(plant, context):
    for q in random_joints(plant, 5, 1608):
        expected = dh_product(q) @ translation(0.0, TOOL * INCH) @ rotation("z", np.pi)
        np.testing.assert_allclose(frame_pose(plant, context, q, "flange"), expected, atol=1e-9)


def test_stretched_up_it_stands_as_high_as_its_parts(plant, context):
    T = frame_pose(plant, context, np.zeros(7), "flange")
    np.testing.assert_allclose(T[:3, 3], [-0.35 + 5.625 * INCH, 0.0, 0.60 + 60.6 * INCH], atol=1e-9)


def test_pitches_that_add_up_to_half_a_turn_point_the_tool_down_and_back(plant, context):
    T = frame_pose(plant, context, np.array([0.0, 5.0, 0.0, 120.0, 0.0, 55.0, 0.0]) * DEG, "flange")
    np.testing.assert_allclose(T[:3, :3], np.diag([-1.0, 1.0, -1.0]), atol=1e-9)  # yaw 180 deg
    assert 0.4 < T[0, 3] < 0.8  # folded forward, over the work


def test_limits_and_drives(plant):
    degrees = [(-180, 180), (-120, 120), (-180, 180), (0, 175), (-180, 180), (-30, 180), (-270, 270)]
    limits = np.column_stack([plant.GetPositionLowerLimits(), plant.GetPositionUpperLimits()])
    np.testing.assert_allclose(limits, np.array(degrees) * DEG, atol=1e-12)
    np.testing.assert_allclose(plant.GetVelocityUpperLimits(), [1.9, 1.9, 2.4, 2.4, 4.0, 4.0, 5.0])
    np.testing.assert_allclose(plant.GetEffortUpperLimits(), [320, 480, 240, 240, 80, 80, 40])


def test_mass_matrix_is_positive_definite_everywhere(plant, context):
    for q in random_joints(plant, 100, 1609):
        plant.SetPositions(context, q)
        assert np.linalg.eigvalsh(plant.CalcMassMatrix(context))[0] > 0.3  # a wrist motor's reflected inertia


def test_drives_can_hold_the_arm_stretched_out(plant, context):
    plant.SetPositions(context, np.array([0.0, 90.0, 0.0, 0.0, 0.0, 0.0, 0.0]) * DEG)
    load = np.abs(plant.CalcGravityGeneralizedForces(context))
    assert load[1] > 100.0
    assert np.all(load < 0.7 * plant.GetEffortUpperLimits())
