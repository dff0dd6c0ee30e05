"""The looks of the inclined board: white matt face, wooden pegs, black circles and crosses, a stand; no collision."""

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from drake_tracker.world.ball_board import CIRCLE_RADIUS, CIRCLES, PEG_HEIGHT, PEG_RADIUS, TOUCH_MARKS
from drake_tracker.world.visual_mesh import add_visual_mesh, disc, merge, prism, rectangle

THICKNESS = 0.012
"""Of the board [m], downwards from its face."""
WALL_HEIGHT, WALL_THICKNESS = 0.025, 0.008
"""Of the walls [m]: a little higher than the ball's centre, or it would climb their edge."""
PROUD = 0.0002
"""How far [m] circles and crosses stand out of the face, so that no two faces coincide."""
CROSS_SIZE = (0.016, 0.002)
LEG_SIDE = 0.028
LEGS = tuple((x, y) for y in (0.22, 0.80) for x in (-0.24, 0.24))
"""(x, y)_B [m] of the four legs between board and table."""

WHITE = (0.86, 0.86, 0.85, 1.0)
WOOD = (0.62, 0.42, 0.24, 1.0)
BLACK = (0.02, 0.02, 0.02, 1.0)
STEEL = (0.22, 0.23, 0.25, 1.0)


def add_board_visual(plant, body, board, X_WB, pegs, table_height):
    """Draws the board on ``body``, whose frame is B.

    ``pegs`` (n, 2) [m, B]; the legs end at ``table_height`` [m] below the board at X_WB.
    """
    for name, mesh, colour in (
        ("board_face", face_mesh(board), WHITE),
        ("board_pegs", peg_mesh(pegs), WOOD),
        ("board_marks", mark_mesh(), BLACK),
        ("board_stand", stand_mesh(board, X_WB, table_height), STEEL),
    ):
        if mesh[1]:
            add_visual_mesh(plant, body, RigidTransform(), *mesh, name, colour)


def face_mesh(board):
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


def peg_mesh(pegs):
    """Returns the mesh of all pegs; of none when there are none."""
    parts = [prism(disc(peg, PEG_RADIUS, 20), -0.001, PEG_HEIGHT) for peg in pegs]
    return merge(parts) if parts else (np.empty((0, 3)), [])


def mark_mesh():
    """Returns the mesh of the four circles and the crosses at the touch marks."""
    parts = [prism(disc(centre, CIRCLE_RADIUS, 64), -0.001, PROUD) for centre in CIRCLES]
    length, breadth = CROSS_SIZE
    for centre in TOUCH_MARKS:
        parts.append(prism(rectangle(centre, length, breadth), -0.001, PROUD))
        parts.append(prism(rectangle(centre, breadth, length), -0.001, 0.9 * PROUD))
    return merge(parts)


def stand_mesh(board, X_WB, table_height):
    """Returns the mesh, in B, of two rails under the board and of upright legs from them down to the table."""
    middle, reach = 0.5 * board.length, 0.5 * board.length - 0.05
    parts = []
    for x in {x for x, _ in LEGS}:
        parts.append(prism(rectangle((x, middle), LEG_SIDE, 2.0 * reach), -THICKNESS - 0.018, -THICKNESS + 0.001))
    for x, y in LEGS:
        top = X_WB @ np.array([x, y, -THICKNESS - 0.008])
        # Upright in W, so drawn about its own top and then turned into B.
        vertices, faces = prism(rectangle((0.0, 0.0), LEG_SIDE, LEG_SIDE), table_height - top[2], 0.0)
        heading = RotationMatrix.MakeZRotation(np.arctan2(*X_WB.rotation().matrix()[1::-1, 1]))
        parts.append((X_WB.inverse().multiply((heading.multiply(vertices.T) + top[:, None])).T, faces))
    return merge(parts)
