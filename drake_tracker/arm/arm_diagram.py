"""The arm's computer as a Diagram: servo, grasp machine, transform equation, inverse kinematics, joint servos."""

import numpy as np
from pydrake.systems.framework import Diagram, DiagramBuilder
from pydrake.systems.primitives import MatrixGain

from drake_tracker.arm.differential_ik_system import DifferentialIkSystem
from drake_tracker.arm.joint_servo import add_joint_feedforward, add_set_point_spline
from drake_tracker.arm.servo import Servo
from drake_tracker.arm.servo_system import ServoSystem
from drake_tracker.arm.set_point_spline_system import SPLINE_DELAY
from drake_tracker.arm.tool_motion import ToolMotion
from drake_tracker.arm.transform_equation_system import TransformEquationSystem
from drake_tracker.grasp.grasp_machine import GraspMachine
from drake_tracker.grasp.grasp_system import GraspSystem
from drake_tracker.messages import ArmCommand, message_size
from drake_tracker.timing import SERVO_PERIOD, SERVO_SLOT, servo_slot


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
    robot, the others (`ServoTarget`, `ArmCommand`, `ToolStatus`, `GraspDiagnosis`, [rad]) are for logs.

    Args:
      servo, grasp: the scenario's parts of that name. model: the controller's `ArmModel`.
      q_initial: the arm's start [rad]. home: reference pose (x, y, z, yaw) in W over which the hand waits.
      time_step: the plant's step [s]. period: of the set-points [s].
    """

    def __init__(self, servo, grasp, model, q_initial, home, time_step, period=SERVO_PERIOD):
        super().__init__()
        self.set_name("arm")
        self.model = model
        builder = DiagramBuilder()
        # A set-point computed in the servo's slot is sampled at the end of the period, and passed a little later still.
        lead = (1.0 + SPLINE_DELAY) * period - servo_slot(SERVO_SLOT, time_step, period)
        servo_system = builder.AddNamedSystem(
            "servo",
            ServoSystem(
                Servo(servo.tracking_index, servo.yaw_tracking_index, servo.stale_after, lead=lead), time_step, period
            ),
        )
        machine = GraspMachine(grasp, model, period)
        grasp_system = builder.AddNamedSystem("grasp", GraspSystem(machine, time_step, period))
        transform = builder.AddNamedSystem(
            "transform_equation",
            TransformEquationSystem(
                ToolMotion(home, period, model.symmetric_hand), model, q_initial, time_step, period
            ),
        )
        ik = builder.AddNamedSystem("inverse_kinematics", DifferentialIkSystem(model, q_initial, time_step, period))

        builder.Connect(servo_system.GetOutputPort("target"), grasp_system.GetInputPort("target"))
        builder.Connect(servo_system.GetOutputPort("held_packet"), grasp_system.GetInputPort("packet"))
        builder.Connect(servo_system.GetOutputPort("target"), transform.GetInputPort("target"))
        builder.Connect(grasp_system.GetOutputPort("command"), servo_system.GetInputPort("command"))
        builder.Connect(grasp_system.GetOutputPort("command"), transform.GetInputPort("command"))
        builder.Connect(transform.GetOutputPort("status"), grasp_system.GetInputPort("status"))
        builder.Connect(transform.GetOutputPort("X_WT_desired"), ik.GetInputPort("X_WT_desired"))
        builder.Connect(ik.GetOutputPort("q_commanded"), transform.GetInputPort("q_commanded"))
        builder.Connect(ik.GetOutputPort("q_commanded"), grasp_system.GetInputPort("q_commanded"))

        joints = add_set_point_spline(builder, "joint_spline", ik.GetOutputPort("q_commanded"), q_initial, period)
        dynamics = add_joint_feedforward(builder, model, joints)
        half_width = np.zeros((1, message_size(ArmCommand)))
        half_width[0, ArmCommand.get_fields().index("jaw_width")] = 0.5
        finger = builder.AddNamedSystem("finger_set_point", MatrixGain(half_width))
        builder.Connect(grasp_system.GetOutputPort("command"), finger.get_input_port())
        fingers = add_set_point_spline(
            builder, "finger_spline", finger.get_output_port(), [0.5 * grasp.jaw_opening], period
        )

        builder.ExportInput(servo_system.GetInputPort("packet"), "packet")
        builder.ExportInput(dynamics.get_input_port_estimated_state(), "arm_state")
        builder.ExportInput(grasp_system.GetInputPort("jaws"), "jaws")
        builder.ExportOutput(joints.GetOutputPort("desired_state"), "arm_desired_state")
        builder.ExportOutput(dynamics.get_output_port_generalized_force(), "arm_feedforward")
        builder.ExportOutput(fingers.GetOutputPort("desired_state"), "gripper_desired_state")
        builder.ExportOutput(servo_system.GetOutputPort("target"), "target")
        builder.ExportOutput(grasp_system.GetOutputPort("command"), "command")
        builder.ExportOutput(transform.GetOutputPort("status"), "status")
        builder.ExportOutput(grasp_system.GetOutputPort("diagnosis"), "diagnosis")
        builder.ExportOutput(ik.GetOutputPort("q_commanded"), "q_commanded")
        builder.BuildInto(self)
