"""The crossing of a predicted path with the bottom edge of an inclined board, and the place of the cup.

The board's frame B has its origin on the face at the middle of the bottom edge, y_B up the slope and z_B outward.
"""

import math
from typing import NamedTuple

import numpy as np

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.messages import KNOT_FIELDS, Prediction, prediction_knots

HAND_YAW = math.pi
"""Direction [rad] of the hand's x axis from the board's upward direction: the cup's stem is on the arm's side."""
_STD = KNOT_FIELDS.index("std")


class BoardExit(NamedTuple):
    """A crossing of the bottom edge.

    Attributes:
        time: time of the crossing [s].
        p_WQ: position of the ball's centre at the crossing, shape (3,) [m].
        place: pose (x, y, z, yaw) in W, shape (4,) [m, rad], over which the ball will be when it is ``beyond`` the
            edge, at the height of the crossing.
        std: standard deviation that the packet predicts there [m].
    """

    time: float
    p_WQ: np.ndarray
    place: np.ndarray
    std: float


class BoardEdge:
    """The bottom edge of the board as the arm knows it.

    Args:
        X_WB: pose of the board, 4 x 4 or the 12 numbers of its upper three rows.
        width: width of the board's face [m].
        ball_radius: radius of the ball [m].
        beyond: horizontal distance from the edge to the middle of the cup [m].
        hand_yaw: direction of x_T from the board's horizontal direction up the slope [rad].

    Raises DrakeTrackerError for an X_WB that is not the pose of a board that rises.
    """

    def __init__(
        self,
        X_WB: np.ndarray,
        width: float = 0.60,
        ball_radius: float = 0.020,
        beyond: float = 0.050,
        hand_yaw: float = HAND_YAW,
    ) -> None:
        X_WB = np.asarray(X_WB, dtype=float)
        if X_WB.size not in (12, 16) or not np.all(np.isfinite(X_WB)):
            raise DrakeTrackerError("board edge: X_WB must be 4 x 4 numbers, or the 12 of its upper three rows")
        X_WB = X_WB.reshape(-1, 4)[:3]
        self.R_WB, self.p_WB = X_WB[:, :3].copy(), X_WB[:, 3].copy()
        up = self.R_WB[:2, 1]
        if not (self.R_WB[2, 1] > 1e-3 and np.hypot(*up) > 1e-3):
            raise DrakeTrackerError("board edge: X_WB describes a board that does not rise along its y axis")
        self.ball_radius, self.beyond = ball_radius, beyond
        self.farthest = 0.5 * width - ball_radius
        self.outward = -np.append(up / np.hypot(*up), 0.0)
        self.yaw = math.atan2(up[1], up[0]) + hand_yaw

    @property
    def home(self) -> np.ndarray:
        """The `place` of a ball that comes straight down the middle, shape (4,)."""
        return self.place(0.0)

    def crossing(self, packet: np.ndarray) -> BoardExit | None:
        """Returns the crossing on the path of a `Prediction` vector, None when there is none."""
        packet = np.asarray(packet)
        if not _is_path(packet):
            return None
        knots = prediction_knots(packet)
        x, y = self._on_board(knots)
        below = np.flatnonzero((y[:-1] > 0.0) & (y[1:] <= 0.0))
        if len(below) == 0:
            return None
        k = below[0]
        drop = y[k] - y[k + 1]
        part, drift = y[k] / drop, (x[k + 1] - x[k]) / drop
        at = x[k] + drift * y[k]
        p_WQ = self.p_WB + self.R_WB @ [at, 0.0, self.ball_radius]
        std = (1.0 - part) * knots[k, _STD] + part * knots[k + 1, _STD]
        fields = Prediction(packet)
        time = fields.first_time + fields.spacing * (k + part)
        return BoardExit(float(time), p_WQ, self.place(at + drift * self.beyond), float(std))

    def stays_above(self, packet: np.ndarray) -> bool:
        """Returns whether the path of a `Prediction` vector stays on the board from its beginning to its end."""
        packet = np.asarray(packet)
        return _is_path(packet) and bool((self._on_board(prediction_knots(packet))[1] > 0.0).all())

    def place(self, x: float) -> np.ndarray:
        """Returns the pose (x, y, z, yaw) in W of `BoardExit.place`, shape (4,) [m, rad], within the board's width.

        Args:
            x: position of the ball along x_B [m].
        """
        x = min(max(x, -self.farthest), self.farthest)
        p_WQ = self.p_WB + self.R_WB @ [x, 0.0, self.ball_radius] + self.beyond * self.outward
        return np.append(p_WQ, self.yaw)

    def _on_board(self, knots: np.ndarray) -> np.ndarray:
        """Returns x and y in B of knots, shape (2, n) [m]."""
        return ((knots[:, :3] - self.p_WB) @ self.R_WB)[:, :2].T


def _is_path(packet: np.ndarray) -> bool:
    return bool(Prediction(packet).valid) and bool(np.all(np.isfinite(packet)))
