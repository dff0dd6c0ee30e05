"""Where the ball's board is, to the camera and in the world: what the initialisation leaves to all that comes after."""

from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform


@dataclass(frozen=True)
class BoardPoses:
    """What the initialisation found: X_CB and X_WB (RigidTransform), the circles' reprojection error ``rms`` [px], the
    touched points (3, 3) [m, W], ``image``, the first reading (h, w, 3) in RGB, and ``circles``, shape (4, 2) [px]:
    where the images show `CIRCLES`."""

    X_CB: RigidTransform
    X_WB: RigidTransform
    rms: float
    points: np.ndarray
    image: np.ndarray
    circles: np.ndarray


def pose_error(estimate, truth):
    """Returns how far a RigidTransform is from the true one: (distance of origins [m], angle between [rad])."""
    distance = np.linalg.norm(estimate.translation() - truth.translation())
    turn = (truth.rotation().inverse() @ estimate.rotation()).ToAngleAxis().angle()
    return float(distance), float(abs(turn))
