"""What the gripper itself feels: a width from its fingers' encoders, a force from its drive."""

from pydrake.systems.framework import LeafSystem

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

    ``gripper_state`` is (q_left, q_right [m], v_left, v_right [m/s]), ``drive_effort`` the driven finger's effort [N],
    of which the coupling gives half to each pad. No state.
    """

    def __init__(self):
        super().__init__()
        self._state = self.DeclareVectorInputPort("gripper_state", 4)
        self._effort = self.DeclareVectorInputPort("drive_effort", 1)
        self.DeclareVectorOutputPort("jaws", message_size(JawState), self._calc)

    def _calc(self, context, output):
        q_left, q_right, v_left, v_right = self._state.Eval(context)
        (effort,) = self._effort.Eval(context)
        output.SetFromVector([q_left + q_right, v_left + v_right, max(-0.5 * effort, 0.0)])
