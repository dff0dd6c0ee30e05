"""Differential inverse kinematics as a System."""

from collections.abc import Sequence

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context, DiscreteValues, LeafSystem

from drake_tracker.arm.arm_model import ArmModel
from drake_tracker.arm.motion.differential_ik import limit_acceleration, make_parameters, step_joints
from drake_tracker.core.timing import IK_SLOT, SERVO_PERIOD, TIME_STEP, servo_slot


class DifferentialIkSystem(LeafSystem):
    """Turns desired tool poses into joint set-points within the limits of position, speed and torque.

    .. pydrake_system::

        name: DifferentialIkSystem
        input_ports:
        - X_WT_desired
        - q_last
        output_ports:
        - q_commanded

    - ``X_WT_desired``: the desired pose of the tool, a RigidTransform; it is always valid.
    - ``q_last``: the set-point that the joints really received last, n values [rad]. Unconnected: the last
      ``q_commanded``.
    - ``q_commanded``: joint set-points, n values [rad], for the same instant as the pose: `SPLINE_DELAY` periods after
      the set-point is sampled. It is state, updated every period in the last slot of the servo.

    The set-point integrates from ``q_initial``, through ``q_last``, and never reads the measured joints: the joint
    servo closes that loop.

    Args:
        model: the arm.
        q_initial: joint set-points at the start, shape (n,) [rad].
        time_step: the plant's step [s], of which the slot is a fraction.
        period: period of the set-points [s].
    """

    def __init__(
        self,
        model: ArmModel,
        q_initial: Sequence[float] | np.ndarray,
        time_step: float = TIME_STEP,
        period: float = SERVO_PERIOD,
    ) -> None:
        super().__init__()
        self._model = model
        self._parameters = make_parameters(model, period)
        self._pose = self.DeclareAbstractInputPort("X_WT_desired", AbstractValue.Make(RigidTransform()))
        self._last = self.DeclareVectorInputPort("q_last", len(q_initial))
        set_point = self.DeclareDiscreteState(q_initial)
        self.DeclareDiscreteState(len(q_initial))  # velocity of the last step [rad/s]
        self.DeclareStateOutputPort("q_commanded", set_point)
        offset = servo_slot(IK_SLOT, time_step, period)
        self.DeclarePeriodicDiscreteUpdateEvent(period, offset, self._update)

    def _update(self, context: Context, next_state: DiscreteValues) -> None:
        q, v_last = (context.get_discrete_state(group).value() for group in (0, 1))
        if self._last.HasValue(context):
            q_last = self._last.Eval(context)
            v_last = v_last + (q_last - q) / self._parameters.get_time_step()
            q = q_last
        q_next, _ = step_joints(self._model, self._parameters, q, self._pose.Eval(context))
        q_next, v = limit_acceleration(self._model, self._parameters, q, v_last, q_next)
        next_state.set_value(0, q_next)
        next_state.set_value(1, v)
