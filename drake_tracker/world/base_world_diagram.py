"""The common part of all laboratories: arm and drives, cameras and the processes that render, and their ports."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex
from pydrake.systems.framework import BasicVector, Context, Diagram, DiagramBuilder, LeafSystem

from drake_tracker.arm.description import ArmDescription
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.messages import JawState, message_size
from drake_tracker.core.timing import TIME_STEP
from drake_tracker.faults.arm_faults_system import add_gripper_faults, add_joint_faults
from drake_tracker.faults.fault import Fault
from drake_tracker.world.config import LightingConfig
from drake_tracker.world.disturbance_system import add_scene_faults
from drake_tracker.world.imaging.camera_system import Camera, close_cameras, start_cameras
from drake_tracker.world.imaging.cameras import ImageWindow
from drake_tracker.world.imaging.image_pipeline import ImagePipeline


@dataclass(frozen=True, kw_only=True, eq=False)
class WorldConfig:
    """The common settings of all laboratories.

    Attributes:
        arm: the arm and its hand.
        q_initial: joints at the start [rad].
        jaw_opening: opening of the jaws at the start [m].
        grip_force: largest force on each pad [N].
        lighting: the lamps.
        windows: {camera name: window} to render; None renders the full images. When it is empty there are no cameras,
            no ports with images and no renderer.
        pipeline: how late the images are, and which processes make them; None: they are rendered when they are read.
        faults: the injected faults, of which the world has the faults of its own parts.
        seed: of the sensor noise, and of whatever the laboratory draws.
        time_step: of the plant [s].
    """

    arm: ArmDescription
    q_initial: Sequence[float] | np.ndarray
    jaw_opening: float = 0.088
    grip_force: float = 25.0
    lighting: LightingConfig = LightingConfig()
    windows: Mapping[str, ImageWindow] | None = None
    pipeline: ImagePipeline | None = None
    faults: Sequence[Fault] = ()
    seed: int = 0
    time_step: float = TIME_STEP

    @property
    def image_latency(self) -> int:
        """Cycles from the capture of an image until its port shows it."""
        return 0 if self.pipeline is None else self.pipeline.latency


LARGEST_OVERLAP = 1e-3
"""Largest depth by which bodies overlap at the start [m]; contact in equilibrium needs less."""


class BaseWorldDiagram(Diagram):
    """A laboratory: everything that is real, and the only place that holds the ground truth.

    A derived class adds its plant, cameras and judge to a builder, calls `place_robot`, `check_layout` and
    `export_robot`, exports its own ports, and calls ``builder.BuildInto(self)``.

    Args:
        config: common settings of all laboratories.

    Attributes:
        laboratory: the plant and its parts: ground truth.
        cameras: {name: Camera}: ground truth.
        image_latency: cycles from the capture of an image until its port shows it.
    """

    laboratory: Any

    def __init__(self, config: WorldConfig) -> None:
        super().__init__()
        self.set_name("world")
        self.cameras: dict[str, Camera] = {}
        self.image_latency = config.image_latency

    def place_robot(self, config: WorldConfig) -> None:
        """Names the plant, and places the arm and the jaws, if there are any."""
        plant, laboratory = self.laboratory.plant, self.laboratory
        plant.set_name("plant")
        plant.SetDefaultPositions(laboratory.arm, config.q_initial)
        if config.arm.has_fingers:
            plant.SetDefaultPositions(laboratory.gripper, [0.5 * config.jaw_opening, 0.5 * config.jaw_opening])

    def check_layout(self) -> None:
        """Raises DrakeTrackerError when bodies overlap at the start: contact would jam them.

        Everything must have been placed, and there must be no renderer yet that could be copied.
        """
        plant = self.laboratory.plant
        scene_graph = self.laboratory.scene_graph
        context = scene_graph.CreateDefaultContext()
        poses = plant.get_geometry_pose_output_port().Eval(plant.CreateDefaultContext())
        scene_graph.get_source_pose_port(plant.get_source_id()).FixValue(context, AbstractValue.Make(poses))
        query = scene_graph.get_query_output_port().Eval(context)
        overlaps = sorted(query.ComputePointPairPenetration(), key=lambda pair: -pair.depth)
        if overlaps and overlaps[0].depth > LARGEST_OVERLAP:
            frames = [query.inspector().GetFrameId(side) for side in (overlaps[0].id_A, overlaps[0].id_B)]
            one, other = (plant.GetBodyFromFrameId(frame).name() for frame in frames)
            raise DrakeTrackerError(
                f"the layout is impossible: {one} and {other} overlap by {1e3 * overlaps[0].depth:.0f} mm at the start"
            )

    def add_faults(self, builder: DiagramBuilder, config: WorldConfig) -> None:
        """Adds the faults of the scene and of the joints."""
        plant = self.laboratory.plant
        add_scene_faults(builder, plant=plant, faults=config.faults)
        add_joint_faults(builder, plant=plant, arm=self.laboratory.arm, faults=config.faults)

    def export_robot(self, builder: DiagramBuilder, config: WorldConfig) -> None:
        """Exports ``arm_desired_state``, ``arm_feedforward``, the images, ``arm_state`` and ``arm_effort``.

        A hand with fingers adds a `JawSensorSystem` and the ports ``gripper_desired_state`` and ``jaws``.
        """
        laboratory, plant = self.laboratory, self.laboratory.plant
        builder.ExportInput(plant.get_desired_state_input_port(laboratory.arm), "arm_desired_state")
        builder.ExportInput(plant.get_actuation_input_port(laboratory.arm), "arm_feedforward")
        if config.arm.has_fingers:
            gripper = add_gripper_faults(
                builder,
                plant=plant,
                gripper=laboratory.gripper,
                initial=0.5 * config.jaw_opening,
                faults=config.faults,
            )
            builder.ExportInput(gripper, "gripper_desired_state")
        for name, camera in self.cameras.items():
            builder.ExportOutput(camera.image_port, name)
        builder.ExportOutput(plant.get_state_output_port(laboratory.arm), "arm_state")
        builder.ExportOutput(plant.get_net_actuation_output_port(laboratory.arm), "arm_effort")
        if config.arm.has_fingers:
            jaws = add_jaw_sensor(builder, plant=plant, gripper=laboratory.gripper)
            builder.ExportOutput(jaws.GetOutputPort("jaws"), "jaws")

    def start(self) -> None:
        """Starts the processes that make images, if there are any. Otherwise they start with the first image."""
        start_cameras(self.cameras.values())

    def close(self) -> None:
        """Ends the processes that make images, if there are any. They start again when an image is read."""
        close_cameras(self.cameras.values())


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
