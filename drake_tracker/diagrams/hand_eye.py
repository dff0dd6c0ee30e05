"""The wiring of a whole hand-eye system: one Connect for each arrow of the 1991 paper's figure 1."""

from pydrake.systems.framework import Diagram, DiagramBuilder

BETWEEN_ROOMS = (
    ("vision", "point", "host", "point"),
    ("host", "prediction", "link", "packet"),
    ("link", "delivered", "arm", "packet"),
)
"""Arrows from room to room whose two ends have names of their own."""


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

    That is the train's; every task has the ports of its own rooms. World and vision, and world and arm, are wired where
    a port of the one is called like a port of the other. All other outputs of the rooms are outputs of the diagram, for
    logs, pictures and judges; an input of the arm that no room answers is an input of the diagram. Ports named
    ``truth_*`` carry what only the simulator knows and lead out of the diagram, never back into it.

    With `MeasuredVisionDiagram` as vision there are no cameras: the outputs from ``camera_*`` to ``centroid_*`` do not
    exist, and in the place of the images one wire carries the train's true state to this stand-in, and to nothing else.

    Args:
      world: a Diagram with the sensors' ports (`WorldDiagram`). vision: `VisionDiagram` or `MeasuredVisionDiagram`.
      host: `EstimatorSystem`. link: a link System. arm: `ArmDiagram`.
      arrows: (room, output, room, input), of which the wires between rooms with different names of ports are made.
    """

    def __init__(self, world, vision, host, link, arm, arrows=BETWEEN_ROOMS):
        super().__init__()
        self.set_name("hand_eye")
        self.world, self.vision, self.host, self.link, self.arm = world, vision, host, link, arm
        rooms = {"world": world, "vision": vision, "host": host, "link": link, "arm": arm}
        builder = DiagramBuilder()
        for room in rooms.values():
            builder.AddSystem(room)
        for source, output, reader, input_ in arrows:
            builder.Connect(rooms[source].GetOutputPort(output), rooms[reader].GetInputPort(input_))
        for reader, source in ((vision, world), (arm, world), (world, arm)):
            for port in inputs(reader):
                if source.HasOutputPort(port.get_name()):
                    builder.Connect(source.GetOutputPort(port.get_name()), port)
                elif reader is arm and port.get_name() != "packet":
                    builder.ExportInput(port, port.get_name())
        driving = {port.get_name() for port in inputs(world)}
        for room in rooms.values():
            for port in outputs(room):
                if port.get_name() not in driving:
                    builder.ExportOutput(port, port.get_name())
        builder.BuildInto(self)


def inputs(system):
    """Returns the input ports of a System."""
    return [system.get_input_port(index) for index in range(system.num_input_ports())]


def outputs(system):
    """Returns the output ports of a System."""
    return [system.get_output_port(index) for index in range(system.num_output_ports())]
