"""Builds the diagram of a replay from a recording."""

from collections.abc import Mapping

import numpy as np
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, DiscreteValues, LeafSystem, System

from drake_tracker.arm.motion.servo_system import make_servo_system
from drake_tracker.arm.safety.packet_guard_system import make_packet_guard_system
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.log import Signal
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.diagrams.hand_eye import SELECTED, inputs, outputs
from drake_tracker.footage.frame_clock import FrameClock
from drake_tracker.footage.frame_sequence import FrameSequence
from drake_tracker.footage.sources import open_footage
from drake_tracker.footage.video_source_system import VideoSource
from drake_tracker.replay.recording import Recording
from drake_tracker.run.camera_images import image_file
from drake_tracker.run.log_recorder import OPERATOR
from drake_tracker.vision.several_vision_diagram import HAND_DISPLACEMENTS

_SAME_INSTANT = 1e-9
"""Times that differ by less count as equal [s]."""
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
    recorded reports of the arm, ``diagnosis`` and ``status``. Messages and periods are as in the run. The servo reads
    the recorded ``command``, so that the hand moves and stops using vision as in the run.

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


class LogSourceSystem(LeafSystem):
    """Outputs the logged values of a port, and changes when the port changed in the run.

    .. pydrake_system::

        name: LogSourceSystem
        output_ports:
        - signal

    - ``signal``: the recorded message, updated every period at the offset.

    A sample of a log at time t is the value of the port before the updates at that instant. The original System was
    updated in its slot of the previous period. This System is updated in the same slot and then outputs the next sample
    of the log, so that a System that reads it in another slot reads the same value as in the run. After the last sample
    the output stays constant. The output is state; there is no direct feedthrough.

    Args:
        signal: the recorded signal, with at least one sample.
        period: period of the original System's updates [s].
        offset: time of its first update [s].
    """

    def __init__(self, signal: Signal, period: float, offset: float = 0.0) -> None:
        super().__init__()
        self._times, self._data = signal.times, signal.data
        state = self.DeclareDiscreteState(self._data[0])
        self.DeclareStateOutputPort("signal", state)
        self.DeclarePeriodicDiscreteUpdateEvent(period, offset, self._update)

    def _update(self, context: Context, discrete_state: DiscreteValues) -> None:
        following = np.searchsorted(self._times, context.get_time() + _SAME_INSTANT, side="right")
        discrete_state.set_value(self._data[min(following, len(self._times) - 1)])


def make_replay_diagram(recording: Recording) -> ReplayDiagram:
    """Returns the diagram of a replay.

    Args:
        recording: the recording, with the settings of the replay.

    Raises DrakeTrackerError when a file that the replay needs is missing, incomplete, or belongs to another run.
    """
    scenario, task = recording.scenario, recording.task
    parts = task.rebuild(scenario, recording.recorded, recording.start, recording.folder)
    sources = {name: (_log_source(recording, name), "signal") for name in (*recording.sources, "command")}
    sources |= {name: (_video_source(recording, name, size), "image") for name, size in parts.images.items()}
    selected = _selected(recording)
    if selected is not None and parts.vision is not None and parts.vision.HasInputPort(SELECTED):
        sources[SELECTED] = (selected, "signal")
    servo = make_servo_system(scenario.servo, scenario.time_step, task.servo_period)
    servo.set_name("servo")
    guard = make_packet_guard_system(parts.guard, scenario.time_step)
    return ReplayDiagram(sources, parts.vision, parts.host, parts.link, guard, servo)


def _selected(recording: Recording) -> LogSourceSystem | None:
    """Returns the source of the objects that the operator selected as targets, None for a run without an operator."""
    commands = recording.log.get(OPERATOR)
    if commands is None or SELECTED not in commands.names or not len(commands.times):
        return None
    return LogSourceSystem(Signal(commands.times, commands.view(SELECTED), (SELECTED,)), VISION_PERIOD)


def _log_source(recording: Recording, name: str) -> LogSourceSystem:
    """Returns the source of a logged signal, which is updated in the slot of the System that made the signal."""
    task = recording.task
    period = task.signals()[name][0]
    return LogSourceSystem(recording.log[name], period, task.signal_offset(name, recording.scenario.time_step))


def _video_source(recording: Recording, name: str, size: tuple[int, int]) -> VideoSource:
    """Returns the source of the recorded images of a camera.

    Args:
        recording: the recording.
        name: name of the camera.
        size: (width, height) that the vision expects [px].

    Raises DrakeTrackerError when the images are missing, incomplete, or of another size.
    """
    path = image_file(recording.folder, name)
    if not path.is_file():
        raise DrakeTrackerError(f"{path}: the images of this camera are missing")
    footage = open_footage(str(path), fps=1.0 / VISION_PERIOD)
    if footage.size != tuple(size):
        raise DrakeTrackerError(
            f"{path}: the images have {footage.size} px, but the vision of the run needs {tuple(size)} px"
        )
    cycles = round(recording.end / VISION_PERIOD)
    count = 0 if footage.times is None else len(footage.times)
    if count < cycles:
        raise DrakeTrackerError(f"{path}: it has only {count} of {cycles} images; it is incomplete")
    return VideoSource(FrameSequence(footage, FrameClock(VISION_PERIOD)), VISION_PERIOD)
