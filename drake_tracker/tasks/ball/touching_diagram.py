"""The wiring of the board's initialisation: the world of the ball, and an arm that touches three marks."""

import numpy as np
from pydrake.systems.framework import Diagram, DiagramBuilder

from drake_tracker.arm.arm_model import ArmModel
from drake_tracker.grasp.touch_diagram import TouchDiagram
from drake_tracker.world.ball_world_diagram import BallWorldDiagram


class BoardTouchingDiagram(Diagram):
    """A `BallWorldDiagram` whose arm touches the marks over which an operator has jogged it.

    .. pydrake_system::

        name: BoardTouchingDiagram
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

    def __init__(
        self,
        world: BallWorldDiagram,
        model: ArmModel,
        q_initial: np.ndarray,
        jogs: np.ndarray,
        time_step: float,
        period: float,
    ) -> None:
        super().__init__()
        self.set_name("touching")
        self.world = world
        builder = DiagramBuilder()
        builder.AddSystem(world)
        arm = builder.AddSystem(TouchDiagram(model, q_initial, jogs, time_step, period))
        for port in ("arm_state", "arm_effort"):
            builder.Connect(world.GetOutputPort(port), arm.GetInputPort(port))
        for port in ("arm_desired_state", "arm_feedforward"):
            builder.Connect(arm.GetOutputPort(port), world.GetInputPort(port))
        builder.ExportOutput(arm.GetOutputPort("report"), "report")
        for port in ("camera", "truth_query"):
            if world.HasOutputPort(port):
                builder.ExportOutput(world.GetOutputPort(port), port)
        builder.BuildInto(self)
