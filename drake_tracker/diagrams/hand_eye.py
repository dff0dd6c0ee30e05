"""The wiring of a hand-eye system: one connection for each arrow in figure 1 of Allen et al. 1991."""

from pydrake.systems.framework import Diagram, DiagramBuilder, InputPort, OutputPort, System

Connection = tuple[str, str, str, str]
"""(subsystem, name of its output port, subsystem, name of its input port)."""
BETWEEN_SUBSYSTEMS: tuple[Connection, ...] = (
    ("vision", "point", "host", "point"),
    ("host", "prediction", "link", "packet"),
    ("link", "delivered", "arm", "packet"),
)
"""Connections between subsystems whose two ports have different names."""


WITH_TRACKS: tuple[Connection, ...] = (
    ("vision", "tracks", "host", "tracks"),
    ("host", "expected", "vision", "expected"),
    *BETWEEN_SUBSYSTEMS[1:],
)
"""The same with a vision that tracks several objects: the host tells it where it expects those that are not seen."""
WITH_MEASURED_TRACKS: tuple[Connection, ...] = (WITH_TRACKS[0], *BETWEEN_SUBSYSTEMS[1:])
"""The same with a measured vision of several objects, which searches for nothing."""

WITH_HAND_POINT: tuple[Connection, ...] = (
    ("vision", "hand_point", "link", "hand_point"),
    ("link", "delivered_hand_point", "arm", "hand_point"),
)
"""Further connections of a vision that sees the hand (`LinkDiagram` as the link)."""
WITH_WRIST: tuple[Connection, ...] = (("host", "prediction", "vision", "prediction"),)
"""Further connections of a camera on the hand: the host tells vision where it expects the target."""

WITH_ORDERS: tuple[Connection, ...] = (
    ("vision", "parts", "host", "parts"),
    ("arm", "diagnosis", "host", "diagnosis"),
    ("arm", "status", "host", "status"),
    *BETWEEN_SUBSYSTEMS[1:],
    ("host", "order", "link", "order"),
    ("link", "delivered_order", "arm", "order"),
)
"""Connections of a host that gives orders to the arm, which reports what it does (`LinkDiagram` as the link)."""
WITH_ENCODER: tuple[Connection, ...] = (("world", "encoder", "host", "encoder"),)
"""Further connections of a belt with an encoder."""

AT_LAUNCH: Connection = ("arm", "command", "world", "launch")
"""The connection of a world in which something happens when the hand begins to descend."""

SELECTED = "selected"
"""Name of the input of a vision that tracks several objects: the number of the track that the operator selected."""


FROM_THE_LINK = ("packet", "hand_point", "order")
"""Inputs of the arm that the link drives."""


class HandEyeDiagram(Diagram):
    """A hand-eye system: five subsystems, each a System, connected in the order in which data flows.

    .. pydrake_system::

        name: HandEyeDiagram
        input_ports:
        - operator
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
        - accepted
        - packet_report
        - target
        - command
        - status
        - diagnosis
        - goal
        - q_commanded
        - limiter_report
        - arm_state
        - arm_effort
        - jaws
        - truth_train_state
        - truth_verdict
        - truth_query

    ``operator`` is an `OperatorCommand`; unconnected, the operator only supervises. With a vision that tracks several
    objects there is the input ``selected``, the number of the track that the operator selected, and there are the
    outputs ``tracks``, ``regions_left``, ``regions_right`` and ``expected``.

    The block lists the ports of the train; every task has the ports of its own subsystems. A train with further objects
    also has ``truth_object_states``, and ``truth_judged`` where the judge watches several trains. A vision of several
    objects has ``tracks``, ``regions_left`` and ``regions_right`` as well, and its host ``expected``. If vision sees
    the hand, there are ``hand_point``, ``delivered_hand_point`` and ``hand_correction``. With a `PipelinedCamera` the
    ports ``camera_*``, ``motion_*`` and ``motion_images_*`` are ``world.image_latency`` cycles late.

    An output of the world is connected to the input of vision or arm with the same name, and an output of the arm to
    the input of the world with the same name. All outputs of subsystems, except those that drive the world, are outputs
    of the Diagram, for logs, pictures and judges. An input of the arm that no subsystem drives is an input of the
    Diagram. Messages, units and periods of the ports are those of the subsystems. Ports named ``truth_*`` carry ground
    truth: they lead out of the Diagram, never back into it.

    With `MeasuredVisionDiagram` as vision there are no cameras, and the outputs from ``camera_*`` to ``centroid_*`` do
    not exist. In place of the images, one connection carries the train's true state to this diagram only.

    Args:
        world: a Diagram with the ports of the sensors, such as `WorldDiagram`.
        vision: a `VisionDiagram`, `MeasuredVisionDiagram` or `BoardVisionDiagram`.
        host: an `EstimatorSystem`.
        link: a `LinkSystem`, or a `LinkDiagram` for a vision that sees the hand.
        arm: an `ArmDiagram`.
        connections: connections between ports with different names.

    Attributes:
        world: the world.
        vision: the vision.
        host: the host.
        link: the link.
        arm: the arm.
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
                elif (to is arm and port.get_name() not in FROM_THE_LINK) or port.get_name() == SELECTED:
                    builder.ExportInput(port, port.get_name())
        driving = {port.get_name() for port in inputs(world)}
        for subsystem in subsystems.values():
            for port in outputs(subsystem):
                if port.get_name() not in driving:
                    builder.ExportOutput(port, port.get_name())
        builder.BuildInto(self)


def has_images(hand_eye: Diagram) -> bool:
    """Returns whether the vision of a `HandEyeDiagram` reads images.

    It does not if vision is measured, or if the images are processed in another process.
    """
    return hand_eye.HasOutputPort("motion_left") or hand_eye.HasOutputPort("motion")


def has_tracks(hand_eye: Diagram) -> bool:
    """Returns whether the vision of a `HandEyeDiagram` tracks several objects."""
    return hand_eye.HasOutputPort("tracks")


def inputs(system: System) -> list[InputPort]:
    """Returns the input ports of a System."""
    return [system.get_input_port(index) for index in range(system.num_input_ports())]


def outputs(system: System) -> list[OutputPort]:
    """Returns the output ports of a System."""
    return [system.get_output_port(index) for index in range(system.num_output_ports())]
