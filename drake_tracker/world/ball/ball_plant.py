"""The laboratory of the ball: arm with cup, inclined board, release gate, ball and table in one MultibodyPlant."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from pydrake.geometry import SceneGraph
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex, RigidBody
from pydrake.systems.framework import DiagramBuilder

from drake_tracker.arm.description import ArmDescription
from drake_tracker.arm.plant import add_arm, models_parser, set_servo_gains
from drake_tracker.core.timing import BALL_TIME_STEP
from drake_tracker.world.ball.ball_board import BALL_RADIUS, draw_board_pose, draw_pegs, draw_start
from drake_tracker.world.ball.ball_fixtures import GATE_TRAVEL, TABLE_HEIGHT, WOOD, add_board, add_distractor, add_gate
from drake_tracker.world.config import BallConfig, BoardConfig
from drake_tracker.world.train.plant import add_ground, add_plant, add_table

TABLE_X = 0.49
"""Distance by which the table under the board is moved away from the arm [m]: the cup goes below the table's top."""
ASIDE = (1.05, 0.0, BALL_RADIUS)
"""p_W [m] of a ball that is not on the board yet: on the floor, under the table."""


@dataclass(frozen=True)
class BallLaboratory:
    """A plant with an arm, a cup, a table, the board, the gate and the ball, and the values drawn from the seed.

    Attributes:
        plant: finalized.
        scene_graph: with which the plant is registered.
        arm: model instance.
        gripper: model instance of the hand.
        table: model instance.
        board: model instance.
        board_body: its one body, whose frame is B.
        gate: model instance.
        distractor: model instance, or None.
        ball: model instance.
        ball_body: its one body, which is free.
        X_WB: pose of the board before any knock.
        pegs: axes of the pegs, shape (n, 2) [m, B].
        p_BoBall: start of the ball (3,) [m, B].
    """

    plant: MultibodyPlant
    scene_graph: SceneGraph
    arm: ModelInstanceIndex
    gripper: ModelInstanceIndex
    table: ModelInstanceIndex
    board: ModelInstanceIndex
    board_body: RigidBody
    gate: ModelInstanceIndex
    distractor: ModelInstanceIndex | None
    ball: ModelInstanceIndex
    ball_body: RigidBody
    X_WB: RigidTransform
    pegs: np.ndarray
    p_BoBall: np.ndarray


def add_ball_laboratory(
    builder: DiagramBuilder,
    *,
    description: ArmDescription,
    board: BoardConfig = BoardConfig(),
    ball: BallConfig = BallConfig(),
    seed: int = 0,
    time_step: float = BALL_TIME_STEP,
    ball_on_board: bool = True,
    decorate: Callable[[MultibodyPlant], None] | None = None,
) -> BallLaboratory:
    """Adds the plant of the ball's laboratory and its scene graph to a diagram.

    Args:
        builder: of the diagram.
        description: an arm whose hand is a cup.
        board: the board and its pegs.
        ball: where the ball starts.
        seed: of the random draws.
        time_step: of the plant [s].
        ball_on_board: False puts the ball aside and opens the gate, as while camera and board are initialised.
        decorate: called with the plant before it is finalized, to add visuals.

    Raises DrakeTrackerError for a board on which things do not fit.
    """
    plant, scene_graph = add_plant(builder, time_step=time_step)
    parts = add_arm(plant, description=description)
    set_servo_gains(plant, parts.arm, description.servo_inertia, description.servo_bandwidth)
    table = add_table(plant, height=TABLE_HEIGHT, x=TABLE_X)
    ball_instance = add_ball(plant)
    add_ground(plant, table=table, size=(4.0, 4.0, 0.1), material=WOOD.properties())

    X_WB = draw_board_pose(board, seed)
    pegs = draw_pegs(board, seed)
    p_BoBall = draw_start(ball, seed)
    board_instance, board_body = add_board(plant, board=board, X_WB=X_WB, pegs=pegs, loose=board.knock_time > 0.0)
    gate = add_gate(plant, board_body=board_body, start_x=p_BoBall[0])
    distractor = add_distractor(plant) if board.distractor else None
    if decorate is not None:
        decorate(plant)
    plant.Finalize()
    ball_body = plant.GetBodyByName("ball", ball_instance)
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
        board=board_instance,
        board_body=board_body,
        gate=gate,
        distractor=distractor,
        ball=ball_instance,
        ball_body=ball_body,
        X_WB=X_WB,
        pegs=pegs,
        p_BoBall=p_BoBall,
    )


def add_ball(plant: MultibodyPlant) -> ModelInstanceIndex:
    """Adds the ball, one free body, to a plant that is not yet finalized."""
    (ball,) = models_parser(plant).AddModelsFromUrl("package://drake_tracker_models/ball/ball.sdf")
    return ball


def add_floor(plant: MultibodyPlant) -> None:
    """Adds the appearance of a floor to a plant that is not yet finalized."""
    models_parser(plant).AddModelsFromUrl("package://drake_tracker_models/floor/floor.sdf")
