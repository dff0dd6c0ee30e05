"""A further train of the train's laboratory, on the same rail physics as the first one."""

from dataclasses import dataclass

from pydrake.geometry import SceneGraph
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RigidBody

from drake_tracker.world.scene_object import Ride
from drake_tracker.world.train.objects_config import Train
from drake_tracker.world.train.plant import train_pose
from drake_tracker.world.train.track_visual import add_track_visual
from drake_tracker.world.train.train_model import add_train


@dataclass(frozen=True)
class OtherTrain:
    """`Train`: a free body that its own `RailSystem` guides and drives. It can collide with everything.

    Attributes:
        settings: its appearance, and whether it has its own track, whose rails it then adds.
        number: its place in the list of objects.
        motion: its track, its start and its speed.
        table_height: height of the table's top in W [m].
    """

    settings: Train
    number: int
    motion: Ride
    table_height: float

    @property
    def name(self) -> str:
        return f"train_{self.number}"

    def add_body(self, plant: MultibodyPlant, scene_graph: SceneGraph) -> RigidBody:
        look, ride = self.settings, self.motion
        train = add_train(
            plant, body=look.body, scale=ride.scale, colour=look.colour, name=self.name, scene_graph=scene_graph
        )
        if look.track is not None:
            add_track_visual(plant, track=ride.track, table_height=self.table_height, name=f"{self.name}_track")
        body = plant.GetBodyByName("train", train)
        plant.SetDefaultFloatingBaseBodyPose(body, train_pose(ride.track, ride.start, self.table_height))
        return body
