"""The wiring of a replay: recorded sources, then the run's own vision, host, link and servo."""

from collections.abc import Mapping

from pydrake.systems.framework import Diagram, DiagramBuilder, System

from drake_tracker.diagrams.hand_eye import inputs, outputs

UNLOGGED = ("motion", "held_packet")
"""Beginnings of the names of outputs that no log holds."""


class ReplayDiagram(Diagram):
    """The controller of a run without the hand, behind what was recorded of the run.

    .. pydrake_system::

        name: ReplayDiagram
        output_ports:
        - centroid_left
        - centroid_right
        - point
        - filtered
        - prediction
        - delivered
        - target

    The outputs are those of `HandEyeDiagram` that are computed anew; of which there are the fewer, the later the replay
    begins. The servo reads the recorded ``command``: where the hand was, and when it no longer used vision, is as it
    was in the run.

    Args:
      sources: {name of the port replaced: (System, name of its output)}; with ``command``, and ``point`` or what
        ``vision`` reads. vision: from these to ``point``, a System, or None.
      host: `EstimatorSystem`. link: a link System. servo: `ServoSystem`.
    """

    def __init__(
        self,
        sources: Mapping[str, tuple[System, str]],
        vision: System | None,
        host: System,
        link: System,
        servo: System,
    ) -> None:
        super().__init__()
        self.set_name("replay")
        builder = DiagramBuilder()
        ports = {}
        for name, (system, port) in sources.items():
            system.set_name(f"recorded_{name}")
            builder.AddSystem(system)
            ports[name] = system.GetOutputPort(port)
        for system, packet in ((vision, None), (host, None), (link, "prediction"), (servo, "delivered")):
            if system is None:
                continue
            builder.AddSystem(system)
            for port in inputs(system):
                builder.Connect(ports[packet if packet and port.get_name() == "packet" else port.get_name()], port)
            for port in outputs(system):
                ports[port.get_name()] = port
                if not port.get_name().startswith(UNLOGGED):
                    builder.ExportOutput(port, port.get_name())
        builder.BuildInto(self)
