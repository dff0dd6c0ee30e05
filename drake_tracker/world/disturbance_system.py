"""Drake System that moves what the controller takes to be at rest: the knocked board, and the box beside it."""

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex
from pydrake.systems.framework import BasicVector, Context, DiagramBuilder, LeafSystem


class DisturbanceSystem(LeafSystem):
    """Set-points of a slide as a function of time alone: one step, or a sinusoid.

    .. pydrake_system::

        name: DisturbanceSystem
        output_ports:
        - desired_state

    ``desired_state``: position [m] and speed [m/s]. There is no state.

    Args:
        amplitude: of the step or the sinusoid [m].
        step_time: time of the step [s]; None for a sinusoid.
        period: of the sinusoid [s].
    """

    def __init__(self, amplitude: float, *, step_time: float | None = None, period: float = 4.0) -> None:
        super().__init__()
        self._amplitude = amplitude
        self._step_time = step_time
        self._rate = 2.0 * np.pi / period
        self.DeclareVectorOutputPort("desired_state", 2, self._calc, prerequisites_of_calc={self.time_ticket()})

    def _calc(self, context: Context, output: BasicVector) -> None:
        time = context.get_time()
        if self._step_time is not None:
            output.SetFromVector([self._amplitude * (time >= self._step_time), 0.0])
            return
        phase = self._rate * time
        output.SetFromVector(self._amplitude * np.array([np.sin(phase), self._rate * np.cos(phase)]))


def add_disturbance(
    builder: DiagramBuilder,
    *,
    plant: MultibodyPlant,
    slide: ModelInstanceIndex,
    name: str,
    amplitude: float,
    step_time: float | None = None,
    period: float = 4.0,
) -> DisturbanceSystem:
    """Adds a `DisturbanceSystem` and connects it to a slide.

    Args:
        builder: of the diagram that has the plant.
        plant: finalized.
        slide: model instance with one driven joint.
        name: of the System.
        amplitude: as for `DisturbanceSystem`.
        step_time: as for `DisturbanceSystem`.
        period: as for `DisturbanceSystem`.
    """
    disturbance = builder.AddNamedSystem(name, DisturbanceSystem(amplitude, step_time=step_time, period=period))
    builder.Connect(disturbance.get_output_port(), plant.get_desired_state_input_port(slide))
    return disturbance
