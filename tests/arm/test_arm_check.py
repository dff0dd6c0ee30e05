"""Tests of the requirements of an arm, with descriptions like those that other packages offer."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from urdf_arms import AXES, LIMIT, MOTORS, urdf

from drake_tracker.arm.arm_check import check_arm
from drake_tracker.arm.arm_model import make_arm_model, tool_down
from drake_tracker.arm.description import PUMA560, PUMA560_CUP, SEVEN_JOINT, UR5E
from drake_tracker.arm.motion.differential_ik import joints_for
from drake_tracker.arm.plant import add_arm
from drake_tracker.core.errors import DrakeTrackerError


def arm(tmp_path, text, count=6, **changes):
    (tmp_path / "arm.urdf").write_text(text)
    numbers = {"servo_inertia": (1.0,) * count, "servo_bandwidth": (50.0,) * count, "q_start": (0.1,) * count}
    return replace(PUMA560, **{"arm_url": (tmp_path / "arm.urdf").as_uri()} | numbers | changes)


@pytest.mark.parametrize("description", [PUMA560, PUMA560_CUP, SEVEN_JOINT, UR5E])
def test_the_arms_of_the_package_meet_the_requirements(description):
    check_arm(description)


@pytest.mark.parametrize(
    "text",
    [urdf(drives=MOTORS), urdf(), urdf(fixed_to_world=True)],
    ids=["actuators with names of their own", "no transmissions", "fixed to a link named world"],
)
def test_public_descriptions_are_understood(tmp_path, text):
    description = arm(tmp_path, text, base_height=0.3)
    check_arm(description)
    model = make_arm_model(description)
    np.testing.assert_array_equal(model.effort_limit, 90.0)
    assert model.tool_pose(np.zeros(6)).IsNearlyEqualTo(RigidTransform([0.0, 0.0, 0.3 + 1.2 + 0.15]), 1e-9)


MISSING = {name: joint for name, joint in MOTORS.items() if joint != "joint3"}
TURNED = dict(reversed(MOTORS.items()))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (urdf([("prismatic", LIMIT)]), "arm.urdf: joint joint1 is prismatic; every joint of an arm must be revolute"),
        (urdf([("continuous", "")]), "joint joint1 has the position limits -inf to inf; they must be finite"),
        (urdf([("revolute", LIMIT.replace("-2.9", "2.9", 1))]), "joint1 has the position limits 2.9 to 2.9; they"),
        (urdf([("revolute", LIMIT.replace('"3"', '"0"'))]), "joint joint1 has the velocity limits -?0 to 0"),
        (urdf([("revolute", LIMIT.replace('"90"', '"0"'))]), "joint joint1 has the effort limit 0 N m"),
        (urdf(drives=MISSING), "joint joint3 has no actuator; a URDF names it in a transmission"),
        (urdf(drives=TURNED), "the actuators are those of joint6, joint5, .*; they must be in the order of the joints"),
        (urdf(axes=AXES[:5]), r"has 5 joints; a pose of the hand needs 6"),
        (urdf(axes=(*AXES[:5], "1 0 0")), "the axis of the last joint, joint6, is 90 degrees from z of tool"),
        (
            urdf(extra='<link name="tail"/><joint name="wag" type="revolute"><parent link="base"/><child link="tail"/>'
                 f'<axis xyz="1 0 0"/>{LIMIT}</joint>'),
            "joint wag is not between base and flange; fix it in the model",
        ),
        (urdf().replace('name="flange"', 'name="end"').replace('link="flange"', 'link="end"'), "flange"),
        ("<robot", "arm.urdf"),
        ("", "arm.urdf"),
        (urdf(extra='<link name="arm_visual"><visual><geometry><mesh filename="package://not_here/a.obj"/></geometry>'
                    '</visual></link>'), "unknown package 'not_here'"),
    ],
)  # fmt: skip
def test_a_model_that_misses_a_requirement_is_named(tmp_path, text, message):
    count = 5 if "has 5 joints" in message else 6
    with pytest.raises(DrakeTrackerError, match=message) as caught:
        check_arm(arm(tmp_path, text, count))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"q_start": (0.1,) * 5}, "q_start has 5 values for 6 joints with actuators"),
        ({"q_start": (0.1, 3.0, 0.1, 0.1, 0.1, 0.1)}, "q_start is 3 for joint joint2; .* limits, -2.9 to 2.9 rad"),
        (
            {"servo_inertia": (1.0, 1.0, 1.0, 1.0, 1.0, -1.0)},
            "servo_inertia is -1 for joint joint6; it must be above 0",
        ),
        ({"servo_bandwidth": (float("nan"),) * 6}, "servo_bandwidth is nan for joint joint1; it must be above 0"),
        ({"fingers": ("finger_right", "finger_left")}, "the actuator drives finger_left; it must drive finger_right"),
        ({"gripper_url": PUMA560_CUP.gripper_url}, "finger_left"),
        ({"tool_frame": "tip"}, "tip"),
        ({"arm_url": "file:///nowhere/arm.urdf"}, "nowhere"),
        ({"arm_url": "package://nobody/arm.urdf"}, "nobody"),
        ({"base_link": "bottom"}, "bottom"),
    ],
)
def test_a_description_that_misses_a_requirement_is_named(tmp_path, changes, message):
    with pytest.raises(DrakeTrackerError, match=message) as caught:
        check_arm(arm(tmp_path, urdf(), **changes))
    assert "\n" not in str(caught.value)


def test_a_mesh_that_drake_cannot_use_is_named(tmp_path):
    (tmp_path / "a.stl").write_text("solid a\nendsolid a\n")
    shape = '<collision><geometry><mesh filename="a.stl"/></geometry></collision></link>'
    with pytest.raises(DrakeTrackerError, match=r"arm.urdf: .*unsupported extension '.stl' .*a.stl"):
        check_arm(arm(tmp_path, urdf().replace("</link>", shape, 1)))


def test_a_package_is_found_in_the_folders_above_the_file(tmp_path):
    folder = tmp_path / "robots" / "urdf"
    folder.mkdir(parents=True)
    (tmp_path / "robots" / "a.obj").write_text(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 4\n"
    )
    shape = '<visual><geometry><mesh filename="package://robots/a.obj"/></geometry></visual></link>'
    check_arm(arm(folder, urdf().replace("</link>", shape, 1)))


def test_several_models_in_a_file_are_refused(tmp_path):
    (tmp_path / "two.sdf").write_text(
        '<sdf version="1.9"><model name="a"><link name="base"/></model><model name="b"><link name="c"/></model></sdf>'
    )
    with pytest.raises(DrakeTrackerError, match=r"two.sdf"):
        check_arm(replace(PUMA560, arm_url=(tmp_path / "two.sdf").as_uri()))


def test_a_pose_is_found_from_other_starts(tmp_path):
    """The first descent ends at a limit; the pose is within reach."""
    model = make_arm_model(UR5E)
    X_WT = tool_down([0.45, 0.1, 0.4], np.pi)
    q = joints_for(model, (3.0, -0.2, 2.5, 2.5, -2.5, 3.0), X_WT)
    R_WT, R_goal = (X.rotation().matrix() for X in (model.tool_pose(q), X_WT))
    np.testing.assert_allclose(model.tool_pose(q).translation(), X_WT.translation(), atol=1e-6)
    np.testing.assert_allclose(np.abs(np.diag(R_goal.T @ R_WT)), 1.0, atol=1e-5)  # up to half a turn of the hand


def test_a_pose_out_of_reach_names_the_joint_that_limits(tmp_path):
    short = LIMIT.replace("-2.9", "-0.3").replace('"2.9"', '"0.3"')
    model = make_arm_model(arm(tmp_path, urdf([("revolute", LIMIT), ("revolute", short)])))
    with pytest.raises(DrakeTrackerError, match=r"m short, with .*joint2.* at the limit"):
        joints_for(model, (0.1,) * 6, tool_down([0.5, 0.0, 0.3], np.pi))


def test_the_base_height_moves_the_whole_arm():
    plant = MultibodyPlant(0.0)
    add_arm(plant, description=replace(UR5E, base_height=0.25))
    plant.Finalize()
    pose = plant.GetFrameByName("base").CalcPoseInWorld(plant.CreateDefaultContext())
    assert pose.IsExactlyEqualTo(RigidTransform([0.0, 0.0, 0.25]))


def test_a_shape_at_which_drake_stops_is_one_line(tmp_path):
    shape = '<collision><geometry><sphere radius="nan"/></geometry></collision></link>'
    with pytest.raises(DrakeTrackerError, match="arm.urdf: .*radius") as caught:
        check_arm(arm(tmp_path, urdf().replace("</link>", shape, 1)))
    assert "\n" not in str(caught.value)
