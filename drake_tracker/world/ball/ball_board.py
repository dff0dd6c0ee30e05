"""The inclined board with pegs down which the ball rolls: where everything is, drawn from the seed.

Frame B: origin in the middle of the bottom edge, on the face; y up the slope, z the outward normal, x across.
"""

from collections.abc import Sequence

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.world.config import BallConfig, BoardConfig, OperatorConfig

BALL_RADIUS = 0.020
"""Radius of the model ball [m]."""
CIRCLES = ((-0.25, 0.85), (0.25, 0.85), (0.25, 0.05), (-0.22, 0.05))
"""Centres (x, y)_B [m] of the four black circles; the last is out of square, so that their order is unique."""
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
"""Least distance [m] of a peg's axis from a touch mark, so that the cup above its tip does not meet a peg."""
MIN_LENGTH, MIN_WIDTH = 0.88, 0.56
"""Below these [m] the circles would extend over the edges."""

_POSE_STREAM, _PEG_STREAM, _START_STREAM, _PLACING_STREAM = 30, 31, 32, 33
_TRIES = 10_000


def board_pose(board: BoardConfig, dx: float = 0.0, dy: float = 0.0, turn: float = 0.0) -> RigidTransform:
    """Returns X_WB of a board that is displaced from its nominal pose.

    Args:
        board: its size, its incline and its nominal position.
        dx: displacement along x_W [m].
        dy: displacement along y_W [m].
        turn: rotation about z_W [rad].

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


def draw_board_pose(board: BoardConfig, seed: int) -> RigidTransform:
    """Returns X_WB drawn from the seed: displaced and rotated within the configured ranges."""
    rng = np.random.default_rng([seed, _POSE_STREAM])
    dx, dy = rng.uniform(-board.placement_range, board.placement_range, 2)
    limit = np.deg2rad(board.rotation_range_deg)
    return board_pose(board, dx, dy, rng.uniform(-limit, limit))


def draw_pegs(board: BoardConfig, seed: int) -> np.ndarray:
    """Returns (x, y)_B [m] of the pegs' axes, shape (n, 2), drawn from the seed so that each keeps its distances.

    Raises DrakeTrackerError when ``board.peg_count`` pegs (-1: 12 to 14, drawn) do not fit on the board.
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
    raise DrakeTrackerError(f"board.peg_count is {board.peg_count}; with this seed only {len(pegs)} pegs fit")


def draw_start(ball: BallConfig, seed: int) -> np.ndarray:
    """Returns p_BoBall (3,) [m] of the ball behind the gate; its x is ``ball.start_x``, or drawn when that is None.

    Raises DrakeTrackerError when ``ball.start_x`` is out of range.
    """
    start_x = np.random.default_rng([seed, _START_STREAM]).uniform(-START_RANGE, START_RANGE)
    if ball.start_x is not None:
        start_x = ball.start_x
    if not abs(start_x) <= START_RANGE:
        raise DrakeTrackerError(
            f"ball.start_x is {start_x:g} m; it must lie between {-START_RANGE:g} and {START_RANGE:g} m"
        )
    return np.array([start_x, START_Y, BALL_RADIUS])


def draw_placing_errors(operator: OperatorConfig, seed: int) -> np.ndarray:
    """Returns the operator's placement errors (x, y)_B [m] at the touch marks, shape (3, 2), drawn from the seed.

    They replace a person who moves the arm above the marks by eye, with a standard deviation of
    ``operator.placing_std`` per axis.
    """
    rng = np.random.default_rng([seed, _PLACING_STREAM])
    return operator.placing_std * rng.standard_normal((len(TOUCH_MARKS), 2))


def face_corners(board: BoardConfig) -> np.ndarray:
    """Returns the corners of the board's face, shape (4, 3) [m, B]."""
    x, y = 0.5 * board.width, board.length
    return np.array([[-x, 0.0, 0.0], [x, 0.0, 0.0], [x, y, 0.0], [-x, y, 0.0]])


def _distance(point: np.ndarray, others: Sequence[Sequence[float]] | np.ndarray) -> float:
    """Returns the smallest distance of a point (2,) from others (n, 2); infinite when there are none."""
    return np.min(np.linalg.norm(np.reshape(others, (-1, 2)) - point, axis=1), initial=np.inf)
