"""A recorded signal as a Drake System, in place of the port that it was recorded from."""

import numpy as np
from pydrake.systems.framework import Context, DiscreteValues, LeafSystem

from drake_tracker.core.log import Signal

_SAME_INSTANT = 1e-9
"""Times that differ by less [s] are one instant."""


class LogSourceSystem(LeafSystem):
    """Shows what a port of a run showed, and changes when that port changed.

    .. pydrake_system::

        name: LogSourceSystem
        output_ports:
        - signal

    A sample of a log at time t is what the port showed before the updates of that instant. The original was updated in
    its slot of the period before, and this System is updated in the same slot: it then shows the sample that the log
    takes next. So whoever reads it in a slot of its own reads what it read in the run. Beyond the last sample that one
    stays. The output is state, there is no direct feedthrough.

    Args:
        signal: `record.log.Signal` with at least one sample. period, offset: of the original's updates [s].
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
