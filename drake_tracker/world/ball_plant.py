"""The laboratory of the ball in one MultibodyPlant: arm with cup, inclined board, release gate, ball, table."""

from dataclasses import dataclass

import numpy as np
from pydrake.geometry import Box
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlantConfig

from drake_tracker.arm.description import add_arm, models_parser
from drake_tracker.arm.joint_servo import set_servo_gains
from drake_tracker.world.ball_board import BALL_RADIUS, draw_board_pose, draw_pegs, draw_start
from drake_tracker.world.ball_fixtures import GATE_TRAVEL, TABLE_HEIGHT, WOOD, add_board, add_distractor, add_gate
from drake_tracker.world.plant import TABLE_MODEL_HEIGHT

TABLE_X = 0.49
"""How far [m] the table under the board is moved away from the arm: the cup comes down lower than its top."""
ASIDE = (1.05, 0.0, BALL_RADIUS)
"""p_W [m] of a ball that is not on the board yet: on the floor, under the table."""


@dataclass(frozen=True)
class BallLaboratory:
    """The plant, the model instances in it and what the seed has drawn.

    gripper: the hand's instance. board, gate, distractor, ball: instances, ``distractor`` None without one. X_WB: the
    board's pose before any knock. pegs: (n, 2) [m, B]. p_BoBall: start of the ball [m, B].
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
      ball_on_board: False: the ball lies aside and the gate is open, as while the camera and the board are initialised.
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
    p_WBall = X_WB @ p_BoBall if ball_on_board else ASIDE
    plant.SetDefaultFloatingBaseBodyPose(ball_body, RigidTransform(p_WBall))
    if not ball_on_board:
        plant.SetDefaultPositions(gate, [GATE_TRAVEL])
    return BallLaboratory(
        plant=plant,
        scene_graph=scene_graph,
        arm=parts.arm,
        gripper=parts.gripper,
        table=table,
        board=board,
        board_body=board_body,
        gate=gate,
        distractor=distractor,
        ball=ball,
        ball_body=ball_body,
        X_WB=X_WB,
        pegs=pegs,
        p_BoBall=p_BoBall,
    )


def add_floor(plant):
    """Draws a floor to stand on. For ``decorate``: a studio has one of its own."""
    models_parser(plant).AddModelsFromUrl("package://drake_tracker_models/floor/floor.sdf")
