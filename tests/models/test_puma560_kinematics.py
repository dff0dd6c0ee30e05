"""The PUMA 560 model against published kinematics, limits and dynamics.

Reference poses, inertias and gravity loads are those of Corke's Robotics Toolbox for Python
(PyPI roboticstoolbox-python 1.5.0, models.DH.Puma560), printed to twelve digits.
"""

import numpy as np
import pytest
from arm_plants import arm_plant, frame_pose

# Table of models/puma560/README.md: a [m], alpha [deg], d [m] of joints 1 to 6, and the flange beyond the wrist [m].
A = [0.0, 0.4318, 0.0203, 0.0, 0.0, 0.0]
ALPHA = [90.0, 0.0, -90.0, 90.0, -90.0, 0.0]
D = [0.67183, 0.0, 0.15005, 0.4318, 0.0, 0.0]
FLANGE = 0.05625

DEG = np.pi / 180.0
QZ = np.zeros(6)
QR = np.array([0.0, 90.0, -90.0, 0.0, 0.0, 0.0]) * DEG
QS = np.array([0.0, 0.0, -90.0, 0.0, 0.0, 0.0]) * DEG
QN = np.array([0.0, 45.0, -180.0, 0.0, 45.0, 0.0]) * DEG

PUBLISHED_WRIST = [  # joint angles, columns x, z and position of frame 6
    (QZ, [1, 0, 0], [0, 0, 1], [0.4521, -0.15005, 1.10363]),
    (QR, [1, 0, 0], [0, 0, 1], [0.0203, -0.15005, 1.53543]),
    (QS, [0, 0, -1], [1, 0, 0], [0.8636, -0.15005, 0.65153]),
    (QN, [0, 0, -1], [1, 0, 0], [0.596303148575, -0.15005, 0.657475732342]),
    (
        [0.3, 0.7, -1.1, 0.4, -0.6, 1.9],
        [-0.699465751504, 0.587215403354, 0.407339824393],
        [0.699688108548, 0.446600873388, 0.557659583119],
        [0.538354217259, 0.009467396718, 1.339812142211],
    ),
]

PUBLISHED_INERTIA_QN = [
    [3.659375412153, -0.404361246042, 0.100613647780, -0.002516955828, 0.0, 0.0],
    [-0.404361246042, 4.413741933636, 0.350890664956, 0.0, 0.002359513068, 0.0],
    [0.100613647780, 0.350890664956, 0.937841575215, 0.0, 0.001480166389, 0.0],
    [-0.002516955828, 0.0, 0.0, 0.192531706124, 0.0, 0.000028284271],
    [0.0, 0.002359513068, 0.001480166389, 0.0, 0.171348451657, 0.0],
    [0.0, 0.0, 0.0, 0.000028284271, 0.0, 0.194104505668],
]
PUBLISHED_INERTIA_QZ = [
    [3.961126104267, -0.162664810500, -0.138913810500, 0.001640, -0.000432144, 0.00004],
    [-0.162664810500, 4.456622095500, 0.372736323500, 0.0, 0.001885744, 0.0],
    [-0.138913810500, 0.372736323500, 0.938652730438, 0.0, 0.001885744, 0.0],
    [0.001640, 0.0, 0.0, 0.192430626124, 0.0, 0.00004],
    [-0.000432144, 0.001885744, 0.001885744, 0.0, 0.171348451657, 0.0],
    [0.00004, 0.0, 0.0, 0.00004, 0.0, 0.194104505668],
]
REPAIR = 0.008
"""What was added to the published ixx of link 3 [kg m^2]."""

PUBLISHED_GRAVITY = [
    (QN, [0.0, 31.639880378357, 6.035138023011, 0.0, 0.0282528, 0.0]),
    (QR, [0.0, -0.77523525, 0.24892875, 0.0, 0.0, 0.0]),
    (QZ, [0.0, 37.48366665, 0.24892875, 0.0, 0.0, 0.0]),
]


@pytest.fixture(scope="module")
def plant():
    return arm_plant("puma560")


@pytest.fixture
def context(plant):
    return plant.CreateDefaultContext()


def joints(plant):
    return [plant.GetJointByName(f"joint{i}") for i in range(1, 7)]


def dh_product(q, links=6):
    T = np.eye(4)
    for theta, a, alpha, d in list(zip(q, A, np.array(ALPHA) * DEG, D, strict=True))[:links]:
        ct, st, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
        T = T @ [[ct, -st * ca, st * sa, a * ct], [st, ct * ca, -ct * sa, a * st], [0, sa, ca, d], [0, 0, 0, 1]]
    return T


