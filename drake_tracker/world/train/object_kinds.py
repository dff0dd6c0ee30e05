"""The registry of the further moving objects of the train's laboratory."""

from typing import TYPE_CHECKING

from drake_tracker.core.registry import Registry
from drake_tracker.world.train import objects_config

if TYPE_CHECKING:
    from drake_tracker.world.scene_object import SceneObject

OBJECTS: "Registry[SceneObject]" = Registry(
    "object",
    {
        objects_config.Train: "drake_tracker.world.train.other_train:OtherTrain",
        objects_config.Ball: "drake_tracker.world.train.driven_objects:RollingBall",
        objects_config.Hand: "drake_tracker.world.train.driven_objects:WavingHand",
    },
)
"""Every kind of object by its settings; the one place where a kind of object is registered."""
