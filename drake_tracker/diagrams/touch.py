"""The wiring of the board's initialisation: the world of the ball, and an arm that touches three marks."""

from pydrake.systems.framework import Diagram, DiagramBuilder

from drake_tracker.arm.differential_ik_system import DifferentialIkSystem
from drake_tracker.arm.joint_servo import add_joint_feedforward, add_set_point_spline
from drake_tracker.arm.tool_motion import ToolMotion
from drake_tracker.arm.transform_equation_system import TransformEquationSystem
from drake_tracker.grasp.touch_machine import TouchMachine
from drake_tracker.grasp.touch_system import TouchSystem


class TouchDiagram(Diagram):
    """A `BallWorldDiagram` whose arm touches the marks over which an operator has jogged it.

    .. pydrake_system::

        name: TouchDiagram
        output_ports:
        - report
        - camera
        - truth_query

    ``report`` is a `TouchReport`. There is no vision in the loop.

    Args:
      world: `BallWorldDiagram` without a ball on the board. model: the controller's `ArmModel` with the probe for its
      tool. q_initial: the arm's start [rad]. jogs: see `TouchMachine`. time_step: of the plant [s]. period: of the
      set-points [s].
    """

    def __init__(self, world, model, q_initial, jogs, time_step, period):
        super().__init__()
        self.set_name("touching")
        self.world = world
        builder = DiagramBuilder()
        builder.AddSystem(world)
        p_start = model.tool_pose(q_initial).translation()
        machine = TouchMachine(model, jogs, p_start, period)
        touch = builder.AddNamedSystem("touch", TouchSystem(machine, time_step, period))
        motion = ToolMotion(jogs[0], period, symmetric=False)
        transform = builder.AddNamedSystem(
            "transform_equation", TransformEquationSystem(motion, model, q_initial, time_step, period)
        )
        ik = builder.AddNamedSystem("inverse_kinematics", DifferentialIkSystem(model, q_initial, time_step, period))
        joints = add_set_point_spline(builder, "joint_spline", ik.GetOutputPort("q_commanded"), q_initial, period)
        dynamics = add_joint_feedforward(builder, model, joints)

        for port in ("target", "command"):
            builder.Connect(touch.GetOutputPort(port), transform.GetInputPort(port))
        builder.Connect(transform.GetOutputPort("status"), touch.GetInputPort("status"))
        builder.Connect(transform.GetOutputPort("X_WT_desired"), ik.GetInputPort("X_WT_desired"))
        builder.Connect(ik.GetOutputPort("q_commanded"), transform.GetInputPort("q_commanded"))
        builder.Connect(joints.GetOutputPort("desired_acceleration"), touch.GetInputPort("desired_acceleration"))
        builder.Connect(world.GetOutputPort("arm_state"), touch.GetInputPort("arm_state"))
        builder.Connect(world.GetOutputPort("arm_state"), dynamics.get_input_port_estimated_state())
        builder.Connect(world.GetOutputPort("arm_effort"), touch.GetInputPort("arm_effort"))
        builder.Connect(joints.GetOutputPort("desired_state"), world.GetInputPort("arm_desired_state"))
        builder.Connect(dynamics.get_output_port_generalized_force(), world.GetInputPort("arm_feedforward"))
        builder.ExportOutput(touch.GetOutputPort("report"), "report")
        for port in ("camera", "truth_query"):
            if world.HasOutputPort(port):
                builder.ExportOutput(world.GetOutputPort(port), port)
        builder.BuildInto(self)
