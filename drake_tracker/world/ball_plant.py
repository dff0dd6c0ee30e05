"""The laboratory of the ball in one MultibodyPlant: arm with cup, inclined board, release gate, ball, table."""

from dataclasses import dataclass

import numpy as np
from pydrake.geometry import AddContactMaterial, Box, Cylinder, ProximityProperties
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import AddMultibodyPlant, CoulombFriction, MultibodyPlantConfig
from pydrake.multibody.tree import FixedOffsetFrame, PdControllerGains, PrismaticJoint, SpatialInertia

from drake_tracker.arm.description import add_arm, models_parser
from drake_tracker.arm.joint_servo import set_servo_gains
from drake_tracker.world.ball_board import (
    BALL_RADIUS,
    PEG_HEIGHT,
    PEG_RADIUS,
    START_Y,
    draw_board_pose,
    draw_pegs,
    draw_start,
)
from drake_tracker.world.ball_board_visual import THICKNESS, WALL_HEIGHT, WALL_THICKNESS, add_board_visual
from drake_tracker.world.plant import TABLE_MODEL_HEIGHT

TABLE_HEIGHT, TABLE_X = 0.45, 0.49
"""Height [m] of the top of the table under the board, and how far its model is moved away from the arm: the cup comes
down lower than the top."""
BOARD_DENSITY = 600.0
"""Plywood [kg/m^3]."""
KNOCK = 0.004
"""How far [m] a knock moves the board across."""
GATE_SIZE = np.array([0.050, 0.004, 0.030])
GATE_TRAVEL = 0.034
"""How far [m] the gate goes down to open: its top is then below the face."""
DISTRACTOR_SIZE = np.array([0.07, 0.05, 0.06])
SLIDE_AMPLITUDE = 0.25
"""How far [m] it slides to either side."""
DISTRACTOR_PLACE = (1.05, 0.41)
"""(x, y)_W [m] on the table about which the distractor slides to and fro, beside the board."""
ASIDE = (1.05, 0.0, BALL_RADIUS)
"""p_W [m] of a ball that is not on the board yet: on the floor, under the table."""


@dataclass(frozen=True)
class ContactMaterial:
    """Stiffness [N/m] and dissipation [s/m] of point contact, and friction."""

    stiffness: float
    dissipation: float
    friction: float

    def properties(self):
        properties = ProximityProperties()
        AddContactMaterial(
            self.dissipation, self.stiffness, CoulombFriction(self.friction, self.friction), properties
        )
        return properties


WOOD = ContactMaterial(1e4, 10.0, 0.4)
"""Board: the ball sinks in by 5 um and does not bounce."""
PEG = ContactMaterial(200.0, 0.1, 0.2)
"""Pegs and walls: soft enough that a step of 1/600 s resolves the impact."""


@dataclass(frozen=True)
class BallLaboratory:
    """The plant, the model instances in it and what the seed has drawn.

    gripper: the instance of the hand. board, gate, distractor: instances; distractor is None without one. X_WB: the
    board's pose, truth. pegs: (n, 2) [m, B]. p_BoBall: start of the ball [m, B].
    """

    plant: object
    scene_graph: object
    arm: object
    gripper: object
    table: object
    board: object
    board_body: object
    gate: object
    distractor: object
    ball: object
    ball_body: object
    X_WB: RigidTransform
    pegs: np.ndarray
    p_BoBall: np.ndarray


def add_ball_laboratory(builder, description, scenario, ball_on_board=True, decorate=None):
    """Adds the plant and its scene graph to a diagram.

    Args:
      description: an `ArmDescription` whose hand is a cup. scenario: fields board, ball, seed, time_step.
      ball_on_board: False: the ball lies aside, as while the camera and the board are initialised.
      decorate: called with the plant before it is finalized, to add visuals.

    Returns BallLaboratory. Raises DrakeTrackerError for a board on which things do not fit.
    """
    config = MultibodyPlantConfig(
        time_step=scenario.time_step, contact_model="point", discrete_contact_approximation="lagged"
    )
    plant, scene_graph = AddMultibodyPlant(config, builder)
    parts = add_arm(plant, description)
    set_servo_gains(plant, parts.arm, description.servo_inertia, description.servo_bandwidth)
    parser = models_parser(plant)
    (table,) = parser.AddModelsFromUrl("package://drake_tracker_models/table/table.sdf")
    X_WTable = RigidTransform([TABLE_X, 0.0, TABLE_HEIGHT - TABLE_MODEL_HEIGHT])
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("table", table), X_WTable)
    (ball,) = parser.AddModelsFromUrl("package://drake_tracker_models/ball/ball.sdf")
    X_WFloor = RigidTransform([0.0, 0.0, -0.05])
    plant.RegisterCollisionGeometry(plant.world_body(), X_WFloor, Box(4.0, 4.0, 0.1), "floor", WOOD.properties())

    X_WB = draw_board_pose(scenario.board, scenario.seed)
    pegs = draw_pegs(scenario.board, scenario.seed)
    p_BoBall = draw_start(scenario.ball, scenario.seed)
    board, board_body = add_board(plant, scenario.board, X_WB, pegs, loose=scenario.board.knock_time > 0.0)
    gate = add_gate(plant, board_body, p_BoBall[0])
    distractor = add_distractor(plant) if scenario.board.distractor else None
    if decorate is not None:
        decorate(plant)
    plant.Finalize()
    ball_body = plant.GetBodyByName("ball", ball)
    X_WBall = RigidTransform(X_WB @ p_BoBall) if ball_on_board else RigidTransform(ASIDE)
    plant.SetDefaultFloatingBaseBodyPose(ball_body, X_WBall)
    return BallLaboratory(
        plant, scene_graph, parts.arm, parts.gripper, table, board, board_body, gate, distractor, ball, ball_body,
        X_WB, pegs, p_BoBall,
    )  # fmt: skip


def add_floor(plant):
    """Draws a floor to stand on. For ``decorate``: a studio has one of its own."""
    models_parser(plant).AddModelsFromUrl("package://drake_tracker_models/floor/floor.sdf")


def add_board(plant, board, X_WB, pegs, loose=False):
    """Adds the board with its pegs and walls at X_WB, fixed, or ``loose``: on a stiff drive along x_B that a knock moves.

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
    _add_slide(plant, "distractor_slide", instance, plant.world_frame(), X_WG, box, [1.0, 0.0, 0.0], mass, 30.0, 2.0 * SLIDE_AMPLITUDE)
    return instance


def _add_slide(plant, name, instance, parent, X_PF, body, axis, mass, bandwidth, travel):
    """Puts ``body`` on a prismatic joint with a position drive of ``bandwidth`` [rad/s], free to travel +-travel [m]."""
    frame = plant.AddFrame(FixedOffsetFrame(f"{name}_frame", parent, X_PF, instance))
    joint = plant.AddJoint(PrismaticJoint(name, frame, body.body_frame(), axis, -travel, travel))
    actuator = plant.AddJointActuator(name, joint, 500.0)
    actuator.set_controller_gains(PdControllerGains(p=mass * bandwidth**2, d=2.0 * mass * bandwidth))
    return joint
