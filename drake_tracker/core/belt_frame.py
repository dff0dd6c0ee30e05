"""The frame of an inclined belt, in which its upper face is level."""

import math
from typing import NamedTuple

import numpy as np


class BeltFrame(NamedTuple):
    """W turned about the line y = 0, z = ``height``, so that the belt is level and runs along +y.

    Vision and host describe parts in this frame; all messages and poses are in W. Without an incline both are the same,
    and nothing is computed.

    Attributes:
        angle: by which the belt rises along +y [rad].
        height: z_W of the upper face of the belt at y = 0 [m].
    """

    angle: float = 0.0
    height: float = 0.0

    @property
    def slope(self) -> tuple[float, float]:
        """Height that the belt gains along x_W and along y_W, per metre."""
        return (0.0, math.tan(self.angle))

    @property
    def X_WB(self) -> np.ndarray:
        """(4, 4) homogeneous matrix that takes points of this frame to W [m]."""
        c, s = math.cos(self.angle), math.sin(self.angle)
        transform = np.eye(4)
        transform[1:3, 1:3] = [[c, -s], [s, c]]
        transform[1:3, 3] = [s * self.height, (1.0 - c) * self.height]
        return transform

    def to_world(self, rows: np.ndarray) -> np.ndarray:
        """Returns poses in W, rows x, y, z [m] and yaw [rad], shape (n, 4), of rows in this frame."""
        return self._turned(rows, self.angle, math.cos(self.angle))

    def to_belt(self, rows: np.ndarray) -> np.ndarray:
        """Returns poses in this frame of rows in W, as `to_world`."""
        return self._turned(rows, -self.angle, 1.0 / math.cos(self.angle))

    def _turned(self, rows: np.ndarray, angle: float, stretch: float) -> np.ndarray:
        """Returns rows turned by an angle [rad], with the part along y of directions stretched as seen from above."""
        if angle == 0.0:
            return rows
        c, s = math.cos(angle), math.sin(angle)
        rows = np.array(rows, dtype=float)
        y, above, yaw = rows[:, 1].copy(), rows[:, 2] - self.height, rows[:, 3]
        rows[:, 1], rows[:, 2] = c * y - s * above, self.height + s * y + c * above
        seen = np.arctan2(np.sin(yaw) * stretch, np.cos(yaw))
        rows[:, 3] = yaw + np.arctan2(np.sin(seen - yaw), np.cos(seen - yaw))
        return rows
