"""Drake System of the forces that faults apply to the train."""

from collections.abc import Sequence

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import (
    ExternallyAppliedSpatialForce,
    ExternallyAppliedSpatialForceMultiplexer,
    MultibodyPlant,
)
from pydrake.multibody.tree import BodyIndex, ModelInstanceIndex
from pydrake.systems.framework import Context, DiagramBuilder, LeafSystem, OutputPort

from drake_tracker.faults.fault import Fault, TrainFault, faults_at


class TrainFaultsSystem(LeafSystem):
    """Forces on the train from outside: pushes, and a hand that carries it.

    .. pydrake_system::

        name: TrainFaultsSystem
        input_ports:
        - train_state
        output_ports:
        - spatial_forces

    ``train_state``: the 13 numbers of the free body in W. ``spatial_forces``: the sum of the forces [N] and torques
    [N m] of the active faults at the body's origin. There is no state.

    Args:
        faults: the faults.
        body_index: of the train's body.
    """

    def __init__(self, faults: Sequence[TrainFault], body_index: BodyIndex) -> None:
        super().__init__()
        self._faults, self._body_index = tuple(faults), body_index
        self._train_state = self.DeclareVectorInputPort("train_state", 13)
        self.DeclareAbstractOutputPort(
            "spatial_forces", lambda: AbstractValue.Make([ExternallyAppliedSpatialForce()]), self._calc_forces
        )

    def _calc_forces(self, context: Context, output: AbstractValue) -> None:
        time, state = context.get_time(), self._train_state.Eval(context)
        torque, force = np.zeros(3), np.zeros(3)
        for fault in self._faults:
            if fault.active(time):
                own_torque, own_force = fault.wrench(time, state)
                torque, force = torque + own_torque, force + own_force
        applied = ExternallyAppliedSpatialForce()
        applied.body_index = self._body_index
        applied.F_Bq_W = SpatialForce(torque, force)
        output.set_value([applied])


def add_train_faults(
    builder: DiagramBuilder,
    *,
    plant: MultibodyPlant,
    train: ModelInstanceIndex,
    rail_forces: OutputPort,
    faults: Sequence[Fault],
) -> OutputPort:
    """Adds the forces of faults, if there are any, to the forces of the rail.

    Args:
        builder: of the diagram that has the plant.
        plant: finalized.
        train: model instance with one free body.
        rail_forces: spatial forces of the rail.
        faults: all faults of the run.

    Returns the port with all spatial forces, or the rail's when no fault applies a force.
    """
    own = faults_at(faults, TrainFault)
    if not own:
        return rail_forces
    (body_index,) = plant.GetBodyIndices(train)
    system = builder.AddNamedSystem("train_faults", TrainFaultsSystem(own, body_index))
    builder.Connect(plant.get_state_output_port(train), system.GetInputPort("train_state"))
    both = builder.AddNamedSystem("train_forces", ExternallyAppliedSpatialForceMultiplexer(2))
    builder.Connect(rail_forces, both.get_input_port(0))
    builder.Connect(system.GetOutputPort("spatial_forces"), both.get_input_port(1))
    return both.get_output_port()
