"""The interface of a further moving object of the train's laboratory."""

from dataclasses import dataclass
from typing import Protocol

from pydrake.geometry import SceneGraph
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RigidBody

from drake_tracker.world.config import NoEvent
from drake_tracker.world.disturbance_system import Path
from drake_tracker.world.train.speed_law import SpeedEvent
from drake_tracker.world.train.tracks import Track


@dataclass(frozen=True)
class Ride:
    """How a train runs.

    Attributes:
        track: its track, in the direction of travel.
        start: arc length at which it starts [m].
        speed: mean speed [m/s].
        speed_law: how the speed varies, one of `SPEED_LAWS`.
        variation: amplitude of a varying speed as a fraction of ``speed``.
        start_delay: time until which it stands [s].
        scale: length of the train relative to its model.
        event: sudden change of the speed.
        body: which of the train models it is.
        turns: whether it turns with the track; otherwise it lies along x_W.
    """

    track: Track
    start: float = 0.0
    speed: float = 0.15
    speed_law: str = "constant"
    variation: float = 0.15
    start_delay: float = 0.0
    scale: float = 1.0
    event: SpeedEvent | NoEvent = NoEvent()
    body: str = "plain"
    turns: bool = True


class SceneObject(Protocol):
    """An object that moves by itself. Its motion depends on the time and on its contacts."""

    @property
    def name(self) -> str:
        """Name of its model instance, which no other object has."""
        ...

    @property
    def motion(self) -> Ride | Path:
        """How it moves: on rails, or on a slide of its own along a `Path`."""
        ...

    def add_body(self, plant: MultibodyPlant, scene_graph: SceneGraph) -> RigidBody:
        """Adds the object, which has one body, to a plant, at the place where it starts. Returns the body.

        Args:
            plant: registered with ``scene_graph``, and not yet finalized.
            scene_graph: of the plant.
        """
        ...
