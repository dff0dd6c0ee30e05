"""The inclined board with pegs, down which the ball rolls: where everything is, drawn from the seed.

Frame B: origin in the middle of the bottom edge, on the face; y up the slope, z the outward normal, x across. A
configuration is any object with the fields of a scenario's ``board``: incline_deg, length, width [m], edge_position
(x, y, z) [m, W], placement_range [m], rotation_range_deg, walls, peg_count.
"""

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from drake_tracker.core.errors import DrakeTrackerError

BALL_RADIUS = 0.020
"""Of the model ball [m]."""
CIRCLES = ((-0.25, 0.85), (0.25, 0.85), (0.25, 0.05), (-0.22, 0.05))
"""Centres (x, y)_B [m] of the four black circles; the last is out of square, so that there is one way to name them."""
CIRCLE_RADIUS = 0.025
TOUCH_MARKS = ((-0.20, 0.12), (0.20, 0.12), (0.0, 0.30))
"""(x, y)_B [m] at which the operator has the arm touch the board."""
START_Y = 0.84
"""y_B [m] of the ball's centre behind the gate."""
START_RANGE = 0.22
"""Largest |x_B| [m] of the start."""
PEG_RADIUS, PEG_HEIGHT = 0.006, 0.035
PEG_COUNTS = (12, 14)
PEG_X, PEG_Y = 0.26, (0.20, 0.72)
"""Region of the pegs' axes [m]: |x_B| and y_B."""
PEG_GAP = 0.065
"""Least distance [m] of a peg's axis from another's and from the walls: 0.053 m are left for a ball of 0.040 m."""
MARK_GAP = 0.090
"""Least distance [m] of a peg's axis from a touch mark: the cup above its tip must find room there."""
MIN_LENGTH, MIN_WIDTH = 0.88, 0.56
"""Below these [m] the circles would hang over the edges."""

_POSE_STREAM, _PEG_STREAM, _START_STREAM, _PLACING_STREAM = 30, 31, 32, 33
_TRIES = 10_000


def board_pose(board, dx=0.0, dy=0.0, turn=0.0):
    """Returns X_WB of the board moved by (dx, dy) [m] from its nominal place and turned by ``turn`` [rad] about z_W.

    Raises DrakeTrackerError when the board is too small for its circles or not inclined between 0 and 45 deg.
    """
    if board.length < MIN_LENGTH or board.width < MIN_WIDTH:
        raise DrakeTrackerError(
            f"board.length, board.width are {board.length:g}, {board.width:g} m; they must be at least "
            f"{MIN_LENGTH:g} and {MIN_WIDTH:g} m to hold the circles"
        )
    if not 0.0 < board.incline_deg < 45.0:
        raise DrakeTrackerError(f"board.incline_deg is {board.incline_deg:g}; it must lie between 0 and 45")
    incline = np.deg2rad(board.incline_deg)
    up_the_slope = np.array([np.cos(incline), 0.0, np.sin(incline)])
    normal = np.array([-np.sin(incline), 0.0, np.cos(incline)])
    R_WB = RotationMatrix(np.column_stack([np.cross(up_the_slope, normal), up_the_slope, normal]))
    return RigidTransform(RotationMatrix.MakeZRotation(turn) @ R_WB, np.add(board.edge_position, [dx, dy, 0.0]))


def draw_board_pose(board, seed):
    """Returns X_WB as drawn from the seed: moved and turned within the configured ranges."""
    rng = np.random.default_rng([seed, _POSE_STREAM])
    dx, dy = rng.uniform(-board.placement_range, board.placement_range, 2)
    limit = np.deg2rad(board.rotation_range_deg)
    return board_pose(board, dx, dy, rng.uniform(-limit, limit))


def draw_pegs(board, seed):
    """Returns (x, y)_B [m] of the pegs' axes, shape (n, 2), thrown at random until each has its distance to all else.

    Raises DrakeTrackerError when ``board.peg_count`` (-1: 12 to 14, drawn) does not fit on the board.
    """
    rng = np.random.default_rng([seed, _PEG_STREAM])
    low, high = PEG_COUNTS
    drawn = int(rng.integers(low, high, endpoint=True))
    count = drawn if board.peg_count < 0 else board.peg_count
    half_width = min(PEG_X, 0.5 * board.width - PEG_GAP)
    pegs = np.empty((0, 2))
    for _ in range(_TRIES):
        if len(pegs) == count:
            return pegs
        peg = np.array([rng.uniform(-half_width, half_width), rng.uniform(*PEG_Y)])
        if _distance(peg, pegs) >= PEG_GAP and _distance(peg, TOUCH_MARKS) >= MARK_GAP:
            pegs = np.vstack([pegs, peg])
    raise DrakeTrackerError(f"board.peg_count is {board.peg_count}; only {len(pegs)} pegs found room with this seed")


def draw_start(ball, seed):
    """Returns p_BoBall (3,) [m] of the ball behind the gate; ``ball.start_x`` None: drawn from the seed."""
    start_x = np.random.default_rng([seed, _START_STREAM]).uniform(-START_RANGE, START_RANGE)
    if ball.start_x is not None:
        start_x = ball.start_x
    if not abs(start_x) <= START_RANGE:
        raise DrakeTrackerError(
            f"ball.start_x is {start_x:g} m; it must lie between {-START_RANGE:g} and {START_RANGE:g} m"
        )
    return np.array([start_x, START_Y, BALL_RADIUS])


def draw_placing_errors(operator, seed):
    """Returns (x, y)_B [m], shape (3, 2), by which the operator misses each touch mark.

    A stand-in for a person who brings the arm above the marks by eye; ``operator.placing_std`` [m] per axis.
    """
    rng = np.random.default_rng([seed, _PLACING_STREAM])
    return operator.placing_std * rng.standard_normal((len(TOUCH_MARKS), 2))


def face_corners(board):
    """Returns the corners (4, 3) [m, B] of the board's face."""
    x, y = 0.5 * board.width, board.length
    return np.array([[-x, 0.0, 0.0], [x, 0.0, 0.0], [x, y, 0.0], [-x, y, 0.0]])


def _distance(point, others):
    """Smallest distance of a point (2,) from others (n, 2); infinite when there is none."""
    return np.min(np.linalg.norm(np.reshape(others, (-1, 2)) - point, axis=1), initial=np.inf)
