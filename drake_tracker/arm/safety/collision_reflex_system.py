"""The reflex of the arm on a collision as a System."""

from typing import Any

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, LeafSystem, State

from drake_tracker.arm.arm_model import ArmModel
from drake_tracker.arm.safety.collision_reflex import CollisionReflex, ReflexState
from drake_tracker.core.timing import REFLEX_SLOT, TIME_STEP


class CollisionReflexSystem(LeafSystem):
    """Tells the joints to hold still for a moment when a drive pushes against something with all its torque.

    .. pydrake_system::

        name: CollisionReflexSystem
        input_ports:
        - arm_state
        - arm_effort
        output_ports:
        - hold

    - ``arm_state``: measured joint positions and velocities, 2 n values [rad, rad/s].
    - ``arm_effort``: torques of the drives, n values [N m]. Unconnected: there is no reflex.
    - ``hold``: 1 while the joints shall hold still, and where, 1 + n values [rad]; all zeros before the first time. It
      is state, updated every plant step in the slot of the reflex.

    Args:
        model: the arm.
        time_step: the plant's step [s], the period of the samples.
    """

    def __init__(self, model: ArmModel, time_step: float = TIME_STEP) -> None:
        super().__init__()
        n = self._n = model.num_joints
        self._reflex = CollisionReflex(model, time_step)
        self._arm_state = self.DeclareVectorInputPort("arm_state", 2 * n)
        self._effort = self.DeclareVectorInputPort("arm_effort", n)
        self._state = self.DeclareAbstractState(AbstractValue.Make(self._reflex.initial_state()))
        self.DeclareVectorOutputPort("hold", 1 + n, self._calc_hold, {self.abstract_state_ticket(self._state)})
        self.DeclarePeriodicUnrestrictedUpdateEvent(time_step, REFLEX_SLOT * time_step, self._update)

    def _update(self, context: Context, state: State) -> None:
        if not self._effort.HasValue(context):
            return
        old = self._value(context)
        arm_state = self._arm_state.Eval(context)
        q, v = arm_state[: self._n], arm_state[self._n :]
        new = self._reflex.update(old, context.get_time(), q, v, self._effort.Eval(context))
        if new is not old:
            state.get_mutable_abstract_state(int(self._state)).set_value(new)

    def _calc_hold(self, context: Context, output: Any) -> None:
        state = self._value(context)
        output.SetFromVector(np.concatenate([[float(state.held)], state.q_hold]))

    def _value(self, context: Context) -> ReflexState:
        return context.get_abstract_state(int(self._state)).get_value()
