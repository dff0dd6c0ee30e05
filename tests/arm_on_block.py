"""The PUMA goes down onto a block that its controller does not know."""

import numpy as np
from pydrake.geometry import Box
from pydrake.math import RigidTransform
from pydrake.multibody.plant import CoulombFriction
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, LogVectorOutput

from drake_tracker.arm.arm_model import make_arm_model, tool_down
from drake_tracker.arm.description import PUMA560
from drake_tracker.arm.motion.differential_ik import joints_for
from drake_tracker.arm.motion.tool_controller import add_tool_controller
from drake_tracker.arm.motion.tool_motion import ToolMotion
from drake_tracker.core.messages import ArmCommand, ServoTarget, message_size
from drake_tracker.core.timing import SERVO_PERIOD, TIME_STEP
from drake_tracker.world.train.plant import add_laboratory

REFERENCE = np.array([0.56, 0.0, 0.485, np.pi])
HEIGHT, DOWN = 0.22, 0.35
BLOCK = 0.10
"""Height of the block above the table [m]."""


def press(*, reflex):
    """Returns the longest saturation of a drive [s] while the hand goes down onto the block, with or without reflex."""
    builder = DiagramBuilder()

    def add_block(plant):
        X_WB = RigidTransform([0.56, 0.0, 0.45 + 0.5 * BLOCK])
        plant.RegisterCollisionGeometry(
            plant.world_body(), X_WB, Box(0.2, 0.2, BLOCK), "block", CoulombFriction(0.5, 0.5)
        )

    laboratory = add_laboratory(builder, description=PUMA560, decorate=add_block)
    plant, model = laboratory.plant, make_arm_model(PUMA560)
    q = joints_for(model, PUMA560.q_start, tool_down(REFERENCE[:3] + [0.0, 0.0, HEIGHT], np.pi))
    target, command = np.zeros(message_size(ServoTarget)), np.zeros(message_size(ArmCommand))
    down = ArmCommand(command)
    down.motion, down.duration, down.height = 1.0, DOWN, 0.0
    controller = add_tool_controller(
        builder,
        motion=ToolMotion(REFERENCE, SERVO_PERIOD),
        model=model,
        q_initial=q,
        target=builder.AddSystem(ConstantVectorSource(target)).get_output_port(),
        command=builder.AddSystem(ConstantVectorSource(down[:])).get_output_port(),
    )
    state = plant.get_state_output_port(laboratory.arm)
    effort = plant.get_net_actuation_output_port(laboratory.arm)
    builder.Connect(state, controller.inverse_dynamics.get_input_port_estimated_state())
    builder.Connect(state, controller.reflex.GetInputPort("arm_state"))
    if reflex:
        builder.Connect(effort, controller.reflex.GetInputPort("arm_effort"))
    builder.Connect(
        controller.spline.GetOutputPort("desired_state"), plant.get_desired_state_input_port(laboratory.arm)
    )
    builder.Connect(
        controller.inverse_dynamics.get_output_port_generalized_force(),
        plant.get_actuation_input_port(laboratory.arm),
    )
    fingers = builder.AddSystem(ConstantVectorSource([0.03, 0.0]))
    builder.Connect(fingers.get_output_port(), plant.get_desired_state_input_port(laboratory.gripper))
    log = LogVectorOutput(effort, builder, publish_period=TIME_STEP)
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    inside = plant.GetMyMutableContextFromRoot(context)
    plant.SetPositions(inside, laboratory.arm, q)
    plant.SetPositions(inside, laboratory.gripper, [0.03, 0.03])
    plant.SetFreeBodyPose(inside, laboratory.train_body, RigidTransform([0.56, 0.4, 0.485]))
    Simulator(diagram, context).AdvanceTo(0.9)
    saturated = np.abs(log.FindLog(context).data()) >= 0.999 * model.effort_limit[:, None]
    return (
        max(max(map(len, "".join("x" if s else " " for s in row).split()), default=0) for row in saturated) * TIME_STEP
    )
