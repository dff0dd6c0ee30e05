"""A machine of the hand as a System: the common part of the systems of grasping, catching and picking."""

from collections.abc import Callable, Mapping
from typing import Any, Protocol

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, LeafSystem, State

from drake_tracker.core.frozen_state import declare_outputs
from drake_tracker.core.messages import OperatorCommand, message_size
from drake_tracker.core.timing import GRASP_SLOT, servo_slot


class Machine(Protocol):
    """The arithmetic of a `MachineSystem`."""

    def initial_state(self) -> Any:
        """Returns the state before the first tick."""
        ...

    def update(self, state: Any, seen: Any) -> Any:
        """Returns the state after a tick."""
        ...


class MachineSystem(LeafSystem):
    """Runs a machine every period in the slot of the grasp machine, which follows the slot of the servo.

    .. pydrake_system::

        name: MachineSystem
        input_ports:
        - (the inputs)
        - operator
        output_ports:
        - (the outputs)

    ``operator``: an `OperatorCommand`. All zeros, or left unconnected: the operator only supervises. All outputs are
    functions of the state alone.

    Args:
        machine: the arithmetic.
        observation: class of what the machine sees at a tick: its fields are ``time`` and the names of the inputs.
        inputs: {name: named view of the message, or the number of elements of a vector}.
        outputs: as for `declare_outputs`.
        time_step: the plant's step [s], of which the slot is a fraction.
        period: period of the set-points [s].
    """

    def __init__(
        self,
        machine: Machine,
        observation: Callable[..., Any],
        inputs: Mapping[str, Any],
        outputs: Mapping[str, tuple[Any, Callable[[Any], Any]]],
        time_step: float,
        period: float,
    ) -> None:
        super().__init__()
        self._machine, self._observation = machine, observation
        self._inputs = {**inputs, "operator": OperatorCommand}
        self._ports = {name: self.DeclareVectorInputPort(name, _size(view)) for name, view in self._inputs.items()}
        self._state = self.DeclareAbstractState(AbstractValue.Make(machine.initial_state()))
        declare_outputs(self, self._state, outputs)
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, servo_slot(GRASP_SLOT, time_step, period), self._update)

    def _update(self, context: Context, state: State) -> None:
        seen = {}
        for name, view in self._inputs.items():
            port = self._ports[name]
            optional = name == "operator" and not port.HasValue(context)
            vector = np.zeros(port.size()) if optional else np.array(port.Eval(context))
            seen[name] = vector if isinstance(view, int) else view(vector)
        before = context.get_abstract_state(int(self._state)).get_value()
        after = self._machine.update(before, self._observation(time=context.get_time(), **seen))
        state.get_mutable_abstract_state(int(self._state)).set_value(after)


def _size(view: Any) -> int:
    return view if isinstance(view, int) else message_size(view)
