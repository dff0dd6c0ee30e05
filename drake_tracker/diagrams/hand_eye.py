"""The wiring of a hand-eye system: one connection for each arrow in figure 1 of Allen et al. 1991."""

from pydrake.systems.framework import Diagram, DiagramBuilder, InputPort, OutputPort, System

Controller = tuple[System, System, Diagram]
"""Host, link and arm, connected to each other."""
SELECTED = "selected"
"""Name of the input of a vision that tracks several objects: the number of the track that the operator selected."""


def connect(builder: DiagramBuilder, source: System, target: System, **renamed: str) -> None:
    """Connects one subsystem to another: each output to the input with the same name.

    Args:
        builder: of the diagram to which both belong.
        source: the subsystem with the outputs.
        target: the subsystem with the inputs.
        **renamed: {name of an output: name of the input to which it leads}, for those with two names.
    """
    for port in outputs(source):
        name = renamed.get(port.get_name(), port.get_name())
        if target.HasInputPort(name):
            builder.Connect(port, target.GetInputPort(name))


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

    The block lists the ports of the train. In every task, the ports are the ports of its subsystems. A train with
    further objects also has ``truth_object_states``, and ``truth_judged`` where the judge watches several trains. A
    vision of several objects has ``tracks``, ``regions_left`` and ``regions_right`` as well, and its host ``expected``.
    If vision sees the hand, there are ``hand_point``, ``delivered_hand_point`` and ``hand_correction``. With a
    `PipelinedCamera` the ports ``camera_*``, ``motion_*`` and ``motion_images_*`` are ``world.image_latency`` cycles
    late.

    All outputs of subsystems, except those that drive the world, are outputs of the Diagram, for logs, pictures and
    judges. The subsystems define messages, units and periods of the ports. Ports named ``truth_*`` carry ground
    truth: they lead out of the Diagram, never back into it.

    With `MeasuredVisionDiagram` as vision there are no cameras, and the outputs from ``camera_*`` to ``centroid_*`` do
    not exist. In place of the images, one connection carries the train's true state to this diagram only.

    Args:
        builder: holds the five subsystems, connected (see `connect`).
        world: a Diagram with the ports of the sensors, such as `WorldDiagram`.
        vision: a `VisionDiagram`, `MeasuredVisionDiagram` or `BoardVisionDiagram`.
        host: an `EstimatorSystem`.
        link: a `LinkSystem`, or a `LinkDiagram` for a vision that sees the hand.
        arm: an `ArmDiagram`.

    Attributes:
        world: the world.
        vision: the vision.
        host: the host.
        link: the link.
        arm: the arm.
    """

    def __init__(
        self, builder: DiagramBuilder, *, world: Diagram, vision: Diagram, host: System, link: System, arm: Diagram
    ) -> None:
        super().__init__()
        self.set_name("hand_eye")
        self.world, self.vision, self.host, self.link, self.arm = world, vision, host, link, arm
        for subsystem, name in ((vision, SELECTED), (arm, "operator")):
            if subsystem.HasInputPort(name):
                builder.ExportInput(subsystem.GetInputPort(name), name)
        driving = {port.get_name() for port in inputs(world)}
        for subsystem in (world, vision, host, link, arm):
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
