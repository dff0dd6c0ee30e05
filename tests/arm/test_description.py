import os
import subprocess
import sys
import typing
from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.multibody.plant import DiscreteContactApproximation, MultibodyPlant
from pydrake.systems.analysis import Simulator

from drake_tracker.arm.arm_model import make_arm_model, tool_down
from drake_tracker.arm.config import HandKind, Puma560, SevenJoint, UR5e
from drake_tracker.arm.description import (
    ARMS,
    FINGERS,
    PUMA560,
    PUMA560_CUP,
    SEVEN_JOINT,
    UR5E,
    arms_without,
    make_arm,
)
from drake_tracker.arm.motion.differential_ik import joints_for
from drake_tracker.arm.plant import actuators_of, add_arm, couple_fingers
from drake_tracker.core.errors import DrakeTrackerError

DOWN = tool_down([0.56, 0.0, 0.70], np.pi)


def test_the_hand_sits_on_the_flange_and_the_tool_lies_beyond_it():
    plant = MultibodyPlant(0.0)
    parts = add_arm(plant, description=PUMA560)
    plant.Finalize()
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, parts.arm, PUMA560.q_start)
    flange = plant.GetFrameByName("flange", parts.arm)
    tool = plant.GetFrameByName("tool", parts.gripper)
    X_FT = tool.CalcPose(context, flange)
    assert X_FT.IsNearlyEqualTo(RigidTransform([0.0, 0.0, 0.15]), 1e-9)
    for name in FINGERS:  # the jaws open along y_T, one finger to each side
        axis = plant.GetJointByName(name, parts.gripper).translation_axis()
        np.testing.assert_allclose(np.abs(axis), [0.0, 1.0, 0.0])
    assert plant.GetFrameByName("base", parts.arm).CalcPoseInWorld(context).IsExactlyEqualTo(RigidTransform())


def test_the_second_finger_follows_the_driven_one():
    plant = MultibodyPlant(1.0 / 300.0)
    plant.set_discrete_contact_approximation(DiscreteContactApproximation.kLagged)
    parts = add_arm(plant, description=PUMA560)
    couple_fingers(plant, parts.gripper, PUMA560)
    plant.Finalize()
    context = plant.CreateDefaultContext()
    for joint in plant.GetJointIndices(parts.arm):  # the arm itself stands
        if plant.get_joint(joint).num_velocities():
            plant.get_joint(joint).Lock(context)
    plant.SetPositions(context, parts.gripper, [0.04, 0.04])
    plant.get_actuation_input_port(parts.arm).FixValue(context, np.zeros(6))
    plant.get_desired_state_input_port(parts.gripper).FixValue(context, [0.01, 0.0])
    simulator = Simulator(plant, context)
    travel = []
    for k in range(1, 31):
        simulator.AdvanceTo(k / 60.0)
        travel.append(plant.GetPositions(context, parts.gripper))
    travel = np.array(travel)
    assert np.max(np.abs(travel[:, 0] - travel[:, 1])) < 1e-3
    np.testing.assert_allclose(travel[-1], [0.01, 0.01], atol=1e-3)
    (actuator,) = actuators_of(plant, parts.gripper)
    assert actuator.get_controller_gains().p == PUMA560.finger_stiffness


@pytest.mark.parametrize("arm", ["PUMA560", "UR5E"])
def test_no_removed_part_of_the_plant_is_read(arm):
    """glibc overwrites what is freed, so that a reader of freed memory finds nonsense."""
    code = (
        f"from drake_tracker.arm.description import {arm} as arm\n"
        "from drake_tracker.arm.arm_model import make_arm_model\n"
        "from drake_tracker.arm.plant import actuators_of, add_arm, couple_fingers\n"
        "from pydrake.multibody.plant import MultibodyPlant\n"
        "plant = MultibodyPlant(0.001)\n"
        "gripper = add_arm(plant, description=arm).gripper\n"
        "couple_fingers(plant, gripper, arm, grip_force=20.0)\n"
        "make_arm_model(arm)\n"
        "print([(a.name(), a.joint().name(), a.effort_limit()) for a in actuators_of(plant, gripper)])\n"
    )
    overwritten = "glibc.malloc.tcache_count=0:glibc.malloc.perturb=85"
    environment = os.environ | {"GLIBC_TUNABLES": overwritten}
    run = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, timeout=60)
    assert run.stdout.strip() == "[('finger_left', 'finger_left', 40.0)]", run.stderr


def test_the_controllers_model_is_the_arm_with_its_hand_and_nothing_else(arm_model):
    plant = arm_model.plant
    bodies = [plant.get_body(index).name() for index in plant.GetBodyIndices(arm_model.arm_instance)]
    assert plant.num_positions() == plant.num_actuators() == 6
    assert plant.num_model_instances() == 4  # the world's, the default one, arm and gripper
    assert "link6" in bodies and not plant.HasBodyNamed("train") and not plant.HasBodyNamed("table")


