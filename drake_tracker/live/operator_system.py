"""The operator's panel as a System, through which the commands of the person at the page enter the diagram."""

from typing import Any

import numpy as np
from pydrake.systems.framework import (
    BasicVector,
    Context,
    Diagram,
    DiagramBuilder,
    DiscreteValues,
    LeafSystem,
    OutputPort,
)

from drake_tracker.core.messages import OperatorCommand, ToolStatus, message_size
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.diagrams.hand_eye import SELECTED
from drake_tracker.grasp.operator_override import OperatorMode
from drake_tracker.live.operator import JOG_STEP, JOG_TURN, OperatorPanel

LEAD, LEAD_TURN = 0.05, 0.27
"""Largest distance [m] and angle [rad], 15 deg, of the goal from the commanded tool: when a key is released, the hand
soon stands still."""
_STEPS = np.array([JOG_STEP, JOG_STEP, JOG_STEP, JOG_TURN])
_POSE = slice(1, 5)
"""Elements of an `OperatorCommand` with the pose."""
_LEADS = np.array([LEAD, LEAD, LEAD, LEAD_TURN])


class OperatorSystem(LeafSystem):
    """Reads the operator's panel once per vision cycle and outputs the command of the operator.

    .. pydrake_system::

        name: OperatorSystem
        input_ports:
        - status
        output_ports:
        - operator
        - selected

    ``status``: a `ToolStatus`. ``operator``: an `OperatorCommand`, updated every vision period (1/60 s) with offset 0;
    the pose is zero unless the operator has taken over. It begins where the tool is, and steps on the page move it.
    ``selected``: the field ``selected`` of this command alone, for the vision.

    The panel is an external input, like a camera: other threads write it. The command is state, and is logged.

    Args:
        panel: the operator's panel.
    """

    def __init__(self, panel: OperatorPanel) -> None:
        super().__init__()
        self._panel = panel
        self._status = self.DeclareVectorInputPort("status", message_size(ToolStatus))
        command = self.DeclareDiscreteState(message_size(OperatorCommand))
        self.DeclareStateOutputPort("operator", command)
        self.DeclareVectorOutputPort("selected", 1, self._calc_selected, {self.discrete_state_ticket(command)})
        self.DeclarePeriodicDiscreteUpdateEvent(VISION_PERIOD, 0.0, self._update)

    def _update(self, context: Context, state: DiscreteValues) -> None:
        before = OperatorCommand(np.array(context.get_discrete_state_vector().value()))
        wish = self._panel.read()
        command = OperatorCommand(np.zeros(message_size(OperatorCommand)))
        command.mode = wish.mode
        if wish.mode == OperatorMode.TAKE_OVER:
            status = ToolStatus(self._status.Eval(context))
            tool = np.array([status.x, status.y, status.z, status.yaw])
            goal = before[_POSE] if before.mode == OperatorMode.TAKE_OVER else tool
            command[_POSE] = moved(goal, np.array(wish.steps), tool)
        command.selected = wish.selected
        state.set_value(command[:])

    def _calc_selected(self, context: Context, output: BasicVector) -> None:
        command = OperatorCommand(context.get_discrete_state_vector().value())
        output.SetFromVector([command.selected])


def moved(goal: np.ndarray, steps: np.ndarray, tool: np.ndarray) -> np.ndarray:
    """Returns a goal moved by steps, but along no axis farther than the lead from the tool.

    Args:
        goal: pose (x, y, z, yaw) in W, shape (4,) [m, rad].
        steps: whole steps along the axes, shape (4,).
        tool: commanded pose of the tool, shape (4,) [m, rad].
    """
    wanted = goal + steps * _STEPS
    return np.where(steps == 0, goal, np.clip(wanted, tool - _LEADS, tool + _LEADS))


def add_operator(builder: DiagramBuilder, *, hand_eye: Diagram, panel: OperatorPanel) -> OutputPort | None:
    """Adds an `OperatorSystem` and connects it to a `HandEyeDiagram` of the same builder.

    Args:
        builder: receives the System.
        hand_eye: diagram with the output ``status``. With an input ``selected``, the operator can select the target.
        panel: the operator's panel.

    Returns the output port ``operator``, to be logged, or None when the arm listens to no operator.
    """
    if not hand_eye.HasInputPort("operator"):
        return None
    system = builder.AddNamedSystem("operator", OperatorSystem(panel))
    builder.Connect(hand_eye.GetOutputPort("status"), system.GetInputPort("status"))
    builder.Connect(system.GetOutputPort("operator"), hand_eye.GetInputPort("operator"))
    if hand_eye.HasInputPort(SELECTED):
        builder.Connect(system.GetOutputPort("selected"), hand_eye.GetInputPort(SELECTED))
    port: Any = system.GetOutputPort("operator")
    return port
