"""The arm's computer while it touches the board: touching, transform equation, inverse kinematics, joint servos."""

from collections.abc import Sequence

import numpy as np
from pydrake.systems.framework import Diagram, DiagramBuilder

from drake_tracker.arm.arm_model import ArmModel
from drake_tracker.arm.motion.tool_controller import add_tool_controller
from drake_tracker.arm.motion.tool_motion import ToolMotion
from drake_tracker.grasp.ball.catch_system import TouchSystem
from drake_tracker.grasp.ball.touch_machine import TouchMachine
from drake_tracker.grasp.config import TouchConfig


class TouchDiagram(Diagram):
    """From measured contact to joint set-points, until three marks on the board are touched.

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

    - ``arm_state``: measured joint positions and velocities, 2 n values [rad, rad/s].
    - ``arm_effort``: torques that the joint servos apply, n values [N m].
    - ``arm_desired_state``: desired joint positions and velocities, 2 n values [rad, rad/s], continuous in time.
    - ``arm_feedforward``: torques for gravity, friction and acceleration, n values [N m].
    - ``report``: a `TouchReport`, updated every period. The positions of marks that are not touched yet are zero.
    - ``q_commanded``: joint set-points, n values [rad], updated every period.

    Args:
        model: the controller's model of the arm, with the probe as its tool frame.
        q_initial: joint positions at the start, the probe pointing down, shape (n,) [rad].
        jogs: where the operator left the probe over the marks, (x, y, z, yaw) in W, shape (3, 4) [m, rad].
        time_step: the plant's step [s].
        period: period of the set-points [s].
        config: speeds, distances and the threshold of the force.

    Attributes:
        model: as given.
    """

    def __init__(
        self,
        model: ArmModel,
        q_initial: Sequence[float] | np.ndarray,
        jogs: np.ndarray,
        time_step: float,
        period: float,
        config: TouchConfig = TouchConfig(),
    ) -> None:
        super().__init__()
        self.set_name("touch")
        self.model = model
        builder = DiagramBuilder()
        machine = TouchMachine(model, jogs, model.tool_pose(q_initial).translation(), period, config)
        touch = builder.AddNamedSystem("touch", TouchSystem(machine, time_step, period))
        controller = add_tool_controller(
            builder,
            motion=ToolMotion(machine.jogs[0], period, model.symmetric_hand),
            model=model,
            q_initial=q_initial,
            target=touch.GetOutputPort("target"),
            command=touch.GetOutputPort("command"),
            time_step=time_step,
            period=period,
        )
        spline, dynamics = controller.spline, controller.inverse_dynamics
        builder.Connect(controller.transform_equation.GetOutputPort("status"), touch.GetInputPort("status"))
        builder.Connect(spline.GetOutputPort("desired_acceleration"), touch.GetInputPort("desired_acceleration"))

        builder.ExportInput(touch.GetInputPort("arm_state"), "arm_state")
        builder.ConnectInput("arm_state", dynamics.get_input_port_estimated_state())
        builder.ExportInput(touch.GetInputPort("arm_effort"), "arm_effort")
        builder.ExportOutput(spline.GetOutputPort("desired_state"), "arm_desired_state")
        builder.ExportOutput(dynamics.get_output_port_generalized_force(), "arm_feedforward")
        builder.ExportOutput(touch.GetOutputPort("report"), "report")
        builder.ExportOutput(controller.limiter.GetOutputPort("q_commanded"), "q_commanded")
        builder.BuildInto(self)
