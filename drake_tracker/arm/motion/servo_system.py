"""The trajectory generator's high-priority task as a System."""

from operator import attrgetter

from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, DiagramBuilder, LeafSystem, OutputPort, State

from drake_tracker.arm.config import ServoConfig
from drake_tracker.arm.motion.servo import Servo
from drake_tracker.arm.motion.set_point_spline_system import SPLINE_DELAY
from drake_tracker.core.frozen_state import declare_outputs
from drake_tracker.core.messages import ArmCommand, Frozen, Prediction, ServoTarget, message_size
from drake_tracker.core.timing import SERVO_PERIOD, SERVO_SLOT, TIME_STEP, servo_slot


class ServoSystem(LeafSystem):
    """Provides the object's pose at the servo rate, whether or not packets arrive.

    .. pydrake_system::

        name: ServoSystem
        input_ports:
        - packet
        - command
        output_ports:
        - target
        - held_packet

    - ``packet``: the newest `Prediction` on the link. All zeros: none has arrived.
    - ``command``: an `ArmCommand`, of which only ``frozen`` is read. All zeros: the arm is free to follow every packet.
    - ``target``: the `ServoTarget` at the instant for which the set-point is due. All zeros, hence not valid: no packet
      has been used yet.
    - ``held_packet``: the `Prediction` that is followed. All zeros: none yet.

    Both outputs are state, updated every period in the servo's slot.

    Args:
        servo: the arithmetic.
        time_step: the plant's step [s], of which the slot is a fraction.
        period: period of the set-points [s].
    """

    def __init__(self, servo: Servo, time_step: float = TIME_STEP, period: float = SERVO_PERIOD) -> None:
        super().__init__()
        self._servo = servo
        self._packet = self.DeclareVectorInputPort("packet", message_size(Prediction))
        self._command = self.DeclareVectorInputPort("command", message_size(ArmCommand))
        self._state = self.DeclareAbstractState(AbstractValue.Make(servo.initial_state()))
        held_packet = (Prediction, attrgetter("packet"))
        declare_outputs(self, self._state, {"target": (ServoTarget, servo.target), "held_packet": held_packet})
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, servo_slot(SERVO_SLOT, time_step, period), self._update)

    def _update(self, context: Context, state: State) -> None:
        frozen = Frozen(int(ArmCommand(self._command.Eval(context)).frozen))
        old = context.get_abstract_state(int(self._state)).get_value()
        new = self._servo.update(old, context.get_time(), self._packet.Eval(context), frozen)
        state.get_mutable_abstract_state(int(self._state)).set_value(new)


def make_servo_system(
    settings: ServoConfig, time_step: float = TIME_STEP, period: float = SERVO_PERIOD, yaw: float | None = None
) -> ServoSystem:
    """Returns the System of a trajectory generator.

    A set-point computed in the servo's slot is sampled at the end of the period, and the spline passes it
    `SPLINE_DELAY` periods later.

    Args:
        settings: parameters of the filter.
        time_step: the plant's step [s].
        period: period of the set-points [s].
        yaw: as for `Servo`.
    """
    lead = (1.0 + SPLINE_DELAY) * period - servo_slot(SERVO_SLOT, time_step, period)
    return ServoSystem(Servo(settings, lead=lead, yaw=yaw), time_step, period)


def add_servo(
    builder: DiagramBuilder,
    *,
    settings: ServoConfig = ServoConfig(),
    packet: OutputPort | None = None,
    command: OutputPort | None = None,
    time_step: float = TIME_STEP,
    period: float = SERVO_PERIOD,
    yaw: float | None = None,
    name: str = "servo",
) -> ServoSystem:
    """Adds a trajectory generator to a diagram under construction, and returns it.

    Args:
        builder: the diagram's builder.
        settings: parameters of the filter.
        packet: output port of the newest packet on the link (`Prediction`); None leaves the input unconnected.
        command: output port of the command to the arm (`ArmCommand`); None leaves the input unconnected.
        time_step: the plant's step [s].
        period: period of the set-points [s].
        yaw: as for `Servo`.
        name: name of the System.
    """
    servo = builder.AddNamedSystem(name, make_servo_system(settings, time_step, period, yaw))
    for source, port in ((packet, "packet"), (command, "command")):
        if source is not None:
            builder.Connect(source, servo.GetInputPort(port))
    return servo
