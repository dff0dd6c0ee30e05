"""From set-points every 30 ms to a smooth reference at every plant step."""

import numpy as np
from pydrake.systems.framework import LeafSystem

from drake_tracker.core.timing import SERVO_PERIOD

SPLINE_DELAY = 1.5
"""Periods from the sampling of a set-point to the instant at which the reference passes it."""


class SetPointSplineSystem(LeafSystem):
    """A quadratic B-spline through the last three set-points: position and velocity without steps.

    Drake's `StateInterpolatorWithDiscreteDerivative` passes positions on as a staircase, on which a stiff joint servo
    spends all its torque.

    .. pydrake_system::

        name: SetPointSplineSystem
        input_ports:
        - set_point
        output_ports:
        - desired_state
        - desired_acceleration

    ``set_point`` (n) is sampled on the grid of the period. ``desired_state`` (q, v) and ``desired_acceleration`` are
    the spline: a motion of constant speed comes out `SPLINE_DELAY` periods late and otherwise unchanged.

    Args:
      initial: the set-point (n,) held before the first sample.
    """

    def __init__(self, initial, period=SERVO_PERIOD):
        super().__init__()
        initial = np.asarray(initial, dtype=float)
        n = self._n = len(initial)
        self._period = period
        self._set_point = self.DeclareVectorInputPort("set_point", n)
        # The three newest set-points, oldest first, and the time at which the newest was sampled.
        state = self.DeclareDiscreteState(np.concatenate([initial, initial, initial, [0.0]]))
        from_state = {self.discrete_state_ticket(state)}
        self.DeclareVectorOutputPort("desired_state", 2 * n, self._calc_state, from_state | {self.time_ticket()})
        self.DeclareVectorOutputPort("desired_acceleration", n, self._calc_acceleration, from_state)
        # Unrestricted, since the plant's step at the same instant is a discrete one: it comes after, and reads the new
        # spline, whichever of the two times is the less by a rounding.
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._update)

    def _update(self, context, state):
        old = context.get_discrete_state_vector().value()
        new = np.concatenate([old[self._n : 3 * self._n], self._set_point.Eval(context), [context.get_time()]])
        state.get_mutable_discrete_state().get_mutable_vector(0).SetFromVector(new)

    def _calc_state(self, context, output):
        a, b, c, sampled = self._points(context)
        t = min((context.get_time() - sampled) / self._period, 1.0)
        step, bow = b - a, a - 2.0 * b + c
        q = 0.5 * (a + b) + t * step + 0.5 * t * t * bow
        v = (step + t * bow) / self._period
        output.SetFromVector(np.concatenate([q, v]))

    def _calc_acceleration(self, context, output):
        a, b, c, _ = self._points(context)
        output.SetFromVector((a - 2.0 * b + c) / self._period**2)

    def _points(self, context):
        state, n = context.get_discrete_state_vector().value(), self._n
        return state[:n], state[n : 2 * n], state[2 * n : 3 * n], state[3 * n]
