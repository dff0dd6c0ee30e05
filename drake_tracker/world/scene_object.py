"""The interface of a further moving object of the train's laboratory."""

from typing import Protocol

from pydrake.geometry import SceneGraph
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RigidBody
from pydrake.systems.framework import DiagramBuilder, OutputPort


class SceneObject(Protocol):
    """An object that moves by itself. Its motion depends on the time and on what it touches.

    Attributes:
        name: name of its model instance, which no other object has.
    """

    @property
    def name(self) -> str: ...

    def add_body(self, plant: MultibodyPlant, scene_graph: SceneGraph) -> RigidBody:
        """Adds the object to a plant, and returns the body whose state is the state of the object.

        Args:
            plant: registered with ``scene_graph``, and not yet finalized.
            scene_graph: of the plant.
        """
        ...

    def add_systems(self, builder: DiagramBuilder, plant: MultibodyPlant) -> OutputPort | None:
        """Adds what moves the object to a diagram.

        Args:
            builder: of the diagram that has the plant.
            plant: finalized.

        Returns the spatial forces on the object, for the plant's port ``applied_spatial_force``, or None when there are
        none.
        """
        ...
