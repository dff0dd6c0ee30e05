"""The arm's computer while it touches the board: touching, transform equation, inverse kinematics, joint servos."""

from pydrake.systems.framework import Diagram, DiagramBuilder

from drake_tracker.arm.differential_ik_system import DifferentialIkSystem
from drake_tracker.arm.joint_servo import add_joint_feedforward, add_set_point_spline
from drake_tracker.arm.tool_motion import ToolMotion
from drake_tracker.arm.transform_equation_system import TransformEquationSystem
from drake_tracker.grasp.touch_machine import TouchMachine
from drake_tracker.grasp.touch_schema import TouchParameters
from drake_tracker.grasp.touch_system import TouchSystem


class TouchDiagram(Diagram):
    """From what the arm feels to joint set-points, until three marks are touched.

    .. pydrake_system::

        name: TouchDiagram
        input_ports:
        - arm_state
        - arm_effort
        output_ports:
        - arm_desired_state
        - arm_feedforward
        - report
        - q_commanded

    ``arm_state`` is (q, v), ``arm_effort`` [N m] what the drives give. The first two outputs drive the robot,
    ``report`` is a `TouchReport`.

    Args:
      model: the controller's `ArmModel`, its tool frame being the probe.
      q_initial: the arm's start [rad], the probe pointing down.
      jogs: where the operator left the probe over the marks, (x, y, z, yaw) in W, shape (3, 4) [m], [rad].
      time_step: the plant's step [s]. period: of the set-points [s]. parameters: `TouchParameters`.
    """

    def __init__(self, model, q_initial, jogs, time_step, period, parameters=TouchParameters()):
        super().__init__()
        self.set_name("touch")
        self.model = model
        builder = DiagramBuilder()
        machine = TouchMachine(model, jogs, model.tool_pose(q_initial).translation(), period, parameters)
        touch = builder.AddNamedSystem("touch", TouchSystem(machine, time_step, period))
        transform = builder.AddNamedSystem(
            "transform_equation",
            TransformEquationSystem(
                ToolMotion(machine.jogs[0], period, model.symmetric_hand), model, q_initial, time_step, period
            ),
        )
        ik = builder.AddNamedSystem("inverse_kinematics", DifferentialIkSystem(model, q_initial, time_step, period))
        joints = add_set_point_spline(builder, "joint_spline", ik.GetOutputPort("q_commanded"), q_initial, period)
        dynamics = add_joint_feedforward(builder, model, joints)

        builder.Connect(touch.GetOutputPort("target"), transform.GetInputPort("target"))
        builder.Connect(touch.GetOutputPort("command"), transform.GetInputPort("command"))
        builder.Connect(transform.GetOutputPort("status"), touch.GetInputPort("status"))
        builder.Connect(transform.GetOutputPort("X_WT_desired"), ik.GetInputPort("X_WT_desired"))
        builder.Connect(ik.GetOutputPort("q_commanded"), transform.GetInputPort("q_commanded"))
        builder.Connect(joints.GetOutputPort("desired_acceleration"), touch.GetInputPort("desired_acceleration"))

        builder.ExportInput(touch.GetInputPort("arm_state"), "arm_state")
        builder.ConnectInput("arm_state", dynamics.get_input_port_estimated_state())
        builder.ExportInput(touch.GetInputPort("arm_effort"), "arm_effort")
        builder.ExportOutput(joints.GetOutputPort("desired_state"), "arm_desired_state")
        builder.ExportOutput(dynamics.get_output_port_generalized_force(), "arm_feedforward")
        builder.ExportOutput(touch.GetOutputPort("report"), "report")
        builder.ExportOutput(ik.GetOutputPort("q_commanded"), "q_commanded")
        builder.BuildInto(self)
