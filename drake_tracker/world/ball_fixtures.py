"""What stands in the laboratory of the ball: board with pegs and walls, release gate, and a box that distracts."""

from dataclasses import dataclass

import numpy as np
from pydrake.geometry import AddContactMaterial, Box, Cylinder, ProximityProperties
from pydrake.math import RigidTransform
from pydrake.multibody.plant import CoulombFriction
from pydrake.multibody.tree import FixedOffsetFrame, PdControllerGains, PrismaticJoint, SpatialInertia

from drake_tracker.world.ball_board import BALL_RADIUS, PEG_HEIGHT, PEG_RADIUS, START_Y
from drake_tracker.world.ball_board_visual import THICKNESS, WALL_HEIGHT, WALL_THICKNESS, add_board_visual

TABLE_HEIGHT = 0.45
"""Of the top of the table that carries the board [m]."""
BOARD_DENSITY = 600.0
"""Plywood [kg/m^3]."""
KNOCK = 0.004
"""How far [m] a knock moves the board across."""
GATE_SIZE = (0.050, 0.004, 0.030)
GATE_TRAVEL = 0.034
"""How far [m] the gate goes down to open: its top is then below the face."""
DISTRACTOR_SIZE = (0.07, 0.05, 0.06)
SLIDE_AMPLITUDE = 0.25
"""How far [m] it slides to either side."""
DISTRACTOR_PLACE = (1.05, 0.41)
"""(x, y)_W [m] on the table about which the distractor slides to and fro, beside the board."""


@dataclass(frozen=True)
class ContactMaterial:
    """Stiffness [N/m] and dissipation [s/m] of point contact, and friction."""

    stiffness: float
    dissipation: float
    friction: float

    def properties(self):
        properties = ProximityProperties()
        AddContactMaterial(self.dissipation, self.stiffness, CoulombFriction(self.friction, self.friction), properties)
        return properties


WOOD = ContactMaterial(1e5, 10.0, 0.4)
"""Board and gate: the ball sinks in by 5 um and does not bounce."""
PEG = ContactMaterial(200.0, 0.1, 0.2)
"""Pegs and walls. Drake has no coefficient of restitution, and its implicit steps swallow an impact that is over within
a few of them. So these are soft, as if sleeved: the ball sinks in by 1 to 3 mm for 12 ms, and comes back with 0.54 to
0.59 of its speed. On a table it would keep 0.88 (ITTF, Laws 2.1.3: 0.23 m of a drop of 0.30 m); a thin peg takes up
more."""


def add_board(plant, board, X_WB, pegs, loose=False):
    """Adds the board with its pegs and walls at X_WB: fixed, or ``loose``, on a stiff drive along x_B for a knock.

    Returns (model instance, body); the body's frame is B.
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
    add_board_visual(plant, body, board, X_WB, pegs, TABLE_HEIGHT)
    if loose:
        _add_slide(plant, "board_slide", instance, plant.world_frame(), X_WB, body, [1.0, 0.0, 0.0], mass, 60.0, 0.01)
    else:
        plant.WeldFrames(plant.world_frame(), body.body_frame(), X_WB)
    return instance, body


def add_gate(plant, board_body, x):
    """Adds the release gate in front of a ball that starts at x_B [m]; its joint counts up as it goes down, opening.

    Returns the model instance.
    """
    instance = plant.AddModelInstance("gate")
    mass = 0.02
    gate = plant.AddRigidBody("gate", instance, SpatialInertia.SolidBoxWithMass(mass, *GATE_SIZE))
    plant.RegisterCollisionGeometry(gate, RigidTransform(), Box(*GATE_SIZE), "bar", WOOD.properties())
    plant.RegisterVisualGeometry(gate, RigidTransform(), Box(*GATE_SIZE), "look", np.array([0.85, 0.85, 0.83, 1.0]))
    X_BG = RigidTransform([x, START_Y - BALL_RADIUS - 0.5 * GATE_SIZE[1], 0.5 * GATE_SIZE[2] + 0.001])
    _add_slide(
        plant, "gate_slide", instance, board_body.body_frame(), X_BG, gate, [0.0, 0.0, -1.0], mass, 60.0, GATE_TRAVEL
    )
    return instance


def add_distractor(plant):
    """Adds a dark box on the table beside the board, on a slide along x_W. Returns the model instance."""
    instance = plant.AddModelInstance("distractor")
    mass = 0.2
    box = plant.AddRigidBody("distractor", instance, SpatialInertia.SolidBoxWithMass(mass, *DISTRACTOR_SIZE))
    plant.RegisterVisualGeometry(
        box, RigidTransform(), Box(*DISTRACTOR_SIZE), "look", np.array([0.05, 0.05, 0.06, 1.0])
    )
    X_WG = RigidTransform([*DISTRACTOR_PLACE, TABLE_HEIGHT + 0.5 * DISTRACTOR_SIZE[2] + 0.001])
    travel = 2.0 * SLIDE_AMPLITUDE
    _add_slide(plant, "distractor_slide", instance, plant.world_frame(), X_WG, box, [1.0, 0.0, 0.0], mass, 30.0, travel)
    return instance


def _add_slide(plant, name, instance, parent, X_PF, body, axis, mass, bandwidth, travel):
    """Puts ``body`` on a prismatic joint with a position drive of ``bandwidth`` [rad/s]; it travels +-travel [m]."""
    frame = plant.AddFrame(FixedOffsetFrame(f"{name}_frame", parent, X_PF, instance))
    joint = plant.AddJoint(PrismaticJoint(name, frame, body.body_frame(), axis, -travel, travel))
    actuator = plant.AddJointActuator(name, joint, 500.0)
    actuator.set_controller_gains(PdControllerGains(p=mass * bandwidth**2, d=2.0 * mass * bandwidth))
    return joint
