"""Drake System of the belt: its drive's set-points, and what its encoder reads."""

import math

from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex
from pydrake.systems.framework import BasicVector, Context, DiagramBuilder, LeafSystem

from drake_tracker.core.messages import EncoderReading, message_size
from drake_tracker.core.timing import TIME_STEP
from drake_tracker.world.belt_motion import BeltMotion

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
    counts of `ENCODER_STEP`. There is no state.

    Args:
        motion: of the belt.
        time_step: of the plant [s].
    """

    def __init__(self, motion: BeltMotion, time_step: float = TIME_STEP) -> None:
        super().__init__()
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
        counts = math.floor(self._state.Eval(context)[0] / ENCODER_STEP + 1e-6)
        output.SetFromVector([context.get_time(), counts * ENCODER_STEP, 1.0])


def add_belt_drive(
    builder: DiagramBuilder,
    *,
    plant: MultibodyPlant,
    belt: ModelInstanceIndex,
    motion: BeltMotion,
    name: str = "belt_drive",
) -> BeltSystem:
    """Adds a `BeltSystem` and connects it to a belt.

    Args:
        builder: of the diagram that has the plant.
        plant: finalized.
        belt: model instance with one driven joint.
        motion: as for `BeltSystem`.
        name: of the System.
    """
    drive = builder.AddNamedSystem(name, BeltSystem(motion, plant.time_step()))
    builder.Connect(plant.get_state_output_port(belt), drive.GetInputPort("belt_state"))
    builder.Connect(drive.GetOutputPort("desired_state"), plant.get_desired_state_input_port(belt))
    return drive
