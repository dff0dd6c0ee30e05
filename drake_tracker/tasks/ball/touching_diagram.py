"""The wiring of the initialisation: the laboratory of the ball, and an arm that touches three marks on the board."""

import numpy as np
from pydrake.systems.framework import Diagram, DiagramBuilder

from drake_tracker.arm.arm_model import ArmModel
from drake_tracker.grasp.ball.touch_diagram import TouchDiagram
from drake_tracker.world.ball.ball_world_diagram import BallWorldDiagram


class BoardTouchingDiagram(Diagram):
    """The laboratory of the ball with an arm that touches the marks over which an operator has jogged it.

    .. pydrake_system::

        name: BoardTouchingDiagram
        output_ports:
        - report
        - truth_query

    - ``report``: a `TouchReport`, updated every ``period``. The positions of marks that are not touched yet are zero.
    - ``truth_query``: a QueryObject of the world's scene, ground truth.

    There is no vision in the loop.

    Args:
        world: the laboratory, without a ball on the board.
        model: the controller's model of the arm, with the probe as its tool.
        q_initial: joints at the start [rad], shape (n,).
        jogs: poses (x, y, z, yaw) in W over the marks [m, rad], shape (3, 4).
        time_step: the plant's step [s].
        period: period of the set-points [s].

    Attributes:
        world: the laboratory.
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
        builder.ExportOutput(world.GetOutputPort("truth_query"), "truth_query")
        builder.BuildInto(self)
