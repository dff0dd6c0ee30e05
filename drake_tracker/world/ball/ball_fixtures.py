"""The fixtures in the laboratory of the ball: board with pegs and walls, release gate, and a moving distractor."""

from dataclasses import dataclass

import numpy as np
from pydrake.geometry import AddContactMaterial, Box, Cylinder, ProximityProperties
from pydrake.math import RigidTransform
from pydrake.multibody.plant import CoulombFriction, MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex, RigidBody, SpatialInertia

from drake_tracker.faults.fault import MovingBody
from drake_tracker.world.ball.ball_board import BALL_RADIUS, PEG_HEIGHT, PEG_RADIUS, START_Y
from drake_tracker.world.ball.ball_board_visual import THICKNESS, WALL_HEIGHT, WALL_THICKNESS, add_board_visual
from drake_tracker.world.config import BoardConfig
from drake_tracker.world.prismatic_actuator import add_moving_body, add_prismatic_actuator

TABLE_HEIGHT = 0.45
"""Height of the top of the table that carries the board [m]."""
BOARD_DENSITY = 600.0
"""Density of plywood [kg/m^3]."""
KNOCK = 0.004
"""Distance by which a knock moves the board along x_B [m]."""
GATE_SIZE = (0.050, 0.004, 0.030)
GATE_TRAVEL = 0.034
"""Distance by which the gate goes down to open [m]: its top is then below the face."""
DISTRACTOR_SIZE = (0.07, 0.05, 0.06)
SLIDE_AMPLITUDE = 0.25
"""Distance by which the distractor slides to either side [m]."""
DISTRACTOR_PLACE = (1.05, 0.41)
"""Middle (x, y)_W of the distractor's slide, on the table beside the board [m]."""


@dataclass(frozen=True)
class ContactMaterial:
    """How a surface behaves in point contact.

    Attributes:
        stiffness: [N/m].
        dissipation: [s/m].
        friction: coefficient, static and dynamic.
    """

    stiffness: float
    dissipation: float
    friction: float

    def properties(self) -> ProximityProperties:
        """Returns the properties for a collision geometry of a plant."""
        properties = ProximityProperties()
        AddContactMaterial(self.dissipation, self.stiffness, CoulombFriction(self.friction, self.friction), properties)
        return properties


WOOD = ContactMaterial(1e5, 10.0, 0.4)
"""Material of the board and the gate: the ball sinks in by 5 um and does not bounce."""
PEG = ContactMaterial(200.0, 0.1, 0.2)
"""Material of the pegs and walls. Drake has no coefficient of restitution, and its implicit steps damp out an impact
that lasts only a few of them. So these are soft, as if sleeved: the ball sinks in by 1 to 3 mm for 12 ms, and rebounds
with 0.54 to 0.59 of its speed. On a table it would keep 0.88 (ITTF, Laws 2.1.3: 0.23 m of a drop of 0.30 m); a thin peg
absorbs more."""


def add_board(
    plant: MultibodyPlant, *, board: BoardConfig, X_WB: RigidTransform, pegs: np.ndarray, loose: bool = False
) -> tuple[ModelInstanceIndex, RigidBody]:
    """Adds the board with its pegs and walls. Returns (model instance, body); the body's frame is B.

    Args:
        plant: registered with a SceneGraph, and not yet finalized.
        board: its size, and whether it has walls.
        X_WB: pose of the board.
        pegs: axes of the pegs, shape (n, 2) [m, B].
        loose: True puts the board on a stiff drive along x_B, so that it can be knocked; otherwise it is welded to the
            world.
    """
    instance = plant.AddModelInstance("board")
    size = np.array([board.width, board.length, THICKNESS])
    X_BG = RigidTransform([0.0, 0.5 * board.length, -0.5 * THICKNESS])
    mass = BOARD_DENSITY * float(np.prod(size))
    body = plant.AddRigidBody(
        "board", instance, SpatialInertia.SolidBoxWithMass(mass, *size).Shift(-X_BG.translation())
    )
    plant.RegisterCollisionGeometry(body, X_BG, Box(*size), "face", WOOD.properties())
    for k, (x, y) in enumerate(pegs):
        X_BP = RigidTransform([x, y, 0.5 * PEG_HEIGHT])
        plant.RegisterCollisionGeometry(body, X_BP, Cylinder(PEG_RADIUS, PEG_HEIGHT), f"peg_{k}", PEG.properties())
    if board.walls:
        for side in (-1.0, 1.0):
            x = side * 0.5 * (board.width + WALL_THICKNESS)
            X_BWall = RigidTransform([x, 0.5 * board.length, 0.5 * WALL_HEIGHT])
            wall = Box(WALL_THICKNESS, board.length, WALL_HEIGHT)
            name = "wall_left" if side < 0.0 else "wall_right"
            plant.RegisterCollisionGeometry(body, X_BWall, wall, name, PEG.properties())
    add_board_visual(plant, body=body, board=board, X_WB=X_WB, pegs=pegs, table_height=TABLE_HEIGHT)
    if loose:
        add_prismatic_actuator(
            plant,
            name="board_slide",
            parent=plant.world_frame(),
            X_PF=X_WB,
            body=body,
            axis=[1.0, 0.0, 0.0],
            bandwidth=60.0,
            travel=0.01,
        )
    else:
        plant.WeldFrames(plant.world_frame(), body.body_frame(), X_WB)
    return instance, body


def add_gate(plant: MultibodyPlant, *, board_body: RigidBody, start_x: float) -> ModelInstanceIndex:
    """Adds the release gate, on a slide. Returns the model instance; its joint position grows as the gate opens.

    Args:
        plant: registered with a SceneGraph, and not yet finalized.
        board_body: of the board on which the gate stands.
        start_x: x_B of the ball behind the gate [m].
    """
    instance = plant.AddModelInstance("gate")
    gate = plant.AddRigidBody("gate", instance, SpatialInertia.SolidBoxWithMass(0.02, *GATE_SIZE))
    plant.RegisterCollisionGeometry(gate, RigidTransform(), Box(*GATE_SIZE), "bar", WOOD.properties())
    plant.RegisterVisualGeometry(gate, RigidTransform(), Box(*GATE_SIZE), "look", np.array([0.85, 0.85, 0.83, 1.0]))
    X_BG = RigidTransform([start_x, START_Y - BALL_RADIUS - 0.5 * GATE_SIZE[1], 0.5 * GATE_SIZE[2] + 0.001])
    add_prismatic_actuator(
        plant,
        name="gate_slide",
        parent=board_body.body_frame(),
        X_PF=X_BG,
        body=gate,
        axis=[0.0, 0.0, -1.0],
        bandwidth=60.0,
        travel=GATE_TRAVEL,
    )
    return instance


def add_distractor(plant: MultibodyPlant) -> ModelInstanceIndex:
    """Adds a dark box on the table beside the board, on a slide along x_W, to a plant that is not yet finalized.

    Returns the model instance.
    """
    distractor = MovingBody(
        name="distractor",
        size=DISTRACTOR_SIZE,
        colour=(0.05, 0.05, 0.06, 1.0),
        X_WP=RigidTransform([*DISTRACTOR_PLACE, TABLE_HEIGHT + 0.5 * DISTRACTOR_SIZE[2] + 0.001]).GetAsMatrix4(),
        axis=(1.0, 0.0, 0.0),
        travel=2.0 * SLIDE_AMPLITUDE,
        mass=0.2,
        force=500.0,
    )
    return add_moving_body(plant, distractor)
