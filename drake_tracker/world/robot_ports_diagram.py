"""The ports between a laboratory with an arm, a gripper and cameras and its controller."""

from collections.abc import Mapping, Sequence
from typing import Any

from pydrake.systems.framework import DiagramBuilder, System

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
