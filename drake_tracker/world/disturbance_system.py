"""Drake System that moves what should stand still: a knock on the board, and a box that slides beside it."""

import numpy as np
from pydrake.systems.framework import LeafSystem


class DisturbanceSystem(LeafSystem):
    """Set-points of a slide, as a function of time alone: one step, or to and fro without end.

    .. pydrake_system::

        name: DisturbanceSystem
        output_ports:
        - desired_state

    ``desired_state``: position [m] and speed [m/s].

    Args:
      amplitude [m]. step_time: when the step comes [s]; None: to and fro instead, with ``period`` [s].
    """

    def __init__(self, amplitude, *, step_time=None, period=4.0):
        super().__init__()
        self._amplitude = amplitude
        self._step_time = step_time
        self._rate = 2.0 * np.pi / period
        self.DeclareVectorOutputPort("desired_state", 2, self._calc, prerequisites_of_calc={self.time_ticket()})

    def _calc(self, context, output):
        time = context.get_time()
        if self._step_time is not None:
            output.SetFromVector([self._amplitude * (time >= self._step_time), 0.0])
            return
        phase = self._rate * time
        output.SetFromVector(self._amplitude * np.array([np.sin(phase), self._rate * np.cos(phase)]))
