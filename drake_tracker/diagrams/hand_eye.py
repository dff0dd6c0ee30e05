"""The wiring of a complete hand-eye system: one connection for each arrow of figure 1 of Allen et al. 1991."""

from pydrake.systems.framework import Diagram, DiagramBuilder, InputPort, OutputPort, System

Connection = tuple[str, str, str, str]
"""(subsystem, its output port, subsystem, its input port)."""
BETWEEN_SUBSYSTEMS: tuple[Connection, ...] = (
    ("vision", "point", "host", "point"),
    ("host", "prediction", "link", "packet"),
    ("link", "delivered", "arm", "packet"),
)
"""Connections between subsystems whose two ports have different names."""


class HandEyeDiagram(Diagram):
    """The five subsystems, each a System of its own, in the order in which data flows.

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

    These are the train's ports; every task has the ports of its own subsystems. World and vision, and world and arm,
    are connected where an output of one has the name of an input of the other. All other outputs of the subsystems are
    outputs of the Diagram, for logs, pictures and judges; an input of the arm that no subsystem drives is an input of
    the Diagram. Units and periods of the ports are those of the subsystems. Ports named ``truth_*`` carry ground truth:
    they lead out of the Diagram, never back into it.

    With `MeasuredVisionDiagram` as vision there are no cameras: the outputs from ``camera_*`` to ``centroid_*`` do not
    exist. Instead of the images, one wire carries the train's true state to this stand-in and to nothing else.

    Args:
        world: a Diagram with the sensors' ports, such as `WorldDiagram`.
        vision: `VisionDiagram`, `MeasuredVisionDiagram` or `BoardVisionDiagram`.
        host: `EstimatorSystem`.
        link: a link System, see `drake_tracker.link.kinds`.
        arm: `ArmDiagram`.
        connections: between ports with different names.

    Attributes:
        world, vision, host, link, arm: the subsystems, as given.
    """

    def __init__(
        self,
        world: Diagram,
        vision: Diagram,
        host: System,
        link: System,
        arm: Diagram,
        connections: tuple[Connection, ...] = BETWEEN_SUBSYSTEMS,
    ) -> None:
        super().__init__()
        self.set_name("hand_eye")
        self.world, self.vision, self.host, self.link, self.arm = world, vision, host, link, arm
        subsystems = {"world": world, "vision": vision, "host": host, "link": link, "arm": arm}
        builder = DiagramBuilder()
        for subsystem in subsystems.values():
            builder.AddSystem(subsystem)
        for source, output, reader, input_ in connections:
            builder.Connect(subsystems[source].GetOutputPort(output), subsystems[reader].GetInputPort(input_))
        for to, origin in ((vision, world), (arm, world), (world, arm)):
            for port in inputs(to):
                if origin.HasOutputPort(port.get_name()):
                    builder.Connect(origin.GetOutputPort(port.get_name()), port)
                elif to is arm and port.get_name() != "packet":
                    builder.ExportInput(port, port.get_name())
        driving = {port.get_name() for port in inputs(world)}
        for subsystem in subsystems.values():
            for port in outputs(subsystem):
                if port.get_name() not in driving:
                    builder.ExportOutput(port, port.get_name())
        builder.BuildInto(self)


def has_images(hand_eye: Diagram) -> bool:
    """Returns whether the vision of a `HandEyeDiagram` reads images: not with measured vision, nor when another process
    does.
    """
    return hand_eye.HasOutputPort("motion_left") or hand_eye.HasOutputPort("motion")


def inputs(system: System) -> list[InputPort]:
    """Returns the input ports of a System."""
    return [system.get_input_port(index) for index in range(system.num_input_ports())]


def outputs(system: System) -> list[OutputPort]:
    """Returns the output ports of a System."""
    return [system.get_output_port(index) for index in range(system.num_output_ports())]
