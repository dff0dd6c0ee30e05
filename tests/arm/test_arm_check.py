"""Tests of the requirements of an arm, with descriptions like those that other packages offer."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import DiagramBuilder
from urdf_arms import AXES, LIMIT, MOTORS, urdf

from drake_tracker.arm.arm_check import check_arm
from drake_tracker.arm.arm_model import make_arm_model, tool_down
from drake_tracker.arm.description import PUMA560, PUMA560_CUP, SEVEN_JOINT, UR5E
from drake_tracker.arm.motion.differential_ik import joints_for
from drake_tracker.arm.plant import add_arm
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.models_path import models_path
from drake_tracker.world.train.plant import add_laboratory


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
        (urdf(drives=MISSING), "joint joint3 has no actuator; it needs an effort limit above 0 and, in a URDF, a t"),
        (urdf([("revolute", LIMIT.replace('"90"', '"0"'))], drives=MOTORS), "joint1 has no actuator; it needs an"),
        (urdf(drives=TURNED), "those of joint6, joint5, .*; there must be one for each joint, in the order of the"),
        (urdf(drives=MOTORS | {"motor7": "joint1"}), "those of joint1, .*, joint6, joint1; there must be one"),
        (urdf([("floating", "")]), "arm.urdf: link link1 is not carried by base_link, base"),
        (urdf(extra='<link name="stray"/>'), "arm.urdf: link stray is not carried by base_link, base"),
        (urdf([("revolute", LIMIT), ("revolute", LIMIT + '<mimic joint="joint1"/>')]), "arm.urdf has constraints such"),
        (urdf([("revolute", LIMIT.replace('"3"', '"-3"'))]), "arm.urdf: set_v.*; a velocity limit is negative"),
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
        ({"tool_frame": "tip"}, "tool_frame: .*gripper.sdf has no frame tip; its frames are hand, jaw_left, .*, tool$"),
        ({"markers": True}, "markers: .*gripper.sdf has no frame marker_left"),
        ({"hand_link": "jaw_left"}, "gripper.sdf: link hand is not carried by hand_link, jaw_left"),
        ({"base_link": "link1"}, "arm.urdf: link base is not carried by base_link, link1"),
        ({"q_start": ("a",) * 6}, r"q_start is \('a', .*\); it must be a tuple of numbers"),
        ({"servo_inertia": np.ones((6, 2))}, r"servo_inertia is array\(.*\); it must be a tuple of numbers"),
        ({"servo_inertia": 3.0}, "servo_inertia is 3.0; it must be a tuple of numbers"),
        ({"finger_stiffness": float("nan")}, "finger_stiffness is nan; it must be a finite number, at least 0"),
        ({"base_height": "high"}, "base_height is 'high'; it must be a finite number, at least 0"),
        ({"flange": None}, "flange is None; it must be text"),
        ({"fingers": "finger_left"}, "fingers is 'finger_left'; it must be a tuple of names"),
        ({"fingers": ("finger_left",) * 2}, r"fingers is \('finger_left', 'finger_left'\); a gripper has two joints"),
        ({"arm_url": "/nowhere/arm.urdf"}, "arm_url is '/nowhere/arm.urdf'; it must be a URL, file://"),
        ({"arm_url": "file:///nowhere/arm.urdf"}, "nowhere"),
        ({"arm_url": "package://nobody/arm.urdf"}, "nobody"),
        ({"base_link": "bottom"}, "base_link: .*arm.urdf has no frame bottom; its frames are base, link1"),
    ],
)
def test_a_description_that_misses_a_requirement_is_named(tmp_path, changes, message):
    with pytest.raises(DrakeTrackerError, match=message) as caught:
        check_arm(arm(tmp_path, urdf(), **changes))
    assert "\n" not in str(caught.value)


HOOK = (
    '<link name="hook"/><joint name="third" type="prismatic"><parent>hand</parent><child>hook</child><axis>'
    "<xyz>0 0 1</xyz><limit><lower>0</lower><upper>0.01</upper><effort>0</effort></limit></axis></joint></model>"
)


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        ('type="prismatic"', 'type="revolute"', "hand.sdf: finger_left is revolute; fingers are prismatic"),
        ("</model>", HOOK, "hand.sdf: joint third is not in fingers; fix it in the model"),
        ("</model>", '<link name="stray"/></model>', "hand.sdf: link stray is not carried by hand_link, hand"),
        (
            "<xyz>0 1 0</xyz>",
            "<xyz>1 0 0</xyz>",
            r"finger_left moves along \[1.0, 0.0, 0.0\] of tool, .* must move along y",
        ),
        ("0 0 3.1415926535897931", "0 0 0", "; fingers must move along y, away from each other"),
        (
            "<lower>0</lower>",
            "<lower>0.03</lower>",
            "hand.sdf: finger_left travels from 0.03 to 0.045 m; it must be able",
        ),
    ],
)
def test_a_hand_that_misses_a_requirement_is_named(tmp_path, before, after, message):
    text = (models_path() / "gripper" / "gripper.sdf").read_text()
    assert before in text
    (tmp_path / "hand.sdf").write_text(text.replace(before, after))
    with pytest.raises(DrakeTrackerError, match=message):
        check_arm(replace(PUMA560, gripper_url=(tmp_path / "hand.sdf").as_uri()))


@pytest.mark.parametrize("name", ["gripper", "train", "table"])
def test_the_name_of_a_model_is_free(tmp_path, name):
    description = arm(tmp_path, urdf().replace('name="arm"', f'name="{name}"'))
    check_arm(description)
    assert add_laboratory(DiagramBuilder(), description=description).plant.HasModelInstanceNamed("own_arm")


def test_packages_of_ros_concern_only_the_models_of_the_user(tmp_path, monkeypatch):
    (tmp_path / "package.xml").write_text("<package")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    check_arm(PUMA560)
    with pytest.raises(DrakeTrackerError, match=r"arm.urdf: .*Failed to parse XML in file .*package.xml"):
        check_arm(arm(tmp_path, urdf()))


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


def test_the_nearest_start_is_searched_first():
    """A farther start ends more than a whole turn away."""
    model, start = make_arm_model(UR5E), (-1.35, -0.07, 2.53, -1.79, 1.4, -1.49)
    for p_WT in ([0.45, 0.1, 0.5], [0.5, -0.1, 0.5], [0.55, 0.15, 0.5]):
        assert np.abs(joints_for(model, start, tool_down(p_WT, np.pi)) - start).max() < 5.5


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
