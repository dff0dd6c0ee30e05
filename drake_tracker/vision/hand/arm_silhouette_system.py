"""The silhouette of the robot's own arm in the images of all cameras, as a Drake System."""

from collections.abc import Mapping

import cv2
import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, DiagramBuilder, InputPort, LeafSystem, ValueProducer

from drake_tracker.arm.arm_shape import ArmShape
from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.core.frozen_state import read_only
from drake_tracker.core.messages import JawState, message_size
from drake_tracker.vision.delay_line_system import DelayLineSystem
from drake_tracker.vision.hand.arm_silhouette import ArmSilhouette


class ArmSilhouetteSystem(LeafSystem):
    """Draws where the arm is in each image, as its joint angles tell, and its markers where they are seen.

    .. pydrake_system::

        name: ArmSilhouetteSystem
        input_ports:
        - arm_state
        - jaws
        - displacement_left
        - displacement_right
        output_ports:
        - hidden_left
        - hidden_right

    ``arm_state`` is (q, v) [rad, rad/s] at the capture of the images, and ``jaws`` a `JawState`.
    ``displacement_*`` is by how much the hand is displaced to the right and downwards in each image, shape (2,) [px];
    unconnected, it is not displaced. ``hidden_*`` is a uint8 array of the image's shape, 255 where the arm is, or None
    when it is in no pixel. There is no state and no period: the outputs follow the inputs at once.

    Args:
        shape: the arm.
        silhouettes: {side: `ArmSilhouette`}.
        num_joints: number n of the arm's joints.
    """

    def __init__(self, shape: ArmShape, silhouettes: Mapping[str, ArmSilhouette], num_joints: int) -> None:
        super().__init__()
        self._shape, self._num_joints = shape, num_joints
        self._arm_state = self.DeclareVectorInputPort("arm_state", 2 * num_joints)
        self._jaws = self.DeclareVectorInputPort("jaws", message_size(JawState))
        inputs = {self._arm_state.ticket(), self._jaws.ticket()}
        producer = ValueProducer(lambda: AbstractValue.Make([]), self._calc_pieces)
        self._pieces = self.DeclareCacheEntry("pieces", producer, inputs)
        for side, silhouette in silhouettes.items():
            displacement = self.DeclareVectorInputPort(f"displacement_{side}", 2)

            def calc(
                context: Context,
                output: AbstractValue,
                silhouette: ArmSilhouette = silhouette,
                displacement: InputPort = displacement,
            ) -> None:
                moved = displacement.Eval(context) if displacement.HasValue(context) else np.zeros(2)
                mask = silhouette.mask(self._pieces.Eval(context), moved)
                output.set_value(read_only(mask) if cv2.countNonZero(mask) else None)

            self.DeclareAbstractOutputPort(
                f"hidden_{side}",
                lambda: AbstractValue.Make(object()),
                calc,
                {self._pieces.ticket(), displacement.ticket()},
            )

    def _calc_pieces(self, context: Context, output: AbstractValue) -> None:
        q = self._arm_state.Eval(context)[: self._num_joints]
        output.set_value(self._shape.pieces(q, JawState(self._jaws.Eval(context)).width))


def add_arm_silhouette(
    builder: DiagramBuilder,
    cameras: Mapping[str, CameraModel],
    image_windows: Mapping[str, tuple[int, int, int, int]],
    arm: tuple[ArmShape, int],
    *,
    period: float,
    latency: int,
) -> ArmSilhouetteSystem:
    """Adds the silhouettes of the arm at the capture of the images, and exports the inputs ``arm_state`` and ``jaws``.

    Args:
        builder: of the vision's diagram.
        cameras: {side: calibrated camera}.
        image_windows: {side: part of the full image that the images show (u0, v0, width, height) [px]}.
        arm: its shape and the number of its joints.
        period: of a cycle [s].
        latency: cycles from the capture of an image until it appears.
    """
    shape, num_joints = arm
    silhouettes = {side: ArmSilhouette(camera, image_windows[side]) for side, camera in cameras.items()}
    system = builder.AddNamedSystem("arm_silhouette", ArmSilhouetteSystem(shape, silhouettes, num_joints))
    for name, size in (("arm_state", 2 * num_joints), ("jaws", message_size(JawState))):
        if latency == 0:
            builder.ExportInput(system.GetInputPort(name), name)
            continue
        # Vision reads the line before it takes in the newest sample, hence one step less.
        line = builder.AddNamedSystem(f"{name}_at_capture", DelayLineSystem(size, latency - 1, period=period))
        builder.ExportInput(line.get_input_port(), name)
        builder.Connect(line.get_output_port(), system.GetInputPort(name))
    return system
