"""Objects of the train's laboratory that a driven slide moves along a line, as a function of time.

They are driven, not free: a drive holds the body on its line, at its height, whatever it touches. A push from the arm
or a train moves it away against the force of the drive, and it comes back.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.geometry import SceneGraph, Sphere
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import CoulombFriction, MultibodyPlant
from pydrake.multibody.tree import RigidBody, SpatialInertia

from drake_tracker.core.colour import rgb
from drake_tracker.world.prismatic_actuator import add_prismatic_actuator
from drake_tracker.world.scene_object import Ride
from drake_tracker.world.train.objects_config import Ball, Hand, Train
from drake_tracker.world.train.plant import train_pose
from drake_tracker.world.train.track_visual import add_track_visual
from drake_tracker.world.train.train_model import add_train
from drake_tracker.world.visual_mesh import FlatMesh, add_visual_mesh, merge, prism, rectangle

CLEARANCE = 0.001
"""Gap between the ball and the table [m]."""
PARKED = 0.7
"""Distance by which the hand is farther out before it comes and after it has left [m]."""
REACHING = 1.0
"""Time in which the hand reaches in, and in which it leaves [s]."""
HAND_THICKNESS = 0.028
"""Thickness of the hand and of its forearm, which ends behind the table [m]."""
HAND_LENGTH, HAND_WIDTH = 0.50, 0.13
"""Length of the hand with its forearm, and width across thumb and palm [m]."""
_MASS, _BANDWIDTH, _FORCE, _FRICTION = 0.1, 30.0, 3.0, 0.4
_MARGIN = 0.05


class DrivenObject:
    """An object on a slide with a position drive.

    Args:
        settings: its settings.
        number: its place in the list of objects.
        table_height: height of the table's top in W [m].
    """

    def __init__(self, settings: Any, number: int, table_height: float) -> None:
        self.settings = settings
        self.number = number
        self.table_height = table_height

    @property
    def name(self) -> str:
        return f"{type(self.settings).__name__.lower()}_{self.number}"

    def place(self) -> tuple[float, float]:
        """Returns the distance of the middle of its body from the table [m], and the reach of its slide [m]."""
        raise NotImplementedError

    def motion(self, time: float) -> tuple[float, float]:
        """Returns position [m] and speed [m/s] along its heading at a time [s]."""
        raise NotImplementedError

    def shape(self, plant: MultibodyPlant, body: RigidBody) -> None:
        """Gives the body its appearance, and its collision geometry if it is solid."""
        raise NotImplementedError

    def add_body(self, plant: MultibodyPlant, scene_graph: SceneGraph) -> RigidBody:
        instance = plant.AddModelInstance(self.name)
        body = plant.AddRigidBody(self.name, instance, SpatialInertia.SolidSphereWithMass(_MASS, 0.02))
        self.shape(plant, body)
        height, travel = self.place()
        heading, p_WF = math.radians(self.settings.heading_deg), [*self.settings.place, self.table_height + height]
        add_prismatic_actuator(
            plant,
            name=f"{self.name}_slide",
            parent=plant.world_frame(),
            X_PF=RigidTransform(RotationMatrix.MakeZRotation(heading), p_WF),
            body=body,
            axis=(1.0, 0.0, 0.0),
            bandwidth=_BANDWIDTH,
            travel=travel + _MARGIN,
            force=_FORCE,
        )
        plant.GetJointByName(f"{self.name}_slide", instance).set_default_translation(self.motion(0.0)[0])
        return body


class RollingBall(DrivenObject):
    """`Ball`: a sphere that goes to and fro in a sinusoid, from rest at one end of its path.

    It slides without turning, which cannot be seen: it has one colour.
    """

    settings: Ball

    def place(self) -> tuple[float, float]:
        return self.settings.radius + CLEARANCE, self.settings.amplitude

    def motion(self, time: float) -> tuple[float, float]:
        amplitude, speed = self.settings.amplitude, self.settings.speed
        phase = max(time - self.settings.at, 0.0) * speed / amplitude
        return -amplitude * math.cos(phase), speed * math.sin(phase)

    def shape(self, plant: MultibodyPlant, body: RigidBody) -> None:
        ball, X_BG = Sphere(self.settings.radius), RigidTransform()
        plant.RegisterVisualGeometry(body, X_BG, ball, "look", np.array([*rgb(self.settings.colour), 1.0]))
        plant.RegisterCollisionGeometry(body, X_BG, ball, "body", CoulombFriction(_FRICTION, _FRICTION))


class WavingHand(DrivenObject):
    """`Hand`: forearm, palm and fingers, which nothing can touch. The origin of the body is between the fingertips.

    It reaches in during `REACHING`, moves to and fro in a sinusoid, and leaves as it came.
    """

    settings: Hand

    def place(self) -> tuple[float, float]:
        return self.settings.height + 0.5 * HAND_THICKNESS, PARKED + self.settings.amplitude

    def motion(self, time: float) -> tuple[float, float]:
        end = math.inf if self.settings.duration is None else self.settings.at + self.settings.duration
        coming = time - self.settings.at < end - time
        share = min(max(min(time - self.settings.at, end - time) / REACHING, 0.0), 1.0)
        present = 0.5 * (1.0 - math.cos(math.pi * share))
        change = 0.5 * math.pi / REACHING * math.sin(math.pi * share) * (1.0 if coming else -1.0)
        amplitude = self.settings.amplitude
        rate = self.settings.speed / amplitude if amplitude > 0.0 else 0.0
        phase = rate * (time - self.settings.at)
        wave, wave_rate = amplitude * math.sin(phase), amplitude * rate * math.cos(phase)
        return PARKED * (present - 1.0) + present * wave, change * (PARKED + wave) + present * wave_rate

    def shape(self, plant: MultibodyPlant, body: RigidBody) -> None:
        colour = (*rgb(self.settings.colour).tolist(), 1.0)
        add_visual_mesh(plant, body=body, X_BG=RigidTransform(), mesh=hand_mesh(), name="look", colour=colour)


def hand_mesh() -> FlatMesh:
    """Returns the mesh of a hand [m]: x from the forearm to the fingertips, which are at 0, z up."""
    half = 0.5 * HAND_THICKNESS
    forearm = np.array([[-0.50, -0.045], [-0.17, -0.028], [-0.17, 0.028], [-0.50, 0.045]])
    thumb = np.array([[-0.15, 0.035], [-0.08, 0.055], [-0.075, 0.072], [-0.09, 0.075], [-0.16, 0.045]])
    parts = [
        prism(forearm, -1.2 * half, 1.2 * half),
        prism(rectangle((-0.125, 0.0), 0.10, 0.084), -half, half),
        prism(thumb, -0.7 * half, 0.7 * half),
    ]
    for across, length in ((-0.0325, 0.055), (-0.011, 0.07), (0.0105, 0.075), (0.032, 0.068)):
        parts.append(prism(rectangle((-0.075 + 0.5 * length, across), length, 0.018), -0.65 * half, 0.65 * half))
    return merge(parts)


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
        plant.SetDefaultFloatingBaseBodyPose(body, train_pose(ride.track, ride.start, self.table_height, ride.turns))
        return body
