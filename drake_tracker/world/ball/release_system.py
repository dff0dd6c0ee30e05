"""Drake System that opens the release gate."""

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex
from pydrake.systems.framework import Context, DiagramBuilder, DiscreteValues, LeafSystem

from drake_tracker.core.timing import VISION_PERIOD

DELAY_RANGE = (0.3, 1.0)
"""Delay of the gate after the arm is ready [s]; it is random, so that nothing can rely on the start of the ball."""
_STREAM = 34


def draw_delay(seed: int) -> float:
    """Returns the gate's delay [s], drawn from the seed."""
    return float(np.random.default_rng([seed, _STREAM]).uniform(*DELAY_RANGE))


class ReleaseSystem(LeafSystem):
    """Opens the gate once, a delay after the arm has reported that it is ready. The gate then stays open.

    .. pydrake_system::

        name: ReleaseSystem
        input_ports:
        - ready
        output_ports:
        - gate_desired_state

    ``ready``: 1 element, 1 while the arm waits for the ball; a port left unconnected counts as 0.
    ``gate_desired_state``: position [m] and speed [m/s] of the gate's slide, zero while the gate is closed. Updated
    every ``period``, at ``offset``.

    Args:
        delay: from ready to open [s]; infinite: the gate never opens.
        travel: position of the open gate [m].
        is_open: whether the gate is open from the beginning.
        period: of the update [s].
        offset: of the update [s].
    """

    def __init__(
        self,
        delay: float,
        travel: float,
        is_open: bool = False,
        *,
        period: float = VISION_PERIOD,
        offset: float = 0.0,
    ) -> None:
        super().__init__()
        self._delay = delay
        self._travel = travel
        self._ready = self.DeclareVectorInputPort("ready", 1)
        # When to open [s], infinite until the arm is ready; and the set-point, which is the output.
        self._opening_time = self.DeclareDiscreteState([np.inf])
        self._set_point = self.DeclareDiscreteState([travel if is_open else 0.0, 0.0])
        self.DeclareStateOutputPort("gate_desired_state", self._set_point)
        self.DeclarePeriodicDiscreteUpdateEvent(period, offset, self._update)

    def _update(self, context: Context, state: DiscreteValues) -> None:
        (opening_time,) = context.get_discrete_state(self._opening_time).value()
        ready = self._ready.HasValue(context) and self._ready.Eval(context)[0] > 0.5
        if np.isinf(opening_time) and ready:
            opening_time = context.get_time() + self._delay
            state.set_value(self._opening_time, [opening_time])
        if context.get_time() >= opening_time:
            state.set_value(self._set_point, [self._travel, 0.0])


def add_release(
    builder: DiagramBuilder,
    *,
    plant: MultibodyPlant,
    gate: ModelInstanceIndex,
    delay: float,
    travel: float,
    is_open: bool = False,
    name: str = "release",
) -> ReleaseSystem:
    """Adds a `ReleaseSystem` and connects it to the slide of a gate; its port ``ready`` is left open.

    Args:
        builder: of the diagram that has the plant.
        plant: finalized.
        gate: model instance with one driven joint.
        delay: as for `ReleaseSystem`.
        travel: as for `ReleaseSystem`.
        is_open: as for `ReleaseSystem`.
        name: of the System.
    """
    release = builder.AddNamedSystem(name, ReleaseSystem(delay, travel, is_open))
    builder.Connect(release.GetOutputPort("gate_desired_state"), plant.get_desired_state_input_port(gate))
    return release
