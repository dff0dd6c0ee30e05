"""Differential inverse kinematics as a System."""

from pydrake.common.value import AbstractValue
from pydrake.math import RigidTransform
from pydrake.systems.framework import LeafSystem

from drake_tracker.arm.differential_ik import limit_acceleration, make_parameters, step_joints
from drake_tracker.core.timing import IK_SLOT, SERVO_PERIOD, TIME_STEP, servo_slot


class DifferentialIkSystem(LeafSystem):
    """Turns desired tool poses into joint set-points within the limits of position, speed and torque.

    .. pydrake_system::

        name: DifferentialIkSystem
        input_ports:
        - X_WT_desired
        output_ports:
        - q_commanded

    ``X_WT_desired`` is a RigidTransform; ``q_commanded`` [rad] is the set-point of the same instant, `SPLINE_DELAY`
    periods after it is sampled. Updates every 30 ms in the last slot of the servo room. The set-point integrates from
    ``q_initial`` and never reads the measured joints: the joint servo closes that loop.
    """

    def __init__(self, model, q_initial, time_step=TIME_STEP, period=SERVO_PERIOD):
        super().__init__()
        self._model = model
        self._parameters = make_parameters(model, period)
        self._pose = self.DeclareAbstractInputPort("X_WT_desired", AbstractValue.Make(RigidTransform()))
        set_point = self.DeclareDiscreteState(q_initial)
        self.DeclareDiscreteState(len(q_initial))  # its speed in the last step [rad/s]
        self.DeclareStateOutputPort("q_commanded", set_point)
        offset = servo_slot(IK_SLOT, time_step, period)
        self.DeclarePeriodicDiscreteUpdateEvent(period, offset, self._update)

    def _update(self, context, next_state):
        q, v_last = (context.get_discrete_state(group).value() for group in (0, 1))
        q_next, _ = step_joints(self._model, self._parameters, q, self._pose.Eval(context))
        q_next, v = limit_acceleration(self._model, self._parameters, q, v_last, q_next)
        next_state.set_value(0, q_next)
        next_state.set_value(1, v)