def test_the_model_loads_each_joint_like_the_robot_with_half_open_jaws(arm_model):
    plant = MultibodyPlant(0.0)
    parts = add_arm(plant, description=PUMA560)
    plant.Finalize()
    context, own = plant.CreateDefaultContext(), arm_model.plant.CreateDefaultContext()
    middle = [
        0.5 * (joint.position_lower_limits()[0] + joint.position_upper_limits()[0])
        for joint in (plant.GetJointByName(name, parts.gripper) for name in FINGERS)
    ]
    for q in np.random.default_rng(1).uniform(arm_model.position_lower, arm_model.position_upper, size=(5, 6)):
        plant.SetPositions(context, parts.arm, q)
        plant.SetPositions(context, parts.gripper, middle)
        arm_model.plant.SetPositions(own, arm_model.arm_instance, q)
        whole = plant.GetVelocitiesFromArray(parts.arm, plant.CalcGravityGeneralizedForces(context))
        np.testing.assert_allclose(arm_model.plant.CalcGravityGeneralizedForces(own), whole, atol=1e-9)
    for name in ("jaw_left", "jaw_right"):
        there, here = (each.GetBodyByName(name) for each in (plant, arm_model.plant))
        X_WF, X_WF_own = there.EvalPoseInWorld(context), here.EvalPoseInWorld(own)
        assert X_WF_own.IsNearlyEqualTo(X_WF, 1e-9)


@pytest.mark.parametrize("p_WT", [[0.40, 0.0, 0.49], [0.72, 0.0, 0.49], [0.56, 0.22, 0.705], [0.56, -0.22, 0.49]])
def test_joints_are_found_all_over_the_track(arm_model, p_WT):
    X_WT = tool_down(p_WT, np.pi)
    q = joints_for(arm_model, PUMA560.q_start, X_WT)
    assert arm_model.tool_pose(q).IsNearlyEqualTo(X_WT, 1e-6)
    assert np.all(q > arm_model.position_lower + np.deg2rad(2)) and np.all(q < arm_model.position_upper - np.deg2rad(2))
    assert abs(q[3]) < 1e-3  # pointing down, joint 4 stays at zero


def test_a_pose_out_of_reach_is_refused_by_name(arm_model):
    with pytest.raises(DrakeTrackerError, match=r"cannot bring its tool to \[1.6, 0.0, 0.7\] m: 0\.\d+ m short"):
        joints_for(arm_model, PUMA560.q_start, tool_down([1.6, 0.0, 0.7], np.pi))


@pytest.mark.parametrize("description, joints", [(PUMA560_CUP, 6), (SEVEN_JOINT, 7)], ids=["PUMA 560", "seven joints"])
def test_a_hand_without_fingers_is_one_body_and_has_no_symmetry(description, joints):
    model = make_arm_model(description)
    plant = model.plant
    assert not description.has_fingers and PUMA560.has_fingers
    assert not model.symmetric_hand
    assert plant.num_positions() == plant.num_actuators() == model.num_joints == joints
    probe = make_arm_model(replace(description, tool_frame="probe"))
    X_WT = tool_down([0.55, 0.1, 0.60], np.pi)
    q = joints_for(model, description.q_start, X_WT)
    X_TP = X_WT.inverse() @ probe.tool_pose(q)
    np.testing.assert_allclose(X_TP.translation()[:2], 0.0, atol=1e-5)  # straight beneath the bowl
    assert X_TP.translation()[2] > 0.08 and X_TP.rotation().IsNearlyIdentity(1e-5)


@pytest.mark.parametrize("description", [PUMA560_CUP, SEVEN_JOINT], ids=["PUMA 560", "seven joints"])
@pytest.mark.parametrize("mark", [[-0.20, 0.12], [0.20, 0.12], [0.0, 0.30]])
def test_the_probe_reaches_the_marks_of_the_board(description, mark):
    model = make_arm_model(replace(description, tool_frame="probe"))
    slope = np.deg2rad(10.0)
    p_WP = [0.56 + mark[1] * np.cos(slope), -mark[0], 0.53 + mark[1] * np.sin(slope)]
    q = joints_for(model, description.q_start, tool_down(p_WP, np.pi))
    assert np.all(np.minimum(q - model.position_lower, model.position_upper - q) > np.deg2rad(10.0))


@pytest.mark.parametrize(
    "settings, hand, expected",
    [
        (Puma560(), HandKind.GRIPPER, PUMA560),
        (Puma560(), HandKind.CUP, PUMA560_CUP),
        (SevenJoint(), HandKind.CUP, SEVEN_JOINT),
        (UR5e(), HandKind.GRIPPER, UR5E),
    ],
)
def test_an_arm_is_chosen_by_its_settings_and_the_hand_of_the_task(settings, hand, expected):
    arm = make_arm(settings, hand=hand)
    assert arm is expected and arm.hand is hand


def test_a_hand_that_an_arm_does_not_have_is_refused():
    with pytest.raises(DrakeTrackerError, match="the arm SevenJoint has no gripper; it has a cup"):
        make_arm(SevenJoint(), hand=HandKind.GRIPPER)
    with pytest.raises(DrakeTrackerError, match="arm: kind is .*; allowed are puma560, seven_joint, ur5e"):
        make_arm(PUMA560, hand=HandKind.CUP)


def test_the_hand_follows_from_the_fingers():
    assert replace(PUMA560, fingers=()).hand is HandKind.CUP


def test_a_task_offers_the_arms_that_have_its_hand():
    assert arms_without(HandKind.GRIPPER) == (SevenJoint,) and arms_without(HandKind.CUP) == (UR5e,)
    assert set(typing.get_args(ARMS.union(int, without=arms_without(HandKind.GRIPPER)))) == {Puma560, UR5e, int}


def test_settings_and_descriptions_do_not_load_drake():
    names = "HandKind, Puma560, ServoConfig, PUMA560"
    code = f"import sys; from drake_tracker.arm import {names}; assert 'pydrake' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)
