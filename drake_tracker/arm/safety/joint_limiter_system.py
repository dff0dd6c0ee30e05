"""The limiter of the joints' set-points as a System."""

from collections.abc import Sequence

import numpy as np
from pydrake.systems.framework import Context, DiscreteValues, LeafSystem

from drake_tracker.arm.safety.joint_limiter import JointLimiter, Limit, LimitedStep
from drake_tracker.core.messages import LimiterReport, message_size
from drake_tracker.core.timing import LIMITER_SLOT, SERVO_PERIOD, TIME_STEP, servo_slot


class JointLimiterSystem(LeafSystem):
    """Passes on set-points that break no limit of the arm, and changes the others.

    .. pydrake_system::

        name: JointLimiterSystem
        input_ports:
        - q_wanted
        - hold
        output_ports:
        - q_commanded
        - limiter_report

    - ``q_wanted``: joint set-points, n values [rad].
    - ``hold``: output of a `CollisionReflexSystem`. While it holds, the set-point is where the joints hold still.
      Unconnected: never.
    - ``q_commanded``: joint set-points within the limits, n values [rad]. It is state, updated every period in the slot
      of the limiter, the last one of the servo.
    - ``limiter_report``: how often a set-point was changed, and why, a `LimiterReport`, for logs.

    Args:
        limiter: the arithmetic.
        q_initial: joint set-points at the start, shape (n,) [rad].
        time_step: the plant's step [s], of which the slot is a fraction.
        period: period of the set-points [s].
    """

    def __init__(
        self,
        limiter: JointLimiter,
        q_initial: Sequence[float] | np.ndarray,
        time_step: float = TIME_STEP,
        period: float = SERVO_PERIOD,
    ) -> None:
        super().__init__()
        self._limiter = limiter
        self._wanted = self.DeclareVectorInputPort("q_wanted", len(q_initial))
        self._hold = self.DeclareVectorInputPort("hold", 1 + len(q_initial))
        set_point = self.DeclareDiscreteState(q_initial)
        self.DeclareDiscreteState(len(q_initial))  # velocity of the last step [rad/s]
        report = self.DeclareDiscreteState(message_size(LimiterReport))
        self.DeclareStateOutputPort("q_commanded", set_point)
        self.DeclareStateOutputPort("limiter_report", report)
        offset = servo_slot(LIMITER_SLOT, time_step, period)
        self.DeclarePeriodicDiscreteUpdateEvent(period, offset, self._update)

    def _update(self, context: Context, next_state: DiscreteValues) -> None:
        q, v_last, counts = (context.get_discrete_state(group).value() for group in range(3))
        hold = self._hold.Eval(context) if self._hold.HasValue(context) else None
        if hold is not None and hold[0]:
            step = LimitedStep(hold[1:], np.zeros_like(q), frozenset({Limit.CONTACT}))
        else:
            step = self._limiter.step(q, v_last, self._wanted.Eval(context))
        next_state.set_value(0, step.q)
        next_state.set_value(1, step.v)
        counts = np.array(counts)
        counts[0] += bool(step.limits)
        for limit in step.limits:
            counts[1 + limit] += 1
        next_state.set_value(2, counts)
