"""A conveyor's world whose arm stands still, for tests."""

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.analysis import Simulator

from drake_tracker.arm.arm_model import make_arm_model, tool_down
from drake_tracker.arm.description import PUMA560
from drake_tracker.arm.motion.differential_ik import joints_for
from drake_tracker.core.messages import PickVerdict
from drake_tracker.core.part_kinds import PART_SHAPES, PartKind
from drake_tracker.world.base_world_diagram import WorldConfig
from drake_tracker.world.config import CamerasConfig
from drake_tracker.world.conveyor.arrivals import PART_COLOURS, Arrival
from drake_tracker.world.conveyor.conveyor_config import BeltConfig
from drake_tracker.world.conveyor.conveyor_world_diagram import ConveyorWorldDiagram
from drake_tracker.world.conveyor.part_fates import PartFate

KINDS = tuple(PART_SHAPES)
HEIGHT = BeltConfig().height
OVER_BELT = [0.60, 0.0, 0.62]


def arrival(time, kind=PartKind.BOX, x=0.60, yaw=0.5, colour=PART_COLOURS[0]):
    return Arrival(time, kind, colour, x, yaw)


class World:
    """A world in which the arm is to stand still at ``p_WT`` [m]."""

    def __init__(self, arrivals, p_WT=OVER_BELT, opening=0.088, belt=BeltConfig(), cameras=None, faults=()):
        q = joints_for(make_arm_model(PUMA560), PUMA560.q_start, tool_down(p_WT, np.pi))
        config = WorldConfig(
            arm=PUMA560, q_initial=q, jaw_opening=opening, windows=None if cameras else {}, faults=faults
        )
        self.diagram = ConveyorWorldDiagram(
            config, arrivals=arrivals, duration=30.0, belt=belt, cameras=cameras or CamerasConfig()
        )
        self.simulator = Simulator(self.diagram)
        self.context = self.simulator.get_mutable_context()
        self.fix("arm_desired_state", [*q, *np.zeros(6)])
        self.fix("arm_feedforward", np.zeros(6))
        self.fix("gripper_desired_state", [0.5 * opening, 0.0])

    def fix(self, port, values):
        self.diagram.GetInputPort(port).FixValue(self.context, values)

    def read(self, port):
        return self.diagram.GetOutputPort(port).Eval(self.context)

    @property
    def states(self):
        return self.read("truth_part_states").reshape(-1, 13).copy()

    @property
    def fates(self):
        return [PartFate(int(fate)) for fate in self.read("truth_fates")]

    @property
    def verdict(self):
        return PickVerdict(self.read("truth_verdict").copy())

    def put(self, number, p_WP, yaw=0.0):
        """Puts a part to a place; its number counts from 1."""
        plant, part = self.diagram.laboratory.plant, self.diagram.laboratory.parts[number - 1]
        X_WP = RigidTransform(RotationMatrix.MakeZRotation(yaw), p_WP)
        plant.SetFreeBodyPose(plant.GetMyMutableContextFromRoot(self.context), part, X_WP)
