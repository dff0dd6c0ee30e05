"""A delay line with an offset, as a Drake System."""

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem


class DelayLineSystem(LeafSystem):
    """Delays a vector by a whole number of periods: Drake's `DiscreteTimeDelay`, with an offset.

    .. pydrake_system::

        name: DelayLineSystem
        input_ports:
        - signal
        output_ports:
        - delayed

    ``signal`` is sampled in a discrete update every ``period`` at ``offset``, hence after the unrestricted updates of
    the same instant. ``delayed`` is the sample of ``steps`` periods ago, and all zeros before there is one. Both are
    vectors of ``size`` elements.

    Args:
        size: of the vector.
        steps: periods of delay, 0 or more.
        period: of the update [s].
        offset: of the update [s].
    """

    def __init__(self, size: int, steps: int, *, period: float, offset: float = 0.0) -> None:
        super().__init__()
        self._size = size
        self._line = self.DeclareDiscreteState((steps + 1) * size)
        self._signal = self.DeclareVectorInputPort("signal", size)
        self.DeclareVectorOutputPort("delayed", size, self._calc_delayed, {self.discrete_state_ticket(self._line)})
        self.DeclarePeriodicDiscreteUpdateEvent(period, offset, self._update)

    def _update(self, context: Context, values: DiscreteValues) -> None:
        line = context.get_discrete_state(self._line).value()
        values.set_value(self._line, np.concatenate([line[self._size :], self._signal.Eval(context)]))

    def _calc_delayed(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(context.get_discrete_state(self._line).value()[: self._size])
