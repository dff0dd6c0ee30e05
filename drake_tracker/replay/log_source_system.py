"""A recorded signal as a System, which replaces the output port that was recorded."""

import numpy as np
from pydrake.systems.framework import Context, DiscreteValues, LeafSystem

from drake_tracker.core.log import Signal

_SAME_INSTANT = 1e-9
"""Times that differ by less count as equal [s]."""


class LogSourceSystem(LeafSystem):
    """Outputs what a port of a run had as output, and changes when that port changed.

    .. pydrake_system::

        name: LogSourceSystem
        output_ports:
        - signal

    - ``signal``: the recorded message, updated every period at the offset.

    A sample of a log at time t is the value of the port before the updates at that instant. The original System was
    updated in its slot of the previous period. This System is updated in the same slot and then outputs the next sample
    of the log, so that a System that reads it in another slot reads the same value as in the run. After the last sample
    the output stays constant. The output is state; there is no direct feedthrough.

    Args:
        signal: the recorded signal, with at least one sample.
        period: period of the original System's updates [s].
        offset: time of its first update [s].
    """

    def __init__(self, signal: Signal, period: float, offset: float = 0.0) -> None:
        super().__init__()
        self._times, self._data = signal.times, signal.data
        state = self.DeclareDiscreteState(self._data[0])
        self.DeclareStateOutputPort("signal", state)
        self.DeclarePeriodicDiscreteUpdateEvent(period, offset, self._update)

    def _update(self, context: Context, discrete_state: DiscreteValues) -> None:
        following = np.searchsorted(self._times, context.get_time() + _SAME_INSTANT, side="right")
        discrete_state.set_value(self._data[min(following, len(self._times) - 1)])
