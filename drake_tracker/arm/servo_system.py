"""The trajectory generator's high-priority task as a System."""

from pydrake.common.value import AbstractValue
from pydrake.systems.framework import LeafSystem

from drake_tracker.arm.servo import Servo
from drake_tracker.arm.set_point_spline_system import SPLINE_DELAY
from drake_tracker.core.messages import ArmCommand, Prediction, ServoTarget, message_size
from drake_tracker.core.timing import SERVO_PERIOD, SERVO_SLOT, TIME_STEP, servo_slot


class ServoSystem(LeafSystem):
    """Keeps the object's pose at the servo rate, whether or not packets arrive.

    .. pydrake_system::

        name: ServoSystem
        input_ports:
        - packet
        - command
        output_ports:
        - target
        - held_packet

    ``packet`` and ``held_packet`` are `Prediction` vectors, ``command`` an `ArmCommand` (its ``frozen`` field is read),
    ``target`` a `ServoTarget`. Updates every 30 ms in the servo's slot; both outputs are state.
    """

    def __init__(self, servo, time_step=TIME_STEP, period=SERVO_PERIOD):
        super().__init__()
        self._servo = servo
        self._packet = self.DeclareVectorInputPort("packet", message_size(Prediction))
        self._command = self.DeclareVectorInputPort("command", message_size(ArmCommand))
        self._state = self.DeclareAbstractState(AbstractValue.Make(servo.initial_state()))
        from_state = {self.abstract_state_ticket(self._state)}
        self.DeclareVectorOutputPort("target", message_size(ServoTarget), self._calc_target, from_state)
        self.DeclareVectorOutputPort("held_packet", message_size(Prediction), self._calc_held_packet, from_state)
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, servo_slot(SERVO_SLOT, time_step, period), self._update)

    def _update(self, context, state):
        frozen = bool(ArmCommand(self._command.Eval(context)).frozen)
        old = context.get_abstract_state(int(self._state)).get_value()
        new = self._servo.update(old, context.get_time(), self._packet.Eval(context), frozen)
        state.get_mutable_abstract_state(int(self._state)).set_value(new)

    def _calc_target(self, context, output):
        output.SetFromVector(self._servo.target(context.get_abstract_state(int(self._state)).get_value()))

    def _calc_held_packet(self, context, output):
        output.SetFromVector(context.get_abstract_state(int(self._state)).get_value().packet)


def make_servo_system(settings, time_step=TIME_STEP, period=SERVO_PERIOD):
    """Returns the `ServoSystem` of a scenario's part ``servo``; the plant's step and the set-points' period in [s].

    A set-point computed in the servo's slot is sampled at the end of the period, and passed a little later still.
    """
    lead = (1.0 + SPLINE_DELAY) * period - servo_slot(SERVO_SLOT, time_step, period)
    servo = Servo(settings.tracking_index, settings.yaw_tracking_index, settings.stale_after, lead=lead)
    return ServoSystem(servo, time_step, period)
