"""Drake System of the rail."""

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
from pydrake.systems.framework import Context, DiagramBuilder, DiscreteValues, LeafSystem, OutputPort, ValueProducer

from drake_tracker.core.messages import ArmCommand, Frozen, message_size
from drake_tracker.core.timing import TIME_STEP
from drake_tracker.faults.fault import Fault, SpeedFault, faults_at
from drake_tracker.faults.train_faults_system import add_train_faults
from drake_tracker.world.scene_object import Ride
from drake_tracker.world.train.hill import held_on_track, hill_force
from drake_tracker.world.train.rail import load_of, rail_force
from drake_tracker.world.train.speed_law import (
    check_event,
    check_speed_law,
    speed_at,
    speed_factor,
    waits_for_launch,
)


class RailSystem(LeafSystem):
    """Guides and drives the train along a track while it stands on the track (see `rail.rail_force`).

    .. pydrake_system::

        name: RailSystem
        input_ports:
        - train_state
        - launch
        output_ports:
        - spatial_forces

    ``train_state``: the state port of the train's model instance, 13 numbers in W: quaternion w, x, y, z, position [m],
    angular velocity [rad/s], velocity [m/s]. ``spatial_forces``: one force [N] and torque [N m] at the body's origin,
    for the plant's port ``applied_spatial_force``. The target speed is a function of time. An event relative to the
    launch adds the input ``launch``, an `ArmCommand`, which may be left unconnected, and a state: the beginning of the
    first descent [s], infinity before it. The first state is the place of the train on the track at the last plant step
    [m], near which the track is searched, so that the train keeps to its branch where the track crosses or touches
    itself. It is NaN while the rail does not hold the train; the whole track is searched then.

    Args:
        ride: the track, and how the train runs on it.
        body_index: of the train's body.
        height: z_W of the body's origin while the train stands on the rail [m].
        faults: the injected faults, of which only faults of the drive are used.

    Raises DrakeTrackerError when the speed law, its numbers or the event are not allowed.
    """

    def __init__(self, ride: Ride, body_index: BodyIndex, height: float, faults: Sequence[Fault] = ()) -> None:
        super().__init__()
        check_speed_law(ride.speed_law, ride.speed, ride.variation)
        check_event(ride.event)
        self._ride = ride
        self._body_index = body_index
        self._height = height
        self._load = load_of(ride.body, ride.scale)
        self._law = (ride.speed_law, ride.speed, ride.variation)
        self._faults = faults_at(faults, SpeedFault)
        self._train_state = self.DeclareVectorInputPort("train_state", 13)
        self.DeclareAbstractOutputPort(
            "spatial_forces", lambda: AbstractValue.Make([ExternallyAppliedSpatialForce()]), self._calc_forces
        )
        self._place = self.DeclareDiscreteState([ride.start])
        # The place is searched once for a step: the update and the forces of an instant both read it.
        producer = ValueProducer(lambda: AbstractValue.Make(object()), self._calc_held)
        sources = {self._train_state.ticket(), self.discrete_state_ticket(self._place)}
        self._held = self.DeclareCacheEntry("held", producer, sources)
        self.DeclarePeriodicDiscreteUpdateEvent(TIME_STEP, 0.0, self._follow)
        if waits_for_launch(ride.event):
            self._launch = self.DeclareVectorInputPort("launch", message_size(ArmCommand))
            self._launched = self.DeclareDiscreteState([np.inf])
            self.DeclarePeriodicDiscreteUpdateEvent(TIME_STEP, 0.0, self._watch_launch)

    def _calc_held(self, context: Context, output: AbstractValue) -> None:
        state, near = self._train_state.Eval(context).tolist(), context.get_discrete_state(self._place).value()[0]
        output.set_value(held_on_track(self._ride.track, state, self._height, near, self._ride.turns))

    def _follow(self, context: Context, values: DiscreteValues) -> None:
        held = self._held.Eval(context)
        values.set_value(self._place, [held.place if held else np.nan])

    def _watch_launch(self, context: Context, values: DiscreteValues) -> None:
        descends = self._launch.HasValue(context) and ArmCommand(self._launch.Eval(context)).frozen != Frozen.FREE
        before = context.get_discrete_state(self._launched).value()[0]
        values.set_value(self._launched, [min(before, context.get_time()) if descends else before])

    def _calc_forces(self, context: Context, output: AbstractValue) -> None:
        state = self._train_state.Eval(context).tolist()
        time = context.get_time()
        event = self._ride.event
        launched = context.get_discrete_state(self._launched).value()[0] if waits_for_launch(event) else np.inf
        target_speed = speed_at(*self._law, time, self._ride.start_delay) * speed_factor(event, time, launched)
        for fault in self._faults:
            if fault.active(time):
                target_speed = fault.target_speed(target_speed)
        held, ride = self._held.Eval(context), self._ride
        applied = ExternallyAppliedSpatialForce()
        applied.body_index = self._body_index
        if ride.track.heights is None:
            force_x, force_y, torque_z = rail_force(ride.track, held, state, target_speed, self._load, ride.turns)
            applied.F_Bq_W = SpatialForce((0.0, 0.0, torque_z), (force_x, force_y, 0.0))
        else:
            force, torque = hill_force(ride.track, held, state, target_speed, self._load, ride.turns)
            applied.F_Bq_W = SpatialForce(torque, force)
        output.set_value([applied])


def add_rail(
    builder: DiagramBuilder,
    *,
    plant: MultibodyPlant,
    train: ModelInstanceIndex,
    ride: Ride,
    height: float,
    faults: Sequence[Fault] = (),
    others: Sequence[OutputPort] = (),
    name: str = "rail",
) -> RailSystem:
    """Adds a `RailSystem`, with the forces of faults if there are any, and connects it to a train.

    Args:
        builder: of the diagram that has the plant.
        plant: finalized.
        train: model instance with one free body.
        ride: as for `RailSystem`.
        height: as for `RailSystem`.
        faults: faults of the train.
        others: spatial forces of other trains, for the one port for forces that the plant has.
        name: of the System.
    """
    (body_index,) = plant.GetBodyIndices(train)
    rail = builder.AddNamedSystem(name, RailSystem(ride, body_index, height, faults))
    builder.Connect(plant.get_state_output_port(train), rail.GetInputPort("train_state"))
    forces = add_train_faults(
        builder, plant=plant, train=train, rail_forces=rail.GetOutputPort("spatial_forces"), faults=faults
    )
    if others:
        together = builder.AddNamedSystem(f"{name}_forces", ExternallyAppliedSpatialForceMultiplexer(1 + len(others)))
        for number, port in enumerate((forces, *others)):
            builder.Connect(port, together.get_input_port(number))
        forces = together.get_output_port()
    builder.Connect(forces, plant.get_applied_spatial_force_input_port())
    return rail
