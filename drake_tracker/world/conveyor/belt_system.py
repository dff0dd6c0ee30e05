"""Drake System of the belt: the set-points of its drive, and the readings of its encoder."""

import math
from collections.abc import Sequence

from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex
from pydrake.systems.framework import BasicVector, Context, DiagramBuilder, LeafSystem

from drake_tracker.core.messages import EncoderReading, message_size
from drake_tracker.core.timing import TIME_STEP
from drake_tracker.faults.fault import EncoderFault, Fault, faults_at
from drake_tracker.world.conveyor.belt_motion import BeltMotion

ENCODER_STEP = 1e-4
"""Distance between two counts of the encoder [m]."""


class BeltSystem(LeafSystem):
    """Moves a belt as a function of time alone, and reads its encoder.

    .. pydrake_system::

        name: BeltSystem
        input_ports:
        - belt_state
        output_ports:
        - desired_state
        - encoder

    ``belt_state``: distance [m] and speed [m/s] of the belt's joint. ``desired_state``: the same, as its drive should
    make them by the end of the plant's step that begins now. ``encoder``: an `EncoderReading`, the distance in whole
    counts of `ENCODER_STEP`, at the end of the plant's present step. There is no state.

    Args:
        motion: of the belt.
        time_step: of the plant [s].
        faults: faults of the encoder; a later fault replaces an earlier fault.
    """

    def __init__(self, motion: BeltMotion, time_step: float = TIME_STEP, faults: Sequence[EncoderFault] = ()) -> None:
        super().__init__()
        self._faults = tuple(faults)
        self._motion, self._time_step = motion, time_step
        self._state = self.DeclareVectorInputPort("belt_state", 2)
        self.DeclareVectorOutputPort("desired_state", 2, self._calc_desired, prerequisites_of_calc={self.time_ticket()})
        self.DeclareVectorOutputPort(
            "encoder",
            message_size(EncoderReading),
            self._calc_encoder,
            prerequisites_of_calc={self.time_ticket(), self._state.ticket()},
        )

    def _calc_desired(self, context: Context, output: BasicVector) -> None:
        time = context.get_time() + self._time_step
        output.SetFromVector([self._motion.distance(time), self._motion.speed(time)])

    def _calc_encoder(self, context: Context, output: BasicVector) -> None:
        distance = self._state.Eval(context)[0]
        for fault in self._faults:
            if fault.active(context.get_time()):
                distance = fault.travelled(context.get_time(), self._motion.distance)
        counts = math.floor(distance / ENCODER_STEP + 1e-6)
        step = math.ceil(context.get_time() / self._time_step - 1e-6)
        output.SetFromVector([step * self._time_step, counts * ENCODER_STEP, 1.0])


def add_belt_drive(
    builder: DiagramBuilder,
    *,
    plant: MultibodyPlant,
    belt: ModelInstanceIndex,
    motion: BeltMotion,
    faults: Sequence[Fault] = (),
    name: str = "belt_drive",
) -> BeltSystem:
    """Adds a `BeltSystem` and connects it to a belt.

    Args:
        builder: of the diagram that has the plant.
        plant: finalized.
        belt: model instance with one driven joint.
        motion: as for `BeltSystem`.
        faults: the injected faults, of which only faults of the encoder are used.
        name: of the System.
    """
    drive = builder.AddNamedSystem(name, BeltSystem(motion, plant.time_step(), faults_at(faults, EncoderFault)))
    builder.Connect(plant.get_state_output_port(belt), drive.GetInputPort("belt_state"))
    builder.Connect(drive.GetOutputPort("desired_state"), plant.get_desired_state_input_port(belt))
    return drive
