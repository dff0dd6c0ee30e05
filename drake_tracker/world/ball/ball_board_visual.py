"""The appearance of the inclined board: white face, wooden pegs, black circles and crosses, a stand; no collision."""

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RigidBody

from drake_tracker.world.ball.ball_board import CIRCLE_RADIUS, CIRCLES, PEG_HEIGHT, PEG_RADIUS, TOUCH_MARKS
from drake_tracker.world.config import BoardConfig
from drake_tracker.world.visual_mesh import FlatMesh, add_visual_mesh, disc, merge, prism, rectangle

THICKNESS = 0.012
"""Thickness of the board [m], downwards from its face."""
WALL_HEIGHT, WALL_THICKNESS = 0.025, 0.008
"""Size of the walls [m]: a little higher than the ball's centre, or the ball would climb their edge."""
PROUD = 0.0002
"""Height of circles and crosses above the face [m], so that no two faces coincide."""
CROSS_SIZE = (0.016, 0.002)
LEG_SIDE = 0.028
LEGS = tuple((x, y) for y in (0.22, 0.80) for x in (-0.24, 0.24))
"""(x, y)_B [m] of the four legs between board and table."""

WHITE = (0.86, 0.86, 0.85, 1.0)
WOOD = (0.62, 0.42, 0.24, 1.0)
BLACK = (0.02, 0.02, 0.02, 1.0)
STEEL = (0.22, 0.23, 0.25, 1.0)


def add_board_visual(
    plant: MultibodyPlant,
    *,
    body: RigidBody,
    board: BoardConfig,
    X_WB: RigidTransform,
    pegs: np.ndarray,
    table_height: float,
) -> None:
    """Adds the appearance of the board to a body.

    Args:
        plant: registered with a SceneGraph, and not yet finalized.
        body: of the plant; its frame is B.
        board: its size, and whether it has walls.
        X_WB: pose of the board, from which its legs go straight down.
        pegs: axes of the pegs, shape (n, 2) [m, B].
        table_height: z_W at which the legs end [m].
    """
    for name, mesh, colour in (
        ("board_face", face_mesh(board), WHITE),
        ("board_pegs", peg_mesh(pegs), WOOD),
        ("board_marks", mark_mesh(), BLACK),
        ("board_stand", stand_mesh(board, X_WB, table_height), STEEL),
    ):
        if mesh[1]:
            add_visual_mesh(plant, body=body, X_BG=RigidTransform(), mesh=mesh, name=name, colour=colour)


def face_mesh(board: BoardConfig) -> FlatMesh:
    """Returns the mesh of the plate and its walls."""
    middle = 0.5 * board.length
    parts = [prism(rectangle((0.0, middle), board.width, board.length), -THICKNESS, 0.0)]
    if board.walls:
        x = 0.5 * (board.width + WALL_THICKNESS)
        parts += [
            prism(rectangle((side * x, middle), WALL_THICKNESS, board.length), -THICKNESS, WALL_HEIGHT)
            for side in (-1.0, 1.0)
        ]
    return merge(parts)


def peg_mesh(pegs: np.ndarray) -> FlatMesh:
    """Returns the mesh of all pegs, with axes at (x, y)_B [m], shape (n, 2); it is empty when there are none."""
    parts = [prism(disc(peg, PEG_RADIUS, 20), -0.001, PEG_HEIGHT) for peg in pegs]
    return merge(parts) if parts else (np.empty((0, 3)), [])


def mark_mesh() -> FlatMesh:
    """Returns the mesh of the four circles and the crosses at the touch marks."""
    parts = [prism(disc(centre, CIRCLE_RADIUS, 64), -0.001, PROUD) for centre in CIRCLES]
    length, breadth = CROSS_SIZE
    for centre in TOUCH_MARKS:
        parts.append(prism(rectangle(centre, length, breadth), -0.001, PROUD))
        parts.append(prism(rectangle(centre, breadth, length), -0.001, 0.9 * PROUD))
    return merge(parts)


def stand_mesh(board: BoardConfig, X_WB: RigidTransform, table_height: float) -> FlatMesh:
    """Returns the mesh, in B, of two rails under the board, and of upright legs from them down to the table."""
    middle, reach = 0.5 * board.length, 0.5 * board.length - 0.05
    parts = []
    for x in {x for x, _ in LEGS}:
        parts.append(prism(rectangle((x, middle), LEG_SIDE, 2.0 * reach), -THICKNESS - 0.018, -THICKNESS + 0.001))
    for x, y in LEGS:
        top = X_WB @ np.array([x, y, -THICKNESS - 0.008])
        # Upright in W, so made about its own top and then transformed to B.
        vertices, faces = prism(rectangle((0.0, 0.0), LEG_SIDE, LEG_SIDE), table_height - top[2], 0.0)
        heading = RotationMatrix.MakeZRotation(np.arctan2(*X_WB.rotation().matrix()[1::-1, 1]))
        parts.append((X_WB.inverse().multiply((heading.multiply(vertices.T) + top[:, None])).T, faces))
    return merge(parts)
