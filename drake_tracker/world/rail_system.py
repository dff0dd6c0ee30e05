"""Drake System of the rail."""

from pydrake.common.value import AbstractValue
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import ExternallyAppliedSpatialForce
from pydrake.systems.framework import LeafSystem

from drake_tracker.world.rail import rail_force
from drake_tracker.world.speed_law import check_speed_law, speed_at


class RailSystem(LeafSystem):
    """Guides and drives the train along a track, for as long as it stands on it (see `rail.rail_force`).

    .. pydrake_system::

        name: RailSystem
        input_ports:
        - train_state
        output_ports:
        - spatial_forces

    ``train_state``: the state port of the train's model instance, 13 numbers in W: quaternion w, x, y, z, position [m],
    angular velocity [rad/s], velocity [m/s]. ``spatial_forces``: one force [N] and torque [N m] at the body's origin,
    for the plant's port ``applied_spatial_force``. Without state of its own: the target speed is a function of time.
    """

    def __init__(self, track, body_index, height, *, speed, speed_law="constant", variation=0.15):
        """``track`` is travelled along growing arc length; ``height`` [m] of the body's origin on the rail, in W.

        Raises DrakeTrackerError when the speed law or its numbers are not allowed.
        """
        LeafSystem.__init__(self)
        check_speed_law(speed_law, speed, variation)
        self._track = track
        self._body_index = body_index
        self._height = height
        self._law = (speed_law, speed, variation)
        self._train_state = self.DeclareVectorInputPort("train_state", 13)
        self.DeclareAbstractOutputPort(
            "spatial_forces", lambda: AbstractValue.Make([ExternallyAppliedSpatialForce()]), self._calc_forces
        )

    def _calc_forces(self, context, output):
        state = self._train_state.Eval(context).tolist()
        target_speed = speed_at(*self._law, context.get_time())
        force_x, force_y, torque_z = rail_force(self._track, state, target_speed, self._height)
        applied = ExternallyAppliedSpatialForce()
        applied.body_index = self._body_index
        applied.F_Bq_W = SpatialForce((0.0, 0.0, torque_z), (force_x, force_y, 0.0))
        output.set_value([applied])


def add_rail(builder, plant, train, track, height, *, speed, speed_law="constant", variation=0.15):
    """Adds a `RailSystem` named "rail" for the model instance ``train`` of the finalized plant, and connects it."""
    (body_index,) = plant.GetBodyIndices(train)
    rail = builder.AddNamedSystem(
        "rail", RailSystem(track, body_index, height, speed=speed, speed_law=speed_law, variation=variation)
    )
    builder.Connect(plant.get_state_output_port(train), rail.GetInputPort("train_state"))
    builder.Connect(rail.GetOutputPort("spatial_forces"), plant.get_applied_spatial_force_input_port())
    return rail
