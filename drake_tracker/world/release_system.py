"""Drake System that opens the release gate."""

import numpy as np
from pydrake.systems.framework import LeafSystem

from drake_tracker.core.timing import VISION_PERIOD

DELAY_RANGE = (0.3, 1.0)
"""Of the gate after the arm is ready [s]: nobody may count on the ball's start."""
_STREAM = 34


def draw_delay(seed):
    """Returns the gate's delay [s] as drawn from the seed."""
    return float(np.random.default_rng([seed, _STREAM]).uniform(*DELAY_RANGE))


class ReleaseSystem(LeafSystem):
    """Opens the gate once, a delay after the arm has said that it is ready; it stays open whatever the arm says then.

    .. pydrake_system::

        name: ReleaseSystem
        input_ports:
        - ready
        output_ports:
        - gate_desired_state

    ``ready``: 1 element, 1 from when the arm waits; left unconnected, it never does. ``gate_desired_state``: position
    [m] and speed of the gate's slide, 0 while closed. Looks at ``ready`` 60 times a second.

    Args:
      delay: from ready to open [s]; infinite: it never opens. travel: of the open gate [m].
      is_open: whether it stands open from the beginning.
    """

    def __init__(self, delay, travel, is_open=False):
        super().__init__()
        self._delay = delay
        self._travel = travel
        self._ready = self.DeclareVectorInputPort("ready", 1)
        # When to open [s], infinite until the arm is ready; and the set-point, which is the output.
        self._opening_time = self.DeclareDiscreteState([np.inf])
        self._set_point = self.DeclareDiscreteState([travel if is_open else 0.0, 0.0])
        self.DeclareStateOutputPort("gate_desired_state", self._set_point)
        self.DeclarePeriodicDiscreteUpdateEvent(VISION_PERIOD, 0.0, self._update)

    def _update(self, context, state):
        (opening_time,) = context.get_discrete_state(self._opening_time).value()
        ready = self._ready.HasValue(context) and self._ready.Eval(context)[0] > 0.5
        if np.isinf(opening_time) and ready:
            opening_time = context.get_time() + self._delay
            state.set_value(self._opening_time, [opening_time])
        if context.get_time() >= opening_time:
            state.set_value(self._set_point, [self._travel, 0.0])
