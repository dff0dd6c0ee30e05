"""What a packet predicts on the inclined board, as points to draw: the path, and where the ball leaves the board."""

import numpy as np

from drake_tracker.core.messages import predicted_points
from drake_tracker.grasp.ball.board_exit import BoardEdge

INTO_CUP = 0.08
"""Time after the crossing up to which the path is drawn [s]. Afterwards the ball is in the cup or was missed."""
WITHOUT_CROSSING = 1.0
"""Duration of a path that does not reach the edge [s]."""
BAR = 2.0
"""Half the length of the error bar at a predicted crossing, in standard deviations."""


class PredictedPath:
    """Points to draw for packets of predicted path on an inclined board.

    Args:
        edge: the bottom edge of the board, as the arm knows it.
    """

    def __init__(self, edge: BoardEdge) -> None:
        self._edge = edge

    def path(self, packet: np.ndarray, now: float, count: int) -> np.ndarray:
        """Returns points of the predicted path in W [m], shape (n, 3), from now until the ball is in the cup.

        Args:
            packet: vector of a valid `Prediction`.
            now: present time [s].
            count: number of points.

        Returns no points when the ball is already in the cup.
        """
        crossing = self._edge.crossing(packet)
        end = crossing.time + INTO_CUP if crossing is not None else now + WITHOUT_CROSSING
        return predicted_points(packet, np.linspace(now, end, count)) if end > now else np.zeros((0, 3))

    def goal(self, packet: np.ndarray, now: float) -> np.ndarray:
        """Returns the predicted crossing of the edge and the ends of its error bar in W [m], shape (3, 3).

        Args:
            packet: vector of a valid `Prediction`.
            now: present time [s].

        Returns no points when no crossing is predicted, or when it is past.
        """
        crossing = self._edge.crossing(packet)
        if crossing is None or crossing.time + INTO_CUP < now:
            return np.zeros((0, 3))
        reach = BAR * crossing.std * self._edge.R_WB[:, 0]
        return crossing.p_WQ + np.array([np.zeros(3), -reach, reach])
