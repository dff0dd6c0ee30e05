"""The visual edge of the transform graph as a System."""

from typing import Any

from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, LeafSystem, State

from drake_tracker.arm.arm_model import ArmModel
from drake_tracker.arm.hand_eye_correction import HandEyeCorrection, HandEyeCorrectionState
from drake_tracker.core.frozen_state import declare_outputs
from drake_tracker.core.messages import HandCorrection, HandPoint, ServoTarget, message_size
from drake_tracker.core.timing import GUARD_SLOT, TIME_STEP, VISION_PERIOD, vision_slot


class HandEyeCorrectionSystem(LeafSystem):
    """Corrects the target of the hand by the cameras' measurements of the hand.

    .. pydrake_system::

        name: HandEyeCorrectionSystem
        input_ports:
        - hand_point
        - arm_state
        - target
        output_ports:
        - corrected
        - hand_correction

    - ``hand_point``: the newest `HandPoint` on the link. All zeros: none has arrived.
    - ``arm_state``: measured joint positions and velocities, 2 n values [rad, rad/s], read with the images.
    - ``target``: the `ServoTarget` as vision has it.
    - ``corrected``: the same, with the correction. It follows ``target`` at once.
    - ``hand_correction``: a `HandCorrection`, for logs.

    The correction is state, updated every vision period in the slot of the guard, after the link.

    Args:
        edge: the arithmetic.
        model: the arm.
        time_step: the plant's step [s], of which the slot is a fraction.
        period: of a cycle of vision [s].
    """

    def __init__(
        self, edge: HandEyeCorrection, model: ArmModel, time_step: float = TIME_STEP, period: float = VISION_PERIOD
    ) -> None:
        super().__init__()
        self._edge, self._model = edge, model
        self._hand_point = self.DeclareVectorInputPort("hand_point", message_size(HandPoint))
        self._arm_state = self.DeclareVectorInputPort("arm_state", 2 * model.num_joints)
        self._target = self.DeclareVectorInputPort("target", message_size(ServoTarget))
        self._state = self.DeclareAbstractState(AbstractValue.Make(edge.initial_state()))
        tickets = {self.abstract_state_ticket(self._state), self._target.ticket()}
        self.DeclareVectorOutputPort("corrected", message_size(ServoTarget), self._calc_corrected, tickets)
        declare_outputs(self, self._state, {"hand_correction": (HandCorrection, edge.report)})
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._remember)
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, vision_slot(GUARD_SLOT, time_step), self._update)

    def _remember(self, context: Context, state: State) -> None:
        p_WT = self._model.tool_pose(self._arm_state.Eval(context)[: self._model.num_joints]).translation()
        self._set(state, self._edge.remember(self._value(context), context.get_time(), p_WT))

    def _update(self, context: Context, state: State) -> None:
        self._set(state, self._edge.update(self._value(context), context.get_time(), self._hand_point.Eval(context)))

    def _calc_corrected(self, context: Context, output: Any) -> None:
        output.SetFromVector(self._edge.shifted(self._value(context), self._target.Eval(context)))

    def _value(self, context: Context) -> HandEyeCorrectionState:
        return context.get_abstract_state(int(self._state)).get_value()

    def _set(self, state: State, value: HandEyeCorrectionState) -> None:
        state.get_mutable_abstract_state(int(self._state)).set_value(value)
