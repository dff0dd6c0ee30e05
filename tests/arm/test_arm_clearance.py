import numpy as np
import pytest

from drake_tracker.arm.arm_clearance import MARGIN, ArmClearance, Nearness
from drake_tracker.arm.arm_model import tool_down
from drake_tracker.arm.description import PUMA560, PUMA560_CUP, SEVEN_JOINT, UR5E
from drake_tracker.arm.motion.differential_ik import joints_for
from drake_tracker.world.train.plant import table_box

TABLE = 0.45
PAD_BELOW_TOOL = 0.013
"""The lowest pads are spheres of 6 mm, 7 mm beyond the tool's frame [m]."""
HAND_IN_COLUMN = np.array([0.0, -0.1, -3.9, 0.0, -1.5, 0.0])


@pytest.fixture(scope="module")
def clearance():
    return ArmClearance(PUMA560, [table_box(height=TABLE)])


def over_table(arm_model, height):
    """Joints [rad] with the tool this high over the table [m]."""
    return joints_for(arm_model, PUMA560.q_start, tool_down([0.56, 0.0, TABLE + height], np.pi))


@pytest.mark.parametrize("height", [0.05, 0.02, 0.014, 0.005])
def test_the_distance_to_the_table_is_that_of_the_lowest_pad(arm_model, clearance, height):
    distance = clearance.distance(over_table(arm_model, height), 0.02)
    assert distance == pytest.approx(min(0.02, height - PAD_BELOW_TOOL), abs=1e-5)


def test_it_says_what_is_near(arm_model, clearance):
    assert clearance.nearness(over_table(arm_model, 0.10)) is None
    assert clearance.nearness(over_table(arm_model, PAD_BELOW_TOOL + MARGIN + 0.001)) is None
    assert clearance.nearness(over_table(arm_model, PAD_BELOW_TOOL + MARGIN - 0.001)) is Nearness.OBSTACLE
    assert ArmClearance(PUMA560).nearness(HAND_IN_COLUMN) is Nearness.LINK


def test_nothing_is_kept_from_call_to_call(arm_model, clearance):
    q = over_table(arm_model, 0.016)
    first = clearance.distance(q, 0.02)
    clearance.nearness(HAND_IN_COLUMN)
    assert clearance.distance(q, 0.02) == first


@pytest.mark.parametrize(
    "description", [PUMA560, PUMA560_CUP, SEVEN_JOINT, UR5E], ids=["puma560", "cup", "seven_joint", "ur5e"]
)
def test_every_link_is_watched_and_the_arm_starts_clear(description):
    """The geometry of the models leaves room in the pose from which every run starts."""
    clearance = ArmClearance(description)
    assert clearance.distance(np.array(description.q_start), 0.05) > 4 * MARGIN


def test_a_pair_that_is_near_by_construction_is_not_watched():
    """A margin that is wider than the gap between wrist and hand, 24 mm, must not stop the arm for ever."""
    wide = ArmClearance(PUMA560, margin=0.03)
    assert wide.nearness(np.array(PUMA560.q_start)) is None
    assert wide.nearness(HAND_IN_COLUMN) is Nearness.LINK
