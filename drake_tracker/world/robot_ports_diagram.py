"""The ports between a laboratory with an arm, a gripper and cameras and its controller."""

from collections.abc import Mapping, Sequence
from typing import Any

from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex
from pydrake.systems.framework import BasicVector, Context, DiagramBuilder, LeafSystem, System

from drake_tracker.core.messages import JawState, message_size
from drake_tracker.faults.arm_faults_system import add_gripper_faults
from drake_tracker.faults.fault import Fault
from drake_tracker.world.imaging.camera_system import Camera


def export_robot_ports(
    builder: DiagramBuilder,
    *,
    laboratory: Any,
    cameras: Mapping[str, Camera],
    jaws: System,
    jaw_opening: float,
    faults: Sequence[Fault],
) -> None:
    """Exports ``arm_desired_state``, ``arm_feedforward`` and ``gripper_desired_state``, and then the images,
    ``arm_state``, ``arm_effort`` and ``jaws``.

    Args:
        builder: of the world.
        laboratory: with the attributes ``plant``, ``arm`` and ``gripper``.
        cameras: {name of the port: camera}.
        jaws: the sensor of the jaws.
        jaw_opening: opening of the jaws at the start [m].
        faults: what goes wrong; of these, those of the gripper are added.
    """
    plant, arm = laboratory.plant, laboratory.arm
    builder.ExportInput(plant.get_desired_state_input_port(arm), "arm_desired_state")
    builder.ExportInput(plant.get_actuation_input_port(arm), "arm_feedforward")
    gripper = add_gripper_faults(
        builder, plant=plant, gripper=laboratory.gripper, initial=0.5 * jaw_opening, faults=faults
    )
    builder.ExportInput(gripper, "gripper_desired_state")
    for name, camera in cameras.items():
        builder.ExportOutput(camera.image_port, name)
    builder.ExportOutput(plant.get_state_output_port(arm), "arm_state")
    builder.ExportOutput(plant.get_net_actuation_output_port(arm), "arm_effort")
    builder.ExportOutput(jaws.GetOutputPort("jaws"), "jaws")


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
