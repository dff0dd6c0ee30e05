"""Drake Systems of the faults of the arm's joints and of the gripper's drive."""

from collections.abc import Sequence

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex
from pydrake.systems.framework import BasicVector, Context, DiagramBuilder, DiscreteValues, InputPort, LeafSystem

from drake_tracker.faults.fault import Fault, GripperFault, JointFault, faults_at


class JointFaultsSystem(LeafSystem):
    """Additional torques at the joints of the arm.

    .. pydrake_system::

        name: JointFaultsSystem
        input_ports:
        - arm_state
        output_ports:
        - generalized_force

    ``arm_state``: (q, v) of the arm [rad, rad/s]. ``generalized_force``: for the plant's port
    ``applied_generalized_force`` [N m], zero for everything that is not a joint of the arm. There is no state.

    Args:
        faults: the faults.
        selector: (velocities of the plant, joints), 1 where a velocity belongs to a joint of the arm.
    """

    def __init__(self, faults: Sequence[JointFault], selector: np.ndarray) -> None:
        super().__init__()
        self._faults, self._selector = tuple(faults), selector
        rows, joints = selector.shape
        self._arm_state = self.DeclareVectorInputPort("arm_state", 2 * joints)
        self.DeclareVectorOutputPort("generalized_force", rows, self._calc)

    def _calc(self, context: Context, output: BasicVector) -> None:
        joints = self._selector.shape[1]
        v, torques = self._arm_state.Eval(context)[joints:], np.zeros(joints)
        for fault in self._faults:
            if fault.active(context.get_time()):
                torques += fault.torques(v)
        output.SetFromVector(self._selector @ torques)


class GripperFaultsSystem(LeafSystem):
    """Changes the set-points of the gripper as faults do.

    .. pydrake_system::

        name: GripperFaultsSystem
        input_ports:
        - desired_state
        - gripper_state
        output_ports:
        - desired_state

    ``desired_state``: position and speed of the driven finger [m, m/s]. ``gripper_state``: (q, v) of the fingers, the
    driven one first [m, m/s]. While no fault acts, the output is the input. The state, updated every step, holds the
    position that each fault made of the set-point.

    Args:
        faults: applied in this order.
        time_step: of the plant [s].
        initial: position of the driven finger at the start [m].
    """

    def __init__(self, faults: Sequence[GripperFault], time_step: float, initial: float) -> None:
        super().__init__()
        self._faults, self._time_step = tuple(faults), time_step
        self._desired = self.DeclareVectorInputPort("desired_state", 2)
        self._gripper = self.DeclareVectorInputPort("gripper_state", 4)
        self.DeclareDiscreteState(np.full(len(self._faults), initial))
        self.DeclareVectorOutputPort("desired_state", 2, self._calc)
        self.DeclarePeriodicDiscreteUpdateEvent(time_step, 0.0, self._remember)

    def _set_points(self, context: Context) -> list[np.ndarray]:
        """Returns the set-point after each fault."""
        set_point, position = self._desired.Eval(context), self._gripper.Eval(context)[0]
        found = []
        for fault, before in zip(self._faults, context.get_discrete_state_vector().value()):
            if fault.active(context.get_time()):
                set_point = fault.set_point(set_point, before, position, self._time_step)
            found.append(set_point)
        return found

    def _remember(self, context: Context, state: DiscreteValues) -> None:
        state.set_value([set_point[0] for set_point in self._set_points(context)])

    def _calc(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._set_points(context)[-1])


def add_joint_faults(
    builder: DiagramBuilder, *, plant: MultibodyPlant, arm: ModelInstanceIndex, faults: Sequence[Fault]
) -> None:
    """Adds the faults of the joints to a diagram, if there are any.

    Args:
        builder: of the diagram that has the plant.
        plant: finalized.
        arm: model instance of the arm.
        faults: all faults of the run.
    """
    own = faults_at(faults, JointFault)
    if not own:
        return
    joints = plant.num_velocities(arm)
    selector = np.zeros((plant.num_velocities(), joints))
    for joint in range(joints):
        velocities = np.zeros(plant.num_velocities())
        plant.SetVelocitiesInArray(arm, np.eye(joints)[joint], velocities)
        selector[:, joint] = velocities
    system = builder.AddNamedSystem("joint_faults", JointFaultsSystem(own, selector))
    builder.Connect(plant.get_state_output_port(arm), system.GetInputPort("arm_state"))
    builder.Connect(system.get_output_port(), plant.get_applied_generalized_force_input_port())


def add_gripper_faults(
    builder: DiagramBuilder,
    *,
    plant: MultibodyPlant,
    gripper: ModelInstanceIndex,
    initial: float,
    faults: Sequence[Fault],
) -> InputPort:
    """Adds the faults of the gripper's drive to a diagram, if there are any.

    Args:
        builder: of the diagram that has the plant.
        plant: finalized.
        gripper: model instance of the gripper.
        initial: position of the driven finger at the start [m].
        faults: all faults of the run.

    Returns the port for the set-points of the gripper: the plant's when there is no such fault.
    """
    own = faults_at(faults, GripperFault)
    port = plant.get_desired_state_input_port(gripper)
    if not own:
        return port
    system = builder.AddNamedSystem("gripper_faults", GripperFaultsSystem(own, plant.time_step(), initial))
    builder.Connect(plant.get_state_output_port(gripper), system.GetInputPort("gripper_state"))
    builder.Connect(system.GetOutputPort("desired_state"), port)
    return system.GetInputPort("desired_state")
