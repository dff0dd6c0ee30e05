"""The wiring of a replay: recorded sources, followed by vision, host, link, packet guard and servo."""

from collections.abc import Mapping

from pydrake.systems.framework import Diagram, DiagramBuilder, System

from drake_tracker.diagrams.hand_eye import SELECTED, inputs, outputs
from drake_tracker.vision.several_vision_diagram import HAND_DISPLACEMENTS

UNLOGGED = ("motion", "accepted", "held_packet", "expected")
"""First parts of the names of outputs that are not logged."""
OPTIONAL = (SELECTED, *HAND_DISPLACEMENTS)
"""Inputs that may be left unconnected: no operator took part in the run, or a replay does not see the hand."""


class ReplayDiagram(Diagram):
    """The controller of a run without the hand, driven by recorded signals.

    .. pydrake_system::

        name: ReplayDiagram
        output_ports:
        - centroid_left
        - centroid_right
        - point
        - filtered
        - prediction
        - delivered
        - packet_report
        - target

    The outputs are the ports of `HandEyeDiagram` with the same names, as far as they are computed again: with vision
    the centroids and points, otherwise from ``filtered`` on. A vision of several objects also has ``tracks`` and
    ``regions_*``, and reads what its host expects. The host of the conveyor has ``order`` and ``belt``, and reads the
    recorded reports of the arm, ``diagnosis`` and ``status``. Messages and periods are those of the run. The servo
    reads the recorded ``command``, so that the hand moves and stops using vision as in the run.

    Args:
        sources: {name of the replaced port: (System, name of its output port)}. They include ``command``, and either
            ``point``, ``tracks`` or ``parts``, which the host reads, or the inputs of ``vision``; its input
            ``selected`` may be missing.
        vision: System with these inputs and the output that the host reads, or None.
        host: an `EstimatorSystem`, an `EstimatorBankSystem`, or a `PickHostSystem`.
        link: a `LinkSystem` or a `LinkDiagram`.
        guard: a `PacketGuardSystem`.
        servo: a `ServoSystem`.
    """

    def __init__(
        self,
        sources: Mapping[str, tuple[System, str]],
        vision: System | None,
        host: System,
        link: System,
        guard: System,
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
        packets = {link: "prediction", guard: "delivered", servo: "accepted"}
        systems = [system for system in (vision, host, link, guard, servo) if system is not None]
        for system in systems:
            builder.AddSystem(system)
            ports |= {port.get_name(): port for port in outputs(system)}
        for system in systems:
            for port in inputs(system):
                name = port.get_name()
                if name in OPTIONAL and name not in ports:
                    continue
                builder.Connect(ports[packets[system] if name == "packet" else name], port)
            for port in outputs(system):
                if not port.get_name().startswith(UNLOGGED):
                    builder.ExportOutput(port, port.get_name())
        builder.BuildInto(self)