def test_joints_come_in_order(plant):
    assert plant.num_positions() == plant.num_velocities() == plant.num_actuators() == 6
    assert [joint.position_start() for joint in joints(plant)] == list(range(6))
    actuators = [plant.get_joint_actuator(i) for i in plant.GetJointActuatorIndices()]
    assert [actuator.name() for actuator in actuators] == [f"joint{i}" for i in range(1, 7)]


@pytest.mark.parametrize("row", PUBLISHED_WRIST)
def test_wrist_is_where_the_published_model_puts_it(plant, context, row):
    q, x_axis, z_axis, position = row
    T = frame_pose(plant, context, q, "link6")
    np.testing.assert_allclose(T[:3, 0], x_axis, atol=1e-9)
    np.testing.assert_allclose(T[:3, 2], z_axis, atol=1e-9)
    np.testing.assert_allclose(T[:3, 3], position, atol=1e-9)


def test_every_link_frame_is_its_dh_frame(plant, context):
    lower, upper = plant.GetPositionLowerLimits(), plant.GetPositionUpperLimits()
    for q in np.random.default_rng(560).uniform(lower, upper, size=(20, 6)):
        for link in range(1, 7):
            np.testing.assert_allclose(frame_pose(plant, context, q, f"link{link}"), dh_product(q, link), atol=1e-12)


def test_flange_lies_ahead_of_the_wrist(plant, context):
    expected = dh_product(QN) @ [0.0, 0.0, FLANGE, 1.0]
    T = frame_pose(plant, context, QN, "flange")
    np.testing.assert_allclose(T[:3, 3], expected[:3], atol=1e-12)
    np.testing.assert_allclose(T[:3, :3], dh_product(QN)[:3, :3], atol=1e-12)


def test_limits(plant):
    degrees = [(-160, 160), (-45, 225), (-225, 45), (-110, 170), (-100, 100), (-266, 266)]
    limits = np.column_stack([plant.GetPositionLowerLimits(), plant.GetPositionUpperLimits()])
    np.testing.assert_allclose(limits, np.array(degrees) * DEG, atol=1e-12)
    speed = [1.92, 1.51, 2.40, 5.34, 5.09, 5.74]
    np.testing.assert_allclose(plant.GetVelocityUpperLimits(), speed)
    np.testing.assert_allclose(plant.GetVelocityLowerLimits(), np.negative(speed))


def test_actuators(plant):
    actuators = [plant.get_joint_actuator(i) for i in plant.GetJointActuatorIndices()]
    assert [a.effort_limit() for a in actuators] == [97.6, 186.4, 89.4, 24.2, 20.1, 21.3]
    assert [a.default_gear_ratio() for a in actuators] == [62.6111, 107.815, 53.7063, 76.0364, 71.923, 76.686]
    assert [a.default_rotor_inertia() for a in actuators] == [200e-6] * 3 + [33e-6] * 3


def test_damping_is_the_motor_friction_seen_through_the_gears(plant):
    motor_friction = np.array([1.48e-3, 0.817e-3, 1.38e-3, 71.2e-6, 82.6e-6, 36.7e-6])
    gear = np.array([62.6111, 107.815, 53.7063, 76.0364, 71.923, 76.686])
    np.testing.assert_allclose(
        [joint.default_damping() for joint in joints(plant)], motor_friction * gear**2, atol=1e-4
    )


@pytest.mark.parametrize("q, published", [(QN, PUBLISHED_INERTIA_QN), (QZ, PUBLISHED_INERTIA_QZ)])
def test_mass_matrix_is_the_published_one_but_for_the_repair(plant, context, q, published):
    plant.SetPositions(context, q)
    expected = np.array(published)
    expected[0, 0] += REPAIR * dh_product(q, 3)[2, 0] ** 2  # joint 1 turns link 3 about z_W, partly its x axis
    np.testing.assert_allclose(plant.CalcMassMatrix(context), expected, atol=1e-9)


def test_mass_matrix_is_positive_definite_everywhere(plant, context):
    lower, upper = plant.GetPositionLowerLimits(), plant.GetPositionUpperLimits()
    for q in np.random.default_rng(561).uniform(lower, upper, size=(100, 6)):
        plant.SetPositions(context, q)
        assert np.linalg.eigvalsh(plant.CalcMassMatrix(context))[0] > 0.15  # a wrist motor's reflected inertia


@pytest.mark.parametrize("q, load", PUBLISHED_GRAVITY)
def test_gravity_load_is_the_published_one(plant, context, q, load):
    plant.SetPositions(context, q)
    np.testing.assert_allclose(-plant.CalcGravityGeneralizedForces(context), load, atol=1e-9)


def test_drives_can_hold_the_arm_stretched_out(plant, context):
    plant.SetPositions(context, QS)
    load = np.abs(plant.CalcGravityGeneralizedForces(context))
    assert np.all(load < 0.5 * plant.GetEffortUpperLimits())
