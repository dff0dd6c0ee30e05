"""The arm's computer as a Diagram: servo, decision, transform equation, inverse kinematics, joint servos."""

import numpy as np
from pydrake.systems.framework import Diagram, DiagramBuilder
from pydrake.systems.primitives import MatrixGain

from drake_tracker.arm.differential_ik_system import DifferentialIkSystem
from drake_tracker.arm.joint_servo import add_joint_feedforward, add_set_point_spline
from drake_tracker.arm.servo_system import make_servo_system
from drake_tracker.arm.tool_motion import ToolMotion
from drake_tracker.arm.transform_equation_system import TransformEquationSystem
from drake_tracker.core.messages import ArmCommand, message_size
from drake_tracker.core.timing import SERVO_PERIOD

_ANSWERED = {"target": "servo", "status": "transform_equation", "q_commanded": "inverse_kinematics"}
"""Inputs of the decision that this room answers: {port: the System that has an output of that name}."""


class ArmDiagram(Diagram):
    """From packets of predicted path to joint and jaw set-points.

    .. pydrake_system::

        name: ArmDiagram
        input_ports:
        - packet
        - arm_state
        - jaws
        output_ports:
        - arm_desired_state
        - arm_feedforward
        - gripper_desired_state
        - target
        - command
        - status
        - diagnosis
        - q_commanded

    ``packet`` is a `Prediction`, ``arm_state`` (q, v), ``jaws`` a `JawState`. The first three outputs drive the
    robot, the others (`ServoTarget`, `ArmCommand`, `ToolStatus`, the decision's diagnosis, [rad]) are for logs. Without
    a hand that has jaws there are neither ``jaws`` nor ``gripper_desired_state``; what else the decision asks or says
    is an input or an output of its name.

    Args:
      decision: the System that decides what the hand does next: `GraspSystem`, or another with its ports target,
        packet, status -> command, diagnosis. One with an input ``jaws`` has jaws to move; one with an output ``object``
        (a `ServoTarget`) sends the hand there, and not to where the servo has the object.
      servo: the scenario's part of that name. model: the controller's `ArmModel`. q_initial: the arm's start [rad].
      home: reference pose (x, y, z, yaw) in W over which the hand waits. time_step: the plant's step [s].
      period: of the set-points [s]. jaw_opening: of the jaws at the start [m].
    """

    def __init__(self, decision, servo, model, q_initial, home, time_step, period=SERVO_PERIOD, *, jaw_opening=0.0):
        super().__init__()
        self.set_name("arm")
        self.model = model
        builder = DiagramBuilder()
        servo_system = builder.AddNamedSystem("servo", make_servo_system(servo, time_step, period))
        builder.AddSystem(decision)
        goal = decision if decision.HasOutputPort("object") else servo_system
        motion = ToolMotion(home, period, model.symmetric_hand, moving=goal is servo_system)
        transform = builder.AddNamedSystem(
            "transform_equation", TransformEquationSystem(motion, model, q_initial, time_step, period)
        )
        ik = builder.AddNamedSystem("inverse_kinematics", DifferentialIkSystem(model, q_initial, time_step, period))

        command = decision.GetOutputPort("command")
        builder.Connect(
            goal.GetOutputPort("object" if goal is decision else "target"), transform.GetInputPort("target")
        )
        builder.Connect(command, servo_system.GetInputPort("command"))
        builder.Connect(command, transform.GetInputPort("command"))
        builder.Connect(transform.GetOutputPort("X_WT_desired"), ik.GetInputPort("X_WT_desired"))
        builder.Connect(ik.GetOutputPort("q_commanded"), transform.GetInputPort("q_commanded"))
        builder.Connect(servo_system.GetOutputPort("held_packet"), decision.GetInputPort("packet"))
        builder.ExportInput(servo_system.GetInputPort("packet"), "packet")
        for index in range(decision.num_input_ports()):
            port = decision.get_input_port(index)
            if port.get_name() in _ANSWERED:
                source = builder.GetSubsystemByName(_ANSWERED[port.get_name()])
                builder.Connect(source.GetOutputPort(port.get_name()), port)
            elif port.get_name() != "packet":
                builder.ExportInput(port, port.get_name())

        joints = add_set_point_spline(builder, "joint_spline", ik.GetOutputPort("q_commanded"), q_initial, period)
        dynamics = add_joint_feedforward(builder, model, joints)
        if decision.HasInputPort("jaws"):
            half_width = np.zeros((1, message_size(ArmCommand)))
            half_width[0, ArmCommand.get_fields().index("jaw_width")] = 0.5
            finger = builder.AddNamedSystem("finger_set_point", MatrixGain(half_width))
            builder.Connect(command, finger.get_input_port())
            fingers = add_set_point_spline(
                builder, "finger_spline", finger.get_output_port(), [0.5 * jaw_opening], period
            )
            builder.ExportOutput(fingers.GetOutputPort("desired_state"), "gripper_desired_state")

        builder.ExportInput(dynamics.get_input_port_estimated_state(), "arm_state")
        builder.ExportOutput(joints.GetOutputPort("desired_state"), "arm_desired_state")
        builder.ExportOutput(dynamics.get_output_port_generalized_force(), "arm_feedforward")
        builder.ExportOutput(servo_system.GetOutputPort("target"), "target")
        builder.ExportOutput(transform.GetOutputPort("status"), "status")
        builder.ExportOutput(ik.GetOutputPort("q_commanded"), "q_commanded")
        for index in range(decision.num_output_ports()):
            builder.ExportOutput(decision.get_output_port(index), decision.get_output_port(index).get_name())
        builder.BuildInto(self)
