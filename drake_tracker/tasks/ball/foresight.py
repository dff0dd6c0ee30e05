"""What a packet foretells, as points to be drawn: the path ahead and, on a board, where the ball comes out."""

import numpy as np

from drake_tracker.core.messages import predicted_points
from drake_tracker.grasp.crossing import BoardEdge

INTO_CUP = 0.08
"""Time [s] after the crossing up to which the path is drawn: then the ball is in the cup, or nobody knows."""
WITHOUT_CROSSING = 1.0
"""Length [s] of a path that does not come to the edge."""
BAR = 2.0
"""Half the length of the bar about a foreseen crossing, in standard deviations."""


class BoardForesight:
    """What the packets foretell on an inclined board.

    Args:
      edge: a `BoardEdge`, as the arm knows it.
    """

    def __init__(self, edge: BoardEdge) -> None:
        self._edge = edge

    def path(self, packet: np.ndarray, now: float, count: int) -> np.ndarray:
        """Returns ``count`` points (n, 3) [m, W] from ``now`` [s] until the ball is in the cup; none when it is."""
        crossing = self._edge.crossing(packet)
        end = crossing.time + INTO_CUP if crossing is not None else now + WITHOUT_CROSSING
        return predicted_points(packet, np.linspace(now, end, count)) if end > now else np.zeros((0, 3))

    def goal(self, packet: np.ndarray, now: float) -> np.ndarray:
        """Returns the foreseen crossing of the edge and the ends of a bar of `BAR` deviations about it, (3, 3) [m, W],
        or none once it lies behind.
        """
        crossing = self._edge.crossing(packet)
        if crossing is None or crossing.time + INTO_CUP < now:
            return np.zeros((0, 3))
        reach = BAR * crossing.std * self._edge.R_WB[:, 0]
        return crossing.p_WQ + np.array([np.zeros(3), -reach, reach])
