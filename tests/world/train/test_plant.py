import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from drake_tracker.arm.description import PUMA560
from drake_tracker.core.timing import TIME_STEP
from drake_tracker.world.train.plant import TRAIN_HEIGHT, add_laboratory, place_train
from drake_tracker.world.train.tracks import make_track

TABLE_HEIGHT = 0.45


class Laboratory:
    """A laboratory in a diagram of its own, its Simulator, and the plant's Context."""

    def __init__(self, train="plain", table_height=TABLE_HEIGHT, track=None, s=0.0, decorate=None):
        builder = DiagramBuilder()
        self.parts = add_laboratory(
            builder, description=PUMA560, body=train, table_height=table_height, decorate=decorate
        )
        self.plant = self.parts.plant
        if track is not None:
            place_train(self.parts, track=track, s=s, table_height=table_height)
        self.simulator = Simulator(builder.Build())
        self.context = self.plant.GetMyMutableContextFromRoot(self.simulator.get_mutable_context())

    def pose(self, body):
        return body.EvalPoseInWorld(self.context)

    def servo(self, q, q_desired, finger, finger_desired):
        """Puts arm and jaws at rest at q [rad] and finger [m], and gives both their set-points.

        Drake's solver wants set-points for both servos or for neither.
        """
        plant, parts = self.plant, self.parts
        plant.SetPositions(self.context, parts.arm, q)
        plant.SetPositions(self.context, parts.gripper, [finger, finger])
        plant.get_desired_state_input_port(parts.arm).FixValue(self.context, [*q_desired, *np.zeros(6)])
        plant.get_desired_state_input_port(parts.gripper).FixValue(self.context, [finger_desired, 0.0])


@pytest.fixture(scope="module")
def laboratory():
    return Laboratory(track=make_track("oval"), s=0.3)


def test_it_holds_the_arm_its_gripper_the_table_and_the_train(laboratory):
    plant, parts = laboratory.plant, laboratory.parts
    names = {plant.GetModelInstanceName(part) for part in (parts.arm, parts.gripper, parts.table, parts.train)}
    assert names == {"puma560", "gripper", "table", "train"}
    assert plant.num_positions() == 6 + 2 + 7
    assert plant.num_actuators(parts.arm) == 6 and plant.num_actuators(parts.gripper) == 1
    assert plant.time_step() == TIME_STEP
    assert plant.is_finalized()


def test_the_arm_stands_on_the_floor_at_the_origin_and_carries_the_gripper(laboratory):
    plant, parts = laboratory.plant, laboratory.parts
    assert laboratory.pose(plant.GetBodyByName("base", parts.arm)).IsNearlyEqualTo(RigidTransform(), 1e-12)
    tool = plant.GetFrameByName("tool", parts.gripper)
    X_FT = plant.CalcRelativeTransform(laboratory.context, plant.GetFrameByName("flange", parts.arm), tool)
    assert X_FT.IsNearlyEqualTo(RigidTransform([0.0, 0.0, 0.150]), 1e-12)


@pytest.mark.parametrize("table_height", [0.45, 0.40])
def test_the_train_stays_where_it_was_placed(table_height):
    track = make_track("oval")
    laboratory = Laboratory(table_height=table_height, track=track, s=0.3)
    x, y, heading = track.pose(0.3)
    placed = RigidTransform(RotationMatrix.MakeZRotation(heading), [x, y, table_height + TRAIN_HEIGHT])
    assert laboratory.pose(laboratory.parts.train_body).IsNearlyEqualTo(placed, 1e-12)
    laboratory.simulator.AdvanceTo(0.2)
    rested = laboratory.pose(laboratory.parts.train_body)
    assert rested.translation() == pytest.approx(placed.translation(), abs=5e-4)
    assert rested.rotation().matrix()[:, 2] == pytest.approx([0.0, 0.0, 1.0], abs=1e-2)


def test_the_fingers_move_as_one():
    laboratory = Laboratory(track=make_track("oval"))
    plant, gripper = laboratory.plant, laboratory.parts.gripper
    laboratory.servo(PUMA560.q_start, PUMA560.q_start, 0.03, 0.01)
    laboratory.simulator.AdvanceTo(0.3)
    left, right = plant.GetPositions(laboratory.context, gripper)
    assert left == pytest.approx(0.01, abs=1e-3)
    assert right == pytest.approx(left, abs=1e-4)


def test_the_arms_servos_hold_it_and_give_way_at_their_rated_torque():
    laboratory = Laboratory(track=make_track("oval"))
    plant, arm = laboratory.plant, laboratory.parts.arm
    q = np.array(PUMA560.q_start)
    laboratory.servo(q, q + 1.0, 0.03, 0.03)
    laboratory.simulator.AdvanceTo(2 * TIME_STEP)
    effort = plant.get_net_actuation_output_port(arm).Eval(laboratory.context)
    limits = [plant.get_joint_actuator(index).effort_limit() for index in plant.GetJointActuatorIndices(arm)]
    assert effort == pytest.approx(limits)
    assert np.all(plant.GetVelocities(laboratory.context, arm) > 0.0)


def test_visuals_can_be_added_before_the_plant_is_finalized():
    seen = []
    Laboratory("round", decorate=lambda plant: seen.append(plant.is_finalized()))
    assert seen == [False]
