"""A further train of the train's laboratory, on the same rail physics as the first one."""

from dataclasses import dataclass

from pydrake.geometry import SceneGraph
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RigidBody
from pydrake.systems.framework import DiagramBuilder, OutputPort

from drake_tracker.world.objects_config import Train
from drake_tracker.world.plant import TRAIN_HEIGHT, train_pose
from drake_tracker.world.rail_system import RailSystem
from drake_tracker.world.track_visual import add_track_visual
from drake_tracker.world.tracks import Track
from drake_tracker.world.train_model import add_train


@dataclass(frozen=True)
class OtherTrain:
    """`Train`: a free body that its own `RailSystem` guides and drives. It can collide with everything.

    Attributes:
        settings: its appearance and its start.
        number: its place in the list of objects.
        track: its track, in the direction of travel.
        start: arc length at which it starts [m].
        speed: mean speed [m/s].
        speed_law: how the speed varies, one of `SPEED_LAWS`.
        variation: amplitude of a varying speed as a fraction of ``speed``.
        table_height: height of the table's top in W [m].
    """

    settings: Train
    number: int
    track: Track
    start: float
    speed: float
    speed_law: str
    variation: float
    table_height: float

    @property
    def name(self) -> str:
        return f"train_{self.number}"

    def add_body(self, plant: MultibodyPlant, scene_graph: SceneGraph) -> RigidBody:
        look = self.settings
        train = add_train(
            plant, body=look.body, scale=look.scale, colour=look.colour, name=self.name, scene_graph=scene_graph
        )
        if look.track is not None:
            add_track_visual(plant, track=self.track, table_height=self.table_height, name=f"{self.name}_track")
        return plant.GetBodyByName("train", train)

    def add_systems(self, builder: DiagramBuilder, plant: MultibodyPlant) -> OutputPort:
        train = plant.GetModelInstanceByName(self.name)
        body = plant.GetBodyByName("train", train)
        plant.SetDefaultFloatingBaseBodyPose(body, train_pose(self.track, self.start, self.table_height))
        rail = RailSystem(
            self.track,
            body.index(),
            self.table_height + TRAIN_HEIGHT,
            speed=self.speed,
            speed_law=self.speed_law,
            variation=self.variation,
            start_delay=self.settings.start_delay,
            scale=self.settings.scale,
        )
        builder.AddNamedSystem(f"{self.name}_rail", rail)
        builder.Connect(plant.get_state_output_port(train), rail.GetInputPort("train_state"))
        return rail.GetOutputPort("spatial_forces")
