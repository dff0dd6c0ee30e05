"""Noise replayed from the camera loop: errors recorded by `record_points.py`, taken up in blocks by heading."""

from pathlib import Path

import numpy as np

PATH = Path(__file__).with_name("camera_points.npz")
BLOCK = 15
"""Points taken up in one piece: a quarter of a second, so that the jitter hangs together as in the recording."""
NEAR = np.radians(6.0)
"""A block may begin at any recorded point whose heading is this near; at the nearest one if there is none."""
LONGEST_STEP = 0.03
"""Stamps farther apart than this [s] are not of one piece."""


class Recording:
    """Errors of points, rows (n, 3) [m, W], with the heading [rad] of the object and the stamp [s] of each."""

    def __init__(self, stamps, yaw, errors):
        self.errors = np.asarray(errors, dtype=float)
        self._yaw = np.asarray(yaw, dtype=float)
        steps = np.diff(stamps)
        broken = np.cumsum(np.concatenate([[0], (steps > LONGEST_STEP) | (steps <= 0.0)]))
        starts = np.arange(len(self._yaw) - BLOCK + 1)
        self._starts = starts[broken[starts] == broken[starts + BLOCK - 1]]
        turning = np.concatenate([np.diff(self._yaw), [0.0]])
        self._turning = np.where(turning >= 0.0, 1, -1)
        self.rms = float(np.sqrt(np.mean(self.errors[:, :2] ** 2)))

    @classmethod
    def load(cls, path=PATH):
        """Reads what `record_points.py` wrote."""
        with np.load(path) as runs:
            rows = np.concatenate([runs[name] for name in runs.files]).astype(float)
        return cls(rows[:, 0], rows[:, 1], rows[:, 2:])

    def draw(self, yaw, sigma, rng):
        """Returns errors (n, 3) [m] for an object that heads along ``yaw`` (n,) [rad], of the recording's rms per
        horizontal axis scaled to ``sigma`` [m]. Blocks are drawn among those recorded at such a heading, and while the
        object turned to the same side.
        """
        drawn = np.empty((len(yaw), 3))
        for first in range(0, len(yaw), BLOCK):
            middle = min(first + BLOCK // 2, len(yaw) - 1)
            turning = 1 if yaw[middle] >= yaw[first] else -1
            sided = self._starts[self._turning[self._starts] == turning]
            allowed = sided if len(sided) else self._starts
            away = np.abs(np.angle(np.exp(1j * (self._yaw[allowed + BLOCK // 2] - yaw[middle]))))
            near = allowed[away <= NEAR]
            start = rng.choice(near) if len(near) else allowed[np.argmin(away)]
            count = min(BLOCK, len(yaw) - first)
            drawn[first : first + count] = self.errors[start : start + count]
        return drawn * (sigma / self.rms)
