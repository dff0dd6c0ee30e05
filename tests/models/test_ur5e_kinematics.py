"""The UR5e-like arm against its table of Denavit-Hartenberg parameters, multiplied out here by itself."""

import numpy as np
import pytest
from arm_plants import arm_plant, frame_pose

from drake_tracker.arm.arm_model import make_arm_model, tool_down
from drake_tracker.arm.description import UR5E
from drake_tracker.arm.motion.differential_ik import joints_for

# Table of models/ur5e/README.md.
A = [0.0, -0.425, -0.3922, 0.0, 0.0, 0.0]
D = [0.1625, 0.0, 0.0, 0.1333, 0.0997, 0.0996]
ALPHA = [90.0, 0.0, 0.0, 90.0, -90.0, 0.0]
MASSES = [3.761, 8.058, 2.846, 1.37, 1.3, 0.365]
PEDESTAL = 0.45


def dh_product(q, links=6):
    T = np.eye(4)
    T[2, 3] = PEDESTAL
    for theta, a, d, alpha in list(zip(q, A, D, np.deg2rad(ALPHA), strict=True))[:links]:
        ct, st, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
        T = T @ np.array(
            [[ct, -st * ca, st * sa, a * ct], [st, ct * ca, -ct * sa, a * st], [0, sa, ca, d], [0, 0, 0, 1]]
        )
    return T


@pytest.fixture(scope="module")
def plant():
    return arm_plant("ur5e")


def test_every_link_frame_is_its_dh_frame(plant):
    context = plant.CreateDefaultContext()
    random = np.random.default_rng(5)
    for q in random.uniform(-np.pi, np.pi, (10, 6)):
        for link in range(1, 7):
            np.testing.assert_allclose(frame_pose(plant, context, q, f"link{link}"), dh_product(q, link), atol=1e-9)
        np.testing.assert_allclose(frame_pose(plant, context, q, "flange"), dh_product(q), atol=1e-9)


def test_masses_limits_and_drives_are_the_published_ones(plant):
    masses = [plant.GetBodyByName(f"link{link}").default_mass() for link in range(1, 7)]
    np.testing.assert_allclose(masses, MASSES)
    np.testing.assert_allclose(plant.GetVelocityUpperLimits(), np.pi)
    np.testing.assert_allclose(plant.GetEffortUpperLimits(), [150, 150, 150, 28, 28, 28])
    np.testing.assert_allclose(plant.GetPositionUpperLimits(), np.deg2rad([360, 360, 180, 360, 360, 360]))


def test_the_inertias_belong_to_bodies_that_can_exist(plant):
    context = plant.CreateDefaultContext()
    for link in range(1, 7):
        assert plant.GetBodyByName(f"link{link}").CalcSpatialInertiaInBodyFrame(context).IsPhysicallyValid()
    for q in np.random.default_rng(6).uniform(-np.pi, np.pi, (50, 6)):
        plant.SetPositions(context, q)
        assert np.linalg.eigvalsh(plant.CalcMassMatrix(context))[0] > 0.08


def test_it_reaches_belt_and_trays_far_from_its_limits():
    model = make_arm_model(UR5E)
    for x, y in ((0.55, -0.45), (0.65, -0.45), (0.65, 0.45), (0.345, 0.19), (0.345, -0.515), (0.41, 0.515)):
        for z in (0.46, 0.58):
            q = joints_for(model, UR5E.q_start, tool_down((x, y, z), np.pi))
            assert np.all(np.minimum(q - model.position_lower, model.position_upper - q) > 0.5)
            _, jacobian = model.tool_pose_and_jacobian(q)
            assert np.linalg.svd(jacobian)[1][-1] > 0.1
            still = np.zeros(6)
            assert np.all(np.abs(model.drive_torques(q, still, still)) < 0.5 * model.effort_limit)
