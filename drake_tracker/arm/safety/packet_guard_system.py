"""The receiver of the link as a System."""

from typing import Any

from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, LeafSystem, State

from drake_tracker.arm.safety.packet_guard import GuardState, PacketGuard
from drake_tracker.core.frozen_state import declare_outputs
from drake_tracker.core.messages import PacketReport, Prediction, message_size
from drake_tracker.core.timing import GUARD_SLOT, TIME_STEP, VISION_PERIOD, vision_slot


class PacketGuardSystem(LeafSystem):
    """Rejects and counts packets that the arm must not follow.

    .. pydrake_system::

        name: PacketGuardSystem
        input_ports:
        - packet
        output_ports:
        - accepted
        - packet_report

    - ``packet``: the newest `Prediction` on the link. All zeros: none has arrived.
    - ``accepted``: the newest `Prediction` that broke no rule: that on the link, or an earlier one. All zeros: none
      yet. It is computed when it is read, so that a packet is available as soon as it arrives.
    - ``packet_report``: a `PacketReport`, for logs. It is state, updated every vision period in the slot of the guard,
      which follows that of the link.

    A packet that is on the link again, or that is replaced before the guard looks at it, is not counted.

    Args:
        guard: the arithmetic.
        time_step: the plant's step [s], of which the slot is a fraction.
        period: period at which packets are counted [s].
    """

    def __init__(self, guard: PacketGuard, time_step: float = TIME_STEP, period: float = VISION_PERIOD) -> None:
        super().__init__()
        self._guard = guard
        self._packet = self.DeclareVectorInputPort("packet", message_size(Prediction))
        self._state = self.DeclareAbstractState(AbstractValue.Make(guard.initial_state()))
        tickets = {self.abstract_state_ticket(self._state), self._packet.ticket(), self.time_ticket()}
        self.DeclareVectorOutputPort("accepted", message_size(Prediction), self._calc_accepted, tickets)
        declare_outputs(self, self._state, {"packet_report": (PacketReport, guard.report)})
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, vision_slot(GUARD_SLOT, time_step), self._update)

    def _update(self, context: Context, state: State) -> None:
        new = self._guard.update(self._value(context), context.get_time(), self._packet.Eval(context))
        state.get_mutable_abstract_state(int(self._state)).set_value(new)

    def _calc_accepted(self, context: Context, output: Any) -> None:
        packet = self._packet.Eval(context)
        output.SetFromVector(self._guard.accepted(self._value(context), context.get_time(), packet))

    def _value(self, context: Context) -> GuardState:
        return context.get_abstract_state(int(self._state)).get_value()


def make_packet_guard_system(guard: PacketGuard, time_step: float = TIME_STEP) -> PacketGuardSystem:
    """Returns the System of a receiver, named "packet_guard".

    Args:
        guard: the arithmetic.
        time_step: the plant's step [s].
    """
    system = PacketGuardSystem(guard, time_step)
    system.set_name("packet_guard")
    return system
