"""Drake System that moves things which the controller assumes to be at rest: the knocked board, the box beside it, and
faults."""

from collections.abc import Callable, Sequence

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex
from pydrake.systems.framework import BasicVector, Context, DiagramBuilder, LeafSystem

from drake_tracker.faults.fault import Fault, SceneFault, faults_at

Path = Callable[[float], tuple[float, float]]
"""Position [m] and speed [m/s] of a slide as a function of time [s]."""


def step(amplitude: float, step_time: float) -> Path:
    """Returns the path of one step.

    Args:
        amplitude: of the step [m].
        step_time: time of the step [s].
    """
    return lambda time: (amplitude * (time >= step_time), 0.0)


def sinusoid(amplitude: float, period: float = 4.0) -> Path:
    """Returns the path of a sinusoid.

    Args:
        amplitude: of the sinusoid [m].
        period: of the sinusoid [s].
    """
    rate = 2.0 * np.pi / period
    return lambda time: (amplitude * np.sin(rate * time), amplitude * (rate * np.cos(rate * time)))


class DisturbanceSystem(LeafSystem):
    """Set-points of a slide as a function of time alone.

    .. pydrake_system::

        name: DisturbanceSystem
        output_ports:
        - desired_state

    ``desired_state``: position [m] and speed [m/s]. There is no state.

    Args:
        path: of the slide, such as `step` or `sinusoid`.
    """

    def __init__(self, path: Path) -> None:
        super().__init__()
        self._path = path
        self.DeclareVectorOutputPort("desired_state", 2, self._calc, prerequisites_of_calc={self.time_ticket()})

    def _calc(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._path(context.get_time()))


def add_disturbance(
    builder: DiagramBuilder, *, plant: MultibodyPlant, slide: ModelInstanceIndex, name: str, path: Path
) -> DisturbanceSystem:
    """Adds a `DisturbanceSystem` and connects it to a slide.

    Args:
        builder: of the diagram that has the plant.
        plant: finalized.
        slide: model instance with one driven joint.
        name: of the System.
        path: as for `DisturbanceSystem`.
    """
    disturbance = builder.AddNamedSystem(name, DisturbanceSystem(path))
    builder.Connect(disturbance.get_output_port(), plant.get_desired_state_input_port(slide))
    return disturbance


def add_scene_faults(builder: DiagramBuilder, *, plant: MultibodyPlant, faults: Sequence[Fault]) -> None:
    """Adds a `DisturbanceSystem` for the body of each fault of the scene.

    Args:
        builder: of the diagram that has the plant.
        plant: finalized, with these bodies.
        faults: the injected faults, of which only faults of the scene are used.
    """
    for fault in faults_at(faults, SceneFault):
        name = fault.body.name
        add_disturbance(builder, plant=plant, slide=plant.GetModelInstanceByName(name), name=name, path=fault.slide)
