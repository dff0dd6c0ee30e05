"""Which pairs of images agree on how two cameras stand, and which end of a symmetric board is the first.

Two cameras that do not move have the same relative pose in every pair. A board with rotational symmetry gives several
candidates for each pair, of which only one agrees with the other pairs. A pair of which none agrees was not taken at
one instant, or its images belong to different pairs.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drake_tracker.cameras.boards.board import Board
from drake_tracker.cameras.calibration.camera_calibration import board_pose
from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.core.errors import DrakeTrackerError

ANGLE = np.radians(5.0)
"""Angle by which the relative poses of two pairs may differ [rad]: one view gives a pose to 1 or 2 deg."""
_SHARE = 0.1
"""Distance by which they may differ, as a fraction of the distance of the board."""
_WORSE = 6.0
"""Multiple of the median disagreement beyond which a pair does not agree."""
_WORST = 2.0
"""Disagreement beyond which a pair never agrees, as a multiple of the limits above."""
_APART = 2.0
"""Least ratio between the disagreements of two answers, below which both are possible."""


@dataclass(frozen=True, eq=False)
class Agreement:
    """Agreement of the pairs of two cameras.

    Attributes:
        views_right: points (n, 2) [px] of the board in the right images, in the order of the points in the left images.
        agrees: whether each pair agrees with most others, shape (m,).
        angles: angle between the relative pose of each pair and the agreed relative pose, shape (m,) [rad].
    """

    views_right: list[np.ndarray]
    agrees: np.ndarray
    angles: np.ndarray


def upright(view: np.ndarray, board: Board) -> np.ndarray:
    """Returns the points (n, 2) [px] of a board in the order whose x axis points most to the right in the image."""
    right = board.points()[:, 0] - board.points()[:, 0].mean()
    return max((view[turn] for turn in board.turns()), key=lambda each: float(np.nansum(right * each[:, 0])))


def agree(
    views_left: Sequence[np.ndarray],
    views_right: Sequence[np.ndarray],
    cameras: Sequence[CameraModel],
    board: Board,
) -> Agreement:
    """Returns how the pairs of images agree.

    Args:
        views_left: points (n, 2) [px] of the board in the left image of each pair, NaN for hidden points.
        views_right: points (n, 2) [px] in the right images, in the order of any turn of the board.
        cameras: the lenses of the left and of the right camera, at any pose.
        board: the board.

    Raises DrakeTrackerError when the board is symmetric, and the pairs allow two answers.
    """
    alone = [camera.in_frame(camera.X_WC) for camera in cameras]
    turns = board.turns()
    X_LB = np.array([board_pose(view, alone[0], board) for view in views_left])
    X_RB = np.array([[board_pose(view[turn], alone[1], board) for turn in turns] for view in views_right])
    X_RL = X_RB @ np.linalg.inv(X_LB)[:, np.newaxis]  # (m, turns, 4, 4)
    depth = np.median(X_LB[:, 2, 3])

    def differences(X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Returns the disagreement (m, turns) with a relative pose, 1 at its limit, and the angle [rad]."""
        cosine = 0.5 * (np.einsum("mtij,ij->mt", X_RL[:, :, :3, :3], X[:3, :3]) - 1.0)
        angle = np.arccos(np.clip(cosine, -1.0, 1.0))
        # The camera's own position, seen from the middle of the boards, does not depend on the angle.
        middle = np.array([0.0, 0.0, depth])
        moved = np.linalg.norm((X_RL[:, :, :3, :3] - X[:3, :3]) @ middle + X_RL[:, :, :3, 3] - X[:3, 3], axis=2)
        return np.maximum(angle / ANGLE, moved / (_SHARE * depth)), angle

    answers = []
    for k in range(len(X_RL)):
        for turn in range(len(turns)):
            disagreement, _ = differences(X_RL[k, turn])
            choice = disagreement.argmin(axis=1)
            answers.append((float(np.median(disagreement.min(axis=1))), choice.tolist(), X_RL[k, turn]))
    answers.sort(key=lambda answer: answer[0])
    best, choice, X = answers[0]
    disagreement, angle = differences(X)
    least, angles = disagreement.min(axis=1), angle[np.arange(len(choice)), choice]
    agrees = least <= np.clip(_WORSE * best, 1.0, _WORST)
    other = [score for score, others, _ in answers if sum(a == b for a, b in zip(choice, others)) <= len(choice) // 2]
    if len(turns) > 1 and other and best <= 1.0 and min(other) < max(_APART * best, 0.2):
        raise DrakeTrackerError(
            f"the {board.name} looks the same after half a turn, and the pairs do not tell which end is which: take "
            "photographs of it at more different angles, or use a board with one odd and one even number of corners"
        )
    right = [view[turns[each]] for view, each in zip(views_right, choice)]
    return Agreement(right, agrees, angles)
