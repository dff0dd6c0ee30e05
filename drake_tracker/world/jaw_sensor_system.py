"""What the gripper itself measures: an opening from its fingers' encoders, a force from its drive."""

from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex
from pydrake.systems.framework import BasicVector, Context, DiagramBuilder, LeafSystem

from drake_tracker.core.messages import JawState, message_size


class JawSensorSystem(LeafSystem):
    """Turns the gripper's joint state and drive effort into a `JawState`.

    .. pydrake_system::

        name: JawSensorSystem
        input_ports:
        - gripper_state
        - drive_effort
        output_ports:
        - jaws

    ``gripper_state`` is (q_left, q_right [m], v_left, v_right [m/s]). ``drive_effort`` is the effort [N] of the driven
    finger, of which the coupling gives half to each pad. ``jaws`` is a `JawState`, a function of the inputs; there is
    no state.
    """

    def __init__(self) -> None:
        super().__init__()
        self._state = self.DeclareVectorInputPort("gripper_state", 4)
        self._effort = self.DeclareVectorInputPort("drive_effort", 1)
        self.DeclareVectorOutputPort("jaws", message_size(JawState), self._calc)

    def _calc(self, context: Context, output: BasicVector) -> None:
        q_left, q_right, v_left, v_right = self._state.Eval(context)
        (effort,) = self._effort.Eval(context)
        output.SetFromVector([q_left + q_right, v_left + v_right, max(-0.5 * effort, 0.0)])


def add_jaw_sensor(
    builder: DiagramBuilder, *, plant: MultibodyPlant, gripper: ModelInstanceIndex, name: str = "jaw_sensor"
) -> JawSensorSystem:
    """Adds a `JawSensorSystem` and connects it to a gripper with two fingers, the first of which is driven.

    Args:
        builder: of the diagram that has the plant.
        plant: finalized.
        gripper: model instance in the plant.
        name: of the System.
    """
    jaws = builder.AddNamedSystem(name, JawSensorSystem())
    builder.Connect(plant.get_state_output_port(gripper), jaws.GetInputPort("gripper_state"))
    builder.Connect(plant.get_net_actuation_output_port(gripper), jaws.GetInputPort("drive_effort"))
    return jaws
