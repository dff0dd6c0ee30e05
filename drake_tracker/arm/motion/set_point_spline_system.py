"""From periodic set-points to a smooth reference at every plant step."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from pydrake.systems.controllers import InverseDynamics
from pydrake.systems.framework import Context, DiagramBuilder, LeafSystem, OutputPort, State

from drake_tracker.arm.arm_model import ArmModel
from drake_tracker.core.timing import SERVO_PERIOD

SPLINE_DELAY = 1.5
"""Periods from the sampling of a set-point to the instant at which the reference passes it."""


class SetPointSplineSystem(LeafSystem):
    """A quadratic B-spline of the last three set-points: position and velocity without steps.

    Drake's `StateInterpolatorWithDiscreteDerivative` holds positions between samples; a stiff joint servo spends all
    its torque on such steps.

    .. pydrake_system::

        name: SetPointSplineSystem
        input_ports:
        - set_point
        - hold
        output_ports:
        - desired_state
        - desired_acceleration

    - ``set_point``: n values [rad or m], sampled at the multiples of the period. It is always valid.
    - ``hold``: output of a `CollisionReflexSystem`. During a hold, the spline rests where the joints hold still;
      afterwards it begins at this place. Unconnected: never.
    - ``desired_state``: position and velocity of the spline, 2 n values [rad, rad/s or m, m/s], continuous in time. A
      motion with constant speed is delayed by `SPLINE_DELAY` periods and otherwise unchanged.
    - ``desired_acceleration``: acceleration of the spline, n values [rad/s^2 or m/s^2], constant during a period.

    Args:
        initial: the set-point held before the first sample, shape (n,).
        period: period of the set-points [s].
    """

    def __init__(self, initial: Sequence[float] | np.ndarray, period: float = SERVO_PERIOD) -> None:
        super().__init__()
        initial = np.asarray(initial, dtype=float)
        n = self._n = len(initial)
        self._period = period
        self._set_point = self.DeclareVectorInputPort("set_point", n)
        self._hold = self.DeclareVectorInputPort("hold", 1 + n)
        # The three newest set-points, oldest first, and the time at which the newest was sampled.
        state = self.DeclareDiscreteState(np.concatenate([initial, initial, initial, [0.0]]))
        from_state = {self.discrete_state_ticket(state), self._hold.ticket()}
        self.DeclareVectorOutputPort("desired_state", 2 * n, self._calc_state, from_state | {self.time_ticket()})
        self.DeclareVectorOutputPort("desired_acceleration", n, self._calc_acceleration, from_state)
        # An unrestricted update, since the plant's step at the same instant is a discrete update: that comes later and
        # reads the new spline, whichever of the two times is smaller by a rounding error.
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._update)

    def _update(self, context: Context, state: State) -> None:
        held = self._held(context)
        if held is None:
            old = context.get_discrete_state_vector().value()
            points = [old[self._n : 3 * self._n], self._set_point.Eval(context)]
        else:
            points = [held] * 3
        new = np.concatenate([*points, [context.get_time()]])
        state.get_mutable_discrete_state().get_mutable_vector(0).SetFromVector(new)

    def _calc_state(self, context: Context, output: Any) -> None:
        first, second, third, sampled = self._points(context)
        t = min((context.get_time() - sampled) / self._period, 1.0)
        q, v = [], []
        for a, b, c in zip(first, second, third):
            step, bow = b - a, a - 2.0 * b + c
            q.append(0.5 * (a + b) + t * step + 0.5 * t * t * bow)
            v.append((step + t * bow) / self._period)
        output.SetFromVector(q + v)

    def _calc_acceleration(self, context: Context, output: Any) -> None:
        *points, _ = self._points(context)
        square = self._period**2
        output.SetFromVector([(a - 2.0 * b + c) / square for a, b, c in zip(*points)])

    def _points(self, context: Context) -> tuple[list[float], list[float], list[float], float]:
        """Returns the three newest set-points, oldest first, and the time [s] at which the newest was sampled."""
        state, n = context.get_discrete_state_vector().value().tolist(), self._n  # floats: faster than small arrays
        held = self._held(context)
        if held is not None:
            return held, held, held, state[3 * n]
        return state[:n], state[n : 2 * n], state[2 * n : 3 * n], state[3 * n]

    def _held(self, context: Context) -> list[float] | None:
        """Returns where the joints hold still; None: they are free."""
        if not self._hold.HasValue(context):
            return None
        hold = self._hold.Eval(context)
        return hold[1:].tolist() if hold[0] else None


def add_joint_feedforward(
    builder: DiagramBuilder, *, model: ArmModel, desired_acceleration: OutputPort, name: str = "inverse_dynamics"
) -> InverseDynamics:
    """Adds Drake's `InverseDynamics` on the controller's own model of the arm, and returns it.

    It computes the torques for gravity, friction and the desired acceleration, so that the actuators' PD control only
    has to correct the errors. Its input port for the estimated state remains to be connected.

    Args:
        builder: the diagram's builder.
        model: the arm.
        desired_acceleration: output port of the desired joint accelerations, n values [rad/s^2].
        name: name of the System.
    """
    dynamics = builder.AddNamedSystem(
        name, InverseDynamics(model.plant, InverseDynamics.InverseDynamicsMode.kInverseDynamics)
    )
    builder.Connect(desired_acceleration, dynamics.get_input_port_desired_acceleration())
    return dynamics


def add_set_point_spline(
    builder: DiagramBuilder,
    *,
    name: str,
    set_points: OutputPort,
    initial: Sequence[float] | np.ndarray,
    period: float = SERVO_PERIOD,
) -> SetPointSplineSystem:
    """Adds a `SetPointSplineSystem` behind an output port of set-points, and returns it.

    Args:
        builder: the diagram's builder.
        name: name of the System.
        set_points: output port of the set-points, n values.
        initial: the set-point held before the first sample, shape (n,).
        period: period of the set-points [s].
    """
    spline = builder.AddNamedSystem(name, SetPointSplineSystem(initial, period))
    builder.Connect(set_points, spline.GetInputPort("set_point"))
    return spline
