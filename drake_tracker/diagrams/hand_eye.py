"""The wiring of the whole hand-eye system: one Connect for each arrow of the paper's figure 1."""

from pydrake.systems.framework import Diagram, DiagramBuilder

from drake_tracker.vision.measured_vision_system import TRUTH_PORT
from drake_tracker.world.cameras import CAMERA_NAMES


class HandEyeDiagram(Diagram):
    """Five rooms, each a System of its own, in the order in which data flows.

    .. pydrake_system::

        name: HandEyeDiagram
        output_ports:
        - camera_left
        - camera_right
        - motion_left
        - motion_right
        - motion_images_left
        - motion_images_right
        - centroid_left
        - centroid_right
        - point
        - filtered
        - prediction
        - delivered
        - target
        - command
        - status
        - diagnosis
        - q_commanded
        - arm_state
        - arm_effort
        - jaws
        - truth_train_state
        - truth_verdict
        - truth_query

    The outputs are those of the rooms, for logs, pictures and judges; ports named ``truth_*`` carry what only the
    simulator knows and lead out of the diagram, never back into it.

    With `MeasuredVisionDiagram` as vision there are no cameras: the outputs from ``camera_*`` to ``centroid_*`` do not
    exist, and in the place of the images one wire carries the train's true state to this stand-in, and to nothing else.

    Args:
      world: `WorldDiagram`. vision: `VisionDiagram` or `MeasuredVisionDiagram`. host: `EstimatorSystem`. link: a link
      System. arm: `ArmDiagram`.
    """

    def __init__(self, world, vision, host, link, arm):
        super().__init__()
        self.set_name("hand_eye")
        self.world, self.vision, self.host, self.link, self.arm = world, vision, host, link, arm
        builder = DiagramBuilder()
        for room in (world, vision, host, link, arm):
            builder.AddSystem(room)

        seen = CAMERA_NAMES if world.cameras else (TRUTH_PORT,)
        for port in seen:
            builder.Connect(world.GetOutputPort(port), vision.GetInputPort(port))
        builder.Connect(vision.GetOutputPort("point"), host.GetInputPort("point"))
        builder.Connect(host.GetOutputPort("prediction"), link.GetInputPort("packet"))
        builder.Connect(link.GetOutputPort("delivered"), arm.GetInputPort("packet"))
        builder.Connect(world.GetOutputPort("arm_state"), arm.GetInputPort("arm_state"))
        builder.Connect(world.GetOutputPort("jaws"), arm.GetInputPort("jaws"))
        for port in ("arm_desired_state", "arm_feedforward", "gripper_desired_state"):
            builder.Connect(arm.GetOutputPort(port), world.GetInputPort(port))

        processed = ("motion_left", "motion_right", "motion_images_left", "motion_images_right")
        centroids = ("centroid_left", "centroid_right")
        exported = {
            world: (
                *((*CAMERA_NAMES,) if world.cameras else ()),
                *("arm_state", "arm_effort", "jaws"),
                *("truth_train_state", "truth_verdict", "truth_query"),
            ),
            vision: (*((*processed, *centroids) if world.cameras else ()), "point"),
            host: ("filtered", "prediction"),
            link: ("delivered",),
            arm: ("target", "command", "status", "diagnosis", "q_commanded"),
        }
        for room, ports in exported.items():
            for port in ports:
                builder.ExportOutput(room.GetOutputPort(port), port)
        builder.BuildInto(self)
